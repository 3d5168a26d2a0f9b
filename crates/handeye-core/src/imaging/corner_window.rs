//! The pixels around a corner: smoothed grey values in strips along its two edges.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use super::corner_equations::Samples;
use super::corner_guess::CornerGuess;
use super::{Picture, index, nearest, single};
use crate::simd::{Kernel, Simd, Vector, VectorUnit, dispatch};

/// Cameras sharpen, and guess colours between the pixels that see them: where an edge runs along the rows of pixels
/// that shifts it, less so in a picture smoothed beforehand (standard deviation of a Gaussian).
pub(super) const SMOOTHING_PX: f64 = 1.0;
/// Pixels on each side that smoothing takes in.
const TAPS: i64 = 4;
const WEIGHTS: usize = 9;
/// Single values side by side.
const LANES: usize = 16;

/// The window of a corner, and room to work in.
#[derive(Default)]
pub(super) struct Window {
    /// Pixel that the samples' places are counted from.
    pub origin: [i64; 2],
    /// What the corner is fitted to.
    pub samples: Samples,
    smoothed: Smoothed,
}

impl Window {
    /// Takes the pixels near the edges; those further away tell nothing about the corner.
    ///
    /// Returns the share of the window that lies inside the picture.
    pub fn lay<T: Copy + Into<f32>>(
        &mut self,
        unit: VectorUnit,
        picture: &Picture<'_, T>,
        guess: &CornerGuess,
    ) -> f64 {
        self.origin = nearest(guess.place);
        self.samples.clear();
        #[expect(clippy::cast_possible_truncation, reason = "a radius is in its range")]
        let reach = guess.radius.ceil() as i64 + 1;
        let [column, row] = self.origin;
        let size = picture.size();
        let is_far = [column, row].iter().zip(size).any(|(&x, size)| x + reach < 0 || x - reach >= size);
        if is_far {
            return 0.0;
        }
        dispatch(unit, Smoothing { picture, origin: self.origin, reach, out: &mut self.smoothed });
        let offset = [guess.place[0] - column as f64, guess.place[1] - row as f64];
        // Outside the picture there is nothing to be seen, which shows in the share.
        let (least, most) = (-column, size[0] - 1 - column);
        for v in -reach..=reach {
            let is_row = (0..size[1]).contains(&(row + v));
            let greys = self.smoothed.row(index(v + reach));
            for [from, to] in strips(guess, offset, v as f64, reach) {
                if from > to {
                    continue;
                }
                let ends = [from, from.max(least).min(to + 1), from.max(to.min(most) + 1), to + 1];
                for (part, is_column) in ends.windows(2).zip([false, true, false]) {
                    if part[0] < part[1] {
                        let weight = f64::from(u8::from(is_row && is_column));
                        let greys = &greys[index(part[0] + reach)..index(part[1] + reach)];
                        self.samples.extend([part[0], v], greys, weight);
                    }
                }
            }
        }
        self.samples.pad();
        let [whole, inside] = dispatch(unit, Weighing { samples: &mut self.samples, guess, offset });
        inside / whole.max(1e-9)
    }
}

/// Columns of a row of the window, from its origin, that are near the edges: two intervals that do not overlap.
fn strips(guess: &CornerGuess, offset: [f64; 2], row: f64, reach: i64) -> [[i64; 2]; 2] {
    const NONE: [i64; 2] = [1, 0];
    let y = row - offset[1];
    let (rim, half) = (guess.radius + 0.5, guess.band + 0.5);
    if rim <= y.abs() {
        return [NONE; 2];
    }
    let chord = (rim * rim - y * y).sqrt();
    let mut found = guess.directions.map(|[cosine, sine]| {
        let (mut from, mut to) = (-chord, chord);
        if sine.abs() > 1e-6 {
            let (middle, aside) = (cosine * y / sine, half / sine.abs());
            (from, to) = (from.max(middle - aside), to.min(middle + aside));
        } else if (cosine * y).abs() >= half {
            return NONE;
        }
        #[expect(clippy::cast_possible_truncation, reason = "no further away than the radius")]
        [((from + offset[0]).ceil() as i64).max(-reach), ((to + offset[0]).floor() as i64).min(reach)]
    });
    found.sort_unstable();
    let [first, second] = found;
    if first[0] > first[1] || second[0] > second[1] || first[1] < second[0] {
        return found;
    }
    [[first[0], first[1].max(second[1])], NONE]
}

/// A smoothed window, row by row, filled up to whole vectors; and room to work in.
#[derive(Default)]
struct Smoothed {
    values: Vec<f32>,
    stride: usize,
    raw: Vec<f32>,
    columns: Vec<f32>,
}

impl Smoothed {
    fn row(&self, row: usize) -> &[f32] {
        &self.values[row * self.stride..][..self.stride]
    }
}

/// Smooths the grey values of a window; those outside the picture are those that a mirror at its edge would show.
struct Smoothing<'a, 'p, T> {
    picture: &'a Picture<'p, T>,
    origin: [i64; 2],
    reach: i64,
    out: &'a mut Smoothed,
}

impl<T: Copy + Into<f32>> Kernel for Smoothing<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let weights = gaussian();
        let [column, row] = self.origin;
        let [width, height] = self.picture.size();
        let side = index(2 * self.reach + 1);
        let wide = side + WEIGHTS - 1;
        let Smoothed { values, stride, raw, columns } = self.out;
        *stride = side.next_multiple_of(LANES);
        let raw_stride = *stride + LANES;
        raw.resize(wide * raw_stride, 0.0);
        let first = column - self.reach - TAPS;
        let is_within = first >= 0 && column + self.reach + TAPS < width;
        let begin = row - self.reach - TAPS;
        for (v, out) in (begin..).zip(raw.chunks_exact_mut(raw_stride)) {
            let line = self.picture.row(mirrored(v, height));
            if is_within {
                for (out, grey) in out.iter_mut().zip(&line[index(first)..][..wide]) {
                    *out = (*grey).into();
                }
            } else {
                for (out, u) in out[..wide].iter_mut().zip(first..) {
                    *out = line[mirrored(u, width)].into();
                }
            }
        }
        // Down the columns, then along the rows.
        columns.resize(raw_stride, 0.0);
        values.resize(side * *stride, 0.0);
        for (row, out) in values.chunks_exact_mut(*stride).enumerate() {
            let lines = &raw[row * raw_stride..][..WEIGHTS * raw_stride];
            for at in (0..raw_stride).step_by(LANES) {
                let mut sum = [0.0_f32; LANES];
                for k in 0..WEIGHTS {
                    let part = &lines[k * raw_stride + at..][..LANES];
                    for lane in 0..LANES {
                        sum[lane] += weights[k] * part[lane];
                    }
                }
                columns[at..at + LANES].copy_from_slice(&sum);
            }
            for at in (0..*stride).step_by(LANES) {
                let mut sum = [0.0_f32; LANES];
                for k in 0..WEIGHTS {
                    let part = &columns[at + k..][..LANES];
                    for lane in 0..LANES {
                        sum[lane] += weights[k] * part[lane];
                    }
                }
                out[at..at + LANES].copy_from_slice(&sum);
            }
        }
    }
}

/// The place inside a picture's side that a mirror at its first and last pixel shows at a place outside.
fn mirrored(place: i64, size: i64) -> usize {
    let last = size - 1;
    let place = place.abs();
    index((if place > last { 2 * last - place } else { place }).clamp(0, last))
}

/// Weights of neighbours, which add up to one.
fn gaussian() -> [f32; WEIGHTS] {
    let bell = |i: usize| (-0.5 * ((i as f64 - TAPS as f64) / SMOOTHING_PX).powi(2)).exp();
    let all: [f64; WEIGHTS] = std::array::from_fn(bell);
    let sum: f64 = all.iter().sum();
    all.map(|weight| single(weight / sum))
}

/// Weighs the pixels of a window by how near they are to its edges; the weights of all, and of those inside.
struct Weighing<'a> {
    samples: &'a mut Samples,
    guess: &'a CornerGuess,
    offset: [f64; 2],
}

impl Kernel for Weighing<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> [f64; 2] {
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        let offset = self.offset.map(|x| simd.splat(x));
        let directions = self.guess.directions.map(|d| d.map(|x| simd.splat(x)));
        let [rim, near_rim] = [self.guess.radius, self.guess.beyond].map(|x| simd.splat(x + 0.5));
        let half = simd.splat(std::f64::consts::FRAC_1_SQRT_2);
        let strip = simd.splat(self.guess.band + 0.5);
        let (mut whole, mut inside) = (zero, zero);
        let Samples { x, y, root, .. } = self.samples;
        for at in (0..x.len()).step_by(S::LANES) {
            let (x, y) = (simd.load(&x[at..]) - offset[0], simd.load(&y[at..]) - offset[1]);
            let [first, second] = directions.map(|d| d[0].mul_add(y, -(d[1] * x)).abs());
            // The smaller of two is the negative of the larger of their negatives. A soft rim, so that no pixel
            // leaps in or out as the corner moves.
            let near = (strip + (-first).max(-second)).max(zero);
            let away = x.mul_add(x, y * y).sqrt();
            let [along, beside] = directions.map(|d| d[0].mul_add(x, d[1] * y));
            let ahead = along.max(beside) - half * away;
            let rim = rim.keep_or(ahead.at_least(zero), near_rim);
            let within = (rim - away).max(zero);
            let soft = (-(-near).max(-one)) * (-(-within).max(-one));
            let seen = simd.load(&root[at..]);
            whole = whole + soft.keep(seen.at_least(zero));
            let counted = soft * seen.max(zero);
            inside = inside + counted;
            counted.sqrt().store(&mut root[at..]);
        }
        [whole.sum(), inside.sum()]
    }
}
