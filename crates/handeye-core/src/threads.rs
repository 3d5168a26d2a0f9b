//! How many threads there are for work that can be shared.

use std::sync::LazyLock;

/// The system is asked once: it takes a tenth of a millisecond.
static AVAILABLE: LazyLock<usize> =
    LazyLock::new(|| std::thread::available_parallelism().map_or(1, usize::from));

/// Threads that the system lets run at once; at least one.
pub(crate) fn available() -> usize {
    *AVAILABLE
}
