//! The pose of a target in one image, by least squares on the reprojection error.
//!
//! Levenberg-Marquardt (Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", 1963) on the
//! left perturbation of `T_camera_target`: six unknowns, normal equations summed over the points, many at once in vector
//! lanes where they are corners and the lens is no fisheye.

mod linearise;
mod packed;

use nalgebra::{Matrix6, Vector2, Vector6};

use crate::batched_algebra::upper;
use crate::camera::{Camera, Feature};
use crate::error::Error;
use crate::se3::{Se3, entries};
use crate::simd::{MAX_LANES, VectorUnit};

pub(crate) use linearise::{LinearisedGroup, linearise};
pub(crate) use packed::{Measurements, Row, View};

/// Fewest features that fix a pose near a given one.
pub const MIN_FEATURES: usize = 3;

/// Steps tried before giving up; from a closed-form start it takes three to six.
const MAX_STEPS: usize = 100;

/// Damping to begin with, a share of the diagonal: little, as turns and shifts across go together almost entirely.
const FIRST_DAMPING: f64 = 1e-6;

/// Ends when a step is predicted to lower the cost by no more than this part of it.
const COST_TOLERANCE: f64 = 1e-14;

/// Ends when a step is no larger than this, metres and radians.
const STEP_TOLERANCE: f64 = 1e-13;

/// Smallest eigenvalue of the information, scaled to a unit diagonal, of a pose that counts as determined.
const MIN_EIGENVALUE: f64 = 1e-13;

/// A pose that fits the pixels best, near the starting one.
#[derive(Clone, Copy, Debug)]
pub struct PoseFit {
    /// Target to camera.
    pub t_camera_target: Se3,
    /// Root of the mean squared distance between prediction and pixel, over the features; pixels.
    pub rmse_px: f64,
    /// Information of the left perturbation `[rho; phi]` at a noise of 1 px per coordinate; its inverse times the
    /// pixel variance is the covariance of the pose.
    pub information: Matrix6<f64>,
    /// Steps tried.
    pub steps: usize,
}

/// Sums of the normal equations at one pose.
struct Normal {
    information: Matrix6<f64>,
    gradient: Vector6<f64>,
    cost: f64,
}

/// Sum over the lanes, by halves: no addition waits for the one before.
fn total(row: Row) -> f64 {
    let [a, b, c, d, e, f, g, h] = row;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// A view whose pose is looked for.
struct Seen<'a> {
    camera: &'a Camera,
    features: &'a [Feature],
    pixels: &'a [Vector2<f64>],
    /// Its points shared out over the lanes; `None` for circles, fisheyes and very few points.
    packed: Option<(Measurements, Box<LinearisedGroup>)>,
}

impl<'a> Seen<'a> {
    fn new(camera: &'a Camera, features: &'a [Feature], pixels: &'a [Vector2<f64>]) -> Self {
        let view = View { motion: &Se3::identity(), features, pixels };
        let packed = (features.len() >= MAX_LANES && Measurements::in_lanes(camera, &[view]))
            .then(|| (Measurements::in_parts(camera, &[view], MAX_LANES), Box::new(LinearisedGroup::new())));
        Self { camera, features, pixels, packed }
    }

    /// The normal equations; the index of a feature that is not seen otherwise.
    fn normal(&mut self, t: &Se3) -> Result<Normal, usize> {
        if let Some((measurements, out)) = &mut self.packed {
            measurements.groups[0].motions = entries(t).map(|entry| [entry; MAX_LANES]);
            let (still, out) = (&Se3::identity(), std::slice::from_mut(&mut **out));
            linearise(
                VectorUnit::widest(),
                self.camera,
                (still, still),
                &[[1.0; MAX_LANES]],
                measurements,
                out,
            );
            if out[0].whole.iter().all(|whole| *whole > 0.0) {
                let upper_triangle = out[0].information.map(total);
                return Ok(Normal {
                    information: Matrix6::from_fn(|i, j| upper_triangle[upper(i.min(j), i.max(j))]),
                    gradient: -Vector6::from(out[0].gradient.map(total)),
                    cost: 0.5 * total(out[0].cost),
                });
            }
        }
        self.one_by_one(t)
    }

    fn one_by_one(&self, t: &Se3) -> Result<Normal, usize> {
        let mut sums = Normal { information: Matrix6::zeros(), gradient: Vector6::zeros(), cost: 0.0 };
        for (i, (feature, pixel)) in self.features.iter().zip(self.pixels).enumerate() {
            let (predicted, d_twist) = self.camera.observe_with_twist_derivative(t, feature).ok_or(i)?;
            let residual = pixel - predicted;
            sums.information += d_twist.tr_mul(&d_twist);
            sums.gradient += d_twist.tr_mul(&residual);
            sums.cost += 0.5 * residual.norm_squared();
        }
        Ok(sums)
    }
}

/// Refines the pose of one target from a start near it.
///
/// # Errors
/// - [`Error::InvalidInput`]: different numbers of features and pixels, fewer than [`MIN_FEATURES`], a pixel that
///   is not finite.
/// - [`Error::Degenerate`]: the features do not determine the pose (all on one line, or all on one ray).
/// - [`Error::Numerical`]: a feature is not seen from the starting pose, or no convergence.
pub fn refine_pose(
    camera: &Camera,
    features: &[Feature],
    pixels: &[Vector2<f64>],
    start: &Se3,
) -> Result<PoseFit, Error> {
    check(features, pixels)?;
    let mut seen = Seen::new(camera, features, pixels);
    let mut t = *start;
    let mut sums = seen.normal(&t).map_err(|i| {
        Error::numerical(format!(
            "feature {i} is not in view of the camera at the starting pose of the target"
        ))
    })?;
    let mut damping = FIRST_DAMPING;
    for steps in 0..MAX_STEPS {
        let mut damped = sums.information;
        for i in 0..6 {
            damped[(i, i)] *= 1.0 + damping;
        }
        let Some(cholesky) = damped.cholesky() else {
            return Err(undetermined());
        };
        let step = cholesky.solve(&sums.gradient);
        let predicted = step.dot(&sums.gradient) - 0.5 * step.dot(&(sums.information * step));
        if predicted <= COST_TOLERANCE * sums.cost || step.amax() <= STEP_TOLERANCE {
            determined(&sums.information)?;
            let rmse_px = (2.0 * sums.cost / features.len() as f64).sqrt();
            return Ok(PoseFit { t_camera_target: t, rmse_px, information: sums.information, steps });
        }
        let trial = Se3::exp(&step) * t;
        match seen.normal(&trial) {
            Ok(lower) if lower.cost < sums.cost => {
                (t, sums) = (trial, lower);
                damping = (damping * 0.1).max(1e-12);
            }
            _ => damping = (damping * 10.0).max(1e-8),
        }
    }
    determined(&sums.information)?;
    Err(diverged(MAX_STEPS, sums.cost, features.len()))
}

fn check(features: &[Feature], pixels: &[Vector2<f64>]) -> Result<(), Error> {
    if features.len() != pixels.len() {
        return Err(Error::invalid(format!("{} features but {} pixels", features.len(), pixels.len())));
    }
    if features.len() < MIN_FEATURES {
        return Err(Error::invalid(format!(
            "{} features cannot fix a pose: at least {MIN_FEATURES} needed",
            features.len()
        )));
    }
    if let Some(i) = pixels.iter().position(|p| !(p.x.is_finite() && p.y.is_finite())) {
        return Err(Error::invalid(format!("pixel {i} is not finite")));
    }
    Ok(())
}

/// Refuses an information that leaves a direction of the pose open, whatever the units.
fn determined(information: &Matrix6<f64>) -> Result<(), Error> {
    let scale = information.diagonal().map(|d| 1.0 / d.sqrt());
    let unit = Matrix6::from_fn(|i, j| information[(i, j)] * scale[i] * scale[j]);
    // Eigenvalues of a sum of 6 have a product of the other five of at most (6 / 5)^5: the least of them is larger.
    if unit.cholesky().is_some_and(|factor| factor.determinant() > 1.2_f64.powi(5) * MIN_EIGENVALUE) {
        return Ok(());
    }
    if unit.iter().all(|x| x.is_finite()) && unit.symmetric_eigenvalues().min() > MIN_EIGENVALUE {
        return Ok(());
    }
    Err(undetermined())
}

fn undetermined() -> Error {
    Error::degenerate(
        "the features do not determine the pose of the target: they lie on one line, or coincide",
    )
}

fn diverged(steps: usize, cost: f64, count: usize) -> Error {
    let rmse = (2.0 * cost / count as f64).sqrt();
    Error::numerical(format!(
        "the pose of the target did not converge in {steps} steps, left at {rmse:.3} px RMS"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Lens;
    use crate::testing::{Random, numerical_jacobian};
    use nalgebra::Vector3;
    use proptest::prelude::*;

    fn camera() -> Camera {
        Camera::new(Lens::BrownConrady5, &[1400.0, 1390.0, 640.0, 480.0, -0.2, 0.08, 1e-3, -5e-4, 0.01])
            .unwrap()
    }

    fn grid(radius: f64) -> Vec<Feature> {
        let place = |i: usize| Vector3::new((i % 6) as f64, (i / 6) as f64, 0.0) * 0.025;
        (0..24).map(|i| Feature { position: place(i), radius }).collect()
    }

    fn pose(random: &mut Random) -> Se3 {
        let mut t = random.transform(0.05, 0.4);
        t.translation.z += 0.6;
        t
    }

    fn seen(camera: &Camera, features: &[Feature], t: &Se3) -> Vec<Vector2<f64>> {
        features.iter().map(|f| camera.observe(t, f).expect("in view")).collect()
    }

    proptest! {
        #[test]
        fn exact_pixels_give_the_exact_pose(
            seed in any::<u64>(), radius in prop::sample::select(vec![0.0, 0.008]),
        ) {
            let random = &mut Random::new(seed);
            let (camera, features, truth) = (camera(), grid(radius), pose(random));
            let start = random.transform(0.05, 0.15) * truth;
            let fit = refine_pose(&camera, &features, &seen(&camera, &features, &truth), &start).unwrap();
            let error = (fit.t_camera_target * truth.inverse()).log().amax();
            prop_assert!(error < 1e-9, "{error} after {} steps", fit.steps);
            prop_assert!(fit.rmse_px < 1e-6);
        }

        #[test]
        fn the_fit_is_a_minimum_and_its_information_the_curvature(seed in any::<u64>()) {
            let random = &mut Random::new(seed);
            let (camera, features, truth) = (camera(), grid(0.008), pose(random));
            let mut pixels = seen(&camera, &features, &truth);
            for pixel in &mut pixels {
                *pixel += Vector2::new(random.normal(), random.normal()) * 0.2;
            }
            let fit = refine_pose(&camera, &features, &pixels, &truth).unwrap();
            let stacked = numerical_jacobian::<48, 6>(&Vector6::zeros(), |xi| {
                let predicted = seen(&camera, &features, &(Se3::exp(xi) * fit.t_camera_target));
                nalgebra::SVector::from_iterator(predicted.iter().flat_map(|p| [p.x, p.y]))
            });
            let expected = stacked.transpose() * stacked;
            let scale = fit.information.amax();
            prop_assert!((fit.information - expected).amax() < 1e-6 * scale);
            let cost = |t: &Se3| -> f64 {
                let away = |(a, b): (&Vector2<f64>, &Vector2<f64>)| (a - b).norm_squared();
                0.5 * pixels.iter().zip(&seen(&camera, &features, t)).map(away).sum::<f64>()
            };
            let best = cost(&fit.t_camera_target);
            prop_assert!((fit.rmse_px - (best / 12.0).sqrt()).abs() < 1e-12);
            for axis in 0..6 {
                for size in [-1e-5, 1e-5] {
                    let mut xi = Vector6::zeros();
                    xi[axis] = size;
                    let other = cost(&(Se3::exp(&xi) * fit.t_camera_target));
                    prop_assert!(other > best);
                }
            }
        }
    }

    #[test]
    fn sums_in_lanes_are_those_one_by_one() {
        let (camera, features, truth) = (camera(), grid(0.0), pose(&mut Random::new(5)));
        let features = &features[..19];
        let mut pixels = seen(&camera, features, &truth);
        pixels[7].x += 0.4;
        let mut view = Seen::new(&camera, features, &pixels);
        assert!(view.packed.is_some());
        let (found, expected) = (view.normal(&truth).ok().unwrap(), view.one_by_one(&truth).ok().unwrap());
        let scale = expected.information.amax();
        assert!((found.information - expected.information).amax() < 1e-12 * scale);
        assert!((found.gradient - expected.gradient).amax() < 1e-12 * expected.gradient.amax());
        assert!((found.cost - expected.cost).abs() < 1e-12 * expected.cost);
        assert!(Seen::new(&camera, &grid(0.008), &pixels).packed.is_none());
    }

    #[test]
    fn features_on_a_line_are_degenerate() {
        let (camera, truth) = (camera(), pose(&mut Random::new(1)));
        let line: Vec<Feature> = grid(0.0).into_iter().take(6).collect();
        let outcome = refine_pose(&camera, &line, &seen(&camera, &line, &truth), &truth);
        assert!(matches!(outcome, Err(Error::Degenerate { .. })), "{outcome:?}");
        let same = vec![line[0]; 5];
        let outcome = refine_pose(&camera, &same, &seen(&camera, &same, &truth), &truth);
        assert!(matches!(outcome, Err(Error::Degenerate { .. })), "{outcome:?}");
    }

    #[test]
    fn unusable_input_is_refused() {
        let (camera, features, truth) = (camera(), grid(0.0), pose(&mut Random::new(2)));
        let mut pixels = seen(&camera, &features, &truth);
        let refused = |features: &[Feature], pixels: &[Vector2<f64>]| {
            matches!(refine_pose(&camera, features, pixels, &truth), Err(Error::InvalidInput { .. }))
        };
        assert!(refused(&features, &pixels[1..]));
        assert!(refused(&features[..2], &pixels[..2]));
        pixels[3].x = f64::NAN;
        assert!(refused(&features, &pixels));
        pixels[3].x = 0.0;
        let behind = Se3::new(truth.rotation, -truth.translation);
        let outcome = refine_pose(&camera, &features, &pixels, &behind);
        assert!(matches!(outcome, Err(Error::Numerical { .. })), "{outcome:?}");
    }
}
