//! The information of corners seen through a Brown-Conrady lens, lanes = candidates.
//!
//! With the lens' Jacobian `J` at unit depth, a row of `d pi / d eta` with entries `(A, B)` of `F J` is
//! `[A w, B w, -s w, -(y s + B), A + x s, B x - A y]`, `s = x A + y B`.

use super::block::{BLOCK, Block};
use super::target::{Patch, Target};
use crate::camera::{MAX_PARAMETERS, MIN_DEPTH_M};
use crate::lanes::{UPPER, Window, bend, load, store, upper};
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
    for (line_y, line_z, line_x) in target.patches.iter().flat_map(Patch::lines) {
        let (line_y, line_z) = (simd.splat(line_y), simd.splat(line_z));
        let start_x = pose[1].mul_add(line_y, pose[2].mul_add(line_z, pose[9]));
        let start_y = pose[4].mul_add(line_y, pose[5].mul_add(line_z, pose[10]));
        let start_z = pose[7].mul_add(line_y, pose[8].mul_add(line_z, pose[11]));
        for along in line_x {
            let along = simd.splat(along);
            let depth = pose[6].mul_add(along, start_z);
            let w = one / depth;
            let x = pose[0].mul_add(along, start_x) * w;
            let y = pose[3].mul_add(along, start_y) * w;
            let bent = bend::<S, RATIONAL, PRISM>(simd, parameters, x, y);
            let in_sight = bent.in_sight(simd, window) & depth.greater(simd.splat(MIN_DEPTH_M));
            seen = seen + one.keep(in_sight);
            let (w, x, y) = (w.keep(in_sight), x.keep(in_sight), y.keep(in_sight));
            let aspect = simd.splat(parameters[1] / parameters[0]);
            let rows = [
                (bent.along_x.keep(in_sight), bent.cross_x.keep(in_sight)),
                ((bent.cross_y * aspect).keep(in_sight), (bent.along_y * aspect).keep(in_sight)),
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
        }
    }
    for i in [2, 3] {
        for j in [0, 1, 4, 5] {
            sums[upper(i, j)] = -sums[upper(i, j)];
        }
    }
    (sums, seen)
}
