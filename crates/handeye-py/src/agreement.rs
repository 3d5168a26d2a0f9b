//! How well views agree, as a Python value.

use handeye_core::estimation::{Agreement as CoreAgreement, Cell, Measurement, Station, log_densities};
use nalgebra::Vector6;
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::call::CallCore;
use crate::convert::{self, Array, Indices};
use crate::errors::{invalid, to_python};
use crate::estimation::{CameraGiven, PoseMeasurements, body, seen_by};

/// Registers the class of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Agreement>()?;
    module.add_function(wrap_pyfunction!(log_densities_py, module)?)
}

type Floats<'py> = Bound<'py, PyArrayDyn<f64>>;
/// Logarithm of the evidence, levels by name, constants, X and Y, and of every view: deviations, covariances, logarithms of the
/// densities, and probabilities.
type Fitted<'py> = (
    f64,
    Vec<(&'static str, f64)>,
    Vec<f64>,
    Floats<'py>,
    Floats<'py>,
    Floats<'py>,
    Floats<'py>,
    Vec<f64>,
    Vec<f64>,
);

/// Views of one target through one camera, linearised at X and Y.
#[pyclass(frozen, module = "handeye._core")]
pub struct Agreement {
    inner: CoreAgreement,
}

#[pymethods]
impl Agreement {
    #[new]
    #[pyo3(signature = (stations, images, poses, seen, variances_px2, camera, x, y))]
    #[expect(clippy::too_many_arguments, reason = "one argument for each part of the views")]
    fn new<'py>(
        py: Python<'py>,
        stations: Array<'py>,
        images: Indices,
        poses: Array<'py>,
        seen: &PoseMeasurements,
        variances_px2: Vec<f64>,
        camera: CameraGiven<'py>,
        x: Array<'py>,
        y: Array<'py>,
    ) -> PyResult<Self> {
        let stations = convert::transforms(py, "stations", &stations)?;
        let poses = convert::transforms(py, "poses", &poses)?;
        let (count, known) = (stations.len(), seen.views.len());
        if [images.0.len(), poses.len()] != [count; 2] || variances_px2.len() != known {
            return Err(invalid(py, "as many images and poses as stations, and a variance of every image"));
        }
        if images.0.iter().any(|i| *i >= known) {
            return Err(invalid(py, &format!("images must be among {known}")));
        }
        let mut counted = vec![false; known];
        let measurements = images
            .0
            .iter()
            .zip(&poses)
            .enumerate()
            .map(|(station, (image, read))| {
                let mut pose = seen.views[*image].clone();
                pose.pose = *read;
                // What an image says of the camera counts once.
                if std::mem::replace(&mut counted[*image], true) {
                    pose.camera_information.fill(0.0);
                    pose.camera_gradient.fill(0.0);
                }
                let variance_px2 = variances_px2[*image];
                Measurement { station, camera: 0, target: 0, pose, variance_px2 }
            })
            .collect();
        let on_flange = camera.0;
        let cell = Cell {
            stations: stations
                .iter()
                .map(|pose| Station {
                    pose: *pose,
                    joints: None,
                    velocity: None,
                    links: None,
                    approach: None,
                })
                .collect(),
            cameras: vec![seen_by(py, camera)?],
            targets: vec![body(!on_flange)],
            board_scale: true,
            measurements,
            tips: vec![],
            touches: vec![],
        };
        let guess = (vec![convert::transform(py, "X", &x)?], vec![convert::transform(py, "Y", &y)?]);
        let inner = CoreAgreement::new(&cell, guess).map_err(|e| to_python(py, e))?;
        Ok(Self { inner })
    }

    /// Fits a set of views and predicts all; see the type stub.
    fn fit<'py>(
        &self,
        py: Python<'py>,
        members: Indices,
        levels: Option<Vec<f64>>,
        pairs: usize,
    ) -> PyResult<Fitted<'py>> {
        let fit = py
            .core(|| self.inner.fit(&members.0, levels.as_deref(), pairs))?
            .map_err(|e| to_python(py, e))?;
        let count = fit.predictions.len();
        let deviations = fit.predictions.iter().flat_map(|p| p.deviation.iter().copied()).collect();
        let covariances = fit.predictions.iter().flat_map(|p| p.covariance.iter().copied()).collect();
        Ok((
            fit.log_evidence,
            fit.levels,
            fit.constants,
            convert::matrix_out(py, &fit.x[0].to_matrix()),
            convert::matrix_out(py, &fit.y[0].to_matrix()),
            convert::array(py, &[count, 6], deviations),
            convert::array(py, &[count, 6, 6], covariances),
            fit.predictions.iter().map(|p| p.log_density).collect(),
            fit.predictions.iter().map(|p| p.p_value).collect(),
        ))
    }
}

/// Logarithms of densities; see the type stub.
#[pyfunction]
#[pyo3(name = "log_densities")]
fn log_densities_py<'py>(
    py: Python<'py>,
    deviations: Array<'py>,
    covariances: Array<'py>,
    variances: Array<'py>,
) -> PyResult<Floats<'py>> {
    let deviations = convert::vectors::<6>(py, "deviations", &deviations)?;
    let covariances = convert::matrices::<6, 6>(py, "covariances", &covariances)?;
    let count = deviations.len();
    let [views, each, 6] = *variances.shape() else {
        return Err(invalid(py, "variances must have shape (K, M, 6)"));
    };
    if covariances.len() != count || views != count {
        return Err(invalid(py, "as many covariances and sets of variances as deviations are needed"));
    }
    let entries = convert::in_place(&variances);
    let variances: Vec<_> = entries.chunks_exact(6).map(Vector6::from_column_slice).collect();
    let found = py.core(|| {
        let mut found = Vec::with_capacity(count * each);
        for (k, (deviation, covariance)) in deviations.iter().zip(&covariances).enumerate() {
            found.extend(log_densities(deviation, covariance, &variances[k * each..(k + 1) * each])?);
        }
        Ok(found)
    })?;
    Ok(convert::array(py, &[count, each], found.map_err(|e| to_python(py, e))?))
}
