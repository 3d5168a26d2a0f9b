//! Pose measurements of a cell, and the posterior of everything in it.

use crate::call::CallCore;
use handeye_core::estimation::{
    Assumptions, Body, CameraPrior, Cell, Measurement, Options, PoseMeasurement, SeenBy, Station, Tip, Touch,
    TouchPoint, WeakPrior, compress, estimate, relative_weights, shared_error, shrunk_variances,
    start_from_poses, start_of_cell,
};
use handeye_core::least_squares::{PixelParameters, Problem as CoreProblem};
use handeye_core::se3::Se3;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::convert::{self, Array};
use crate::errors::{invalid, to_python};
use crate::model::{jacobian_list, square};
use crate::posterior::Posterior;
use crate::problem::Problem;

/// Registers the classes and functions of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(start_from_poses_py, module)?)?;
    module.add_class::<PoseMeasurements>()?;
    module.add_function(wrap_pyfunction!(estimate_cell, module)?)
}

type Floats<'py> = Bound<'py, PyArrayDyn<f64>>;

fn weak_prior(translation_m: f64) -> WeakPrior {
    WeakPrior { x_translation_sigma_m: translation_m, ..WeakPrior::default() }
}

type Chain<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>, f64, &'static str);

fn given(py: Python<'_>, start: Option<(Array<'_>, Array<'_>)>) -> PyResult<Option<(Se3, Se3)>> {
    start
        .map(|(x, y)| Ok((convert::transform(py, "start X", &x)?, convert::transform(py, "start Y", &y)?)))
        .transpose()
}

#[pyfunction]
#[pyo3(name = "start_from_poses", signature = (motions, poses, covariances, *, start=None, prior_sigma_m=1.0))]
fn start_from_poses_py<'py>(
    py: Python<'py>,
    motions: Array<'py>,
    poses: Array<'py>,
    covariances: Array<'py>,
    start: Option<(Array<'py>, Array<'py>)>,
    prior_sigma_m: f64,
) -> PyResult<Chain<'py>> {
    let motions = convert::transforms(py, "motions", &motions)?;
    let poses = convert::transforms(py, "poses", &poses)?;
    let covariances = convert::matrices::<6, 6>(py, "covariances", &covariances)?;
    let start = given(py, start)?;
    let found = py
        .core(|| start_from_poses(&motions, &poses, &covariances, &weak_prior(prior_sigma_m), start))?
        .map_err(|e| to_python(py, e))?;
    Ok((
        convert::matrix_out(py, &found.x.to_matrix()),
        convert::matrix_out(py, &found.y.to_matrix()),
        found.cost,
        found.origin,
    ))
}

/// Weights of the points of each view by their deviations, where they are given.
fn weights_of(
    py: Python<'_>,
    problem: &CoreProblem,
    sigmas_px: &[Option<Array<'_>>],
) -> PyResult<Vec<Option<Vec<f64>>>> {
    if sigmas_px.len() != problem.view_count() {
        return Err(invalid(py, "deviations of the points: one array, or None, for each view"));
    }
    sigmas_px
        .iter()
        .enumerate()
        .map(|(k, sigmas)| {
            let Some(sigmas) = sigmas else { return Ok(None) };
            let sigmas = convert::scalars(py, "sigmas_px", sigmas)?;
            if sigmas.len() != problem.point_count(k) || !sigmas.iter().all(|s| *s > 0.0 && s.is_finite()) {
                return Err(invalid(
                    py,
                    &format!("view {k}: a deviation above zero for each point is needed"),
                ));
            }
            Ok(Some(relative_weights(&sigmas)))
        })
        .collect()
}

/// Views of one target through one camera, each as a pose with its covariance.
#[pyclass(frozen, module = "handeye._core")]
pub struct PoseMeasurements {
    pub views: Vec<PoseMeasurement>,
}

#[pymethods]
impl PoseMeasurements {
    #[new]
    #[pyo3(signature = (problem, poses, *, free_camera=None, board_scale=false, sigmas_px=None))]
    fn new<'py>(
        py: Python<'py>,
        problem: &Problem,
        poses: Array<'py>,
        free_camera: Option<Vec<usize>>,
        board_scale: bool,
        sigmas_px: Option<Vec<Option<Array<'py>>>>,
    ) -> PyResult<Self> {
        let poses = convert::transforms(py, "poses", &poses)?;
        let count = problem.inner.view_count();
        if poses.len() != count {
            return Err(invalid(py, &format!("{} poses for {count} views", poses.len())));
        }
        let free = free_camera.unwrap_or_default();
        let most = problem.inner.camera().lens.parameter_count();
        if let Some(i) = free.iter().find(|i| **i >= most) {
            return Err(invalid(py, &format!("camera parameter {i} of a lens with {most}")));
        }
        let columns = free.len() + usize::from(board_scale);
        let parameters = (columns > 0).then_some(PixelParameters { camera: free, board_scale });
        let weights = match sigmas_px {
            None => vec![None; count],
            Some(sigmas) => weights_of(py, &problem.inner, &sigmas)?,
        };
        let views = py
            .core(|| {
                poses
                    .iter()
                    .zip(&weights)
                    .enumerate()
                    .map(|(k, (pose, weights))| {
                        let (problem, weights) = (&problem.inner, weights.as_deref());
                        compress(problem, k, problem.camera(), pose, parameters.as_ref(), weights)
                    })
                    .collect::<Result<Vec<_>, _>>()
            })?
            .map_err(|e| to_python(py, e))?;
        Ok(Self { views })
    }

    /// Poses (K, 4, 4) that somebody else's detector states, with the covariance (K, 6, 6) of their left perturbation.
    #[staticmethod]
    fn stated<'py>(
        py: Python<'py>,
        motions: Array<'py>,
        poses: Array<'py>,
        covariances: Array<'py>,
    ) -> PyResult<Self> {
        let motions = convert::transforms(py, "motions", &motions)?;
        let poses = convert::transforms(py, "poses", &poses)?;
        let covariances = convert::matrices::<6, 6>(py, "covariances", &covariances)?;
        if motions.len() != poses.len() || covariances.len() != poses.len() {
            return Err(invalid(py, "as many motions and covariances as poses are needed"));
        }
        let each = motions.into_iter().zip(poses).zip(covariances);
        let views =
            each.map(|((motion, pose), covariance)| PoseMeasurement::stated(motion, pose, covariance));
        Ok(Self { views: views.collect() })
    }

    fn __len__(&self) -> usize {
        self.views.len()
    }

    /// Variance of the pixels of each view from its own residual, px^2.
    #[getter]
    fn variances_px2(&self) -> Vec<f64> {
        self.views.iter().map(|v| v.variance_px2).collect()
    }

    /// Covariance (K, 6, 6) of each view's pose at 1 px.
    #[getter]
    fn covariances<'py>(&self, py: Python<'py>) -> Floats<'py> {
        convert::matrices_out(py, &self.views.iter().map(|v| v.covariance).collect::<Vec<_>>())
    }

    /// What all views say of the camera that their poses do not absorb, at 1 px: information and gradient.
    fn camera_normal<'py>(&self, py: Python<'py>) -> PyResult<(Floats<'py>, Floats<'py>)> {
        let Some(first) = self.views.first() else { return Err(invalid(py, "no views")) };
        let mut information = first.camera_information.clone();
        let mut gradient = first.camera_gradient.clone();
        for view in &self.views[1..] {
            information += &view.camera_information;
            gradient += &view.camera_gradient;
        }
        Ok((convert::dynamic_out(py, &information), convert::scalars_out(py, gradient.as_slice().to_vec())))
    }

    /// How each view's pose moves with the free parameters of the camera and, last, the scale of the board (K, 6, c).
    #[getter]
    fn sensitivities<'py>(&self, py: Python<'py>) -> Floats<'py> {
        let columns = self.views.first().map_or(0, |v| v.sensitivity.ncols());
        let dynamic = |v: &PoseMeasurement| DMatrix::from_column_slice(6, columns, v.sensitivity.as_slice());
        convert::dynamics_out(py, &self.views.iter().map(dynamic).collect::<Vec<_>>(), 6, columns)
    }

    /// Factor on the pixel variances for errors that neighbouring points share; one where there are none.
    fn shared_error(&self, variances_px2: Vec<f64>) -> f64 {
        let views: Vec<_> = self.views.iter().map(|v| v.slow).zip(variances_px2).collect();
        shared_error(&views)
    }

    /// Pixel variance of each view, shrunk towards their median, px^2.
    #[pyo3(signature = (*, prior_degrees, floor_px2))]
    fn shrunk_variances(&self, prior_degrees: f64, floor_px2: f64) -> Vec<f64> {
        shrunk_variances(&self.views.iter().collect::<Vec<_>>(), prior_degrees, floor_px2)
    }
}

/// Whether it is on the flange, number of free parameters, whether the prior comes from these pixels, and the prior: information, mean, whether it is inflated.
pub type CameraGiven<'py> = (bool, usize, bool, Option<(Array<'py>, Array<'py>, bool)>);
/// Jacobians of joints and links per station, scales and free joints, and which ways of displacing are in metres.
type ArmGiven<'py> = (Array<'py>, Array<'py>, Vec<f64>, Vec<usize>, Vec<bool>);
/// Camera, target, measurements, and for each of these its station and pixel variance.
type SeenGiven<'py> = (usize, usize, Bound<'py, PoseMeasurements>, Vec<usize>, Vec<f64>);

/// A tip: whether it is on the flange, where, and how well that is known.
type TipGiven<'py> = (bool, Array<'py>, Array<'py>);
/// A touch: its station, one tip or two, where there is one the target and the point of it, and its covariance.
type TouchGiven<'py> = (usize, Vec<usize>, Option<(usize, Array<'py>)>, Array<'py>);

fn point(py: Python<'_>, what: &str, given: &Array<'_>) -> PyResult<Vector3<f64>> {
    let values = convert::scalars(py, what, given)?;
    let [x, y, z] = values[..] else { return Err(invalid(py, &format!("{what}: three numbers are needed"))) };
    Ok(Vector3::new(x, y, z))
}

fn three_by_three(py: Python<'_>, what: &str, given: &Array<'_>) -> PyResult<Matrix3<f64>> {
    let m = square(py, what, given)?;
    if m.nrows() != 3 {
        return Err(invalid(py, &format!("{what}: three rows are needed")));
    }
    Ok(Matrix3::from_column_slice(m.as_slice()))
}

fn tip(py: Python<'_>, (on_flange, at, information): TipGiven<'_>) -> PyResult<Tip> {
    let at = point(py, "tip", &at)?;
    Ok(Tip { body: body(on_flange), at, information: three_by_three(py, "tip's information", &information)? })
}

fn touch(py: Python<'_>, (station, tips, target, covariance): TouchGiven<'_>) -> PyResult<Touch> {
    let mut points: Vec<TouchPoint> = tips.into_iter().map(TouchPoint::Tip).collect();
    if let Some((target, at)) = target {
        points.push(TouchPoint::OfTarget { target, at: point(py, "touched point", &at)? });
    }
    let points = <[TouchPoint; 2]>::try_from(points).map_err(|_| invalid(py, "a touch is of two points"))?;
    Ok(Touch { station, points, covariance: three_by_three(py, "covariance of a touch", &covariance)? })
}

/// A camera from what was given of it.
pub fn seen_by(
    py: Python<'_>,
    (on_flange, parameters, from_these_pixels, prior): CameraGiven<'_>,
) -> PyResult<SeenBy> {
    let prior = prior
        .map(|(information, mean, inflated)| {
            Ok::<_, PyErr>(CameraPrior {
                information: square(py, "camera prior", &information)?,
                mean: DVector::from_vec(convert::scalars(py, "camera mean", &mean)?),
                inflated,
            })
        })
        .transpose()?;
    Ok(SeenBy { body: body(on_flange), parameters, from_these_pixels, prior })
}

pub fn body(on_flange: bool) -> Body {
    if on_flange { Body::Flange } else { Body::Base }
}

/// The posterior of a cell; see the type stub.
#[pyfunction]
#[pyo3(signature = (
    stations, cameras, targets, seen, *, velocities=None, arm=None, approach=None, exact_robot=false, roughness=1.0, board_scale=false, start=None,
    tips=vec![], touches=vec![], pairs, most_rounds, levels=vec![],
))]
#[expect(clippy::too_many_arguments, reason = "one argument per part of a cell")]
fn estimate_cell<'py>(
    py: Python<'py>,
    stations: Array<'py>,
    cameras: Vec<CameraGiven<'py>>,
    targets: Vec<bool>,
    seen: Vec<SeenGiven<'py>>,
    velocities: Option<Array<'py>>,
    arm: Option<ArmGiven<'py>>,
    approach: Option<Array<'py>>,
    exact_robot: bool,
    roughness: f64,
    board_scale: bool,
    start: Option<(Array<'py>, Array<'py>)>,
    tips: Vec<TipGiven<'py>>,
    touches: Vec<TouchGiven<'py>>,
    pairs: usize,
    most_rounds: usize,
    levels: Vec<(String, f64)>,
) -> PyResult<Posterior> {
    let poses = convert::transforms(py, "stations", &stations)?;
    let mut assumptions = Assumptions {
        exact_robot,
        roughness,
        joint_scales: vec![],
        free_joints: vec![],
        link_lengths: vec![],
    };
    let mut of_arm = None;
    if let Some((joints, links, scales, free, lengths)) = arm {
        let (joints, links) = (jacobian_list(py, &joints)?, jacobian_list(py, &links)?);
        if joints.len() != poses.len() || links.len() != poses.len() {
            return Err(invalid(py, "Jacobians of the arm must be as many as stations"));
        }
        (assumptions.joint_scales, assumptions.free_joints, assumptions.link_lengths) =
            (scales, free, lengths);
        of_arm = Some((joints, links));
    }
    let velocities = velocities.map(|v| convert::vectors::<6>(py, "velocities", &v)).transpose()?;
    if velocities.as_ref().is_some_and(|v| v.len() != poses.len()) {
        return Err(invalid(py, "velocities must be as many as stations"));
    }
    let approach = approach.map(|a| jacobian_list(py, &a)).transpose()?;
    if approach.as_ref().is_some_and(|a| a.len() != poses.len()) {
        return Err(invalid(py, "approaches must be as many as stations"));
    }
    let stations = poses
        .iter()
        .enumerate()
        .map(|(k, pose)| Station {
            pose: *pose,
            velocity: velocities.as_ref().map(|v| v[k]),
            joints: of_arm.as_ref().map(|(joints, _): &(Vec<_>, Vec<_>)| joints[k].clone()),
            links: of_arm.as_ref().map(|(_, links)| links[k].clone()),
            approach: approach.as_ref().map(|a| a[k].clone()),
        })
        .collect();
    let cameras = cameras.into_iter().map(|camera| seen_by(py, camera)).collect::<PyResult<Vec<_>>>()?;
    let mut measurements = Vec::new();
    for (camera, target, views, at, variances) in &seen {
        let views = &views.get().views;
        if at.len() != views.len() || variances.len() != views.len() {
            return Err(invalid(py, "as many stations and variances as views are needed"));
        }
        for ((pose, station), variance_px2) in views.iter().zip(at).zip(variances) {
            measurements.push(Measurement {
                station: *station,
                camera: *camera,
                target: *target,
                pose: pose.clone(),
                variance_px2: *variance_px2,
            });
        }
    }
    measurements.sort_by_key(|m| m.station);
    let cell = Cell {
        stations,
        cameras,
        targets: targets.into_iter().map(body).collect(),
        board_scale,
        measurements,
        tips: tips.into_iter().map(|one| tip(py, one)).collect::<PyResult<_>>()?,
        touches: touches.into_iter().map(|one| touch(py, one)).collect::<PyResult<_>>()?,
    };
    let given = start
        .map(|(x, y)| {
            Ok::<_, PyErr>((convert::transforms(py, "start X", &x)?, convert::transforms(py, "start Y", &y)?))
        })
        .transpose()?;
    let options = Options { assumptions, weak: WeakPrior::default(), pairs, most_rounds, levels };
    let (inner, origin) = py
        .core(|| {
            let given = given.as_ref().map(|(x, y)| (x.as_slice(), y.as_slice()));
            let start = start_of_cell(&cell, &options.weak, given)?;
            Ok((estimate(&cell, (start.x, start.y), &options)?, start.origin))
        })?
        .map_err(|e| to_python(py, e))?;
    Ok(Posterior { inner, origin })
}
