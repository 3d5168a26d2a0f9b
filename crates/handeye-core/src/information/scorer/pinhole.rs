//! The information of corners seen by a pinhole camera, lanes = candidates.

use super::block::{BLOCK, Block};
use super::forms::packed;
use super::target::Target;
use super::wide_points::Column;
use crate::camera::MIN_DEPTH_M;
use crate::lanes::{Sums, Window, load, store, upper};
use crate::simd::{Kernel, Mask, Simd, Vector};

/// Sums the information, divided by `f_x^2`, of the points in sight, and counts them.
///
/// With `CAMERA` also that of `f_x`, `f_y`, `c_x` and `c_y` as far as they are among the columns, which needs but two
/// more sums.
pub(super) struct Pinhole<'a, const CAMERA: bool> {
    /// Focal lengths.
    pub focal: [f64; 2],
    pub columns: &'a [Column],
    pub window: &'a Window,
    pub target: &'a Target,
    pub block: &'a mut Block,
}

impl<const CAMERA: bool> Kernel for Pinhole<'_, CAMERA> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        for at in (0..BLOCK).step_by(S::LANES) {
            let pose = load(simd, &self.block.pose, at);
            let (sums, cubes, seen) = if whole(simd, self.window, self.target, &pose) {
                let (sums, cubes, _) = sum::<S, false, CAMERA>(simd, self.window, self.target, &pose);
                (sums, cubes, simd.splat(self.target.count))
            } else {
                sum::<S, true, CAMERA>(simd, self.window, self.target, &pose)
            };
            let information = sums.information(simd, self.window.squared_aspect, seen);
            seen.store(&mut self.block.seen[at..]);
            if !CAMERA {
                store(&information, self.block.of_twist(), at);
                continue;
            }
            let size = 6 + self.columns.len();
            let rows = &mut self.block.information;
            for i in 0..6 {
                for j in i..6 {
                    information[upper(i, j)].store(&mut rows[packed(size, i, j)][at..]);
                }
            }
            let inverse_focal = simd.splat(1.0 / self.focal[0]);
            for (k, column) in self.columns.iter().enumerate() {
                let Column::Camera(parameter) = *column else { continue };
                let aspect = self.focal[1] / self.focal[0];
                let with_twist = sums.with_camera(simd, parameter, aspect, seen, cubes);
                for (i, entry) in with_twist.into_iter().enumerate() {
                    (entry * inverse_focal).store(&mut rows[packed(size, i, 6 + k)][at..]);
                }
                for (l, other) in self.columns.iter().enumerate().skip(k) {
                    let Column::Camera(other) = *other else { continue };
                    let (i, j) = (parameter.min(other), parameter.max(other));
                    let entry = sums.of_camera(simd, i, j, seen) * inverse_focal * inverse_focal;
                    entry.store(&mut rows[packed(size, 6 + k, 6 + l)][at..]);
                }
            }
        }
    }
}

/// Whether in every lane the box around the target is in sight.
///
/// Seen from the front, a box lies in the window if it lies on the inner side of the four planes through the camera
/// and the window's edges: the least value over a box of a linear function with gradient `n` is its value at the
/// centre minus `|n| .` half size.
#[inline(always)]
fn whole<S: Simd>(simd: S, window: &Window, target: &Target, pose: &[S::Vector; 12]) -> bool {
    // Edges in by a trace: whoever stands on one is looked at point by point.
    let reach = (0.49 * window.max_squared_radius).sqrt();
    let trace = |bound: f64| 1e-9 * (1.0 + bound.abs());
    let low = |bound: f64| (bound + trace(bound)).max(-reach);
    let high = |bound: f64| (bound - trace(bound)).min(reach);
    let [left, right] = [low(window.x[0]), high(window.x[1])];
    let [top, bottom] = [low(window.y[0]), high(window.y[1])];
    let mut inside = simd.splat(f64::INFINITY).greater(simd.splat(0.0));
    macro_rules! plane {
        // `sign * row + factor * depth >= least`
        ($row:expr, $sign:literal, $factor:expr, $least:expr) => {
            let (sign, factor) = (simd.splat($sign), simd.splat($factor));
            let mut value = pose[9 + $row].mul_add(sign, pose[11] * factor) - simd.splat($least);
            for axis in 0..3 {
                let n = pose[3 * $row + axis].mul_add(sign, pose[6 + axis] * factor);
                value = n.mul_add(simd.splat(target.centre[axis]), value);
                value = n.abs().neg_mul_add(simd.splat(target.half_size[axis]), value);
            }
            inside = inside & value.greater(simd.splat(0.0));
        };
    }
    plane!(2, 1.0, 0.0, MIN_DEPTH_M);
    plane!(0, 1.0, -left, 0.0);
    plane!(0, -1.0, right, 0.0);
    plane!(1, 1.0, -top, 0.0);
    plane!(1, -1.0, bottom, 0.0);
    inside.all()
}

/// The sums over the points in sight, those of `x^3` and `y^3` for a `CAMERA`, and the number of points.
#[inline(always)]
fn sum<S: Simd, const PARTLY: bool, const CAMERA: bool>(
    simd: S,
    window: &Window,
    target: &Target,
    pose: &[S::Vector; 12],
) -> (Sums<S::Vector>, [S::Vector; 2], S::Vector) {
    let one = simd.splat(1.0);
    let squared_aspect = simd.splat(window.squared_aspect);
    let mut sums = Sums::new(simd);
    let mut cubes = [simd.splat(0.0); 2];
    let mut seen = simd.splat(0.0);
    for line in &target.lines {
        let (line_y, line_z) = (simd.splat(line.y), simd.splat(line.z));
        let start_x = pose[1].mul_add(line_y, pose[2].mul_add(line_z, pose[9]));
        let start_y = pose[4].mul_add(line_y, pose[5].mul_add(line_z, pose[10]));
        let start_z = pose[7].mul_add(line_y, pose[8].mul_add(line_z, pose[11]));
        for along in &line.x {
            let along = simd.splat(*along);
            let depth = pose[6].mul_add(along, start_z);
            let mut w = one / depth;
            let mut x = pose[0].mul_add(along, start_x) * w;
            let mut y = pose[3].mul_add(along, start_y) * w;
            if PARTLY {
                let in_sight = depth.greater(simd.splat(MIN_DEPTH_M))
                    & x.at_least(simd.splat(window.x[0]))
                    & simd.splat(window.x[1]).at_least(x)
                    & y.at_least(simd.splat(window.y[0]))
                    & simd.splat(window.y[1]).at_least(y)
                    & simd.splat(window.max_squared_radius).at_least(x.mul_add(x, y * y));
                seen = seen + one.keep(in_sight);
                w = w.keep(in_sight);
                x = x.keep(in_sight);
                y = y.keep(in_sight);
            }
            sums.add(squared_aspect, w, x, y);
            if CAMERA {
                cubes = [(x * x).mul_add(x, cubes[0]), (y * y).mul_add(y, cubes[1])];
            }
        }
    }
    (sums, cubes, seen)
}
