//! The one way from Python into the core: without the interpreter's lock, panics as ordinary exceptions, Ctrl-C heard.

use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use handeye_core::interrupt::{Interrupted, asking};
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;

/// How often a long calculation looks whether it was interrupted.
const PAUSE: Duration = Duration::from_millis(50);

thread_local! {
    static LOOKED: Cell<Option<Instant>> = const { Cell::new(None) };
    static RAISED: RefCell<Option<PyErr>> = const { RefCell::new(None) };
}

pub trait CallCore {
    /// What a calculation of the core returns.
    ///
    /// # Errors
    /// What a signal raised, such as `KeyboardInterrupt`; `RuntimeError` where the core panics, a mistake of ours.
    fn core<T: Send>(self, calculation: impl FnOnce() -> T + Send) -> PyResult<T>;
}

impl CallCore for Python<'_> {
    fn core<T: Send>(self, calculation: impl FnOnce() -> T + Send) -> PyResult<T> {
        LOOKED.set(Some(Instant::now()));
        // Nothing that the calculation may have left half done is looked at again.
        let outcome = self.detach(|| catch_unwind(AssertUnwindSafe(|| asking(is_interrupted, calculation))));
        outcome.map_err(|payload| {
            if payload.is::<Interrupted>() {
                return RAISED.take().unwrap_or_else(|| PyKeyboardInterrupt::new_err(()));
            }
            let text = payload
                .downcast_ref::<String>()
                .map(String::as_str)
                .or_else(|| payload.downcast_ref::<&str>().copied())
                .unwrap_or("no message");
            PyRuntimeError::new_err(format!("the core failed: {text}"))
        })
    }
}

fn is_interrupted() -> bool {
    if LOOKED.get().is_some_and(|last| last.elapsed() < PAUSE) {
        return false;
    }
    LOOKED.set(Some(Instant::now()));
    Python::attach(|py| match py.check_signals() {
        Ok(()) => false,
        Err(raised) => {
            RAISED.replace(Some(raised));
            true
        }
    })
}

/// Fails as a mistake in the core would: how that reaches its callers can be tried.
#[pyfunction]
fn panic(py: Python<'_>, message: String) -> PyResult<()> {
    py.core(|| std::panic::panic_any(message))
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(panic, module)?)
}
