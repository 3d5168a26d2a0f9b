//! Andreff, Horaud and Espiau: the rotation as a linear null space through Kronecker products, then
//! translation.

use nalgebra::{DMatrix, Matrix3, SMatrix};

use super::linear::null_vector;
use super::motion::Motion;
use super::rotation_fit::rotation_of_either_sign;
use super::translation::hand_eye_translation;
use crate::error::Error;
use crate::se3::Se3;

pub(super) const PAPER: &str = "N. Andreff, R. Horaud and B. Espiau, \"On-line hand-eye calibration\", \
    International Conference on 3-D Digital Imaging and Modeling (3DIM), 1999";

/// `Z` of `hand Z = Z eye`.
///
/// Rotation: `(I - R_hand (x) R_eye) vec(R_Z) = 0` (first rows of eq. 10, `vec` by rows), whose null space
/// has one dimension if there are two rotation axes; scaled and made orthogonal by eq. 15. Translation: the
/// remaining rows of eq. 10 with that rotation. Solving both halves of eq. 10 at once, as is often done,
/// makes the answer depend on the unit of length and takes the scale of `R_Z` from the translations.
pub(super) fn solve(motions: &[Motion]) -> Result<Se3, Error> {
    let mut matrix = DMatrix::zeros(9 * motions.len(), 9);
    for (k, m) in motions.iter().enumerate() {
        let block = SMatrix::<f64, 9, 9>::identity() - m.hand.rotation.kronecker(&m.eye.rotation);
        matrix.fixed_view_mut::<9, 9>(9 * k, 0).copy_from(&block);
    }
    let null = null_vector(matrix, "the rotation between hand and eye")?;
    let rotation = rotation_of_either_sign(&Matrix3::from_row_slice(null.as_slice()))?;
    Ok(Se3::new(rotation, hand_eye_translation(motions, &rotation)?))
}
