//! Views compressed to poses, and the answer averaged over what the robot's noise may be.

use handeye_core::evidence::{
    CompressedView, EXACT_OFFSET_RAD, EvidenceOptions, Hypothesis, JointErrors as CoreJointErrors,
    JointPrior, LevelPrior, LinkErrors as CoreLinkErrors, Nature, Posterior as CorePosterior, SMOOTH_ODDS,
    SmoothError, WeakPrior, compress, estimate, shrunk_variances, start_from_poses,
};
use handeye_core::least_squares::{PixelParameters, Side};
use handeye_core::se3::Se3;
use nalgebra::{DMatrix, Matrix6};
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::convert::{self, Array};
use crate::errors::{invalid, to_python};
use crate::model::{jacobian_list, square};
use crate::problem::Problem;

/// Registers the classes and functions of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(start_from_poses_py, module)?)?;
    module.add_class::<Compressed>()?;
    module.add_class::<JointErrors>()?;
    module.add_class::<LinkErrors>()?;
    module.add_class::<Posterior>()
}

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
        .detach(|| start_from_poses(&motions, &poses, &covariances, &weak_prior(prior_sigma_m), start))
        .map_err(|e| to_python(py, e))?;
    Ok((
        convert::matrix_out(py, &found.x.to_matrix()),
        convert::matrix_out(py, &found.y.to_matrix()),
        found.cost,
        found.origin,
    ))
}

/// How errors of the joints move the motions, and how large they are if that is known.
#[pyclass(frozen, module = "handeye._core")]
pub struct JointErrors {
    inner: CoreJointErrors,
    noise_rad: Option<f64>,
    offset_rad: Option<f64>,
}

#[pymethods]
impl JointErrors {
    #[new]
    #[pyo3(signature = (jacobians, scales, free, *, noise_rad=None, offset_rad=None))]
    fn new<'py>(
        py: Python<'py>,
        jacobians: Array<'py>,
        scales: Vec<f64>,
        free: Vec<usize>,
        noise_rad: Option<f64>,
        offset_rad: Option<f64>,
    ) -> PyResult<Self> {
        let jacobians = jacobian_list(py, &jacobians)?;
        for level in [noise_rad, offset_rad].into_iter().flatten() {
            if !(level >= 0.0 && level.is_finite()) {
                return Err(invalid(py, &format!("levels of joint errors cannot be {level}")));
            }
        }
        Ok(Self { inner: CoreJointErrors { jacobians, scales, free }, noise_rad, offset_rad })
    }
}

impl JointErrors {
    /// The hypotheses about noise on the sides and in the joints, each with every level of the offsets.
    fn hypotheses(
        &self,
        prior: &LevelPrior,
        sides: &[Side],
        given: Option<Vec<Hypothesis>>,
        links: Option<&LevelPrior>,
    ) -> Vec<Hypothesis> {
        let joint_prior = JointPrior::default();
        let noise = match (given, self.noise_rad) {
            (Some(given), _) => given,
            (None, Some(level)) => vec![Hypothesis::joints(level, 0.0)],
            (None, None) => prior.grid_with(sides, Some(&joint_prior.noise), links),
        };
        match self.offset_rad {
            Some(level) => {
                let offset_rad = level.max(EXACT_OFFSET_RAD);
                noise.into_iter().map(|h| Hypothesis { offset_rad, ..h }).collect()
            }
            None => joint_prior.with_offsets(&noise),
        }
    }

    /// Those of the views with these numbers.
    fn select(&self, views: Option<&[usize]>) -> CoreJointErrors {
        let mut selected = self.inner.clone();
        selected.jacobians = selected_of(&self.inner.jacobians, views);
        selected
    }
}

/// How joints displaced on their links move the motions.
#[pyclass(frozen, module = "handeye._core")]
pub struct LinkErrors {
    inner: CoreLinkErrors,
}

#[pymethods]
impl LinkErrors {
    #[new]
    fn new<'py>(py: Python<'py>, jacobians: Array<'py>, lengths: Vec<bool>) -> PyResult<Self> {
        Ok(Self { inner: CoreLinkErrors { jacobians: jacobian_list(py, &jacobians)?, lengths } })
    }
}

impl LinkErrors {
    /// Those of the views with these numbers.
    fn select(&self, views: Option<&[usize]>) -> CoreLinkErrors {
        let mut selected = self.inner.clone();
        selected.jacobians = selected_of(&self.inner.jacobians, views);
        selected
    }
}

fn selected_of(jacobians: &[DMatrix<f64>], views: Option<&[usize]>) -> Vec<DMatrix<f64>> {
    match views {
        Some(views) => views.iter().filter_map(|k| jacobians.get(*k).cloned()).collect(),
        None => jacobians.to_vec(),
    }
}

/// Views of a problem, each as a pose with its information.
#[pyclass(frozen, module = "handeye._core")]
pub struct Compressed {
    views: Vec<CompressedView>,
}

impl Compressed {
    fn select(&self, py: Python<'_>, indices: Option<Vec<usize>>) -> PyResult<Vec<&CompressedView>> {
        match indices {
            None => Ok(self.views.iter().collect()),
            Some(indices) => indices
                .into_iter()
                .map(|k| {
                    self.views.get(k).ok_or_else(|| invalid(py, &format!("view {k} of {}", self.views.len())))
                })
                .collect(),
        }
    }
}

#[pymethods]
impl Compressed {
    #[new]
    #[pyo3(signature = (problem, poses, *, free_camera=None, board_scale=false))]
    fn new<'py>(
        py: Python<'py>,
        problem: &Problem,
        poses: Array<'py>,
        free_camera: Option<Vec<usize>>,
        board_scale: bool,
    ) -> PyResult<Self> {
        let poses = convert::transforms(py, "poses", &poses)?;
        if poses.len() != problem.inner.view_count() {
            return Err(invalid(
                py,
                &format!("{} poses for {} views", poses.len(), problem.inner.view_count()),
            ));
        }
        let free = free_camera.unwrap_or_default();
        let count = problem.inner.camera().lens.parameter_count();
        if let Some(i) = free.iter().find(|i| **i >= count) {
            return Err(invalid(py, &format!("camera parameter {i} of a lens with {count}")));
        }
        let columns = free.len() + usize::from(board_scale);
        let parameters = (columns > 0).then_some(PixelParameters { camera: free, board_scale });
        let views = py
            .detach(|| {
                poses
                    .iter()
                    .enumerate()
                    .map(|(k, pose)| {
                        compress(&problem.inner, k, problem.inner.camera(), pose, parameters.as_ref())
                    })
                    .collect::<Result<Vec<_>, _>>()
            })
            .map_err(|e| to_python(py, e))?;
        Ok(Self { views })
    }

    /// Variance of the pixels of each view from its own residual, px^2.
    #[getter]
    fn variances_px2(&self) -> Vec<f64> {
        self.views.iter().map(|v| v.variance_px2).collect()
    }

    /// Covariance (K, 6, 6) of each view's pose at 1 px.
    #[getter]
    fn covariances<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f64>> {
        convert::matrices_out(py, &self.views.iter().map(|v| v.covariance).collect::<Vec<_>>())
    }

    /// Pixel variance of each of these views, shrunk towards their median, px^2.
    #[pyo3(signature = (views=None, *, prior_degrees=20.0, floor_px2=1e-8))]
    fn shrunk_variances(
        &self,
        py: Python<'_>,
        views: Option<Vec<usize>>,
        prior_degrees: f64,
        floor_px2: f64,
    ) -> PyResult<Vec<f64>> {
        Ok(shrunk_variances(&self.select(py, views)?, prior_degrees, floor_px2))
    }

    /// The answer from these views, averaged over the hypotheses; see the type stub.
    #[pyo3(signature = (
        *, views=None, camera_prior=None, start=None, prior_sigma_m=1.0, exact_probability=1.0/3.0,
        sides=None, levels=None, joints=None, links=None, likeness=None, prior_degrees=20.0,
        floor_px2=1e-8, linearisations=5,
    ))]
    #[expect(clippy::too_many_arguments, reason = "one keyword per assumption")]
    fn estimate<'py>(
        &self,
        py: Python<'py>,
        views: Option<Vec<usize>>,
        camera_prior: Option<Array<'py>>,
        start: Option<(Array<'py>, Array<'py>)>,
        prior_sigma_m: f64,
        exact_probability: f64,
        sides: Option<Vec<String>>,
        levels: Option<(f64, f64)>,
        joints: Option<&JointErrors>,
        links: Option<&LinkErrors>,
        likeness: Option<Array<'py>>,
        prior_degrees: f64,
        floor_px2: f64,
        linearisations: usize,
    ) -> PyResult<Posterior> {
        let joint_errors = joints.map(|j| j.select(views.as_deref()));
        let link_errors = links.map(|l| l.select(views.as_deref()));
        let chosen = self.select(py, views)?;
        let camera_prior = match camera_prior {
            Some(prior) => square(py, "camera_prior", &prior)?,
            None => DMatrix::zeros(0, 0),
        };
        let sides = match sides {
            None => vec![Side::Left, Side::Right],
            Some(names) => {
                names.iter().map(|name| crate::model::side(py, name)).collect::<PyResult<Vec<_>>>()?
            }
        };
        let given_levels: Option<Vec<Hypothesis>> = levels.map(|(translation_m, rotation_rad)| {
            sides.iter().map(|side| Hypothesis::twists(*side, translation_m, rotation_rad, 0.0)).collect()
        });
        if given_levels.is_some() && joints.is_some_and(|j| j.noise_rad.is_some()) {
            return Err(invalid(
                py,
                "noise of the joints and levels of the robot's poses cannot both be given",
            ));
        }
        let smooth = match likeness {
            Some(correlation) => {
                let correlation = square(py, "likeness", &correlation)?;
                Some(SmoothError::new(&correlation).map_err(|e| to_python(py, e))?)
            }
            None => None,
        };
        let smooth_odds = if smooth.is_some() { SMOOTH_ODDS } else { 0.0 };
        let prior = LevelPrior { exact_probability, smooth_odds, ..LevelPrior::default() };
        let link_prior = links.map(|_| LevelPrior::of_links());
        let hypotheses = match joints {
            Some(joints) => joints.hypotheses(&prior, &sides, given_levels, link_prior.as_ref()),
            None => given_levels.unwrap_or_else(|| prior.grid_with(&sides, None, link_prior.as_ref())),
        };
        let start = given(py, start)?;
        let options = EvidenceOptions {
            prior: weak_prior(prior_sigma_m),
            camera_prior,
            joints: joint_errors,
            smooth,
            links: link_errors,
            linearisations,
        };
        let (posterior, variances, origin) = py
            .detach(|| {
                let variances = shrunk_variances(&chosen, prior_degrees, floor_px2);
                let motions: Vec<Se3> = chosen.iter().map(|v| v.motion).collect();
                let poses: Vec<Se3> = chosen.iter().map(|v| v.pose).collect();
                let covariances: Vec<Matrix6<f64>> =
                    chosen.iter().zip(&variances).map(|(v, s)| v.covariance * *s + start_slack()).collect();
                let chain = start_from_poses(&motions, &poses, &covariances, &options.prior, start)?;
                let posterior = estimate(&chosen, &variances, &hypotheses, (chain.x, chain.y), &options)?;
                Ok((posterior, variances, chain.origin))
            })
            .map_err(|e| to_python(py, e))?;
        Ok(Posterior { inner: posterior, hypotheses, variances, origin })
    }
}

/// Covariance added to the poses when a start is looked for: a millimetre and 0.05 degrees per axis, so that a
/// robot that is not exact does not make every start look hopeless.
fn start_slack() -> Matrix6<f64> {
    let (t, r) = (1e-3_f64, 0.05_f64.to_radians());
    Matrix6::from_diagonal(&nalgebra::Vector6::new(t * t, t * t, t * t, r * r, r * r, r * r))
}

/// What is believed after some views.
#[pyclass(frozen, name = "OldPosterior", module = "handeye._core")]
pub struct Posterior {
    inner: CorePosterior,
    hypotheses: Vec<Hypothesis>,
    variances: Vec<f64>,
    origin: &'static str,
}

impl Posterior {
    fn by_weight(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.hypotheses.len()).collect();
        order.sort_by(|a, b| self.inner.weights[*b].total_cmp(&self.inner.weights[*a]));
        order
    }
}

#[pymethods]
impl Posterior {
    /// `X`, 4 x 4.
    #[getter]
    fn x<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f64>> {
        convert::matrix_out(py, &self.inner.x.to_matrix())
    }

    /// `Y`, 4 x 4.
    #[getter]
    fn y<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f64>> {
        convert::matrix_out(py, &self.inner.y.to_matrix())
    }

    /// Probability that the robot's error changes smoothly with the posture: displaced joints do that too.
    #[getter]
    fn smooth_probability(&self) -> f64 {
        let smooth = |h: &Hypothesis| h.nature != Nature::White;
        self.hypotheses.iter().zip(&self.inner.weights).filter(|(h, _)| smooth(h)).map(|(_, w)| w).sum()
    }

    /// By how much the joints are displaced on their links, metres and radians.
    #[getter]
    fn link_twists(&self) -> Vec<f64> {
        self.inner.link_twists.as_slice().to_vec()
    }

    /// Free camera parameters relative to their calibrated values.
    #[getter]
    fn camera_delta(&self) -> Vec<f64> {
        self.inner.camera_delta.as_slice().to_vec()
    }

    /// Offsets of the free joints, true minus read, radians or metres.
    #[getter]
    fn joint_offsets(&self) -> Vec<f64> {
        self.inner.joint_offsets.as_slice().to_vec()
    }

    /// Levels of the joints' noise and of their offsets as `(noise_rad, offset_rad)`, in the order of `hypotheses`.
    #[getter]
    fn joint_levels(&self) -> Vec<(f64, f64)> {
        self.by_weight()
            .into_iter()
            .map(|i| (self.hypotheses[i].joint_rad, self.hypotheses[i].offset_rad))
            .collect()
    }

    /// Covariance of all parameters.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f64>> {
        convert::dynamic_out(py, &self.inner.covariance)
    }

    /// Degrees of freedom of the covariance of `X`.
    #[getter]
    fn degrees_of_freedom(&self) -> f64 {
        self.inner.degrees_of_freedom
    }

    /// Logarithm of the evidence, up to a constant of the data.
    #[getter]
    fn log_evidence(&self) -> f64 {
        self.inner.log_evidence
    }

    /// Where the start came from.
    #[getter]
    fn origin(&self) -> &'static str {
        self.origin
    }

    /// Pixel variance taken for each view, px^2.
    #[getter]
    fn variances_px2(&self) -> Vec<f64> {
        self.variances.clone()
    }

    /// Hypotheses as `(side, translation_m, rotation_rad, probability)`, likeliest first; side "left", "right",
    /// "joints", "links", "none".
    #[getter]
    fn hypotheses(&self) -> Vec<(&'static str, f64, f64, f64)> {
        self.by_weight()
            .into_iter()
            .map(|i| {
                let h = &self.hypotheses[i];
                let side = match h.side {
                    None if h.nature == Nature::Links => "links",
                    None if h.joint_rad > 0.0 => "joints",
                    None => "none",
                    Some(Side::Left) => "left",
                    Some(Side::Right) => "right",
                };
                (side, h.translation_m, h.rotation_rad, self.inner.weights[i])
            })
            .collect()
    }

    /// Information of all parameters under the `rank`-th likeliest hypothesis.
    fn information<'py>(&self, py: Python<'py>, rank: usize) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let order = self.by_weight();
        let information = order
            .get(rank)
            .map(|i| &self.inner.informations[*i])
            .filter(|m| m.nrows() > 0)
            .ok_or_else(|| invalid(py, &format!("hypothesis {rank} was not weighed")))?;
        Ok(convert::dynamic_out(py, information))
    }
}
