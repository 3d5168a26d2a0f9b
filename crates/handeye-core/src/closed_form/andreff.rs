//! Andreff, Horaud and Espiau: rotation and translation in one linear system through Kronecker products.

use nalgebra::{DMatrix, DVector, Matrix3, SMatrix};

use super::linear::least_squares;
use super::motion::Motion;
use super::rotation_fit::rotation_of_unit_scale;
use super::translation::hand_eye_translation;
use crate::error::Error;
use crate::se3::Se3;

pub(super) const PAPER: &str = "N. Andreff, R. Horaud and B. Espiau, \"On-line hand-eye calibration\", \
    International Conference on 3-D Digital Imaging and Modeling (3DIM), 1999";

/// `Z` of `hand Z = Z eye`.
///
/// Eq. 10: twelve rows per motion for `vec(R_Z)` (by rows) and `t_Z`; the rotation is then made orthogonal.
/// What the translations say about the rotation is used, which makes this more accurate than rotation first
/// where motions are small; the price is that the answer depends on the unit of length (here metres, as for
/// others) and that the scale of `R_Z` comes from the hand's translations alone. The translation is solved
/// for again (the last rows of eq. 10) once the rotation is orthogonal: that of the linear system belongs to
/// the matrix before, and is worse.
pub(super) fn solve(motions: &[Motion]) -> Result<Se3, Error> {
    let mut matrix = DMatrix::zeros(12 * motions.len(), 12);
    let mut rhs = DVector::zeros(12 * motions.len());
    let unit = Matrix3::identity();
    for (k, m) in motions.iter().enumerate() {
        let (rotation_row, translation_row) = (12 * k, 12 * k + 9);
        let turned: SMatrix<f64, 9, 9> = m.hand.rotation.kronecker(&m.eye.rotation);
        let moved: SMatrix<f64, 3, 9> = unit.kronecker(&m.eye.translation.transpose());
        matrix
            .fixed_view_mut::<9, 9>(rotation_row, 0)
            .copy_from(&(SMatrix::<f64, 9, 9>::identity() - turned));
        matrix.fixed_view_mut::<3, 9>(translation_row, 0).copy_from(&moved);
        matrix.fixed_view_mut::<3, 3>(translation_row, 9).copy_from(&(unit - m.hand.rotation));
        rhs.fixed_rows_mut::<3>(translation_row).copy_from(&m.hand.translation);
    }
    let solution = least_squares(matrix, rhs, "the rotation and translation between hand and eye at once")?;
    let rotation = rotation_of_unit_scale(&Matrix3::from_row_slice(&solution.as_slice()[..9]))?;
    Ok(Se3::new(rotation, hand_eye_translation(motions, &rotation)?))
}
