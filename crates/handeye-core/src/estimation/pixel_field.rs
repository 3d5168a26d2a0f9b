//! Pixel errors that neighbouring points share: what they leave in the residuals of a view.
//!
//! Where every point errs by itself, the slow part of the residuals, what a polynomial of the place on the board can
//! follow beyond pose and camera, has the same power as the rest. Where neighbours err alike it has more, and so has
//! what the pose takes up: the covariance of the pose grows by the same factor.

use nalgebra::{DMatrix, DVector, Matrix6, Matrix6xX, Vector6};

use super::products::{Accumulate, TOGETHER};
use crate::camera::Camera;
use crate::least_squares::{PixelColumns, PixelParameters, Problem, ViewBlock};
use crate::se3::Se3;
use crate::simd::{MAX_LANES, VectorUnit, dispatch};

/// Polynomials of the second degree in two coordinates of the board.
const POLYNOMIALS: usize = 6;
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
    let free: &[usize] = parameters.map_or(&[], |p| &p.camera);
    let fitted = 6 + free.len();
    // Behind pose, camera and polynomials the residual and what the scale of the board does, which the pose takes up.
    let columns = fitted + 2 * POLYNOMIALS;
    let scale = columns + 1;
    let features = &problem.features()[samples.clone()];
    let (centre, half) = extent(&features.iter().map(|f| [f.position.x, f.position.y]));
    let width = (columns + 2).next_multiple_of(MAX_LANES);
    let mut rows = vec![0.0; 2 * samples.len() * width];
    let points = features.iter().zip(&problem.pixels()[samples.clone()]);
    for (n, ((feature, pixel), row)) in points.zip(rows.chunks_exact_mut(2 * width)).enumerate() {
        let seen = camera.observe_with_derivatives(pose, feature)?;
        let (x, y) = ((feature.position.x - centre[0]) / half[0], (feature.position.y - centre[1]) / half[1]);
        let turned = pose.rotation * feature.position;
        for (axis, row) in row.chunks_exact_mut(width).enumerate() {
            for (j, entry) in row[..6].iter_mut().enumerate() {
                *entry = seen.d_twist[(axis, j)];
            }
            for (entry, j) in row[6..fitted].iter_mut().zip(free) {
                *entry = seen.d_parameters[(axis, *j)];
            }
            let at = fitted + axis * POLYNOMIALS;
            row[at..at + POLYNOMIALS].copy_from_slice(&[1.0, y, y * y, x, x * y, x * x]);
            row[columns] = pixel[axis] - seen.pixel[axis];
            // The first three columns of a twist are d pixel / d p, and d p / d scale = R P.
            row[scale] = (0..3).map(|i| row[i] * turned[i]).sum();
            if let Some(weights) = weights {
                let root = weights[n].sqrt();
                for entry in row.iter_mut() {
                    *entry *= root;
                }
            }
        }
    }
    let size = (columns + 2).next_multiple_of(TOGETHER);
    let mut gram = vec![0.0; size * width];
    dispatch(VectorUnit::widest(), Accumulate::pairs(&rows, width, columns + 2, &mut gram));
    let product = |i: usize, j: usize| gram[i.min(j) * width + i.max(j)];
    let squared_px = product(columns, columns);
    if !squared_px.is_finite() {
        return None;
    }
    let own: Vec<usize> =
        (6..fitted).chain(parameters.is_some_and(|p| p.board_scale).then_some(scale)).collect();
    let block = ViewBlock {
        m: Matrix6::from_fn(&product),
        g: Vector6::from_fn(|i, _| -product(i, columns)),
        columns: parameters.map(|_| PixelColumns {
            mc: Matrix6xX::from_fn(own.len(), |i, j| product(i, own[j])),
            cc: DMatrix::from_fn(own.len(), own.len(), |i, j| product(own[i], own[j])),
            gc: DVector::from_fn(own.len(), |i, _| -product(own[i], columns)),
        }),
        squared_px,
    };
    if 2 * samples.len() < columns + FEWEST_LEFT {
        return Some((block, SlowResiduals::default()));
    }
    let slow = eliminate(&mut gram, width, columns, fitted);
    Some((block, slow))
}

/// Takes columns out of the residuals one by one; what those beyond the fitted ones take is slow.
fn eliminate(gram: &mut [f64], width: usize, columns: usize, fitted: usize) -> SlowResiduals {
    let mut slow = SlowResiduals::default();
    let before: Vec<f64> = (0..columns).map(|i| gram[i * width + i]).collect();
    for k in 0..columns {
        let pivot = gram[k * width + k];
        if pivot.is_nan() || pivot <= INDEPENDENT * before[k] {
            continue;
        }
        let (done, rest) = gram.split_at_mut((k + 1) * width);
        let row = &done[k * width..];
        if k >= fitted {
            slow.squared_px += row[columns] * row[columns] / pivot;
            slow.freedom += 1;
        }
        for i in k + 1..columns {
            let factor = row[i] / pivot;
            let line = &mut rest[(i - k - 1) * width..(i - k) * width];
            for j in i..=columns {
                line[j] -= factor * row[j];
            }
        }
    }
    slow
}

/// Middle and half size of points in both coordinates; never nothing.
fn extent(points: &(impl Iterator<Item = [f64; 2]> + Clone)) -> ([f64; 2], [f64; 2]) {
    let mut centre = [0.0; 2];
    let mut half = [1.0; 2];
    for axis in 0..2 {
        let low = points.clone().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
        let high = points.clone().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
        centre[axis] = 0.5 * (low + high);
        half[axis] = (0.5 * (high - low)).max(f64::MIN_POSITIVE);
    }
    (centre, half)
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
