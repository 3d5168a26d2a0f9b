//! Where in its surroundings a picture agrees best with what is seen, over shifts of whole pixels.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use super::raster::Raster;
use super::single;
use crate::simd::{Kernel, MAX_LANES, Simd, Vector, VectorUnit, dispatch};

/// Products of pixels that a search over all shifts may take; with more, some rows stand for all.
const BUDGET: usize = 500_000;
const FEWEST_ROWS: usize = 8;
/// Shifts that are looked at with all rows after that.
const CANDIDATES: usize = 6;
/// Variance of grey values below which there is nothing to be seen.
const LEAST_VARIANCE: f64 = 0.25;
/// Shifts side by side.
const TOGETHER: usize = 4;
/// About the mean of grey values.
const MIDDLE: f64 = 128.0;

/// The best shift, and how well the pictures agree there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Best {
    /// From the middle of the surroundings, in pixels and parts of them.
    pub shift: [f64; 2],
    /// -1 to 1; negative where one is the other's negative.
    pub agreement: f32,
}

/// The shift of a picture, of up to `reach` pixels in each direction, for which it agrees best with surroundings that
/// are larger by `aside` on each side; also with their negative if wanted.
pub(super) fn best_shift(
    unit: VectorUnit,
    picture: &Raster,
    around: &Raster,
    aside: usize,
    reach: usize,
    also_negative: bool,
) -> Best {
    let side = 2 * reach + 1;
    let cost = side * side * picture.width;
    let count = (BUDGET / cost.max(1)).max(FEWEST_ROWS).min(picture.height);
    let all: Vec<usize> = (0..picture.height).collect();
    let search = Search::new(picture, around, aside - reach, side);
    let score = |agreement: f32| if also_negative { agreement.abs() } else { agreement };
    let mut shifts: Vec<[usize; 2]> = (0..side * side).map(|i| [i % side, i / side]).collect();
    if count < picture.height {
        // Spread so that no period of the picture is hit at the same place again and again.
        let mut rows: Vec<usize> = (0..count).map(|i| golden(i, picture.height)).collect();
        rows.sort_unstable();
        rows.dedup();
        let rough = search.correlations(unit, &rows, &shifts);
        let mut order: Vec<usize> = (0..shifts.len()).collect();
        order.sort_by(|&a, &b| score(rough[b]).total_cmp(&score(rough[a])));
        shifts = order.into_iter().take(CANDIDATES).map(|i| shifts[i]).collect();
    }
    let found = search.correlations(unit, &all, &shifts);
    let (mut best, mut agreement) = ([reach; 2], f32::NEG_INFINITY);
    for (shift, value) in shifts.into_iter().zip(found) {
        if score(value) > score(agreement) || agreement == f32::NEG_INFINITY {
            (best, agreement) = (shift, value);
        }
    }
    // Between pixels by a parabola through the neighbours.
    let [x, y] = best;
    let mut place = [x as f64, y as f64];
    for axis in 0..2 {
        if best[axis] == 0 || best[axis] + 1 == side {
            continue;
        }
        let ends = [[x - (1 - axis), y - axis], [x + (1 - axis), y + axis]];
        let [before, after] = search.correlations(unit, &all, &ends)[..] else { continue };
        let bend = before - 2.0 * agreement + after;
        if bend * agreement < 0.0 {
            place[axis] += f64::from(((before - after) / (2.0 * bend)).clamp(-0.5, 0.5));
        }
    }
    Best { shift: place.map(|x| x - reach as f64), agreement }
}

/// Whole numbers below a size that are spread evenly, however many are taken.
fn golden(i: usize, size: usize) -> usize {
    let turn = i as f64 * 0.618_033_988_749_894_9;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below the size")]
    let place = ((turn - turn.floor()) * size as f64) as usize;
    place.min(size - 1)
}

/// A picture and its surroundings, ready to be compared.
struct Search<'a> {
    picture: &'a Raster,
    /// Row and column of the surroundings where the first shift begins.
    corner: usize,
    side: usize,
    /// Rows of the picture without their mean, and of the surroundings, in double precision; filled up with zeros.
    drawn: Vec<f64>,
    seen: Vec<f64>,
    strides: [usize; 2],
    /// Sums of the grey values and of their squares under the picture's width: for each row of the surroundings and
    /// each shift along it.
    sums: Vec<[f64; 2]>,
}

impl<'a> Search<'a> {
    fn new(picture: &'a Raster, around: &'a Raster, corner: usize, side: usize) -> Self {
        let mean = picture.values.iter().copied().map(f64::from).sum::<f64>() / picture.values.len() as f64;
        let widened = |raster: &Raster, less: f64, stride: usize| {
            let mut values = Vec::with_capacity(stride * raster.height + MAX_LANES);
            for row in 0..raster.height {
                values.extend(raster.row(row).iter().map(|value| f64::from(*value) - less));
                values.resize((row + 1) * stride, 0.0);
            }
            values.resize(stride * raster.height + MAX_LANES, 0.0);
            values
        };
        // Numbers about zero lose fewer digits.
        let strides = [picture.width.next_multiple_of(MAX_LANES), around.width];
        let seen = widened(around, MIDDLE, strides[1]);
        let mut sums = Vec::with_capacity(around.height * side);
        for row in seen.chunks_exact(around.width).take(around.height) {
            let (mut sum, mut square) = (0.0, 0.0);
            for value in &row[corner..corner + picture.width] {
                sum += value;
                square += value * value;
            }
            for shift in 0..side {
                sums.push([sum, square]);
                let first = corner + shift;
                let (old, new) = (row[first], row.get(first + picture.width).copied().unwrap_or(0.0));
                sum += new - old;
                square += new * new - old * old;
            }
        }
        let drawn = widened(picture, mean, strides[0]);
        Self { picture, corner, side, drawn, seen, strides, sums }
    }

    /// The correlation at each of some shifts, by some rows of the picture.
    fn correlations(&self, unit: VectorUnit, rows: &[usize], shifts: &[[usize; 2]]) -> Vec<f32> {
        let number = (rows.len() * self.picture.width) as f64;
        let (mut sum, mut square) = (0.0, 0.0);
        for &row in rows {
            for value in &self.drawn[row * self.strides[0]..][..self.picture.width] {
                sum += value;
                square += value * value;
            }
        }
        let mean = sum / number;
        let variance = square / number - mean * mean;
        let products = dispatch(unit, Products { search: self, rows, shifts });
        let at = |(&[x, y], product): (&[usize; 2], f64)| {
            let (mut seen, mut seen_square) = (0.0, 0.0);
            for row in rows {
                let [sum, square] = self.sums[(self.corner + y + row) * self.side + x];
                seen += sum;
                seen_square += square;
            }
            let seen = seen / number;
            let contrast = seen_square / number - seen * seen;
            if contrast < LEAST_VARIANCE {
                return 0.0;
            }
            single((product / number - mean * seen) / (variance * contrast).sqrt())
        };
        shifts.iter().zip(products).map(at).collect()
    }
}

/// Sums of the products of a picture's rows with what is seen, for each shift.
struct Products<'a> {
    search: &'a Search<'a>,
    rows: &'a [usize],
    shifts: &'a [[usize; 2]],
}

impl Kernel for Products<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Vec<f64> {
        let Search { corner, ref drawn, ref seen, strides, .. } = *self.search;
        let mut out = vec![0.0; self.shifts.len()];
        // Several shifts side by side, for what is drawn is the same.
        for (out, shifts) in out.chunks_mut(TOGETHER).zip(self.shifts.chunks(TOGETHER)) {
            let mut begins = [0; TOGETHER];
            for (begin, [x, y]) in begins.iter_mut().zip(shifts) {
                *begin = (corner + y) * strides[1] + corner + x;
            }
            let mut sums = [simd.splat(0.0); TOGETHER];
            for &row in self.rows {
                let drawn = &drawn[row * strides[0]..][..strides[0]];
                for at in (0..strides[0]).step_by(S::LANES) {
                    let drawn = simd.load(&drawn[at..]);
                    for k in 0..TOGETHER {
                        sums[k] =
                            drawn.mul_add(simd.load(&seen[begins[k] + row * strides[1] + at..]), sums[k]);
                    }
                }
            }
            for (out, sum) in out.iter_mut().zip(sums) {
                *out = sum.sum();
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    fn scene(size: usize, aside: usize, shift: [usize; 2]) -> (Raster, Raster) {
        let mut random = Random::new(9);
        let mut around = Raster::new(size + 2 * aside, size + 2 * aside);
        for value in &mut around.values {
            *value = super::super::single(120.0 + 40.0 * random.normal());
        }
        let mut picture = Raster::new(size, size);
        for row in 0..size {
            let seen = &around.row(row + shift[1])[shift[0]..][..size];
            for (drawn, seen) in picture.values[row * size..][..size].iter_mut().zip(seen) {
                *drawn = (seen - 100.0) / 200.0;
            }
        }
        (picture, around)
    }

    #[test]
    fn a_shift_is_found_also_with_some_rows_only_and_in_the_negative() {
        for (reach, aside) in [(5, 6), (38, 40)] {
            for (x, y) in [(0, 3), (2 * reach - 1, reach)] {
                let (picture, mut around) = scene(90, aside, [aside - reach + x, aside - reach + y]);
                for is_negative in [false, true] {
                    let unit = VectorUnit::widest();
                    let best = best_shift(unit, &picture, &around, aside, reach, is_negative);
                    let expected = [x as f64 - reach as f64, y as f64 - reach as f64];
                    for axis in 0..2 {
                        assert!((best.shift[axis] - expected[axis]).abs() < 0.1, "{best:?} {expected:?}");
                    }
                    assert!((best.agreement.abs() - 1.0).abs() < 1e-3);
                    assert_eq!(best.agreement < 0.0, is_negative);
                    for value in &mut around.values {
                        *value = 255.0 - *value;
                    }
                }
            }
        }
    }
}
