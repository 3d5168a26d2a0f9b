//! Shiu and Ahmad: one angle per motion is free, and two motions fix both.

use nalgebra::{DMatrix, DVector, Matrix3, SVector, Vector3};

use super::linear::least_squares;
use super::motion::Motion;
use super::rotation_fit::rotation_from_correlation;
use super::screw::screw_pairs;
use super::translation::hand_eye_translation;
use crate::error::Error;
use crate::se3::{Se3, hat, so3_exp};

pub(super) const PAPER: &str = "Y. C. Shiu and S. Ahmad, \"Calibration of wrist-mounted robotic sensors by \
    solving homogeneous transform equations of the form AX = XB\", IEEE Transactions on Robotics and \
    Automation 5(1), 1989";

/// `Z` of `hand Z = Z eye`.
///
/// A motion fixes the rotation up to an angle about its axis, `R = Rot(k_hand, beta) R_p` with any `R_p` that
/// carries the axis of the eye to that of the hand. In `cos(beta)` and `sin(beta)` this is linear, and two
/// motions, each with two unknowns, give nine equations for four. The paper's system grows by two unknowns
/// with each motion; here `R` is kept as nine unknowns and the two of each motion are eliminated, which is
/// the same least-squares problem with a size that does not grow, then made orthogonal. Each motion is weighted by
/// `2 sin(angle / 2)`, as well as its axis is known. Translation: linear least squares.
pub(super) fn solve(motions: &[Motion]) -> Result<Se3, Error> {
    let pairs = screw_pairs(motions);
    let mut matrix = DMatrix::zeros(9 * pairs.len(), 9);
    let mut rhs = DVector::zeros(9 * pairs.len());
    for (k, pair) in pairs.iter().enumerate() {
        let axis = pair.hand.direction;
        let particular = rotation_between(&pair.eye.direction, &axis);
        let along = axis * axis.transpose();
        // R = along R_p + cos(beta) (I - along) R_p + sin(beta) hat(axis) R_p: the free part is spanned by two
        // orthogonal matrices of length sqrt(2).
        let flat = |m: Matrix3<f64>| SVector::<f64, 9>::from_column_slice((m * particular).as_slice());
        let fixed = flat(along);
        let (cosine, sine) = (flat(Matrix3::identity() - along), flat(hat(&axis)));
        let across = (nalgebra::SMatrix::<f64, 9, 9>::identity()
            - (cosine * cosine.transpose() + sine * sine.transpose()) * 0.5)
            * pair.weight;
        matrix.fixed_view_mut::<9, 9>(9 * k, 0).copy_from(&across);
        rhs.fixed_rows_mut::<9>(9 * k).copy_from(&(across * fixed));
    }
    let solution = least_squares(matrix, rhs, "the rotation between hand and eye")?;
    let rotation = rotation_from_correlation(&Matrix3::from_column_slice(solution.as_slice()))?;
    Ok(Se3::new(rotation, hand_eye_translation(motions, &rotation)?))
}

/// A rotation with `R from = to`: about the common normal, or half a turn about any normal where the two are
/// opposite.
fn rotation_between(from: &Vector3<f64>, to: &Vector3<f64>) -> Matrix3<f64> {
    let middle = from + to;
    if middle.norm() < 1e-6 {
        let normal = from.cross(&Vector3::ith(from.iamin(), 1.0)).normalize();
        let first = so3_exp(&(normal * std::f64::consts::PI));
        return rotation_between(&(first * from), to) * first;
    }
    // Half a turn about the middle carries one to the other.
    let m = middle.normalize();
    m * m.transpose() * 2.0 - Matrix3::identity()
}
