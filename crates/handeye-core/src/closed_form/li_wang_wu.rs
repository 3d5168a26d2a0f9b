//! Li, Wang and Wu: everything in one linear system through Kronecker products.

use nalgebra::{DMatrix, DVector, Matrix3, SMatrix};

use super::estimate::Estimate;
use super::linear::least_squares;
use super::rotation_fit::rotation_of_unit_scale;
use super::translation::robot_world_translations;
use crate::error::Error;
use crate::se3::Se3;

pub(super) const PAPER: &str = "A. Li, L. Wang and D. Wu, \"Simultaneous robot-world and hand-eye \
    calibration using dual-quaternions and Kronecker product\", International Journal of the Physical \
    Sciences 5(10), 2010";

/// `X` and `Y` of `C = X A Y`, as `C W = X A` with `W = Y^-1`.
///
/// Eq. 19: twelve rows per view for `vec(R_W)`, `vec(R_X)` (by rows), `t_W` and `t_X`; the two rotations are
/// then made orthogonal. Their scale comes from the translations alone, so views that only turn about the
/// camera's centre are refused. The translations are solved for again once the rotations are orthogonal: those
/// of the linear system belong to the matrices before, and are worse.
pub(super) fn solve(a: &[Se3], c: &[Se3]) -> Result<Estimate, Error> {
    let mut matrix = DMatrix::zeros(12 * a.len(), 24);
    let mut rhs = DVector::zeros(12 * a.len());
    let eye = Matrix3::identity();
    for (k, (a, c)) in a.iter().zip(c).enumerate() {
        let (rotation_row, translation_row) = (12 * k, 12 * k + 9);
        let from_w: SMatrix<f64, 9, 9> = c.rotation.kronecker(&eye);
        let from_x: SMatrix<f64, 9, 9> = eye.kronecker(&a.rotation.transpose());
        let moved: SMatrix<f64, 3, 9> = eye.kronecker(&a.translation.transpose());
        matrix.fixed_view_mut::<9, 9>(rotation_row, 0).copy_from(&from_w);
        matrix.fixed_view_mut::<9, 9>(rotation_row, 9).copy_from(&-from_x);
        matrix.fixed_view_mut::<3, 9>(translation_row, 9).copy_from(&moved);
        matrix.fixed_view_mut::<3, 3>(translation_row, 18).copy_from(&-c.rotation);
        matrix.fixed_view_mut::<3, 3>(translation_row, 21).copy_from(&eye);
        rhs.fixed_rows_mut::<3>(translation_row).copy_from(&c.translation);
    }
    let solution = least_squares(matrix, rhs, "the rotations and translations of X and Y at once")?;
    let rotation = |first: usize| {
        rotation_of_unit_scale(&Matrix3::from_row_slice(&solution.as_slice()[first..first + 9]))
    };
    let (w, x) = (rotation(0)?, rotation(9)?);
    let (t_w, t_x) = robot_world_translations(a, c, &x)?;
    Ok(Estimate { x: Se3::new(x, t_x), y: Se3::new(w, t_w).inverse() })
}
