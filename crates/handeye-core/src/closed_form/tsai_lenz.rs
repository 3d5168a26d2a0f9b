//! Tsai and Lenz: axis vectors, then translation.

use nalgebra::{DMatrix, DVector, Vector4};

use super::linear::{least_squares, singular_of_stack};
use super::motion::Motion;
use super::quaternion::{conjugate, half_turns, multiply, to_rotation, vector_part};
use super::translation::hand_eye_translation;
use crate::error::Error;
use crate::se3::{Se3, hat};

pub(super) const PAPER: &str = "R. Y. Tsai and R. K. Lenz, \"A new technique for fully autonomous and \
    efficient 3D robotics hand/eye calibration\", IEEE Transactions on Robotics and Automation 5(3), 1989";

/// A frame other than the paper's own must have this many times its smallest singular value to be preferred.
const CLEARLY_BETTER: f64 = 2.0;

/// `Z` of `hand Z = Z eye`.
///
/// Rotation: `hat(p_hand + p_eye) g = p_eye - p_hand` (eq. 12) for `g = tan(angle / 2) axis` of `Z`, which
/// eq. 14 turns into `Z`. `g` is infinite where `Z` is half a turn, a usual way to mount a camera. So the
/// camera frame is turned by half a turn about one of its axes wherever that makes the equations clearly
/// better conditioned, and the answer is turned back. Translation: eq. 15.
///
/// The paper advises large rotations between views; motions enter weighted by their rotation, so small ones
/// need not be dropped.
pub(super) fn solve(motions: &[Motion]) -> Result<Se3, Error> {
    let mut best: Option<(f64, Vector4<f64>)> = None;
    for turn in half_turns() {
        let (matrix, _) = equations(motions, &turn);
        let smallest = singular_of_stack(matrix)?.values[2];
        if best.is_none_or(|(other, _)| smallest > CLEARLY_BETTER * other) {
            best = Some((smallest, turn));
        }
    }
    let turn = best.map_or_else(Vector4::x, |(_, turn)| turn);
    let (matrix, rhs) = equations(motions, &turn);
    let g = least_squares(matrix, rhs, "the rotation between hand and eye")?;
    // `g` is the vector part over the scalar part (eq. 14); `Z turn^-1` was solved for.
    let turned = Vector4::new(1.0, g[0], g[1], g[2]).normalize();
    let rotation = to_rotation(&multiply(&turned, &turn));
    Ok(Se3::new(rotation, hand_eye_translation(motions, &rotation)?))
}

/// Eq. 12 stacked over the motions, the eye's axes turned by `turn`.
fn equations(motions: &[Motion], turn: &Vector4<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let mut matrix = DMatrix::zeros(3 * motions.len(), 3);
    let mut rhs = DVector::zeros(3 * motions.len());
    for (k, m) in motions.iter().enumerate() {
        let hand = m.hand_axis();
        let eye = vector_part(&multiply(&multiply(turn, &m.eye_quaternion), &conjugate(turn))) * 2.0;
        matrix.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(&hat(&(hand + eye)));
        rhs.fixed_rows_mut::<3>(3 * k).copy_from(&(eye - hand));
    }
    (matrix, rhs)
}
