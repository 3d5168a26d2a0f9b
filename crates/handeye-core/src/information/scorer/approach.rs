//! From robot motions to camera poses: check that they are rigid, then `X A` and `X A Y`.

use super::block::{BLOCK, Block};
use crate::batched_algebra::store;
use crate::se3::RIGID_TOLERANCE;
use crate::se3::{left_product, right_product};
use crate::simd::{Kernel, Mask, Simd, Vector};

/// Doubles of a homogeneous 4 x 4 matrix.
pub(super) const MATRIX: usize = 16;

/// A rotation that deviates by less, root of the sum of squares, is used as it is.
const ROUNDING: f64 = 1e-14;

/// Puts a block of motions, row-major 4 x 4 matrices, at its places in front of the target.
pub(super) struct Approach<'a> {
    pub x: &'a [f64; 12],
    pub y: &'a [f64; 12],
    pub motions: &'a [f64],
    pub block: &'a mut Block,
}

impl Kernel for Approach<'_> {
    /// Whether every motion is rigid; the block is of no use otherwise.
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> bool {
        let motions = &self.motions[..BLOCK * MATRIX];
        for at in (0..BLOCK).step_by(S::LANES) {
            let motions = &motions[at * MATRIX..];
            let mut motion = [simd.splat(0.0); 12];
            for i in 0..3 {
                let [a, b, c, t] = simd.load_four(&motions[4 * i..], MATRIX);
                motion[3 * i] = a;
                motion[3 * i + 1] = b;
                motion[3 * i + 2] = c;
                motion[9 + i] = t;
            }
            let last = simd.load_four(&motions[12..], MATRIX);
            if !repair(simd, &mut motion, &last) {
                return false;
            }
            let before_y = left_product(simd, self.x, &motion);
            store(&before_y, &mut self.block.before_y, at);
            store(&right_product(simd, &before_y, self.y), &mut self.block.pose, at);
        }
        true
    }
}

/// Repairs rounding in the rotations as [`Se3::from_matrix`] does; false if one is not rigid, or hardly.
#[inline(always)]
fn repair<S: Simd>(simd: S, motion: &mut [S::Vector; 12], last: &[S::Vector; 4]) -> bool {
    let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
    let r = &*motion;
    // A rotation's first two columns are of unit length and square to each other, and the third is their product.
    let deviations = [
        r[0].mul_add(r[0], r[3].mul_add(r[3], r[6].mul_add(r[6], -one))),
        r[1].mul_add(r[1], r[4].mul_add(r[4], r[7].mul_add(r[7], -one))),
        r[0].mul_add(r[1], r[3].mul_add(r[4], r[6] * r[7])),
        r[6].mul_add(r[4], r[3].neg_mul_add(r[7], r[2])),
        r[0].mul_add(r[7], r[6].neg_mul_add(r[1], r[5])),
        r[3].mul_add(r[1], r[0].neg_mul_add(r[4], r[8])),
        last[0],
        last[1],
        last[2],
        last[3] - one,
    ];
    // Not a number where a translation is not finite.
    let mut squared = r[9].mul_add(zero, r[10].mul_add(zero, r[11] * zero));
    for deviation in deviations {
        squared = deviation.mul_add(deviation, squared);
    }
    if simd.splat(ROUNDING * ROUNDING).at_least(squared).all() {
        return true;
    }
    if !simd.splat(RIGID_TOLERANCE * RIGID_TOLERANCE).at_least(squared).all() {
        return false;
    }
    newton_schulz(simd, motion);
    newton_schulz(simd, motion);
    true
}

/// `R' R`, upper triangle row by row.
#[inline(always)]
fn columns_squared<V: Vector>(r: &[V; 12]) -> [V; 6] {
    macro_rules! dot {
        ($i:literal, $j:literal) => {
            r[$i].mul_add(r[$j], r[3 + $i].mul_add(r[3 + $j], r[6 + $i] * r[6 + $j]))
        };
    }
    [dot!(0, 0), dot!(0, 1), dot!(0, 2), dot!(1, 1), dot!(1, 2), dot!(2, 2)]
}

/// One step towards the nearest rotation: `R (3 I - R' R) / 2`.
#[inline(always)]
fn newton_schulz<S: Simd>(simd: S, r: &mut [S::Vector; 12]) {
    let [g00, g01, g02, g11, g12, g22] = columns_squared(r);
    let (half, middle) = (simd.splat(-0.5), simd.splat(1.5));
    let d = [g00.mul_add(half, middle), g11.mul_add(half, middle), g22.mul_add(half, middle)];
    let (o01, o02, o12) = (g01 * half, g02 * half, g12 * half);
    for i in 0..3 {
        let (a, b, c) = (r[3 * i], r[3 * i + 1], r[3 * i + 2]);
        r[3 * i] = a.mul_add(d[0], b.mul_add(o01, c * o02));
        r[3 * i + 1] = a.mul_add(o01, b.mul_add(d[1], c * o12));
        r[3 * i + 2] = a.mul_add(o02, b.mul_add(o12, c * d[2]));
    }
}
