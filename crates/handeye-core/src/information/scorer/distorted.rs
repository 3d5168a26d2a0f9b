//! The information of corners seen through a Brown-Conrady lens, lanes = candidates.
//!
//! With the lens' Jacobian `J` at unit depth, a row of `d pi / d eta` with entries `(A, B)` of `F J` is
//! `[A w, B w, -s w, -(y s + B), A + x s, B x - A y]`, `s = x A + y B`.

use super::block::{BLOCK, Block};
use super::target::{Target, Way, advance};
use super::window::Window;
use crate::batched_algebra::{UPPER, load, store, upper};
use crate::camera::distort;
use crate::camera::{MAX_PARAMETERS, MIN_DEPTH_M};
use crate::simd::{Kernel, Simd, Vector};

/// Sums the information, divided by `f_x^2`, of the points in sight, and counts them.
///
/// The window bounds points after the lens, its radius those before it. `RATIONAL` and `PRISM` say whether `k4..k6`
/// and `s1..s4` can differ from zero.
pub(super) struct Distorted<'a, const RATIONAL: bool, const PRISM: bool> {
    pub parameters: &'a [f64; MAX_PARAMETERS],
    pub window: &'a Window,
    pub target: &'a Target,
    pub block: &'a mut Block,
}

impl<const RATIONAL: bool, const PRISM: bool> Kernel for Distorted<'_, RATIONAL, PRISM> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        for at in (0..BLOCK).step_by(S::LANES) {
            let pose = load(simd, &self.block.pose, at);
            let (information, seen) =
                sum::<S, RATIONAL, PRISM>(simd, self.parameters, self.window, self.target, &pose);
            store(&information, self.block.of_twist(), at);
            seen.store(&mut self.block.seen[at..]);
        }
    }
}

#[inline(always)]
fn sum<S: Simd, const RATIONAL: bool, const PRISM: bool>(
    simd: S,
    parameters: &[f64; MAX_PARAMETERS],
    window: &Window,
    target: &Target,
    pose: &[S::Vector; 12],
) -> ([S::Vector; UPPER], S::Vector) {
    let zero = simd.splat(0.0);
    let one = simd.splat(1.0);
    let mut sums = [zero; UPPER];
    let mut seen = zero;
    for patch in &target.patches {
        let way = Way::new(simd, patch, pose);
        let mut line = way.first;
        for _ in 0..patch.counts[1] {
            let mut point = line;
            for _ in 0..patch.counts[0] {
                let depth = point[2];
                let w = one / depth;
                let (x, y) = (point[0] * w, point[1] * w);
                let distorted = distort::<S, RATIONAL, PRISM>(simd, parameters, x, y);
                let in_sight = window.shows(simd, &distorted) & depth.greater(simd.splat(MIN_DEPTH_M));
                seen = seen + one.keep(in_sight);
                let (w, x, y) = (w.keep(in_sight), x.keep(in_sight), y.keep(in_sight));
                let aspect = simd.splat(parameters[1] / parameters[0]);
                let rows = [
                    (distorted.along_x.keep(in_sight), distorted.cross_x.keep(in_sight)),
                    (
                        (distorted.cross_y * aspect).keep(in_sight),
                        (distorted.along_y * aspect).keep(in_sight),
                    ),
                ];
                for (a, b) in rows {
                    let s = a.mul_add(x, b * y);
                    // Third and fourth entry with the opposite sign, put right at the end.
                    let row = [a * w, b * w, s * w, y.mul_add(s, b), x.mul_add(s, a), b.mul_add(x, -(a * y))];
                    for i in 0..6 {
                        for j in i..6 {
                            sums[upper(i, j)] = row[i].mul_add(row[j], sums[upper(i, j)]);
                        }
                    }
                }
                advance(&mut point, &way.next);
            }
            advance(&mut line, &way.next_line);
        }
    }
    for i in [2, 3] {
        for j in [0, 1, 4, 5] {
            sums[upper(i, j)] = -sums[upper(i, j)];
        }
    }
    (sums, seen)
}
