//! Evidence of sets of views, as a Python value.

use crate::call::CallCore;
use handeye_core::estimation::{LinearisedView, NoiseLevel, ViewSets as CoreViewSets};
use handeye_core::least_squares::Side;
use nalgebra::DVector;
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::convert::{self, Array, Indices};
use crate::errors::{invalid, to_python};
use crate::model::{jacobian_list, square};

/// Registers the class of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<ViewSets>()
}

/// Views linearised, to be weighed in sets.
#[pyclass(frozen, module = "handeye._core")]
pub struct ViewSets {
    inner: CoreViewSets,
}

type Floats<'py> = Bound<'py, PyArrayDyn<f64>>;

#[pymethods]
impl ViewSets {
    #[new]
    #[expect(clippy::too_many_arguments, reason = "one array for each part of the views")]
    fn new<'py>(
        py: Python<'py>,
        deviations: Array<'py>,
        rows: Array<'py>,
        covariances: Array<'py>,
        from_left: Array<'py>,
        from_right: Array<'py>,
        prior: Array<'py>,
        prior_right: Array<'py>,
    ) -> PyResult<Self> {
        let deviations = convert::vectors::<6>(py, "deviations", &deviations)?;
        let rows = jacobian_list(py, &rows)?;
        let covariances = convert::matrices::<6, 6>(py, "covariances", &covariances)?;
        let from_left = convert::matrices::<6, 6>(py, "from_left", &from_left)?;
        let from_right = convert::matrices::<6, 6>(py, "from_right", &from_right)?;
        let count = deviations.len();
        if [rows.len(), covariances.len(), from_left.len(), from_right.len()] != [count; 4] {
            return Err(invalid(py, &format!("all parts must be of {count} views")));
        }
        let views: Vec<LinearisedView> = rows
            .into_iter()
            .enumerate()
            .map(|(k, rows)| LinearisedView {
                deviation: deviations[k],
                rows,
                covariance: covariances[k],
                from_robot: [from_left[k], from_right[k]],
            })
            .collect();
        let prior = square(py, "prior", &prior)?;
        let prior_right = DVector::from_vec(convert::scalars(py, "prior_right", &prior_right)?);
        let inner = CoreViewSets::new(&views, prior, prior_right).map_err(|e| to_python(py, e))?;
        Ok(Self { inner })
    }

    /// Covariances of theta, its means and the log-likelihoods under each level; see the type stub.
    fn fit<'py>(
        &self,
        py: Python<'py>,
        left: Vec<bool>,
        translation_m: Array<'py>,
        rotation_rad: Array<'py>,
        members: Indices,
    ) -> PyResult<(Floats<'py>, Floats<'py>, Floats<'py>)> {
        let translation = convert::entries(py, "translation_m", &translation_m)?;
        let rotation = convert::entries(py, "rotation_rad", &rotation_rad)?;
        if translation.len() != left.len() || rotation.len() != left.len() {
            return Err(invalid(py, "a level has a side, a translation and a rotation"));
        }
        let side = |left: bool| if left { Side::Left } else { Side::Right };
        let levels: Vec<NoiseLevel> = left
            .iter()
            .zip(translation.iter().zip(&*rotation))
            .map(|(left, (t, r))| NoiseLevel { side: side(*left), translation_m: *t, rotation_rad: *r })
            .collect();
        let fit = py.core(|| self.inner.fit(&levels, &members.0))?.map_err(|e| to_python(py, e))?;
        let (n, count) = (self.inner.size(), levels.len());
        Ok((
            convert::array(py, &[count, n, n], fit.covariances),
            convert::array(py, &[count, n], fit.means),
            convert::scalars_out(py, fit.log_likelihoods),
        ))
    }
}
