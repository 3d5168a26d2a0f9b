//! Horaud and Dornaika: unit quaternions, then translation (the closed-form one of their two methods).

use nalgebra::DMatrix;

use super::linear::null_vector;
use super::motion::Motion;
use super::quaternion::{left, right, to_rotation};
use super::translation::hand_eye_translation;
use crate::error::Error;
use crate::se3::Se3;

pub(super) const PAPER: &str = "R. Horaud and F. Dornaika, \"Hand-eye calibration\", International Journal \
    of Robotics Research 14(3), 1995";

/// `Z` of `hand Z = Z eye`.
///
/// Rotation: the unit quaternion that minimises `sum |Q(q_hand) z - W(q_eye) z|^2`, the eigenvector of the
/// smallest eigenvalue of `sum (Q - W)' (Q - W)` (section on the closed-form solution; Q and W: appendix A),
/// taken as the null vector of the stacked rows `Q - W`. The paper writes it for the unit rotation axes; with
/// the quaternions of the motions, both with non-negative real part, each axis is weighted by `sin(angle /
/// 2)`, so that small rotations, whose axes are vague, count little. Translation: linear least squares.
pub(super) fn solve(motions: &[Motion]) -> Result<Se3, Error> {
    let mut matrix = DMatrix::zeros(4 * motions.len(), 4);
    for (k, m) in motions.iter().enumerate() {
        let block = left(&m.hand_quaternion) - right(&m.eye_quaternion);
        matrix.fixed_view_mut::<4, 4>(4 * k, 0).copy_from(&block);
    }
    let null = null_vector(matrix, "the rotation between hand and eye")?;
    let rotation = to_rotation(&null.fixed_rows::<4>(0).into_owned());
    Ok(Se3::new(rotation, hand_eye_translation(motions, &rotation)?))
}
