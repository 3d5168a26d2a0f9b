//! The one border where a core error becomes an exception of `handeye.errors`.

use handeye_core::error::Error;
use pyo3::prelude::*;

/// Name of the Python class and the word that scripts compare.
fn class_and_code(error: &Error) -> (&'static str, &'static str) {
    match error {
        Error::NotRigid { .. } => ("InputError", "not_rigid"),
        Error::InvalidInput { .. } => ("InputError", "invalid_input"),
        Error::TooFewViews { .. } => ("InputError", "too_few_views"),
        Error::Degenerate { .. } => ("DegenerateError", "degenerate"),
        Error::Numerical { .. } => ("SolveError", "not_solved"),
    }
}

/// The Python exception for a core error.
pub fn to_python(py: Python<'_>, error: Error) -> PyErr {
    let (class, code) = class_and_code(&error);
    raise(py, class, code, &error.to_string())
}

/// An `InputError` about an argument.
pub fn invalid(py: Python<'_>, message: &str) -> PyErr {
    raise(py, "InputError", "invalid_input", message)
}

fn raise(py: Python<'_>, class: &str, code: &str, message: &str) -> PyErr {
    let build = || -> PyResult<PyErr> {
        let arguments = pyo3::types::PyDict::new(py);
        arguments.set_item("code", code)?;
        let class = py.import("handeye.errors")?.getattr(class)?;
        Ok(PyErr::from_value(class.call((message,), Some(&arguments))?))
    };
    // Failing to build the exception (a broken installation) is itself the error to report.
    build().unwrap_or_else(|error| error)
}
