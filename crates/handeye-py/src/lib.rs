//! The extension module `handeye._core`: extract, release the interpreter lock, call the core, wrap.
//!
//! Nothing is decided here. Each file registers its own functions.

#![allow(clippy::needless_pass_by_value, reason = "what Python calls takes its arguments by value")]

use pyo3::prelude::*;

mod agreement;
mod alignment;
mod call;
mod camera;
mod closed_form;
mod convert;
mod errors;
mod estimation;
mod geometry;
mod imaging;
mod information;
mod kinematics;
mod model;
mod observability;
mod planar_pose;
mod planning;
mod posterior;
mod problem;

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    agreement::register(module)?;
    call::register(module)?;
    alignment::register(module)?;
    camera::register(module)?;
    closed_form::register(module)?;
    estimation::register(module)?;
    posterior::register(module)?;
    geometry::register(module)?;
    kinematics::register(module)?;
    imaging::register(module)?;
    planar_pose::register(module)?;
    planning::register(module)?;
    problem::register(module)?;
    model::register(module)?;
    observability::register(module)?;
    information::register(module)?;
    Ok(())
}
