//! What of the grey values around a crossing does not look the same after half a turn.
//!
//! A crossing does, and so does any tone curve of it: gamma, or a profile that is no Gaussian's, leaves residuals but
//! does not move the place. It makes each edge look turned, for it moves both halves of it towards what is light.
//! What is left beside such curves and turns tells how well the place is known.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use nalgebra::{SMatrix, SVector};

use super::corner_equations::{FIRST, LOG_BLUR, N, SECOND, Samples, X, Y, edge};
use crate::simd::{Kernel, Simd, Vector};

/// A constant, light that changes across the window, four powers of the crossing, what an oblique one adds, and turns
/// of both edges.
const COLUMNS: usize = 10;

/// Fits such curves to a crossing of which all but the greys is known; gives the weighted squares left.
pub(super) struct Asymmetry<'a> {
    pub samples: &'a Samples,
    pub p: [f64; N],
    pub bends: [f64; 2],
}

impl Kernel for Asymmetry<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> f64 {
        let place = [simd.splat(self.p[X]), simd.splat(self.p[Y])];
        let inverse_blur = simd.splat((-self.p[LOG_BLUR]).exp());
        let turns = [FIRST, SECOND].map(|i| {
            let (sine, cosine) = self.p[i].sin_cos();
            [simd.splat(sine), simd.splat(cosine)]
        });
        let half_bends = self.bends.map(|bend| simd.splat(0.5 * bend));
        let mut upper = [[simd.splat(0.0); COLUMNS + 1]; COLUMNS + 1];
        for at in (0..self.samples.x.len()).step_by(S::LANES) {
            let x = simd.load(&self.samples.x[at..]) - place[0];
            let y = simd.load(&self.samples.y[at..]) - place[1];
            let root = simd.load(&self.samples.root[at..]);
            let first = edge(simd, x, y, turns[0], inverse_blur, half_bends[0]);
            let second = edge(simd, x, y, turns[1], inverse_blur, half_bends[1]);
            let tone = first.side * second.side;
            let squared = tone * tone;
            let grey = simd.load(&self.samples.grey[at..]);
            let one = simd.splat(1.0);
            let oblique = first.slope * second.slope;
            let [a, b] = [(&first, &second), (&second, &first)].map(|(a, b)| a.slope * a.along * b.side);
            let row = [one, x, y, tone, squared, squared * tone, squared * squared, oblique, a, b, grey];
            let row = row.map(|value| root * value);
            for (i, sums) in upper.iter_mut().enumerate() {
                for k in i..=COLUMNS {
                    sums[k] = row[i].mul_add(row[k], sums[k]);
                }
            }
        }
        let normal = SMatrix::<f64, COLUMNS, COLUMNS>::from_fn(|i, k| upper[i.min(k)][i.max(k)].sum());
        let right = SVector::<f64, COLUMNS>::from_fn(|i, _| upper[i][COLUMNS].sum());
        let cost = upper[COLUMNS][COLUMNS].sum();
        let ridge =
            SMatrix::<f64, COLUMNS, COLUMNS>::from_diagonal(&normal.diagonal().map(|d| 1e-12 * d + 1e-12));
        (normal + ridge).cholesky().map_or(cost, |solved| (cost - right.dot(&solved.solve(&right))).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{MAX_LANES, VectorUnit, dispatch};

    const P: [f64; N] = [0.3, -0.2, 0.1, 1.6, 0.2, 0.0, 0.0, 0.0, 0.0];

    fn left(unit: VectorUnit, grey: impl Fn(f64, f64) -> f64) -> f64 {
        let mut samples = Samples::default();
        for i in 0..21 * 21 {
            let [x, y] = [i % 21, i / 21].map(|k| f64::from(k) - 10.0);
            samples.x.push(x);
            samples.y.push(y);
            samples.grey.push(grey(x - P[X], y - P[Y]));
            samples.root.push(1.0);
        }
        let count = samples.x.len();
        assert!(count > MAX_LANES);
        samples.pad();
        samples.root[count..].fill(0.0);
        dispatch(unit, Asymmetry { samples: &samples, p: P, bends: [0.0; 2] })
    }

    /// The side of an edge that a pixel is on, blurred.
    fn side(x: f64, y: f64, angle: f64) -> f64 {
        let step = (angle.cos() * y - angle.sin() * x) * (-P[LOG_BLUR]).exp() / 2000.0;
        let bell = |i: i32| (-0.5 * ((f64::from(i) + 0.5) * step).powi(2)).exp();
        (2.0 * std::f64::consts::FRAC_1_PI).sqrt() * step * (0..2000).map(bell).sum::<f64>()
    }

    #[test]
    fn only_what_half_a_turn_changes_is_left() {
        for unit in VectorUnit::ALL {
            let tone = |x, y| side(x, y, P[FIRST]) * side(x, y, P[SECOND]);
            let even = left(unit, |x, y| 100.0 + 2.0 * x - y + 50.0 * tone(x, y) - 9.0 * tone(x, y).powi(4));
            assert!(even < 1e-3, "{even}");
            let odd = left(unit, |x, y| 10.0 * side(x, y, P[FIRST]));
            assert!(odd > 100.0, "{odd}");
        }
    }
}
