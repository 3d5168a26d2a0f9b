//! The information of corners seen through a Brown-Conrady lens, lanes = candidates.
//!
//! With the lens' Jacobian `J` at unit depth, a row of `d pi / d eta` with entries `(A, B)` of `F J` is
//! `[A w, B w, -s w, -(y s + B), A + x s, B x - A y]`, `s = x A + y B`.

use super::block::{BLOCK, Block, UPPER, load, store, upper};
use super::pinhole::Window;
use super::target::Target;
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
            store(&information, &mut self.block.information, at);
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
    for line in &target.lines {
        let (line_y, line_z) = (simd.splat(line.y), simd.splat(line.z));
        let start_x = pose[1].mul_add(line_y, pose[2].mul_add(line_z, pose[9]));
        let start_y = pose[4].mul_add(line_y, pose[5].mul_add(line_z, pose[10]));
        let start_z = pose[7].mul_add(line_y, pose[8].mul_add(line_z, pose[11]));
        for along in &line.x {
            let along = simd.splat(*along);
            let depth = pose[6].mul_add(along, start_z);
            let w = one / depth;
            let x = pose[0].mul_add(along, start_x) * w;
            let y = pose[3].mul_add(along, start_y) * w;
            let bent = bend::<S, RATIONAL, PRISM>(simd, parameters, x, y);
            let determinant = bent.cross_y.neg_mul_add(bent.cross_x, bent.along_x * bent.along_y);
            let in_sight = depth.greater(simd.splat(MIN_DEPTH_M))
                & simd.splat(window.max_squared_radius).at_least(bent.squared_radius)
                & determinant.greater(zero)
                & bent.x.at_least(simd.splat(window.x[0]))
                & simd.splat(window.x[1]).at_least(bent.x)
                & bent.y.at_least(simd.splat(window.y[0]))
                & simd.splat(window.y[1]).at_least(bent.y);
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

/// A point after the lens and the derivatives `[along_x, cross_x; cross_y, along_y]`.
struct Bent<V> {
    x: V,
    y: V,
    squared_radius: V,
    along_x: V,
    cross_x: V,
    cross_y: V,
    along_y: V,
}

/// As `camera::brown_conrady::bend`.
#[inline(always)]
fn bend<S: Simd, const RATIONAL: bool, const PRISM: bool>(
    simd: S,
    p: &[f64; MAX_PARAMETERS],
    x: S::Vector,
    y: S::Vector,
) -> Bent<S::Vector> {
    let (xx, yy, xy) = (x * x, y * y, x * y);
    let s = xx + yy;
    let (mut radial, mut twice_slope) = cubic(simd, [p[4], p[5], p[8]], s);
    if RATIONAL {
        let (denominator, twice_rise) = cubic(simd, [p[9], p[10], p[11]], s);
        let inverse = simd.splat(1.0) / denominator;
        radial = radial * inverse;
        twice_slope = radial.neg_mul_add(twice_rise, twice_slope) * inverse;
    }
    let (p1, p2) = (simd.splat(2.0 * p[6]), simd.splat(2.0 * p[7]));
    let (half_p1, half_p2) = (simd.splat(p[6]), simd.splat(p[7]));
    let cross = xy.mul_add(twice_slope, p1.mul_add(x, p2 * y));
    let two = simd.splat(2.0);
    let mut bent = Bent {
        x: x.mul_add(radial, p1.mul_add(xy, half_p2 * two.mul_add(xx, s))),
        y: y.mul_add(radial, p2.mul_add(xy, half_p1 * two.mul_add(yy, s))),
        squared_radius: s,
        along_x: xx.mul_add(twice_slope, p1.mul_add(y, simd.splat(6.0 * p[7]).mul_add(x, radial))),
        cross_x: cross,
        cross_y: cross,
        along_y: yy.mul_add(twice_slope, p2.mul_add(x, simd.splat(6.0 * p[6]).mul_add(y, radial))),
    };
    if PRISM {
        let (s1, s2, s3, s4) = (p[12], p[13], p[14], p[15]);
        bent.x = simd.splat(s2).mul_add(s, simd.splat(s1)).mul_add(s, bent.x);
        bent.y = simd.splat(s4).mul_add(s, simd.splat(s3)).mul_add(s, bent.y);
        let along_x = simd.splat(4.0 * s2).mul_add(s, simd.splat(2.0 * s1));
        let along_y = simd.splat(4.0 * s4).mul_add(s, simd.splat(2.0 * s3));
        bent.along_x = along_x.mul_add(x, bent.along_x);
        bent.cross_x = along_x.mul_add(y, bent.cross_x);
        bent.cross_y = along_y.mul_add(x, bent.cross_y);
        bent.along_y = along_y.mul_add(y, bent.along_y);
    }
    bent
}

/// `1 + c1 s + c2 s^2 + c3 s^3` and twice its derivative.
#[inline(always)]
fn cubic<S: Simd>(simd: S, c: [f64; 3], s: S::Vector) -> (S::Vector, S::Vector) {
    let value = simd.splat(c[2]).mul_add(s, simd.splat(c[1])).mul_add(s, simd.splat(c[0]));
    let slope = simd.splat(6.0 * c[2]).mul_add(s, simd.splat(4.0 * c[1])).mul_add(s, simd.splat(2.0 * c[0]));
    (value.mul_add(s, simd.splat(1.0)), slope)
}
