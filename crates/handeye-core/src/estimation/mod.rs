//! Everything that is wrong in a cell at once: one linear mixed model, its levels found and integrated out.
//!
//! A [`Cell`] is stations (stops of the arm), cameras and targets. Each detection is a [`PoseMeasurement`]: the pose of
//! a target in a camera with its covariance and its dependence on the camera's parameters; pixels are read once. Around
//! a guess of all unknowns the twist between chain and measurement is linear in what is constant (poses, camera, joint
//! offsets, links, board: parameters with a prior) and in what is new at every station (noise). Each [`Component`] of
//! the error is one file; how large it is, its level, is found by restricted likelihood, and the answer is averaged over
//! what the levels may be.
//!
//! Sources: Patterson and Thompson 1971 and Harville 1977 (restricted likelihood), Gilmour, Thompson and Cullis 1995
//! (average information), Rue, Martino and Chopin 2009 (nested Laplace), Huber 1967 and White 1980 (sandwich).

mod acts;
mod agreement;
mod assembly;
mod cell;
mod cell_start;
mod chain_information;
mod component;
mod components;
mod degrees_of_freedom;
mod densities;
mod descent;
mod explained;
mod levels;
mod linearisation;
mod mixed;
mod nodes;
mod normal_equations;
mod pixel_field;
mod pixel_rows;
mod pose_measurement;
mod posterior;
mod products;
mod recurring;
mod reduction;
mod sandwich;
mod slopes;
mod start;
mod station_covariances;
mod systems;
mod twists;
mod weak_prior;

#[cfg(test)]
mod statistics_tests;
#[cfg(test)]
mod tests;

pub use agreement::{Agreement, SetFit};
pub use cell::{Body, CameraPrior, Cell, Measurement, SeenBy, Station, Tip, Touch, TouchPoint};
pub use cell_start::{CellStart, start_of_cell};
pub use chain_information::chain_information;
pub use components::Assumptions;
pub use densities::log_densities;
pub use levels::{Level, LevelPrior};
pub use pixel_field::{SlowResiduals, shared_error};
pub use pose_measurement::{PoseMeasurement, compress, relative_weights, shrunk_variances};
pub use posterior::{Attribution, Node, Options, Posterior, estimate};
pub use start::{ChainStart, start_from_poses};
pub use weak_prior::WeakPrior;
