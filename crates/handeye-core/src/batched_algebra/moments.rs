//! The information of a camera-frame twist that points seen by a pinhole camera give.
//!
//! With `x = p_x / p_z`, `y = p_y / p_z`, `w = 1 / p_z` the rows of `d pi / d eta` are
//!
//! ```text
//! f_x [w, 0, -x w, -x y,       1 + x^2, -y]
//! f_y [0, w, -y w, -(1 + y^2), x y,      x]
//! ```
//!
//! so that every entry of their square is a sum of few monomials over the points: 23 sums in place of two times 21.

use super::symmetric::{UPPER, upper};
use crate::simd::{Simd, Vector};

/// The sums; `q` is `x^2 + aspect^2 y^2`.
#[derive(Clone, Copy)]
pub(crate) struct Sums<V> {
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

impl<V: Vector> Sums<V> {
    /// Of no points.
    #[inline(always)]
    pub fn new<S: Simd<Vector = V>>(simd: S) -> Self {
        let zero = simd.splat(0.0);
        Self {
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
        }
    }

    /// Adds a point; all zero adds nothing.
    #[inline(always)]
    pub fn add(&mut self, squared_aspect: V, w: V, x: V, y: V) {
        let (xx, yy, xy, ww) = (x * x, y * y, x * y, w * w);
        let (xw, yw) = (x * w, y * w);
        let q = yy.mul_add(squared_aspect, xx);
        self.w = self.w + w;
        self.ww = self.ww + ww;
        self.x = self.x + x;
        self.y = self.y + y;
        self.xw = self.xw + xw;
        self.yw = self.yw + yw;
        self.xx = self.xx + xx;
        self.yy = self.yy + yy;
        self.xy = self.xy + xy;
        self.xww = xw.mul_add(w, self.xww);
        self.yww = yw.mul_add(w, self.yww);
        self.qww = q.mul_add(ww, self.qww);
        self.xyw = xy.mul_add(w, self.xyw);
        self.xxw = xx.mul_add(w, self.xxw);
        self.yyw = yy.mul_add(w, self.yyw);
        self.xqw = xw.mul_add(q, self.xqw);
        self.yqw = yw.mul_add(q, self.yqw);
        self.xyq = xy.mul_add(q, self.xyq);
        self.xxxx = xx.mul_add(xx, self.xxxx);
        self.yyyy = yy.mul_add(yy, self.yyyy);
        self.xxyy = xx.mul_add(yy, self.xxyy);
        self.xyy = xy.mul_add(y, self.xyy);
        self.xxy = xy.mul_add(x, self.xxy);
    }

    /// The information of `count` points, divided by `f_x^2`.
    #[inline(always)]
    pub fn information<S: Simd<Vector = V>>(&self, simd: S, squared_aspect: f64, count: V) -> [V; UPPER] {
        let a = simd.splat(squared_aspect);
        let rest = simd.splat(1.0 - squared_aspect);
        let two = simd.splat(2.0);
        let mut m = [simd.splat(0.0); UPPER];
        m[upper(0, 0)] = self.ww;
        m[upper(0, 2)] = -self.xww;
        m[upper(0, 3)] = -self.xyw;
        m[upper(0, 4)] = self.w + self.xxw;
        m[upper(0, 5)] = -self.yw;
        m[upper(1, 1)] = a * self.ww;
        m[upper(1, 2)] = -(a * self.yww);
        m[upper(1, 3)] = -(a * (self.w + self.yyw));
        m[upper(1, 4)] = a * self.xyw;
        m[upper(1, 5)] = a * self.xw;
        m[upper(2, 2)] = self.qww;
        m[upper(2, 3)] = a.mul_add(self.yw, self.yqw);
        m[upper(2, 4)] = -(self.xw + self.xqw);
        m[upper(2, 5)] = rest * self.xyw;
        m[upper(3, 3)] = a.mul_add(two.mul_add(self.yy, count + self.yyyy), self.xxyy);
        m[upper(3, 4)] = -(self.xyq + simd.splat(1.0 + squared_aspect) * self.xy);
        m[upper(3, 5)] = rest * self.xyy - a * self.x;
        m[upper(4, 4)] = a.mul_add(self.xxyy, two.mul_add(self.xx, count + self.xxxx));
        m[upper(4, 5)] = -rest.mul_add(self.xxy, self.y);
        m[upper(5, 5)] = a.mul_add(self.xx, self.yy);
        m
    }
}
