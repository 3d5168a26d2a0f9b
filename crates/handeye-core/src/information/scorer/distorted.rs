//! The information of corners seen through a Brown-Conrady lens, lanes = candidates.

use super::block::{BLOCK, Block};
use super::target::{Target, Way, advance};
use super::window::Window;
use crate::batched_algebra::{UPPER, load, store, upper};
use crate::camera::{MAX_PARAMETERS, MIN_DEPTH_M, distort, projection_row, restore_signs};
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
                for of_lens in rows {
                    let row = projection_row(of_lens, w, x, y);
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
    restore_signs(&mut sums);
    (sums, seen)
}
