//! Serial arms: where the flange is at given joint positions, how it moves with them, and which positions reach a pose.
//!
//! A chain is placements and axes: `T_base_flange(q) = P_1 M_1(q_1) P_2 M_2(q_2) ... P_n M_n(q_n) T_tip`, where `P_i` is
//! the pose of joint `i` in the link before it and `M_i` turns about or slides along its axis. Inside, every frame is
//! turned so that its axis is `z`: what remains between two joints is constant, and a joint costs four products.

mod batch;
mod chain;
mod clearance;
mod forward;
mod inverse;
#[cfg(test)]
mod tests;

pub use batch::Frame;
pub use chain::{Chain, Joint, JointKind, MAX_JOINTS};
pub use clearance::{CapsulePair, least_gaps};
pub use forward::Columns;
pub use inverse::{InverseOptions, Reach, Unreached};
