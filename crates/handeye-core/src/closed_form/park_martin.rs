//! Park and Martin: rotation vectors on the Lie algebra, then translation.

use nalgebra::Matrix3;

use super::motion::Motion;
use super::rotation_fit::rotation_from_correlation;
use super::translation::hand_eye_translation;
use crate::error::Error;
use crate::se3::{Se3, so3_log};

pub(super) const PAPER: &str = "F. C. Park and B. J. Martin, \"Robot sensor calibration: solving AX = XB on \
    the Euclidean group\", IEEE Transactions on Robotics and Automation 10(5), 1994";

/// `Z` of `hand Z = Z eye`.
///
/// Rotation: with the rotation vectors `alpha` of the hand and `beta` of the eye, `M = sum beta alpha'` and
/// `R = (M' M)^(-1/2) M'`, which minimises `sum |alpha - R beta|^2` (the paper's least-squares solution). The
/// inverse root is taken from the singular values with the sign that keeps `R` a rotation; as the paper
/// writes it, noise in the third singular value (three views turned by little) makes `R` a reflection.
/// Translation: linear least squares.
pub(super) fn solve(motions: &[Motion]) -> Result<Se3, Error> {
    let correlation: Matrix3<f64> =
        motions.iter().map(|m| so3_log(&m.hand.rotation) * so3_log(&m.eye.rotation).transpose()).sum();
    let rotation = rotation_from_correlation(&correlation)?;
    Ok(Se3::new(rotation, hand_eye_translation(motions, &rotation)?))
}
