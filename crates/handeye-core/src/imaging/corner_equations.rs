//! The picture of a corner and the normal equations of its fit, several pixels side by side.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use nalgebra::{SMatrix, SVector};

use crate::simd::{Kernel, MAX_LANES, Simd, Vector};

pub(super) const N: usize = 9;
// Parameters: place, angles of the edges, logarithm of the blur, then the greys, which enter linearly.
pub(super) const X: usize = 0;
pub(super) const Y: usize = 1;
pub(super) const FIRST: usize = 2;
pub(super) const SECOND: usize = 3;
pub(super) const LOG_BLUR: usize = 4;
pub(super) const MEAN: usize = 5;
pub(super) const A: usize = 6;
pub(super) const B: usize = 7;
pub(super) const PRODUCT: usize = 8;

/// Further from an edge than so many deviations of the blur there is only one side.
const FAR: f64 = 6.0;
/// Vectors of pixels whose products are added up together.
const BLOCK: usize = 16;
/// Weight of what only fills the last vector, before it is weighed.
const NOT_THERE: f64 = -1.0;

/// Pixels of a window: places relative to the window's origin, grey values and square roots of weights.
#[derive(Default)]
pub(super) struct Samples {
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    pub grey: Vec<f64>,
    pub root: Vec<f64>,
}

impl Samples {
    pub fn clear(&mut self) {
        for values in [&mut self.x, &mut self.y, &mut self.grey, &mut self.root] {
            values.clear();
        }
    }

    /// Adds neighbours of a row, the first of them at a place, all with one weight.
    pub fn extend(&mut self, [column, row]: [i64; 2], greys: &[f32], weight: f64) {
        let first = column as f64;
        self.x.extend((0_u32..).zip(greys).map(|(i, _)| first + f64::from(i)));
        self.y.resize(self.x.len(), row as f64);
        self.grey.extend(greys.iter().copied().map(f64::from));
        self.root.resize(self.x.len(), weight);
    }

    /// Fills the last vector with pixels that do not count.
    pub fn pad(&mut self) {
        let length = self.x.len().next_multiple_of(MAX_LANES);
        for values in [&mut self.x, &mut self.y, &mut self.grey] {
            values.resize(length, 0.0);
        }
        self.root.resize(length, NOT_THERE);
    }
}

/// `J' W J`, `J' W r` and the weighted sum of squares.
#[derive(Clone, Copy)]
pub(super) struct Equations {
    pub normal: SMatrix<f64, N, N>,
    pub right: SVector<f64, N>,
    pub cost: f64,
}

/// Adds the equations up over the pixels, for parameters and curvatures of the edges.
pub(super) struct Sum<'a, const IS_CROSSING: bool> {
    pub samples: &'a Samples,
    pub p: [f64; N],
    pub bends: [f64; 2],
}

/// A blurred edge at pixels: side runs from -1 to 1, slope is its derivative in the distance.
pub(super) struct Edge<V> {
    distance: V,
    pub along: V,
    pub side: V,
    pub slope: V,
}

impl<const IS_CROSSING: bool> Kernel for Sum<'_, IS_CROSSING> {
    type Output = Equations;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Equations {
        let p = self.p.map(|x| simd.splat(x));
        let inverse_blur = simd.splat((-self.p[LOG_BLUR]).exp());
        let turns = [FIRST, SECOND].map(|i| {
            let (sine, cosine) = self.p[i].sin_cos();
            [simd.splat(sine), simd.splat(cosine)]
        });
        let half_bends = self.bends.map(|bend| simd.splat(0.5 * bend));
        // Where edges are not square to each other, the blur across one goes along with that across the other: the
        // share of both sides is not the product of theirs. Mehler's series, two terms.
        let (sine, correlation) = (self.p[FIRST] - self.p[SECOND]).sin_cos();
        let blur_squared = (2.0 * self.p[LOG_BLUR]).exp();
        let together = [correlation * blur_squared, 0.5 * correlation * correlation].map(|x| simd.splat(x));
        let turning = [sine * blur_squared, sine * correlation].map(|x| simd.splat(x) * p[PRODUCT]);
        let per_blur_squared = simd.splat(-1.0 / blur_squared);
        let zero = simd.splat(0.0);
        // Derivatives and residuals of some pixels first, then their products, one row of them at a time: more sums
        // have no room in the registers.
        let mut block = [[zero; N + 1]; BLOCK];
        let mut filled = 0;
        let mut sums = [[zero; N + 1]; N + 1];
        for at in (0..self.samples.x.len()).step_by(S::LANES) {
            let x = simd.load(&self.samples.x[at..]) - p[X];
            let y = simd.load(&self.samples.y[at..]) - p[Y];
            let root = simd.load(&self.samples.root[at..]);
            let first = edge(simd, x, y, turns[0], inverse_blur, half_bends[0]);
            let second = edge(simd, x, y, turns[1], inverse_blur, half_bends[1]);
            let slopes = first.slope * second.slope;
            let distances = first.distance * second.distance;
            let series = together[1].mul_add(distances, together[0]);
            let both = slopes.mul_add(series, first.side * second.side);
            let turned = slopes * turning[1].mul_add(distances, turning[0]);
            let (basis, drift) =
                if IS_CROSSING { ([x, y], [p[A], p[B]]) } else { ([first.side, second.side], [zero; 2]) };
            let falling = series * per_blur_squared;
            let of_first = falling.mul_add(first.distance, together[1] * second.distance);
            let of_second = falling.mul_add(second.distance, together[1] * first.distance);
            let mut by_first = p[PRODUCT] * of_first.mul_add(second.slope, second.side);
            let mut by_second = p[PRODUCT] * of_second.mul_add(first.slope, first.side);
            if !IS_CROSSING {
                by_first = by_first + p[A];
                by_second = by_second + p[B];
            }
            let predicted = p[A].mul_add(basis[0], p[B].mul_add(basis[1], p[PRODUCT].mul_add(both, p[MEAN])));
            let (across_first, across_second) = (by_first * first.slope, by_second * second.slope);
            let residual = simd.load(&self.samples.grey[at..]) - predicted;
            let row = [
                across_first.mul_add(turns[0][0], across_second * turns[1][0]) - drift[0],
                -across_first.mul_add(turns[0][1], across_second * turns[1][1]) - drift[1],
                -across_first.mul_add(first.along, turned),
                across_second.neg_mul_add(second.along, turned),
                -across_first.mul_add(first.distance, across_second * second.distance),
                simd.splat(1.0),
                basis[0],
                basis[1],
                both,
                residual,
            ];
            for (to, value) in block[filled].iter_mut().zip(row) {
                *to = root * value;
            }
            filled += 1;
            if filled == BLOCK || at + S::LANES >= self.samples.x.len() {
                let block = &block[..filled];
                add_products::<S, 0>(block, &mut sums[0]);
                add_products::<S, 1>(block, &mut sums[1]);
                add_products::<S, 2>(block, &mut sums[2]);
                add_products::<S, 3>(block, &mut sums[3]);
                add_products::<S, 4>(block, &mut sums[4]);
                add_products::<S, 5>(block, &mut sums[5]);
                add_products::<S, 6>(block, &mut sums[6]);
                add_products::<S, 7>(block, &mut sums[7]);
                add_products::<S, 8>(block, &mut sums[8]);
                add_products::<S, 9>(block, &mut sums[9]);
                filled = 0;
            }
        }
        let mut normal = SMatrix::zeros();
        let mut right = SVector::zeros();
        for i in 0..N {
            right[i] = sums[i][N].sum();
            for k in i..N {
                normal[(i, k)] = sums[i][k].sum();
                normal[(k, i)] = normal[(i, k)];
            }
        }
        Equations { normal, right, cost: sums[N][N].sum() }
    }
}

/// Adds the products of one entry with itself and those after it.
#[inline(always)]
fn add_products<S: Simd, const ENTRY: usize>(block: &[[S::Vector; N + 1]], sums: &mut [S::Vector; N + 1]) {
    let mut here = *sums;
    for row in block {
        let factor = row[ENTRY];
        for k in ENTRY..=N {
            here[k] = factor.mul_add(row[k], here[k]);
        }
    }
    *sums = here;
}

/// Adds up the equations of the greys alone, for the rest as given; edges are taken as straight.
pub(super) struct Greys<'a, const IS_CROSSING: bool> {
    pub samples: &'a Samples,
    pub p: [f64; N],
}

impl<const IS_CROSSING: bool> Kernel for Greys<'_, IS_CROSSING> {
    type Output = (SMatrix<f64, 4, 4>, SVector<f64, 4>);

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let place = [simd.splat(self.p[X]), simd.splat(self.p[Y])];
        let inverse_blur = simd.splat((-self.p[LOG_BLUR]).exp());
        let turns = [FIRST, SECOND].map(|i| {
            let (sine, cosine) = self.p[i].sin_cos();
            [simd.splat(sine), simd.splat(cosine)]
        });
        let zero = simd.splat(0.0);
        let mut upper = [[zero; 4]; 4];
        let mut right = [zero; 4];
        for at in (0..self.samples.x.len()).step_by(S::LANES) {
            let x = simd.load(&self.samples.x[at..]) - place[0];
            let y = simd.load(&self.samples.y[at..]) - place[1];
            let grey = simd.load(&self.samples.grey[at..]);
            let root = simd.load(&self.samples.root[at..]);
            let weight = root * root;
            let first = edge(simd, x, y, turns[0], inverse_blur, zero).side;
            let second = edge(simd, x, y, turns[1], inverse_blur, zero).side;
            let [a, b] = if IS_CROSSING { [x, y] } else { [first, second] };
            let basis = [simd.splat(1.0), a, b, first * second];
            for i in 0..4 {
                let weighted = weight * basis[i];
                right[i] = weighted.mul_add(grey, right[i]);
                for k in i..4 {
                    upper[i][k] = weighted.mul_add(basis[k], upper[i][k]);
                }
            }
        }
        let normal = SMatrix::from_fn(|i, k| upper[i.min(k)][i.max(k)].sum());
        (normal, SVector::from(right.map(Vector::sum)))
    }
}

/// A parabola stands for the arc of a bent edge; its derivatives, which matter little to a step, are left out.
#[inline(always)]
pub(super) fn edge<S: Simd>(
    simd: S,
    x: S::Vector,
    y: S::Vector,
    [sine, cosine]: [S::Vector; 2],
    inverse_blur: S::Vector,
    half_bend: S::Vector,
) -> Edge<S::Vector> {
    let along = cosine.mul_add(x, sine * y);
    let straight = sine.neg_mul_add(x, cosine * y);
    let distance = (half_bend * along).neg_mul_add(along, straight);
    let scaled = distance * inverse_blur;
    // The smaller of the two is the negative of the larger of their negatives.
    let far = -(-scaled.abs()).max(simd.splat(-FAR));
    let bell = bell(simd, far);
    let slope = simd.splat((2.0 * std::f64::consts::FRAC_1_PI).sqrt()) * bell * inverse_blur;
    let magnitude = error_function(simd, far * simd.splat(std::f64::consts::FRAC_1_SQRT_2), bell);
    let side = magnitude.keep_or(scaled.at_least(simd.splat(0.0)), -magnitude);
    Edge { distance, along, side, slope }
}

/// `exp(-x^2 / 2)` for `x` up to [`FAR`]: the series of its 64th root, squared six times; good to 1e-9.
#[inline(always)]
fn bell<S: Simd>(simd: S, x: S::Vector) -> S::Vector {
    let z = x * x * simd.splat(-0.5 / 64.0);
    let mut root = simd.splat(1.0 / 40_320.0);
    for factorial in [5_040.0, 720.0, 120.0, 24.0, 6.0, 2.0, 1.0, 1.0] {
        root = root.mul_add(z, simd.splat(1.0 / factorial));
    }
    for _ in 0..6 {
        root = root * root;
    }
    root
}

/// The error function of `x >= 0`, given `exp(-x^2)`; Abramowitz and Stegun 7.1.26, good to 1.5e-7.
#[inline(always)]
fn error_function<S: Simd>(simd: S, x: S::Vector, bell: S::Vector) -> S::Vector {
    let one = simd.splat(1.0);
    let t = one / simd.splat(0.327_591_1).mul_add(x, one);
    let mut series = simd.splat(1.061_405_429);
    for coefficient in [-1.453_152_027, 1.421_413_741, -0.284_496_736, 0.254_829_592] {
        series = series.mul_add(t, simd.splat(coefficient));
    }
    (series * t).neg_mul_add(bell, one)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{VectorUnit, dispatch};
    use crate::testing::Random;

    fn window() -> Samples {
        let mut random = Random::new(3);
        let mut samples = Samples::default();
        for i in 0..169 {
            let place = [f64::from(i % 13) - 6.0, f64::from(i / 13) - 6.0];
            samples.x.push(place[0]);
            samples.y.push(place[1]);
            samples.grey.push(100.0 + 50.0 * random.normal());
            samples.root.push(random.normal().abs());
        }
        samples.pad();
        samples.root[169..].fill(0.0);
        samples
    }

    const P: [f64; N] = [0.2, -0.3, 0.2, 1.6, 0.3, 100.0, 3.0, -2.0, 50.0];

    fn sum(unit: VectorUnit, samples: &Samples, p: [f64; N], is_crossing: bool) -> Equations {
        let bends = [0.001, -0.002];
        if is_crossing {
            dispatch(unit, Sum::<true> { samples, p, bends })
        } else {
            dispatch(unit, Sum::<false> { samples, p, bends })
        }
    }

    #[test]
    fn units_agree() {
        let samples = window();
        for is_crossing in [true, false] {
            let expected = sum(VectorUnit::Portable, &samples, P, is_crossing);
            for unit in VectorUnit::ALL {
                let found = sum(unit, &samples, P, is_crossing);
                assert!((found.normal - expected.normal).norm() < 1e-9 * expected.normal.norm());
                assert!((found.right - expected.right).norm() < 1e-9 * expected.right.norm());
            }
        }
    }

    #[test]
    fn the_right_side_is_the_slope_of_the_cost() {
        let samples = window();
        for is_crossing in [true, false] {
            let here = sum(VectorUnit::Portable, &samples, P, is_crossing);
            for i in 0..N {
                let cost = |by: f64| {
                    let mut p = P;
                    p[i] += by;
                    sum(VectorUnit::Portable, &samples, p, is_crossing).cost
                };
                let slope = (cost(1e-4) - cost(-1e-4)) / 2e-4;
                // The derivatives of the bend are left out, and the error function is good to 1.5e-7.
                let scale = here.right.amax();
                assert!((slope + 2.0 * here.right[i]).abs() < 0.01 * scale, "{i}: {slope} {}", here.right[i]);
            }
        }
    }
}
