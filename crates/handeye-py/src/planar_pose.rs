//! The pose of a planar target in one image.

use crate::call::CallCore;
use handeye_core::planar_pose::planar_pose as core_planar_pose;
use handeye_core::pose::PoseFit;
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::camera::{camera, features};
use crate::convert::{self, Array};
use crate::errors::to_python;

/// Registers the functions of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(planar_pose, module)?)
}

type Fit<'py> = (Bound<'py, PyArrayDyn<f64>>, f64, Bound<'py, PyArrayDyn<f64>>);

fn fit_out<'py>(py: Python<'py>, fit: &PoseFit) -> Fit<'py> {
    (
        convert::matrix_out(py, &fit.t_camera_target.to_matrix()),
        fit.rmse_px,
        convert::matrix_out(py, &fit.information),
    )
}

#[pyfunction]
fn planar_pose<'py>(
    py: Python<'py>,
    lens: &str,
    parameters: Array<'py>,
    points: Array<'py>,
    radii: Array<'py>,
    pixels: Array<'py>,
) -> PyResult<(Fit<'py>, Option<Fit<'py>>)> {
    let camera = camera(py, lens, &parameters)?;
    let features = features(py, &points, &radii)?;
    let pixels = convert::vectors::<2>(py, "pixels", &pixels)?;
    let pose = py.core(|| core_planar_pose(&camera, &features, &pixels))?.map_err(|e| to_python(py, e))?;
    Ok((fit_out(py, &pose.best), pose.mirrored.as_ref().map(|m| fit_out(py, m))))
}
