//! Fisher information, entropy, and what a candidate view would add.
//!
//! A candidate's information has rank `6 + n_c` and is kept as a factor `F` with `I = F F'`, so that gains are
//! small determinants: `1/2 ln |Lambda + F F'| - 1/2 ln |Lambda| = 1/2 ln |I + F' Lambda^-1 F|`.

mod belief;
mod candidate;
pub mod criteria;
mod gains;
mod scorer;

pub use belief::{Belief, entropy};
pub(crate) use candidate::semidefinite_root;
pub use candidate::{
    ArmColumns, Candidate, CandidateJoints, CandidateModel, Execution, Motions, RobotError, Visibility,
};
