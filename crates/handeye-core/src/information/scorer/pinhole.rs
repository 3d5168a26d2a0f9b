//! The information of corners seen by a pinhole camera, lanes = candidates.
//!
//! With `x = p_x / p_z`, `y = p_y / p_z`, `w = 1 / p_z` the rows of `d pi / d eta` are
//!
//! ```text
//! f_x [w, 0, -x w, -x y,       1 + x^2, -y]
//! f_y [0, w, -y w, -(1 + y^2), x y,      x]
//! ```
//!
//! so that every entry of their square is a sum of few monomials over the points: 23 sums in place of two times 21.

use super::block::{BLOCK, Block, UPPER, load, store, upper};
use super::lens::Window;
use super::target::Target;
use crate::camera::MIN_DEPTH_M;
use crate::simd::{Kernel, Mask, Simd, Vector};

/// Sums the information, divided by `f_x^2`, of the points in sight, and counts them.
pub(super) struct Pinhole<'a> {
    pub window: &'a Window,
    pub target: &'a Target,
    pub block: &'a mut Block,
}

impl Kernel for Pinhole<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        for at in (0..BLOCK).step_by(S::LANES) {
            let pose = load(simd, &self.block.pose, at);
            let (sums, seen) = if whole(simd, self.window, self.target, &pose) {
                (sum::<S, false>(simd, self.window, self.target, &pose).0, simd.splat(self.target.count))
            } else {
                sum::<S, true>(simd, self.window, self.target, &pose)
            };
            store(&arrange(simd, self.window.squared_aspect, &sums, seen), self.block.of_twist(), at);
            seen.store(&mut self.block.seen[at..]);
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

/// The sums over the points.
#[derive(Clone, Copy)]
struct Sums<V> {
    w: V,
    ww: V,
    x: V,
    y: V,
    xw: V,
    yw: V,
    xww: V,
    yww: V,
    qww: V,
    xx: V,
    yy: V,
    xy: V,
    xyw: V,
    xxw: V,
    yyw: V,
    xqw: V,
    yqw: V,
    xyq: V,
    xxxx: V,
    yyyy: V,
    xxyy: V,
    xyy: V,
    xxy: V,
}

/// `q` below is `x^2 + aspect^2 y^2`.
#[inline(always)]
fn sum<S: Simd, const PARTLY: bool>(
    simd: S,
    window: &Window,
    target: &Target,
    pose: &[S::Vector; 12],
) -> (Sums<S::Vector>, S::Vector) {
    let zero = simd.splat(0.0);
    let one = simd.splat(1.0);
    let squared_aspect = simd.splat(window.squared_aspect);
    let mut s = Sums {
        w: zero,
        ww: zero,
        x: zero,
        y: zero,
        xw: zero,
        yw: zero,
        xww: zero,
        yww: zero,
        qww: zero,
        xx: zero,
        yy: zero,
        xy: zero,
        xyw: zero,
        xxw: zero,
        yyw: zero,
        xqw: zero,
        yqw: zero,
        xyq: zero,
        xxxx: zero,
        yyyy: zero,
        xxyy: zero,
        xyy: zero,
        xxy: zero,
    };
    let mut seen = zero;
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
            let (xx, yy, xy, ww) = (x * x, y * y, x * y, w * w);
            let (xw, yw) = (x * w, y * w);
            let q = yy.mul_add(squared_aspect, xx);
            s.w = s.w + w;
            s.ww = s.ww + ww;
            s.x = s.x + x;
            s.y = s.y + y;
            s.xw = s.xw + xw;
            s.yw = s.yw + yw;
            s.xx = s.xx + xx;
            s.yy = s.yy + yy;
            s.xy = s.xy + xy;
            s.xww = xw.mul_add(w, s.xww);
            s.yww = yw.mul_add(w, s.yww);
            s.qww = q.mul_add(ww, s.qww);
            s.xyw = xy.mul_add(w, s.xyw);
            s.xxw = xx.mul_add(w, s.xxw);
            s.yyw = yy.mul_add(w, s.yyw);
            s.xqw = xw.mul_add(q, s.xqw);
            s.yqw = yw.mul_add(q, s.yqw);
            s.xyq = xy.mul_add(q, s.xyq);
            s.xxxx = xx.mul_add(xx, s.xxxx);
            s.yyyy = yy.mul_add(yy, s.yyyy);
            s.xxyy = xx.mul_add(yy, s.xxyy);
            s.xyy = xy.mul_add(y, s.xyy);
            s.xxy = xy.mul_add(x, s.xxy);
        }
    }
    (s, seen)
}

/// The information from the sums, divided by `f_x^2`.
#[inline(always)]
fn arrange<S: Simd>(
    simd: S,
    squared_aspect: f64,
    s: &Sums<S::Vector>,
    seen: S::Vector,
) -> [S::Vector; UPPER] {
    let a = simd.splat(squared_aspect);
    let rest = simd.splat(1.0 - squared_aspect);
    let two = simd.splat(2.0);
    let mut m = [simd.splat(0.0); UPPER];
    m[upper(0, 0)] = s.ww;
    m[upper(0, 2)] = -s.xww;
    m[upper(0, 3)] = -s.xyw;
    m[upper(0, 4)] = s.w + s.xxw;
    m[upper(0, 5)] = -s.yw;
    m[upper(1, 1)] = a * s.ww;
    m[upper(1, 2)] = -(a * s.yww);
    m[upper(1, 3)] = -(a * (s.w + s.yyw));
    m[upper(1, 4)] = a * s.xyw;
    m[upper(1, 5)] = a * s.xw;
    m[upper(2, 2)] = s.qww;
    m[upper(2, 3)] = a.mul_add(s.yw, s.yqw);
    m[upper(2, 4)] = -(s.xw + s.xqw);
    m[upper(2, 5)] = rest * s.xyw;
    m[upper(3, 3)] = a.mul_add(two.mul_add(s.yy, seen + s.yyyy), s.xxyy);
    m[upper(3, 4)] = -(s.xyq + simd.splat(1.0 + squared_aspect) * s.xy);
    m[upper(3, 5)] = rest * s.xyy - a * s.x;
    m[upper(4, 4)] = a.mul_add(s.xxyy, two.mul_add(s.xx, seen + s.xxxx));
    m[upper(4, 5)] = -rest.mul_add(s.xxy, s.y);
    m[upper(5, 5)] = a.mul_add(s.xx, s.yy);
    m
}
