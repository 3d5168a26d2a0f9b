//! Maximum likelihood on reprojection error over the chain `X A_k Y`.
//!
//! Unknowns: `X` and `Y` (twelve parameters), and as the model says: free camera parameters and the board
//! scale with a prior, further parameters of the robot's kinematics with a prior, and one pose correction
//! per view that is marginalised exactly. Twists perturb on the left: `X <- exp(xi_x) X`.

mod accumulate;
mod batched;
mod engine;
mod general;
mod loss;
mod marginal;
mod model;
mod problem;
mod report;
mod solver;

pub(crate) use accumulate::Moments;
pub use accumulate::{PixelColumns, ViewBlock, view_block};
pub(crate) use batched::through_chain;
pub use loss::Loss;
pub(crate) use marginal::marginalised;
pub use model::{ChainPrior, KinematicParameters, Model, PixelParameters, RobotNoise, Side};
pub use problem::{MIN_VIEWS, Problem};
pub use report::{Ending, Solution, ViewReport};
pub use solver::{Method, Options, Start, solve};

#[cfg(test)]
pub(crate) mod tests;
