//! Pixel errors that neighbouring points share: what they leave in the residuals of a view.
//!
//! Where every point errs by itself, the slow part of the residuals, what a polynomial of the place on the board can
//! follow beyond pose and camera, has the same power as the rest. Where neighbours err alike it has more, and so has
//! what the pose takes up: the covariance of the pose grows by the same factor.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use nalgebra::{DMatrix, DVector, Matrix6, Matrix6xX, Vector6};

use super::pixel_rows::{POLYNOMIALS, PixelRows};
use super::products::{Accumulate, TOGETHER};
use crate::camera::Camera;
use crate::least_squares::{PixelColumns, PixelParameters, Problem, ViewBlock};
use crate::se3::Se3;
use crate::simd::{Kernel, MAX_LANES, Simd, Vector, VectorUnit, dispatch};

/// What is left of a column's square below this share is rounding.
const INDEPENDENT: f64 = 1e-6;
/// Fewest measurements beyond all that is fitted.
const FEWEST_LEFT: usize = 12;

/// The slow part of a view's residuals.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlowResiduals {
    /// Sum of its squares, px^2.
    pub squared_px: f64,
    /// Its degrees of freedom; none where the view has too few points to tell.
    pub freedom: usize,
}

/// What the pixels of view `k` say at a pose, at a noise of 1 px: the quadratic in the pose and the parameters, and the slow
/// part of the residuals; of points that are not equally good each with its weight.
///
/// `None` where a point cannot be seen.
pub(super) fn quadratic(
    problem: &Problem,
    k: usize,
    camera: &Camera,
    pose: &Se3,
    parameters: Option<&PixelParameters>,
    weights: Option<&[f64]>,
) -> Option<(ViewBlock, SlowResiduals)> {
    let samples = problem.samples(k);
    let seen = PixelRows {
        camera,
        pose,
        free: parameters.map_or(&[], |p| &p.camera),
        features: &problem.features()[samples.clone()],
        pixels: &problem.pixels()[samples.clone()],
        weights,
    };
    let (fitted, residual, width) = (seen.fitted(), seen.residual(), seen.width());
    let scale = residual + 1;
    let grams = seen.rows()?.map(|rows| {
        let mut gram = vec![0.0; (scale + 1).next_multiple_of(TOGETHER) * width];
        dispatch(VectorUnit::widest(), Accumulate::pairs(&rows, width, 0, scale + 1, &mut gram));
        gram
    });
    let product = |i: usize, j: usize| {
        let at = i.min(j) * width + i.max(j);
        grams[0][at] + grams[1][at]
    };
    let squared_px = product(residual, residual);
    if !squared_px.is_finite() {
        return None;
    }
    let own: Vec<usize> =
        (6..fitted).chain(parameters.is_some_and(|p| p.board_scale).then_some(scale)).collect();
    let block = ViewBlock {
        m: Matrix6::from_fn(&product),
        g: Vector6::from_fn(|i, _| -product(i, residual)),
        columns: parameters.map(|_| PixelColumns {
            mc: Matrix6xX::from_fn(own.len(), |i, j| product(i, own[j])),
            cc: DMatrix::from_fn(own.len(), own.len(), |i, j| product(own[i], own[j])),
            gc: DVector::from_fn(own.len(), |i, _| -product(own[i], residual)),
        }),
        squared_px,
    };
    // Each axis of the image has polynomials of its own; behind them the residual, and nothing of the board's scale,
    // which the pose takes up.
    let columns = fitted + 2 * POLYNOMIALS;
    if 2 * samples.len() < columns + FEWEST_LEFT {
        return Some((block, SlowResiduals::default()));
    }
    let across = (columns + 1).next_multiple_of(MAX_LANES);
    let mut both = vec![0.0; (columns + 1) * across];
    for (axis, gram) in grams.iter().enumerate() {
        let place =
            |i: usize| if i < fitted { i } else { i + axis.max(usize::from(i == residual)) * POLYNOMIALS };
        for i in 0..=residual {
            for j in i..=residual {
                both[place(i) * across + place(j)] += gram[i * width + j];
            }
        }
    }
    Some((
        block,
        dispatch(VectorUnit::widest(), Eliminate { gram: &mut both, width: across, columns, fitted }),
    ))
}

/// Takes columns out of the residuals one by one; what those beyond the fitted ones take is slow.
struct Eliminate<'a> {
    /// Products of all columns and, last, the residual; the upper triangle, in rows of whole vectors.
    gram: &'a mut [f64],
    width: usize,
    columns: usize,
    fitted: usize,
}

impl Kernel for Eliminate<'_> {
    type Output = SlowResiduals;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> SlowResiduals {
        let Self { gram, width, columns, fitted } = self;
        let mut slow = SlowResiduals::default();
        let before: Vec<f64> = (0..columns).map(|i| gram[i * width + i]).collect();
        for k in 0..columns {
            let (done, rest) = gram.split_at_mut((k + 1) * width);
            let row = &done[k * width..];
            let pivot = row[k];
            if pivot.is_nan() || pivot <= INDEPENDENT * before[k] {
                continue;
            }
            if k >= fitted {
                slow.squared_px += row[columns] * row[columns] / pivot;
                slow.freedom += 1;
            }
            for (i, line) in (k + 1..columns).zip(rest.chunks_exact_mut(width)) {
                let factor = simd.splat(row[i] / pivot);
                for at in (i / S::LANES * S::LANES..width).step_by(S::LANES) {
                    let left = factor.neg_mul_add(simd.load(&row[at..]), simd.load(&line[at..]));
                    left.store(&mut line[at..]);
                }
            }
        }
        slow
    }
}

/// What the pose takes up of a smooth field is slower than what a parabola follows beyond it, and has more of its power.
const SLOWER: f64 = 1.5;
/// How far doubt goes before neighbours are taken to err alike, in standard deviations.
const CERTAIN: f64 = 2.0;

/// Factor on the variances of the pixels for errors that neighbouring points share: by how much the slow part of all
/// views' residuals exceeds what points that err by themselves leave, given each view's own variance; one where that is
/// within chance.
pub fn shared_error(views: &[(SlowResiduals, f64)]) -> f64 {
    let freedom: usize = views.iter().map(|(slow, _)| slow.freedom).sum();
    if freedom == 0 {
        return 1.0;
    }
    let power: f64 = views.iter().map(|(slow, variance)| slow.squared_px / variance).sum();
    let factor = power / freedom as f64;
    let chance = 1.0 + CERTAIN * (2.0 / freedom as f64).sqrt();
    if factor > chance { 1.0 + SLOWER * (factor - 1.0) } else { 1.0 }
}
