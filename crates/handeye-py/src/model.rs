//! The assumptions of a solve, as a Python value.

use handeye_core::least_squares::{
    ChainPrior, KinematicParameters, Model as CoreModel, PixelParameters, RobotNoise, Side,
};
use nalgebra::{DMatrix, SVector};
use pyo3::prelude::*;

use crate::convert::{self, Array};
use crate::errors::invalid;

/// Registers the class of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Model>()
}

/// What a solve believes about noise and about parameters known only roughly.
#[pyclass(frozen, module = "handeye._core")]
pub struct Model {
    pub inner: CoreModel,
}

/// `"left"` or `"right"` of the motion.
pub fn side(py: Python<'_>, name: &str) -> PyResult<Side> {
    match name {
        "left" => Ok(Side::Left),
        "right" => Ok(Side::Right),
        other => Err(invalid(py, &format!("robot_side must be \"left\" or \"right\", found \"{other}\""))),
    }
}

/// A square matrix of any size out of an `(n, n)` array.
pub fn square(py: Python<'_>, name: &str, array: &Array<'_>) -> PyResult<DMatrix<f64>> {
    let shape = array.shape();
    if shape.len() != 2 || shape[0] != shape[1] {
        return Err(invalid(py, &format!("{name} must be a square matrix")));
    }
    Ok(DMatrix::from_row_slice(shape[0], shape[1], &convert::in_place(array)))
}

fn twist(py: Python<'_>, name: &str, array: &Array<'_>) -> PyResult<SVector<f64, 6>> {
    let values = convert::scalars(py, name, array)?;
    if values.len() != 6 {
        return Err(invalid(py, &format!("{name} must have 6 entries, found {}", values.len())));
    }
    Ok(SVector::from_column_slice(&values))
}

#[pymethods]
impl Model {
    #[new]
    #[pyo3(signature = (
        pixel_sigma, *, robot_side=None, robot_roots=None, free_camera=None, board_scale=false,
        pixel_prior=None, kinematic_jacobians=None, kinematic_prior=None, chain_prior=None,
    ))]
    #[expect(clippy::too_many_arguments, reason = "one keyword per assumption")]
    fn new<'py>(
        py: Python<'py>,
        pixel_sigma: Array<'py>,
        robot_side: Option<&str>,
        robot_roots: Option<Array<'py>>,
        free_camera: Option<Vec<usize>>,
        board_scale: bool,
        pixel_prior: Option<Array<'py>>,
        kinematic_jacobians: Option<Array<'py>>,
        kinematic_prior: Option<Array<'py>>,
        chain_prior: Option<(Array<'py>, Array<'py>, Array<'py>, Array<'py>)>,
    ) -> PyResult<Self> {
        let robot = match (robot_side, robot_roots) {
            (None, None) => None,
            (Some(name), Some(roots)) => Some(RobotNoise {
                side: side(py, name)?,
                square_roots: convert::matrices::<6, 6>(py, "robot_roots", &roots)?,
            }),
            _ => return Err(invalid(py, "robot_side and robot_roots go together")),
        };
        let camera = free_camera.unwrap_or_default();
        let pixel_parameters = if camera.is_empty() && !board_scale {
            None
        } else {
            let count = camera.len() + usize::from(board_scale);
            let prior_information = match pixel_prior {
                Some(prior) => square(py, "pixel_prior", &prior)?,
                None => DMatrix::zeros(count, count),
            };
            Some(PixelParameters { camera, board_scale, prior_information })
        };
        let kinematic = match (kinematic_jacobians, kinematic_prior) {
            (None, None) => None,
            (Some(jacobians), Some(prior)) => Some(KinematicParameters {
                jacobians: jacobian_list(py, &jacobians)?,
                prior_information: square(py, "kinematic_prior", &prior)?,
            }),
            _ => return Err(invalid(py, "kinematic_jacobians and kinematic_prior go together")),
        };
        let chain_prior = chain_prior
            .map(|(x, y, sigma_x, sigma_y)| {
                PyResult::Ok(ChainPrior {
                    x: convert::transform(py, "chain_prior X", &x)?,
                    y: convert::transform(py, "chain_prior Y", &y)?,
                    sigma_x: twist(py, "chain_prior sigma_x", &sigma_x)?,
                    sigma_y: twist(py, "chain_prior sigma_y", &sigma_y)?,
                })
            })
            .transpose()?;
        Ok(Self {
            inner: CoreModel {
                pixel_sigma: convert::scalars(py, "pixel_sigma", &pixel_sigma)?,
                robot,
                pixel_parameters,
                kinematic,
                chain_prior,
            },
        })
    }

    /// Number of global parameters.
    #[getter]
    fn parameter_count(&self) -> usize {
        self.inner.parameter_count()
    }
}

/// `(K, 6, q)` as one matrix per view.
pub fn jacobian_list(py: Python<'_>, array: &Array<'_>) -> PyResult<Vec<DMatrix<f64>>> {
    let shape = array.shape().to_vec();
    if shape.len() != 3 || shape[1] != 6 {
        return Err(invalid(py, "joint Jacobians must have shape (N, 6, q)"));
    }
    let values = convert::in_place(array);
    let size = 6 * shape[2];
    Ok((0..shape[0])
        .map(|k| DMatrix::from_row_slice(6, shape[2], &values[k * size..(k + 1) * size]))
        .collect())
}
