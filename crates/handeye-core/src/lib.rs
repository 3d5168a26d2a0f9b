//! The mathematics of `handeye`: geometry, solving, information and planning for hand-eye calibration.
//!
//! No Python, no files, no clock, no global randomness. Transforms are `T_to_from`; lengths are metres,
//! angles radians, pixels have their centres at integer coordinates.

mod batched_algebra;
pub mod camera;
pub mod closed_form;
pub mod error;
pub mod estimation;
pub mod imaging;
pub mod information;
pub mod interrupt;
pub mod kinematics;
pub mod least_squares;
pub mod planar_pose;
pub mod planning;
pub mod pose;
mod positive;
pub mod se3;
pub mod simd;
pub mod testing;
mod threads;
