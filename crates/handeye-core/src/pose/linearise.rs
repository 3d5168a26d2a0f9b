//! Residuals and their derivatives: the 6 x 6 information and gradient of each view, lanes = views.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use crate::batched_algebra::{Sums, UPPER, load, store, upper};
use crate::camera::{Camera, DistortedPoint, Lens, MIN_DEPTH_M, distort, projection_row, restore_signs};
use crate::se3::{Se3, entries, left_product, right_product};
use crate::simd::{Kernel, MAX_LANES, Simd, Vector, VectorUnit, dispatch};

use super::packed::{Group, Measurements, Point, Row};

/// A group of views linearised at one state.
#[derive(Clone)]
#[repr(C, align(64))]
pub(crate) struct LinearisedGroup {
    /// `X` and the robot's motion.
    pub before_y: [Row; 12],
    /// `M` and `G' r / sigma^2`.
    pub information: [Row; UPPER],
    pub gradient: [Row; 6],
    /// Sum of squared whitened residuals.
    pub cost: Row,
    /// One where every point is in front of the camera and in the lens' valid region.
    pub whole: Row,
}

impl LinearisedGroup {
    pub fn new() -> Self {
        const ZERO: Row = [0.0; MAX_LANES];
        Self {
            before_y: [ZERO; 12],
            information: [ZERO; UPPER],
            gradient: [ZERO; 6],
            cost: ZERO,
            whole: ZERO,
        }
    }
}

/// Linearises packed views at a state: `T_camera_target = X A Y` with the motions `A` of each lane.
///
/// `information` is `1 / sigma^2` of each group's pixels.
pub(crate) fn linearise(
    unit: VectorUnit,
    camera: &Camera,
    (x, y): (&Se3, &Se3),
    information: &[Row],
    measurements: &Measurements,
    out: &mut [LinearisedGroup],
) {
    let (x, y) = (&entries(x), &entries(y));
    macro_rules! linearise {
        ($($flag:literal),*) => {
            dispatch(unit, Linearise::<$($flag),*> { x, y, information, camera, measurements, out })
        };
    }
    match camera.lens {
        Lens::Pinhole => linearise!(false, false),
        Lens::BrownConrady4 | Lens::BrownConrady5 => linearise!(true, false),
        Lens::BrownConrady8 | Lens::BrownConrady12 => linearise!(true, true),
        _ => unreachable!("measurements through other lenses are not packed"),
    }
}

/// `DISTORTED` and `FULLY` say whether the lens distorts and whether it does so with all of Brown's and Conrady's
/// terms.
struct Linearise<'a, const DISTORTED: bool, const FULLY: bool> {
    x: &'a [f64; 12],
    y: &'a [f64; 12],
    information: &'a [Row],
    camera: &'a Camera,
    measurements: &'a Measurements,
    out: &'a mut [LinearisedGroup],
}

impl<const DISTORTED: bool, const FULLY: bool> Kernel for Linearise<'_, DISTORTED, FULLY> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let p = &self.camera.parameters;
        let aspect = p[1] / p[0];
        let squared_focal = simd.splat(p[0] * p[0]);
        let how = How::<DISTORTED, FULLY> { camera: self.camera };
        for (g, group) in self.measurements.groups.iter().enumerate() {
            let out = &mut self.out[g];
            for at in (0..MAX_LANES).step_by(S::LANES) {
                let before_y = left_product(simd, self.x, &load(simd, &group.motions, at));
                let pose = right_product(simd, &before_y, self.y);
                let weight = simd.load(&self.information[g][at..]) * squared_focal;
                let mut view = View::new(simd, aspect);
                for (i, point) in group.points.iter().enumerate() {
                    if i < group.full {
                        how.add::<S, false>(simd, &mut view, group, i, point, &pose, at);
                    } else {
                        how.add::<S, true>(simd, &mut view, group, i, point, &pose, at);
                    }
                }
                store(&before_y, &mut out.before_y, at);
                let count = simd.load(&group.counts[at..]);
                let mut information = if DISTORTED {
                    view.information
                } else {
                    view.sums.information(simd, aspect * aspect, count)
                };
                if DISTORTED {
                    restore_signs(&mut information);
                }
                for (sum, row) in information.iter().zip(&mut out.information) {
                    (*sum * weight).store(&mut row[at..]);
                }
                for (i, (sum, row)) in view.gradient.iter().zip(&mut out.gradient).enumerate() {
                    let signed = if i == 2 || i == 3 { -*sum } else { *sum };
                    (signed * weight).store(&mut row[at..]);
                }
                (view.squared * weight).store(&mut out.cost[at..]);
                view.whole.store(&mut out.whole[at..]);
            }
        }
    }
}

/// Sums over the points of a view, in units of the focal length `f_x`; third and fourth row and column of
/// information and gradient with the opposite sign.
struct View<V> {
    sums: Sums<V>,
    information: [V; UPPER],
    gradient: [V; 6],
    squared: V,
    whole: V,
    aspect: V,
    squared_aspect: V,
}

impl<V: Vector> View<V> {
    #[inline(always)]
    fn new<S: Simd<Vector = V>>(simd: S, aspect: f64) -> Self {
        let zero = simd.splat(0.0);
        Self {
            sums: Sums::new(simd),
            information: [zero; UPPER],
            gradient: [zero; 6],
            squared: zero,
            whole: simd.splat(1.0),
            aspect: simd.splat(aspect),
            squared_aspect: simd.splat(aspect * aspect),
        }
    }
}

/// How points are looked at.
struct How<'a, const DISTORTED: bool, const FULLY: bool> {
    camera: &'a Camera,
}

impl<const DISTORTED: bool, const FULLY: bool> How<'_, DISTORTED, FULLY> {
    /// Adds a point; `RAGGED` where some lanes have run out of points.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "one call for both kinds of point")]
    fn add<S: Simd, const RAGGED: bool>(
        &self,
        simd: S,
        view: &mut View<S::Vector>,
        group: &Group,
        i: usize,
        point: &Point,
        pose: &[S::Vector; 12],
        at: usize,
    ) {
        let one = simd.splat(1.0);
        let position = load(simd, &point.position, at);
        let mut moved = [one; 3];
        for axis in 0..3 {
            let last = pose[3 * axis + 2].mul_add(position[2], pose[9 + axis]);
            let sum = pose[3 * axis + 1].mul_add(position[1], last);
            moved[axis] = pose[3 * axis].mul_add(position[0], sum);
        }
        let mut w = one / moved[2];
        let (mut x, mut y) = (moved[0] * w, moved[1] * w);
        let front = moved[2].greater(simd.splat(MIN_DEPTH_M));
        let distorted: DistortedPoint<S::Vector> = if DISTORTED {
            distort::<S, FULLY, FULLY>(simd, &self.camera.parameters, x, y)
        } else {
            DistortedPoint::unchanged(simd, x, y)
        };
        let in_sight = front & distorted.is_valid(simd, self.camera.max_squared_radius());
        // Rows that a lane has no point for are zero.
        let counts = simd.load(&group.counts[at..]).greater(simd.splat(i as f64));
        view.whole = if RAGGED {
            view.whole.keep(in_sight).keep_or(counts, view.whole)
        } else {
            view.whole.keep(in_sight)
        };
        let mut u = distorted.x - simd.load(&point.seen[0][at..]);
        let mut v = distorted.y - simd.load(&point.seen[1][at..]);
        if RAGGED {
            (u, v) = (u.keep(counts), v.keep(counts));
        }
        if !DISTORTED {
            if RAGGED {
                (w, x, y) = (w.keep(counts), x.keep(counts), y.keep(counts));
            }
            view.add_pinhole(w, x, y, u, v);
            return;
        }
        let (a, b) = (distorted.along_x, distorted.cross_x);
        let (c, d) = (distorted.cross_y * view.aspect, distorted.along_y * view.aspect);
        v = v * view.aspect;
        let mut rows = [projection_row((a, b), w, x, y), projection_row((c, d), w, x, y)];
        view.squared = u.mul_add(u, v.mul_add(v, view.squared));
        if RAGGED {
            for row in &mut rows {
                for entry in row {
                    *entry = entry.keep(counts);
                }
            }
        }
        for (row, residual) in [(&rows[0], u), (&rows[1], v)] {
            for i in 0..6 {
                view.gradient[i] = row[i].mul_add(residual, view.gradient[i]);
                for j in i..6 {
                    view.information[upper(i, j)] = row[i].mul_add(row[j], view.information[upper(i, j)]);
                }
            }
        }
    }
}

impl<V: Vector> View<V> {
    /// Adds a point seen without distortion that counts like any other; all zero adds nothing.
    #[inline(always)]
    fn add_pinhole(&mut self, w: V, x: V, y: V, u: V, v: V) {
        self.sums.add(self.squared_aspect, w, x, y);
        let across = v * self.squared_aspect;
        let turn = x.mul_add(u, y * across);
        self.squared = u.mul_add(u, v.mul_add(across, self.squared));
        let g = &mut self.gradient;
        g[0] = w.mul_add(u, g[0]);
        g[1] = w.mul_add(across, g[1]);
        g[2] = w.mul_add(turn, g[2]);
        g[3] = y.mul_add(turn, g[3] + across);
        g[4] = x.mul_add(turn, g[4] + u);
        g[5] = y.neg_mul_add(u, x.mul_add(across, g[5]));
    }
}
