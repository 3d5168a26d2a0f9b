//! Pixel errors that neighbouring points share: what they leave in the residuals of a view.
//!
//! Where every point errs by itself, the slow part of the residuals, what a polynomial of the place on the board can
//! follow beyond pose and camera, has the same power as the rest. Where neighbours err alike it has more, and so has
//! what the pose takes up: the covariance of the pose grows by the same factor.

use super::products::{Accumulate, TOGETHER};
use crate::camera::Camera;
use crate::least_squares::{PixelParameters, Problem};
use crate::se3::Se3;
use crate::simd::{MAX_LANES, VectorUnit, dispatch};

/// Highest power of a coordinate of the board.
const DEGREE: i32 = 2;
/// Polynomials of that degree in two coordinates.
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

/// Measures the slow part of the residuals of view `k` at the pose that fits it.
pub(super) fn slow_residuals(
    problem: &Problem,
    k: usize,
    camera: &Camera,
    pose: &Se3,
    parameters: Option<&PixelParameters>,
    weights: Option<&[f64]>,
) -> SlowResiduals {
    let samples = problem.samples(k);
    let free: &[usize] = parameters.map_or(&[], |p| &p.camera);
    let fitted = 6 + free.len();
    let columns = fitted + 2 * POLYNOMIALS;
    if 2 * samples.len() < columns + FEWEST_LEFT {
        return SlowResiduals::default();
    }
    let features = &problem.features()[samples.clone()];
    let (centre, half) = extent(&features.iter().map(|f| [f.position.x, f.position.y]));
    let width = (columns + 1).next_multiple_of(MAX_LANES);
    let mut rows = vec![0.0; 2 * samples.len() * width];
    let points = features.iter().zip(&problem.pixels()[samples]);
    for (n, ((feature, pixel), row)) in points.zip(rows.chunks_exact_mut(2 * width)).enumerate() {
        let Some(seen) = camera.observe_with_derivatives(pose, feature) else {
            return SlowResiduals::default();
        };
        let (x, y) = ((feature.position.x - centre[0]) / half[0], (feature.position.y - centre[1]) / half[1]);
        for (axis, row) in row.chunks_exact_mut(width).enumerate() {
            for (j, entry) in row[..6].iter_mut().enumerate() {
                *entry = seen.d_twist[(axis, j)];
            }
            for (entry, j) in row[6..fitted].iter_mut().zip(free) {
                *entry = seen.d_parameters[(axis, *j)];
            }
            let mut at = fitted + axis * POLYNOMIALS;
            for i in 0..=DEGREE {
                for j in 0..=DEGREE - i {
                    row[at] = x.powi(i) * y.powi(j);
                    at += 1;
                }
            }
            row[columns] = pixel[axis] - seen.pixel[axis];
            if let Some(weights) = weights {
                let root = weights[n].sqrt();
                for entry in row.iter_mut() {
                    *entry *= root;
                }
            }
        }
    }
    let size = (columns + 1).next_multiple_of(TOGETHER);
    let mut gram = vec![0.0; size * width];
    dispatch(VectorUnit::widest(), Accumulate::pairs(&rows, width, columns + 1, &mut gram));
    eliminate(&mut gram, width, columns, fitted)
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
