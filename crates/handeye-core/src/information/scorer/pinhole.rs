//! The information of corners of a plane seen by a pinhole camera, lanes = candidates.

use super::block::{BLOCK, Block};
use super::forms::packed;
use super::target::{Target, Way, advance};
use super::wide_points::Column;
use super::window::Window;
use crate::batched_algebra::{PlaneMoments, load, store, upper};
use crate::camera::MIN_DEPTH_M;
use crate::simd::{Kernel, Mask, Simd, Vector};

/// A plane nearer to the camera than this, in distances of the target, is seen from the side: inverse depths are not
/// told well from where its points appear.
const GRAZING: f64 = 1e-4;

/// Sums the information, divided by `f_x^2`, of the points in sight of a plane `z = plane_z`, and counts them.
///
/// With `CAMERA` also that of `f_x`, `f_y`, `c_x` and `c_y` as far as they are among the columns.
pub(super) struct Pinhole<'a, const CAMERA: bool> {
    /// Focal lengths.
    pub focal: [f64; 2],
    pub columns: &'a [Column],
    pub window: &'a Window,
    pub target: &'a Target,
    pub plane_z: f64,
    pub block: &'a mut Block,
}

impl<const CAMERA: bool> Kernel for Pinhole<'_, CAMERA> {
    /// Whether no candidate sees the plane from the side; the block is of no use otherwise.
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> bool {
        for at in (0..BLOCK).step_by(S::LANES) {
            let pose = load(simd, &self.block.pose, at);
            let Some(plane) = plane(simd, &pose, self.plane_z) else { return false };
            let (moments, seen) = if whole(simd, self.window, self.target, &pose) {
                let (moments, _) = sum::<S, false>(simd, self.window, self.target, &pose);
                (moments, simd.splat(self.target.count))
            } else {
                sum::<S, true>(simd, self.window, self.target, &pose)
            };
            let deep = moments.with_depth(plane, seen);
            let information = moments.information(simd, &deep, plane, self.window.squared_aspect, seen);
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
                let with_twist = moments.with_camera(simd, &deep, parameter, aspect, seen);
                for (i, entry) in with_twist.into_iter().enumerate() {
                    (entry * inverse_focal).store(&mut rows[packed(size, i, 6 + k)][at..]);
                }
                for (l, other) in self.columns.iter().enumerate().skip(k) {
                    let Column::Camera(other) = *other else { continue };
                    let (i, j) = (parameter.min(other), parameter.max(other));
                    let entry = moments.of_camera(simd, i, j, seen) * inverse_focal * inverse_focal;
                    entry.store(&mut rows[packed(size, 6 + k, 6 + l)][at..]);
                }
            }
        }
        true
    }
}

/// The target's plane in the camera frame, its normal divided by its distance; none if a lane sees it from the side.
#[inline(always)]
fn plane<S: Simd>(simd: S, pose: &[S::Vector; 12], plane_z: f64) -> Option<[S::Vector; 3]> {
    let start = simd.splat(plane_z);
    let distance = pose[2].mul_add(pose[9], pose[5].mul_add(pose[10], pose[8].mul_add(pose[11], start)));
    let away = pose[9].abs() + pose[10].abs() + pose[11].abs();
    if !distance.abs().greater(away * simd.splat(GRAZING)).all() {
        return None;
    }
    let inverse = simd.splat(1.0) / distance;
    Some([pose[2] * inverse, pose[5] * inverse, pose[8] * inverse])
}

/// Whether in every lane the rectangle around the target is in sight.
///
/// Seen from the front, a rectangle lies in the window if it lies on the inner side of the four planes through the
/// camera and the window's edges: the least value over it of a linear function with gradient `n` is its value at the
/// centre minus `|n| .` half size.
#[inline(always)]
fn whole<S: Simd>(simd: S, window: &Window, target: &Target, pose: &[S::Vector; 12]) -> bool {
    let half = [simd.splat(target.half_size[0]), simd.splat(target.half_size[1])];
    let mut centre = [simd.splat(0.0); 3];
    for row in 0..3 {
        let sum = pose[3 * row + 2].mul_add(simd.splat(target.centre[2]), pose[9 + row]);
        let sum = pose[3 * row + 1].mul_add(simd.splat(target.centre[1]), sum);
        centre[row] = pose[3 * row].mul_add(simd.splat(target.centre[0]), sum);
    }
    let nearest = half[0].neg_mul_add(pose[6].abs(), half[1].neg_mul_add(pose[7].abs(), centre[2]));
    let mut inside = nearest.greater(simd.splat(MIN_DEPTH_M));
    if window.is_everything() {
        return inside.all();
    }
    // Edges in by a trace: a board on one is looked at point by point.
    let trace = |bound: f64| 1e-9 * (1.0 + bound.abs());
    let low = |bound: f64| bound + trace(bound);
    let high = |bound: f64| bound - trace(bound);
    let [left, right] = [low(window.x[0]), high(window.x[1])];
    let [top, bottom] = [low(window.y[0]), high(window.y[1])];
    macro_rules! edge {
        // `row - bound * depth`, of which the sign must be that of `sign`.
        ($row:literal, $bound:expr, $sign:literal) => {
            let bound = simd.splat($bound);
            let across = |axis: usize| pose[6 + axis].neg_mul_add(bound, pose[3 * $row + axis]).abs();
            let value = centre[2].neg_mul_add(bound, centre[$row]) * simd.splat($sign);
            let least = half[0].neg_mul_add(across(0), half[1].neg_mul_add(across(1), value));
            inside = inside & least.greater(simd.splat(0.0));
        };
    }
    edge!(0, left, 1.0);
    edge!(0, right, -1.0);
    edge!(1, top, 1.0);
    edge!(1, bottom, -1.0);
    inside.all()
}

/// The moments of the points in sight, and their number.
#[inline(always)]
fn sum<S: Simd, const PARTLY: bool>(
    simd: S,
    window: &Window,
    target: &Target,
    pose: &[S::Vector; 12],
) -> (PlaneMoments<S::Vector>, S::Vector) {
    let one = simd.splat(1.0);
    let mut moments = PlaneMoments::new(simd);
    let mut seen = simd.splat(0.0);
    for patch in &target.patches {
        let way = Way::new(simd, patch, pose);
        let mut line = way.first;
        for _ in 0..patch.counts[1] {
            let mut point = line;
            for _ in 0..patch.counts[0] {
                let w = one / point[2];
                let (mut x, mut y) = (point[0] * w, point[1] * w);
                if PARTLY {
                    let in_sight = point[2].greater(simd.splat(MIN_DEPTH_M))
                        & x.at_least(simd.splat(window.x[0]))
                        & simd.splat(window.x[1]).at_least(x)
                        & y.at_least(simd.splat(window.y[0]))
                        & simd.splat(window.y[1]).at_least(y);
                    seen = seen + one.keep(in_sight);
                    x = x.keep(in_sight);
                    y = y.keep(in_sight);
                }
                moments.add(x, y);
                advance(&mut point, &way.next);
            }
            advance(&mut line, &way.next_line);
        }
    }
    (moments, seen)
}
