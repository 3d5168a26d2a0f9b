//! Maximum likelihood on reprojection error over the chain `X A_k Y`, robot and camera taken as exact.
//!
//! Unknowns are `X` and `Y`, twelve parameters; a prior may say where they are. Twists perturb on the left:
//! `X <- exp(xi_x) X`. [`view_block`] gives the quadratic of a view in its pose.

mod accumulate;
mod batched;
mod engine;
mod marginal;
mod model;
mod options;
mod pixel_parameters;
mod problem;
mod report;
mod side;
mod solver;
mod view_by_view;

pub(crate) use accumulate::Moments;
pub use accumulate::{PixelColumns, ViewBlock, view_block};
pub(crate) use batched::through_chain;
pub(crate) use marginal::marginalised;
pub use model::{ChainPrior, Model};
pub use options::{Options, Start};
pub use pixel_parameters::PixelParameters;
pub use problem::{MIN_VIEWS, Problem};
pub use report::{Ending, Solution};
pub use side::Side;
pub use solver::solve;

#[cfg(test)]
pub(crate) mod tests;
