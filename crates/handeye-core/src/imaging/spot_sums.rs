//! Sums over the pixels of a spot, several side by side.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use std::ops::Add;

use nalgebra::{Matrix2, Vector2};

use crate::simd::{Kernel, MAX_LANES, Simd, Vector, VectorUnit, dispatch};

/// Where pixels that only fill the last vector lie: nowhere near.
const NOWHERE: f64 = 1e6;

/// Moments of pixels at offsets `x` from a centre with grey values `g`.
#[derive(Clone, Copy, Default)]
pub(super) struct Moments {
    pub number: f64,
    /// Sum of `x`.
    pub first: Vector2<f64>,
    /// Sum of `x x'`.
    pub second: Matrix2<f64>,
    /// Sum of `g`.
    pub grey: f64,
    /// Sum of `g x`.
    pub grey_first: Vector2<f64>,
}

impl Moments {
    /// Adds neighbours of a row; the first of them is at offset `(x, y)`.
    pub fn add_row<T: Copy + Into<f32>>(&mut self, greys: &[T], x: f64, y: f64) {
        // Several sums side by side, as a vector unit has them.
        let (mut sums, mut turns) = ([0.0; MAX_LANES], [0.0; MAX_LANES]);
        let (chunks, rest) = greys.as_chunks::<MAX_LANES>();
        for (chunk, at) in chunks.iter().zip(0_u32..) {
            for lane in 0..MAX_LANES {
                let grey = f64::from(chunk[lane].into());
                sums[lane] += grey;
                turns[lane] += grey * f64::from(at);
            }
        }
        let lanes = MAX_LANES as f64;
        let (mut grey, mut grey_at) = (0.0, 0.0);
        for lane in 0..MAX_LANES {
            grey += sums[lane];
            grey_at += lanes * turns[lane] + lane as f64 * sums[lane];
        }
        for (i, value) in rest.iter().enumerate() {
            let value = f64::from((*value).into());
            grey += value;
            grey_at += value * (chunks.len() * MAX_LANES + i) as f64;
        }
        let n = greys.len() as f64;
        let sum = n * x + 0.5 * n * (n - 1.0);
        let squares = n * x * x + x * n * (n - 1.0) + n * (n - 1.0) * (2.0 * n - 1.0) / 6.0;
        self.number += n;
        self.first += Vector2::new(sum, n * y);
        self.second += Matrix2::new(squares, sum * y, sum * y, n * y * y);
        self.grey += grey;
        self.grey_first += Vector2::new(x * grey + grey_at, y * grey);
    }
}

impl Add for Moments {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            number: self.number + other.number,
            first: self.first + other.first,
            second: self.second + other.second,
            grey: self.grey + other.grey,
            grey_first: self.grey_first + other.grey_first,
        }
    }
}

/// What tells the parts around the edge of a spot apart: distances from the edge in pixels.
#[derive(Clone, Copy)]
pub(super) struct Bounds {
    /// Inverse of the shape.
    pub inverse: Matrix2<f64>,
    /// Further inside than this a pixel shows the level inside.
    pub inner: f64,
    /// Nearer than this a pixel is partly covered.
    pub band: f64,
    /// Between the band and this a pixel shows the level outside.
    pub reach: f64,
}

/// Levels of paper and ink at the centre, and a slope of the light that both share.
#[derive(Clone, Copy)]
pub(super) struct Levels {
    pub slope: Vector2<f64>,
    pub bright: f64,
    pub dim: f64,
}

/// Moments of the area that a spot covers, and the least light of all pixels.
pub(super) struct Covered {
    pub area: f64,
    pub first: Vector2<f64>,
    pub second: Matrix2<f64>,
    pub least_light: f64,
}

/// The pixels around the edge of a spot: offsets from its centre, grey values, and what share counts.
#[derive(Default)]
pub(super) struct Ring {
    x: Vec<f64>,
    y: Vec<f64>,
    grey: Vec<f64>,
    /// 0 outside, 1 where the edge may be, 2 inside.
    place: Vec<f64>,
}

impl Ring {
    pub fn clear(&mut self) {
        for values in [&mut self.x, &mut self.y, &mut self.grey] {
            values.clear();
        }
    }

    /// Adds neighbours of a row; the first of them is at offset `(x, y)`.
    pub fn extend<T: Copy + Into<f32>>(&mut self, greys: &[T], x: f64, y: f64) {
        self.x.extend((0..greys.len()).map(|i| x + i as f64));
        self.y.resize(self.x.len(), y);
        self.grey.extend(greys.iter().map(|grey| f64::from((*grey).into())));
    }

    /// Fills the last vector with pixels that do not count.
    pub fn pad(&mut self) {
        let length = self.x.len().next_multiple_of(MAX_LANES);
        for values in [&mut self.x, &mut self.y] {
            values.resize(length, NOWHERE);
        }
        self.grey.resize(length, 0.0);
        self.place.resize(length, 0.0);
    }

    /// Tells the pixels apart; moments of those outside and of those inside.
    pub fn sorted(&mut self, unit: VectorUnit, bounds: Bounds) -> (Moments, Moments) {
        dispatch(unit, Sorting { ring: self, bounds })
    }

    /// Moments of the area that the spot covers of the pixels that were told apart.
    pub fn covered(&self, unit: VectorUnit, levels: Levels) -> Covered {
        dispatch(unit, Covering { ring: self, levels })
    }
}

struct Sorting<'a> {
    ring: &'a mut Ring,
    bounds: Bounds,
}

impl Kernel for Sorting<'_> {
    type Output = (Moments, Moments);

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> (Moments, Moments) {
        let Bounds { inverse, inner, band, reach } = self.bounds;
        let (xx, xy, yy) =
            (simd.splat(inverse[(0, 0)]), simd.splat(inverse[(0, 1)]), simd.splat(inverse[(1, 1)]));
        let (inner, band, reach) = (simd.splat(inner), simd.splat(band), simd.splat(reach));
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        let mut sums = [[zero; 9]; 2];
        let Ring { x, y, grey, place } = self.ring;
        for at in (0..x.len()).step_by(S::LANES) {
            let (x, y, grey) = (simd.load(&x[at..]), simd.load(&y[at..]), simd.load(&grey[at..]));
            let solved = [xx.mul_add(x, xy * y), xy.mul_add(x, yy * y)];
            // Signed distance from the edge, to first order: (q - 1) / |grad q| with q the elliptical radius.
            let squared = solved[0].mul_add(x, solved[1] * y);
            let rise = squared - squared.sqrt();
            let slope = solved[0].mul_add(solved[0], solved[1] * solved[1]).sqrt();
            let outside = rise.greater(band * slope) & (reach * slope).at_least(rise);
            let inside = (-(inner * slope)).greater(rise);
            let beyond = one.keep(rise.greater(band * slope));
            let within = one.keep((-(band * slope)).greater(rise));
            (one - beyond + within).store(&mut place[at..]);
            for (sums, mask) in sums.iter_mut().zip([outside, inside]) {
                let (x, y, grey, one) = (x.keep(mask), y.keep(mask), grey.keep(mask), one.keep(mask));
                sums[0] = sums[0] + one;
                sums[1] = sums[1] + x;
                sums[2] = sums[2] + y;
                sums[3] = x.mul_add(x, sums[3]);
                sums[4] = x.mul_add(y, sums[4]);
                sums[5] = y.mul_add(y, sums[5]);
                sums[6] = sums[6] + grey;
                sums[7] = grey.mul_add(x, sums[7]);
                sums[8] = grey.mul_add(y, sums[8]);
            }
        }
        let [outside, inside] = sums.map(|sums| {
            let [number, x, y, xx, xy, yy, grey, grey_x, grey_y] = sums.map(Vector::sum);
            Moments {
                number,
                first: Vector2::new(x, y),
                second: Matrix2::new(xx, xy, xy, yy),
                grey,
                grey_first: Vector2::new(grey_x, grey_y),
            }
        });
        (outside, inside)
    }
}

struct Covering<'a> {
    ring: &'a Ring,
    levels: Levels,
}

impl Kernel for Covering<'_> {
    type Output = Covered;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Covered {
        let Levels { slope, bright, dim } = self.levels;
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        let slope = [simd.splat(slope[0]), simd.splat(slope[1])];
        let per_grey = simd.splat(1.0 / (bright - dim));
        let paper = simd.splat(bright / (bright - dim));
        let (half, full) = (simd.splat(0.5), simd.splat(1.5));
        let (mut area, mut x_sum, mut y_sum) = (zero, zero, zero);
        let (mut xx, mut xy, mut yy) = (zero, zero, zero);
        let mut darkest = simd.splat(f64::NEG_INFINITY);
        let Ring { x, y, grey, place } = self.ring;
        for at in (0..x.len()).step_by(S::LANES) {
            let (x, y) = (simd.load(&x[at..]), simd.load(&y[at..]));
            let (grey, place) = (simd.load(&grey[at..]), simd.load(&place[at..]));
            let light = slope[0].mul_add(x, slope[1].mul_add(y, one));
            let partly = one.keep_or(place.greater(full), (grey * per_grey / light).neg_mul_add(one, paper));
            let counts = place.greater(half);
            let covered = partly.keep(counts);
            darkest = darkest.max((-light).keep_or(counts, darkest));
            let (x_part, y_part) = (covered * x, covered * y);
            area = area + covered;
            x_sum = x_sum + x_part;
            y_sum = y_sum + y_part;
            xx = x_part.mul_add(x, xx);
            xy = x_part.mul_add(y, xy);
            yy = y_part.mul_add(y, yy);
        }
        let mut lanes = [f64::NEG_INFINITY; MAX_LANES];
        darkest.store(&mut lanes);
        let cross = xy.sum();
        Covered {
            area: area.sum(),
            first: Vector2::new(x_sum.sum(), y_sum.sum()),
            second: Matrix2::new(xx.sum(), cross, cross, yy.sum()),
            least_light: -lanes.into_iter().fold(f64::NEG_INFINITY, f64::max),
        }
    }
}
