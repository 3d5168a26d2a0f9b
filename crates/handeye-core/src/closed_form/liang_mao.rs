//! Liang and Mao: the rotation as a null vector of Kronecker products, then translation.

use nalgebra::{DMatrix, Matrix3, SMatrix};

use super::linear::null_vector;
use super::motion::Motion;
use super::rotation_fit::rotation_of_either_sign;
use super::translation::hand_eye_translation;
use crate::error::Error;
use crate::se3::Se3;

pub(super) const PAPER: &str = "R.-h. Liang and J.-f. Mao, \"Hand-eye calibration with a new linear \
    decomposition algorithm\", Journal of Zhejiang University SCIENCE A 9(10), 2008";

/// `Z` of `hand Z = Z eye`.
///
/// Rotation: `R_hand R = R R_eye` is linear in the nine entries of `R`, `(R_hand (x) I - I (x) R_eye') vec(R)
/// = 0` (by rows); the null vector of all motions is `R` up to a scale of either sign, which the determinant
/// gives, then made orthogonal. Translation: linear least squares.
pub(super) fn solve(motions: &[Motion]) -> Result<Se3, Error> {
    let mut matrix = DMatrix::zeros(9 * motions.len(), 9);
    let unit = Matrix3::identity();
    for (k, m) in motions.iter().enumerate() {
        let block: SMatrix<f64, 9, 9> =
            m.hand.rotation.kronecker(&unit) - unit.kronecker(&m.eye.rotation.transpose());
        matrix.fixed_view_mut::<9, 9>(9 * k, 0).copy_from(&block);
    }
    let null = null_vector(matrix, "the rotation between hand and eye")?;
    let rotation = rotation_of_either_sign(&Matrix3::from_row_slice(null.as_slice()))?;
    Ok(Se3::new(rotation, hand_eye_translation(motions, &rotation)?))
}
