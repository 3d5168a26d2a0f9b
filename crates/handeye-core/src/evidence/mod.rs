//! Noise levels from the data, and the answer averaged over what they may be.
//!
//! Each view is compressed to the pose of the target in its image with that pose's information and its
//! dependence on the camera's parameters: a six-dimensional measurement. On these the restricted likelihood of a
//! noise level costs microseconds, so a whole grid of levels and sides is weighed and the answer is averaged
//! over it. Pixels are read once.




mod hypotheses;
mod joints;
mod links;
mod posterior;
mod smooth;


mod systems;
mod view_sets;
mod weigh;
mod weigh_links;

pub use crate::estimation::{ChainStart, PoseMeasurement as CompressedView, WeakPrior, compress, shrunk_variances, start_from_poses};

pub use hypotheses::{EXACT_OFFSET_RAD, Hypothesis, JointPrior, LevelPrior, LogNormal, Nature, SMOOTH_ODDS};
pub use joints::JointErrors;
pub use links::LinkErrors;
pub use posterior::{EvidenceOptions, Posterior, estimate};
pub use smooth::SmoothError;
pub use view_sets::{LinearisedView, NoiseLevel, SetFit, ViewSets};

#[cfg(test)]
mod tests;
