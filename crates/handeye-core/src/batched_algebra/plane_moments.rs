//! The information of a camera-frame twist that points of a plane seen by a pinhole camera give.
//!
//! With `x = p_x / p_z`, `y = p_y / p_z`, `w = 1 / p_z` the rows of `d pi / d eta` are
//!
//! ```text
//! f_x [w, 0, -x w, -x y,       1 + x^2, -y]
//! f_y [0, w, -y w, -(1 + y^2), x y,      x]
//! ```
//!
//! On a plane `n . p = d` the inverse depth is linear in the other two, `w = (n_x x + n_y y + n_z) / d`, so that every
//! entry of their square is made of the moments of x and y up to the fourth: 14 sums in place of two times 21, and
//! none of them knows the focal lengths.

use super::symmetric::{UPPER, upper};
use crate::simd::{Simd, Vector};

/// Sums of `x^i y^j` over points.
#[derive(Clone, Copy)]
pub(crate) struct PlaneMoments<V> {
    x: V,
    y: V,
    xx: V,
    xy: V,
    yy: V,
    xxx: V,
    xxy: V,
    xyy: V,
    yyy: V,
    xxxx: V,
    xxxy: V,
    xxyy: V,
    xyyy: V,
    yyyy: V,
}

/// The sums with inverse depths that the information needs.
#[derive(Clone, Copy)]
pub(crate) struct DepthMoments<V> {
    w: V,
    xw: V,
    yw: V,
    xxw: V,
    xyw: V,
    yyw: V,
    xxxw: V,
    xxyw: V,
    xyyw: V,
    yyyw: V,
}

impl<V: Vector> PlaneMoments<V> {
    /// Of no points.
    #[inline(always)]
    pub fn new<S: Simd<Vector = V>>(simd: S) -> Self {
        let zero = simd.splat(0.0);
        Self {
            x: zero,
            y: zero,
            xx: zero,
            xy: zero,
            yy: zero,
            xxx: zero,
            xxy: zero,
            xyy: zero,
            yyy: zero,
            xxxx: zero,
            xxxy: zero,
            xxyy: zero,
            xyyy: zero,
            yyyy: zero,
        }
    }

    /// Adds a point; zeros add nothing.
    #[inline(always)]
    pub fn add(&mut self, x: V, y: V) {
        let (xx, xy, yy) = (x * x, x * y, y * y);
        self.x = self.x + x;
        self.y = self.y + y;
        self.xx = self.xx + xx;
        self.xy = self.xy + xy;
        self.yy = self.yy + yy;
        self.xxx = xx.mul_add(x, self.xxx);
        self.xxy = xx.mul_add(y, self.xxy);
        self.xyy = yy.mul_add(x, self.xyy);
        self.yyy = yy.mul_add(y, self.yyy);
        self.xxxx = xx.mul_add(xx, self.xxxx);
        self.xxxy = xx.mul_add(xy, self.xxxy);
        self.xxyy = xx.mul_add(yy, self.xxyy);
        self.xyyy = yy.mul_add(xy, self.xyyy);
        self.yyyy = yy.mul_add(yy, self.yyyy);
    }

    /// With the inverse depths `plane[0] x + plane[1] y + plane[2]` of `count` points.
    #[inline(always)]
    pub fn with_depth(&self, plane: [V; 3], count: V) -> DepthMoments<V> {
        DepthMoments {
            w: linear(plane, self.x, self.y, count),
            xw: linear(plane, self.xx, self.xy, self.x),
            yw: linear(plane, self.xy, self.yy, self.y),
            xxw: linear(plane, self.xxx, self.xxy, self.xx),
            xyw: linear(plane, self.xxy, self.xyy, self.xy),
            yyw: linear(plane, self.xyy, self.yyy, self.yy),
            xxxw: linear(plane, self.xxxx, self.xxxy, self.xxx),
            xxyw: linear(plane, self.xxxy, self.xxyy, self.xxy),
            xyyw: linear(plane, self.xxyy, self.xyyy, self.xyy),
            yyyw: linear(plane, self.xyyy, self.yyyy, self.yyy),
        }
    }

    /// The information of `count` points, divided by `f_x^2`, for the squared ratio `(f_y / f_x)^2`.
    #[inline(always)]
    pub fn information<S: Simd<Vector = V>>(
        &self,
        simd: S,
        deep: &DepthMoments<V>,
        plane: [V; 3],
        squared_aspect: f64,
        count: V,
    ) -> [V; UPPER] {
        let a = simd.splat(squared_aspect);
        let rest = simd.splat(1.0 - squared_aspect);
        let two = simd.splat(2.0);
        let ww = linear(plane, deep.xw, deep.yw, deep.w);
        let xww = linear(plane, deep.xxw, deep.xyw, deep.xw);
        let yww = linear(plane, deep.xyw, deep.yyw, deep.yw);
        let xxww = linear(plane, deep.xxxw, deep.xxyw, deep.xxw);
        let yyww = linear(plane, deep.xyyw, deep.yyyw, deep.yyw);
        let mut m = [simd.splat(0.0); UPPER];
        m[upper(0, 0)] = ww;
        m[upper(0, 2)] = -xww;
        m[upper(0, 3)] = -deep.xyw;
        m[upper(0, 4)] = deep.w + deep.xxw;
        m[upper(0, 5)] = -deep.yw;
        m[upper(1, 1)] = a * ww;
        m[upper(1, 2)] = -(a * yww);
        m[upper(1, 3)] = -(a * (deep.w + deep.yyw));
        m[upper(1, 4)] = a * deep.xyw;
        m[upper(1, 5)] = a * deep.xw;
        m[upper(2, 2)] = a.mul_add(yyww, xxww);
        m[upper(2, 3)] = a.mul_add(deep.yw + deep.yyyw, deep.xxyw);
        m[upper(2, 4)] = -a.mul_add(deep.xyyw, deep.xw + deep.xxxw);
        m[upper(2, 5)] = rest * deep.xyw;
        m[upper(3, 3)] = a.mul_add(two.mul_add(self.yy, count + self.yyyy), self.xxyy);
        m[upper(3, 4)] = -a.mul_add(self.xy + self.xyyy, self.xy + self.xxxy);
        m[upper(3, 5)] = rest * self.xyy - a * self.x;
        m[upper(4, 4)] = a.mul_add(self.xxyy, two.mul_add(self.xx, count + self.xxxx));
        m[upper(4, 5)] = -rest.mul_add(self.xxy, self.y);
        m[upper(5, 5)] = a.mul_add(self.xx, self.yy);
        m
    }

    /// Products, divided by `f_x`, of the twist's columns with that of a camera parameter: `f_x`, `f_y`, `c_x` or `c_y`.
    #[inline(always)]
    pub fn with_camera<S: Simd<Vector = V>>(
        &self,
        simd: S,
        deep: &DepthMoments<V>,
        parameter: usize,
        aspect: f64,
        count: V,
    ) -> [V; 6] {
        let zero = simd.splat(0.0);
        let a = simd.splat(aspect);
        match parameter {
            0 => [deep.xw, zero, -deep.xxw, -self.xxy, self.x + self.xxx, -self.xy],
            1 => [zero, a * deep.yw, -(a * deep.yyw), -(a * (self.y + self.yyy)), a * self.xyy, a * self.xy],
            2 => [deep.w, zero, -deep.xw, -self.xy, count + self.xx, -self.y],
            _ => [zero, a * deep.w, -(a * deep.yw), -(a * (count + self.yy)), a * self.xy, a * self.x],
        }
    }

    /// Products of the columns of two camera parameters, `i <= j`.
    #[inline(always)]
    pub fn of_camera<S: Simd<Vector = V>>(&self, simd: S, i: usize, j: usize, count: V) -> V {
        match (i, j) {
            (0, 0) => self.xx,
            (0, 2) => self.x,
            (1, 1) => self.yy,
            (1, 3) => self.y,
            (2, 2) | (3, 3) => count,
            _ => simd.splat(0.0),
        }
    }
}

/// `p[0] x + p[1] y + p[2] one`.
#[inline(always)]
fn linear<V: Vector>(p: [V; 3], x: V, y: V, one: V) -> V {
    p[0].mul_add(x, p[1].mul_add(y, p[2] * one))
}
