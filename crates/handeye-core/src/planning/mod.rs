//! Several views at once: a good choice of k, and a proof of how good it is.

mod certificate;
mod objective;
mod pool;
mod reweigh;
mod selection;

pub use certificate::{Certificate, certify};
pub use objective::Objective;
pub use selection::{Selection, select};

#[cfg(test)]
mod tests;
