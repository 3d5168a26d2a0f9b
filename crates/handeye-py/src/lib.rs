//! The extension module `handeye._core`: extract, release the interpreter lock, call the core, wrap.
//!
//! Nothing is decided here. Each file registers its own functions.

use pyo3::prelude::*;

mod camera;
mod closed_form;
mod convert;
mod errors;
mod geometry;
mod information;
mod model;
mod planar_pose;
mod problem;

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    camera::register(module)?;
    closed_form::register(module)?;
    geometry::register(module)?;
    planar_pose::register(module)?;
    problem::register(module)?;
    model::register(module)?;
    information::register(module)?;
    Ok(())
}
