//! Where a board whose picture is known lies in an image, from where it is expected.
//!
//! The image around the expected place is taken as if seen squarely, as coarse as the board's details allow. In it the
//! printed picture is looked for, first by its correlation over all shifts that the prediction allows, then by least
//! squares over a homography (inverse compositional: Baker and Matthews, "Lucas-Kanade 20 years on", IJCV 2004). Both
//! are of grey values from which the light around was taken away.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use std::sync::Arc;

use nalgebra::{Matrix2, Matrix3, SVector, Vector2, Vector3};

use super::correlation::best_shift;
use super::plane_map::{PlaneMap, steps, through};
use super::printed::{FREE, Printed, dot, inverse};
use super::raster::{Raster, Room, reduced};
use super::{Picture, single};
use crate::simd::{Kernel, Simd, VectorUnit, dispatch};

/// What is looked at around what is printed, in pitches.
const SURROUNDINGS: f64 = 1.6;
/// Added to the contrast, in grey values, where there is next to none.
const GREY_FLOOR: f32 = 4.0;
const MAX_ITERATIONS: usize = 15;
const STEP_TOLERANCE_PX: f64 = 0.1;
/// Correlation with the picture below which there is no use in going on.
const LEAST_CORRELATION: f32 = 0.2;
/// Grey of what is outside the image.
const OUTSIDE: f32 = 128.0;
/// An image of which less is looked at than this shows nothing.
const SMALLEST_PX: usize = 24;
/// A margin of more pixels of the picture is no prediction.
const WIDEST_PX: f64 = 40.0;
/// Points that are nearer than this to the camera's plane, as a share of the furthest, are behind it.
const NEAREST: f64 = 0.1;

/// Where a board lies in an image.
#[derive(Clone, Debug)]
pub struct Alignment {
    board: Arc<Printed>,
    /// From the plane to the image, as expected.
    map: PlaneMap,
    /// From places in the picture to those that the map expects there.
    shift: Matrix3<f64>,
    /// What is seen where the picture has its pixels, without the light.
    flat: Raster,
    /// What is seen around, light where paper should be, and where in it the picture begins without the shift.
    around: Raster,
    aside: usize,
}

impl Alignment {
    /// Where a board lies whose places are expected at pixels, within a margin; `None` where it is not there.
    ///
    /// What is found is not yet proved to be that board: a grid may be a line off, a marker may be another one, and
    /// what is hidden is not known.
    pub fn of<T: Copy + Into<f32>>(
        board: &Arc<Printed>,
        image: &Picture<'_, T>,
        plane: &[Vector2<f64>],
        pixels: &[Vector2<f64>],
        margin: f64,
        also_negative: bool,
    ) -> Option<Self> {
        let unit = VectorUnit::widest();
        let map = PlaneMap::fitted(plane, pixels)?;
        let [least, most] = scales(board, &map.homography)?;
        let reach = (margin * board.scale / least).ceil();
        if !(0.0..=WIDEST_PX).contains(&reach) {
            return None;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in their range")]
        let [reach, beside] = [reach, (SURROUNDINGS * board.pitch * board.scale).ceil()].map(|x| x as usize);
        let aside = reach + beside;
        let (mut around, inside) = squared(unit, image, board, &map, aside, most / board.scale)?;
        let best = best_shift(unit, &board.picture, &around, aside, reach, also_negative);
        if best.agreement < 0.0 && also_negative {
            for value in &mut around.values {
                *value = 255.0 - *value;
            }
        }
        let agreement = if also_negative { best.agreement.abs() } else { best.agreement };
        // Also where it is not a number.
        if agreement.partial_cmp(&LEAST_CORRELATION).is_none_or(std::cmp::Ordering::is_lt) {
            return None;
        }
        let start = Matrix3::new_translation(&Vector2::from(best.shift));
        let (shift, flat) = least_squares(unit, board, &around, inside.as_ref(), aside, start)?;
        let linear = shift.fixed_view::<2, 2>(0, 0);
        (shift.iter().all(|x| x.is_finite()) && linear.determinant() > 0.0).then(|| Self {
            board: Arc::clone(board),
            map,
            shift,
            flat,
            around,
            aside,
        })
    }

    /// Where a place of the plane of the board is in the image, in pixels.
    pub fn pixel(&self, place: &Vector2<f64>) -> Vector2<f64> {
        self.map.pixel(&self.board.place(&through(&self.shift, &self.board.pixel(place))))
    }

    /// Pixels per metre along each of the plane's axes (rows) at a place.
    pub fn steps(&self, place: &Vector2<f64>) -> Matrix2<f64> {
        steps(|place| self.pixel(place), place, 0.1 * self.board.pitch)
    }

    /// The grey value at a place of the plane, light where paper should be.
    pub fn seen(&self, place: &Vector2<f64>) -> f32 {
        let at = through(&self.shift, &self.board.pixel(place)) + Vector2::repeat(self.aside as f64);
        self.around.clamped(single(at[0]), single(at[1]))
    }

    /// How well image and picture agree, -1 to 1, one pitch around a place of the plane.
    pub fn likeness(&self, place: &Vector2<f64>) -> f32 {
        let drawn = &self.board.flat;
        let pixel = self.board.pixel(place);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let [column, row, half] = [
            pixel[0].round_ties_even().clamp(0.0, (drawn.width - 1) as f64),
            pixel[1].round_ties_even().clamp(0.0, (drawn.height - 1) as f64),
            (0.5 * self.board.pitch * self.board.scale).clamp(0.0, 1e6),
        ]
        .map(|x| x as usize);
        let columns = column.saturating_sub(half)..(column + half + 1).min(drawn.width);
        let (mut common, mut own, mut wanted) = (0.0, 0.0, 0.0);
        for row in row.saturating_sub(half)..(row + half + 1).min(drawn.height) {
            let (seen, drawn) = (&self.flat.row(row)[columns.clone()], &drawn.row(row)[columns.clone()]);
            common += dot(seen, drawn);
            own += dot(seen, seen);
            wanted += dot(drawn, drawn);
        }
        single(common / (own * wanted).max(1e-6).sqrt())
    }
}

/// The least and the largest pixels per metre at the corners; `None` for a board from behind or edge on.
fn scales(board: &Printed, homography: &Matrix3<f64>) -> Option<[f64; 2]> {
    let (width, height) = (board.picture.width as f64, board.picture.height as f64);
    let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]]
        .map(|corner| board.low + Vector2::from(corner) / board.scale);
    let depths = corners.map(|p| (homography * Vector3::new(p[0], p[1], 1.0))[2]);
    let furthest = depths.into_iter().fold(f64::NEG_INFINITY, f64::max);
    if !depths.iter().all(|depth| *depth > NEAREST * furthest) {
        return None;
    }
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for (corner, depth) in corners.iter().zip(depths) {
        let image = through(homography, corner);
        let jacobian =
            (homography.fixed_view::<2, 2>(0, 0) - image * homography.fixed_view::<1, 2>(2, 0)) / depth;
        if !jacobian.iter().all(|x| x.is_finite()) || jacobian.determinant() <= 0.0 {
            return None;
        }
        let values = jacobian.singular_values();
        (least, most) = (least.min(values.min()), most.max(values.max()));
    }
    (least > 0.0 && most.is_finite()).then_some([least, most])
}

/// The image as the picture would show it, and which of it is in the image, `None` for all.
fn squared<T: Copy + Into<f32>>(
    unit: VectorUnit,
    image: &Picture<'_, T>,
    board: &Printed,
    map: &PlaneMap,
    aside: usize,
    reduction: f64,
) -> Option<(Raster, Option<Raster>)> {
    let size = [board.picture.width, board.picture.height].map(|side| side + 2 * aside);
    let start = board.place(&Vector2::repeat(-(aside as f64)));
    let [u, v] = dispatch(unit, Mapping { map, start, step: 1.0 / board.scale, size });
    let last = [image.width, image.height].map(|side| side as f32 - 1.0);
    let (mut low, mut high, mut is_whole) = ([0; 2], [0; 2], true);
    for (axis, values) in [&u, &v].into_iter().enumerate() {
        let least = values.iter().copied().fold(f32::INFINITY, f32::min);
        let most = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        if !(least.is_finite() && most.is_finite()) {
            return None;
        }
        is_whole &= least >= 0.0 && most <= last[axis];
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let ends = [least - 1.0, most + 3.0].map(|x| x.clamp(0.0, last[axis] + 1.0) as usize);
        [low[axis], high[axis]] = ends;
    }
    if (0..2).any(|axis| high[axis] < low[axis] + SMALLEST_PX) {
        return None;
    }
    // Averages over whole squares of pixels are quick.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    let factor = reduction.clamp(1.0, SMALLEST_PX as f64) as usize;
    let small = reduced(unit, image, low, [0, 1].map(|axis| (high[axis] - low[axis]) / factor), factor);
    let per_pixel = 1.0 / factor as f32;
    let begin = low.map(|low| (0.5 - low as f32) * per_pixel - 0.5);
    let mut around = Raster::new(size[0], size[1]);
    dispatch(unit, Sampling { raster: &small, u: &u, v: &v, per_pixel, begin, out: &mut around });
    let inside = (!is_whole).then(|| {
        let is_seen = |(u, v): (&f32, &f32)| (0.0..=last[0]).contains(u) && (0.0..=last[1]).contains(v);
        let values = u.iter().zip(&v).map(|at| f32::from(u8::from(is_seen(at)))).collect();
        Raster { values, width: size[0], height: size[1] }
    });
    Some((around, inside))
}

/// Pixels of an image on a grid of places, both coordinates apart.
struct Mapping<'a> {
    map: &'a PlaneMap,
    start: Vector2<f64>,
    step: f64,
    size: [usize; 2],
}

impl Kernel for Mapping<'_> {
    type Output = [Vec<f32>; 2];

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> [Vec<f32>; 2] {
        let [width, height] = self.size;
        let (h, c) = (&self.map.homography, &self.map.coefficients);
        let mut out = [vec![0.0; width * height], vec![0.0; width * height]];
        let x: Vec<f32> = (0..width).map(|i| single(self.start[0] + i as f64 * self.step)).collect();
        let boxed: Vec<f32> = (0..width)
            .map(|i| {
                single((self.start[0] + i as f64 * self.step - self.map.middle[0]) * self.map.per_half[0])
            })
            .collect();
        for row in 0..height {
            let y = self.start[1] + row as f64 * self.step;
            let b = (y - self.map.middle[1]) * self.map.per_half[1];
            let line = |i: usize| [single(h[(i, 0)]), single(h[(i, 1)] * y + h[(i, 2)])];
            let depth = line(2);
            for (axis, out) in out.iter_mut().enumerate() {
                let above = line(axis);
                // Of a row there is left a polynomial in one coordinate; see the order of the powers.
                let k = |i: usize| c[(i, axis)];
                let rest = [
                    k(0) + b * (k(4) + b * (k(7) + b * k(9))),
                    k(1) + b * (k(5) + b * k(8)),
                    k(2) + b * k(6),
                    k(3),
                ]
                .map(single);
                let values = &mut out[row * width..][..width];
                for (value, (x, boxed)) in values.iter_mut().zip(x.iter().zip(&boxed)) {
                    let bent = rest[0] + boxed * (rest[1] + boxed * (rest[2] + boxed * rest[3]));
                    *value = (above[0] * x + above[1]) / (depth[0] * x + depth[1]) + bent;
                }
            }
        }
        out
    }
}

/// Fills a raster with what another shows at pixels of the image.
struct Sampling<'a> {
    raster: &'a Raster,
    u: &'a [f32],
    v: &'a [f32],
    per_pixel: f32,
    begin: [f32; 2],
    out: &'a mut Raster,
}

impl Kernel for Sampling<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let width = self.out.width;
        let (mut x, mut y, mut room) = (vec![0.0; width], vec![0.0; width], Room::default());
        let rows = self.u.chunks_exact(width).zip(self.v.chunks_exact(width));
        for (out, (u, v)) in self.out.values.chunks_exact_mut(width).zip(rows) {
            for (places, pixels, begin) in [(&mut x, u, self.begin[0]), (&mut y, v, self.begin[1])] {
                for (place, pixel) in places.iter_mut().zip(pixels) {
                    *place = pixel * self.per_pixel + begin;
                }
            }
            self.raster.sample(&x, &y, OUTSIDE, &mut room, out);
        }
    }
}

/// The homography from the picture to the surroundings without their margin, and what is there without its light.
fn least_squares(
    unit: VectorUnit,
    board: &Printed,
    around: &Raster,
    inside: Option<&Raster>,
    aside: usize,
    start: Matrix3<f64>,
) -> Option<(Matrix3<f64>, Raster)> {
    let size = [board.picture.width, board.picture.height];
    let to_around = Matrix3::new_translation(&Vector2::repeat(aside as f64));
    let centring = board.centring();
    let back = centring.try_inverse()?;
    let half = size[0].max(size[1]) as f64 / 2.0;
    let weighted = inside.map(|inside| {
        let weights = dispatch(unit, Warping { raster: inside, to: to_around * start, size, beyond: 0.0 });
        let rows = board.steepest.each_ref().map(|row| -> Vec<f32> {
            row.iter().zip(&weights.values).map(|(value, weight)| value * weight).collect()
        });
        let inverse = inverse(&rows, &board.steepest);
        (rows, inverse)
    });
    let (rows, inverse) = weighted.as_ref().map_or((&board.steepest, &board.inverse), |(rows, i)| (rows, i));
    let mut shift = start;
    let mut flat = Raster::default();
    for _ in 0..MAX_ITERATIONS {
        let seen = dispatch(unit, Warping { raster: around, to: to_around * shift, size, beyond: OUTSIDE });
        flat = seen.flattened(unit, board.light, GREY_FLOOR);
        let step: SVector<f64, FREE> =
            inverse * dispatch(unit, Slope { rows, seen: &flat.values, drawn: &board.flat.values });
        let moved = Matrix3::new(
            1.0 + step[0],
            step[1],
            step[2],
            step[3],
            1.0 + step[4],
            step[5],
            step[6],
            step[7],
            1.0,
        );
        shift = shift * back * moved.try_inverse()? * centring;
        shift /= shift[(2, 2)];
        // Also where it is not a number.
        if step.amax() * half < STEP_TOLERANCE_PX || !step.iter().all(|x| x.is_finite()) {
            break;
        }
    }
    Some((shift, flat))
}

/// The products of rows with the difference of what is seen from what is drawn.
struct Slope<'a> {
    rows: &'a [Vec<f32>; FREE],
    seen: &'a [f32],
    drawn: &'a [f32],
}

impl Kernel for Slope<'_> {
    type Output = SVector<f64, FREE>;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> SVector<f64, FREE> {
        let mut residual = vec![0.0; self.seen.len()];
        for (residual, (seen, drawn)) in residual.iter_mut().zip(self.seen.iter().zip(self.drawn)) {
            *residual = seen - drawn;
        }
        let mut sums = SVector::zeros();
        for i in 0..FREE {
            sums[i] = dot(&self.rows[i], &residual);
        }
        sums
    }
}

/// What a raster shows through a homography.
struct Warping<'a> {
    raster: &'a Raster,
    to: Matrix3<f64>,
    size: [usize; 2],
    beyond: f32,
}

impl Kernel for Warping<'_> {
    type Output = Raster;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> Raster {
        let [width, height] = self.size;
        let mut out = Raster::new(width, height);
        let (mut u, mut v, mut room) = (vec![0.0_f32; width], vec![0.0_f32; width], Room::default());
        for (row, values) in out.values.chunks_exact_mut(width).enumerate() {
            let y = row as f64;
            let [a, b, c] =
                [0, 1, 2].map(|i| [single(self.to[(i, 0)]), single(self.to[(i, 1)] * y + self.to[(i, 2)])]);
            for (column, (u, v)) in u.iter_mut().zip(&mut v).enumerate() {
                let x = column as f32;
                let per_depth = 1.0 / (c[0] * x + c[1]);
                *u = (a[0] * x + a[1]) * per_depth;
                *v = (b[0] * x + b[1]) * per_depth;
            }
            self.raster.sample(&u, &v, self.beyond, &mut room, values);
        }
        out
    }
}
