//! What every closed form returns.

use crate::se3::Se3;

/// What a method returns: `C[k] ~ x A[k] y`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// `X`: `T_camera_flange` (eye-in-hand) or `T_camera_base` (eye-to-hand).
    pub x: Se3,
    /// `Y`: `T_base_target` (eye-in-hand) or `T_flange_target` (eye-to-hand).
    pub y: Se3,
}
