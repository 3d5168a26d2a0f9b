//! Entropy, gains and predicted information of candidates.

use crate::call::CallCore;
use handeye_core::error::Error;
use handeye_core::information::criteria::{
    Criterion, EigenvalueSum, Entropy, EntropyHandEye, MinEigenvalue, Over, Scales, Task, ToolPoint, Trace,
};
use handeye_core::information::{
    ArmColumns, Belief as CoreBelief, CandidateModel, Execution, Motions, RobotError, Visibility,
};
use handeye_core::least_squares::PixelParameters;
use handeye_core::simd::VectorUnit;
use nalgebra::DMatrix;
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::camera::{camera, features};
use crate::convert::{self, Array};
use crate::errors::{invalid, to_python};
use crate::model::square;

/// Registers the classes of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Belief>()?;
    module.add_class::<PyCriterion>()?;
    module.add_class::<Predictor>()
}

/// Information of all global parameters and what follows from it.
#[pyclass(frozen, module = "handeye._core")]
pub struct Belief {
    inner: CoreBelief,
}

#[pymethods]
impl Belief {
    #[new]
    fn new(py: Python<'_>, information: Array<'_>) -> PyResult<Self> {
        let information = square(py, "information", &information)?;
        CoreBelief::new(information).map(|inner| Self { inner }).map_err(|e| to_python(py, e))
    }

    /// Inverse of the information.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArrayDyn<f64>> {
        convert::dynamic_out(py, self.inner.covariance())
    }

    /// `ln |Lambda|`.
    #[getter]
    fn log_determinant(&self) -> f64 {
        self.inner.log_determinant()
    }

    /// Entropy of all parameters, nats.
    #[getter]
    fn entropy(&self) -> f64 {
        self.inner.entropy()
    }

    /// Entropy of the hand-eye alone, nats.
    #[getter]
    fn hand_eye_entropy(&self) -> f64 {
        self.inner.hand_eye_entropy()
    }
}

/// What a view is worth.
#[pyclass(frozen, name = "Criterion", module = "handeye._core")]
pub struct PyCriterion {
    inner: Box<dyn Criterion + Send + Sync>,
}

#[pymethods]
impl PyCriterion {
    #[new]
    #[pyo3(signature = (name, *, length_scale_m=1e-3, angle_scale_rad=1e-3, tool_points=None, over="mean", tasks=None))]
    fn new(
        py: Python<'_>,
        name: &str,
        length_scale_m: f64,
        angle_scale_rad: f64,
        tool_points: Option<Array<'_>>,
        over: &str,
        tasks: Option<Array<'_>>,
    ) -> PyResult<Self> {
        let scales = Scales { length_m: length_scale_m, angle_rad: angle_scale_rad };
        if !(length_scale_m > 0.0 && angle_scale_rad > 0.0) {
            return Err(invalid(py, "length and angle scales must be positive"));
        }
        let inner: Box<dyn Criterion + Send + Sync> = match name {
            "entropy" => Box::new(Entropy),
            "entropy_handeye" => Box::new(EntropyHandEye),
            "trace" => Box::new(Trace { scales }),
            "eigenvalue_sum" => Box::new(EigenvalueSum { scales }),
            "min_eigenvalue" => Box::new(MinEigenvalue { scales }),
            "tool_point" => {
                let points =
                    tool_points.ok_or_else(|| invalid(py, "criterion tool_point needs tool_points"))?;
                let points = convert::vectors::<3>(py, "tool_points", &points)?;
                let over = match over {
                    "mean" => Over::Mean,
                    "worst" => Over::Worst,
                    other => {
                        return Err(invalid(py, &format!("over must be mean or worst, found \"{other}\"")));
                    }
                };
                Box::new(ToolPoint::new(&points, over).map_err(|e| to_python(py, e))?)
            }
            "task" => {
                let tasks = tasks.ok_or_else(|| invalid(py, "criterion task needs tasks"))?;
                let &[count, directions, parameters] = tasks.shape() else {
                    return Err(invalid(py, "tasks must have shape (P, d, n)"));
                };
                let values = convert::in_place(&tasks);
                let rows = DMatrix::from_row_slice(count * directions, parameters, &values);
                Box::new(Task::new(rows, count).map_err(|e| to_python(py, e))?)
            }
            other => {
                return Err(invalid(
                    py,
                    &format!(
                        "unknown criterion \"{other}\"; there are entropy, entropy_handeye, trace, \
                         eigenvalue_sum, min_eigenvalue, tool_point, task"
                    ),
                ));
            }
        };
        Ok(Self { inner })
    }

    /// Stable name.
    #[getter]
    fn name(&self) -> &'static str {
        self.inner.name()
    }
}

fn vector_unit(py: Python<'_>, name: &str) -> PyResult<VectorUnit> {
    VectorUnit::ALL
        .into_iter()
        .find(|unit| unit.name() == name)
        .filter(|unit| unit.is_available())
        .ok_or_else(|| {
            let names: Vec<&str> = VectorUnit::ALL
                .into_iter()
                .filter(|unit| unit.is_available())
                .map(VectorUnit::name)
                .collect();
            invalid(py, &format!("vector_unit must be one of {}, found \"{name}\"", names.join(", ")))
        })
}

fn execution(py: Python<'_>, threads: usize, vector_unit: Option<&str>) -> PyResult<Execution> {
    let unit = vector_unit.map_or_else(|| Ok(VectorUnit::widest()), |name| self::vector_unit(py, name))?;
    Ok(Execution { unit, threads })
}

fn robot(py: Python<'_>, left: Option<&Array<'_>>, right: Option<&Array<'_>>) -> PyResult<RobotError> {
    let root = |name: &str, root: Option<&Array<'_>>| {
        root.map(|root| convert::matrix::<6, 6>(py, name, root)).transpose()
    };
    Ok(RobotError { left: root("robot_left", left)?, right: root("robot_right", right)? })
}

/// Predicts what candidate views would tell.
#[pyclass(frozen, module = "handeye._core")]
pub struct Predictor {
    camera: handeye_core::camera::Camera,
    x: handeye_core::se3::Se3,
    y: handeye_core::se3::Se3,
    features: Vec<handeye_core::camera::Feature>,
    pixel_sigma: f64,
    robot: RobotError,
    pixel_parameters: Option<PixelParameters>,
    kinematic_count: usize,
    visibility: Visibility,
}

impl Predictor {
    /// Has the motions and the arm of candidates looked at; a matrix that is no rigid transform is named.
    fn looked<'py, T: Send>(
        &self,
        py: Python<'py>,
        motions: &Array<'py>,
        arm: Option<&Array<'py>>,
        look: impl FnOnce(&CandidateModel<'_>, Motions<'_>, Option<ArmColumns<'_>>) -> Result<T, Error> + Send,
    ) -> PyResult<T> {
        let matrices = convert::row_major::<4, 4>(py, "motions", motions)?;
        let matrices: &[f64] = &matrices;
        let constants = self.kinematic_count;
        let entries = arm.map(convert::in_place);
        let arm = match (&entries, arm.map(Array::shape)) {
            (None, _) => None,
            (Some(entries), Some(&[_, 6, count])) if count >= constants => {
                Some(ArmColumns { entries, counts: (constants, count - constants) })
            }
            _ => {
                let expected = format!("the arm of candidates must have shape (N, 6, {constants} + r)");
                return Err(invalid(py, &expected));
            }
        };
        match py.core(|| look(&self.model(), Motions::Matrices(matrices), arm))? {
            Ok(found) => Ok(found),
            Err(error @ Error::NotRigid { .. }) => {
                // Once more, to say which.
                convert::transforms(py, "motions", motions)?;
                Err(to_python(py, error))
            }
            Err(error) => Err(to_python(py, error)),
        }
    }

    fn model(&self) -> CandidateModel<'_> {
        CandidateModel {
            camera: &self.camera,
            x: self.x,
            y: self.y,
            features: &self.features,
            pixel_sigma: self.pixel_sigma,
            robot: self.robot,
            pixel_parameters: self.pixel_parameters.as_ref(),
            kinematic_count: self.kinematic_count,
            visibility: self.visibility,
        }
    }
}

#[pymethods]
impl Predictor {
    #[new]
    #[pyo3(signature = (
        lens, parameters, points, radii, x, y, *, pixel_sigma, robot_left=None, robot_right=None,
        free_camera=None, board_scale=false, kinematic_count=0, image_size=None, margin_px=0.0, fewest=3,
    ))]
    #[expect(clippy::too_many_arguments, reason = "one keyword per assumption")]
    fn new<'py>(
        py: Python<'py>,
        lens: &str,
        parameters: Array<'py>,
        points: Array<'py>,
        radii: Array<'py>,
        x: Array<'py>,
        y: Array<'py>,
        pixel_sigma: f64,
        robot_left: Option<Array<'py>>,
        robot_right: Option<Array<'py>>,
        free_camera: Option<Vec<usize>>,
        board_scale: bool,
        kinematic_count: usize,
        image_size: Option<(f64, f64)>,
        margin_px: f64,
        fewest: usize,
    ) -> PyResult<Self> {
        if !(pixel_sigma > 0.0 && pixel_sigma.is_finite()) {
            return Err(invalid(py, "pixel_sigma must be positive"));
        }
        let robot = robot(py, robot_left.as_ref(), robot_right.as_ref())?;
        let free = free_camera.unwrap_or_default();
        let count = free.len() + usize::from(board_scale);
        let pixel_parameters = (count > 0).then_some(PixelParameters { camera: free, board_scale });
        Ok(Self {
            camera: camera(py, lens, &parameters)?,
            x: convert::transform(py, "x", &x)?,
            y: convert::transform(py, "y", &y)?,
            features: features(py, &points, &radii)?,
            pixel_sigma,
            robot,
            pixel_parameters,
            kinematic_count,
            visibility: Visibility { image: image_size.map(|(w, h)| [w, h]), margin_px, fewest },
        })
    }

    /// Gain of each candidate motion; NaN where too little would be in sight.
    ///
    /// Results do not depend on `threads` (0: as many as pay off) and on `vector_unit` beyond rounding.
    #[pyo3(signature = (belief, criterion, motions, *, arm=None, threads=0, vector_unit=None))]
    #[expect(clippy::too_many_arguments, reason = "one keyword per option")]
    fn gains<'py>(
        &self,
        py: Python<'py>,
        belief: &Belief,
        criterion: &PyCriterion,
        motions: Array<'py>,
        arm: Option<Array<'py>>,
        threads: usize,
        vector_unit: Option<&str>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let execution = execution(py, threads, vector_unit)?;
        let (belief, criterion) = (&belief.inner, criterion.inner.as_ref());
        let gains = self.looked(py, &motions, arm.as_ref(), |model, motions, arm| {
            model.gains_by(belief, criterion, motions, arm, &execution)
        })?;
        Ok(convert::scalars_out(py, gains))
    }

    /// Which candidate motions would show enough of the target.
    fn in_sight<'py>(&self, py: Python<'py>, motions: Array<'py>) -> PyResult<Vec<bool>> {
        let execution = Execution::default();
        self.looked(py, &motions, None, |model, motions, _| model.in_sight(motions, &execution))
    }

    /// Information `(N, n, n)` of each candidate motion; zero where too little would be in sight.
    #[pyo3(signature = (motions, *, arm=None))]
    fn informations<'py>(
        &self,
        py: Python<'py>,
        motions: Array<'py>,
        arm: Option<Array<'py>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let n = self.model().parameter_count();
        let all = self.looked(py, &motions, arm.as_ref(), |model, motions, arm| {
            let model: &CandidateModel<'_> = model;
            model.informations(motions, arm)
        })?;
        Ok(convert::dynamics_out(py, &all, n, n))
    }
}
