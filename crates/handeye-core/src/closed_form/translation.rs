//! Translations when the rotations are known, one linear least-squares problem per family.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::linear::least_squares;
use super::motion::Motion;
use crate::error::Error;
use crate::se3::Se3;

/// `t_Z` from `(R_hand - I) t_Z = R_Z t_eye - t_hand` over all motions (Tsai and Lenz 1989, eq. 15).
pub(super) fn hand_eye_translation(motions: &[Motion], z: &Matrix3<f64>) -> Result<Vector3<f64>, Error> {
    let mut matrix = DMatrix::zeros(3 * motions.len(), 3);
    let mut rhs = DVector::zeros(3 * motions.len());
    for (k, m) in motions.iter().enumerate() {
        matrix.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(&(m.hand.rotation - Matrix3::identity()));
        rhs.fixed_rows_mut::<3>(3 * k).copy_from(&(z * m.eye.translation - m.hand.translation));
    }
    let t = least_squares(matrix, rhs, "the translation between hand and eye")?;
    Ok(t.fixed_rows::<3>(0).into_owned())
}

/// `t_W` and `t_X` from `t_X - R_C t_W = t_C - R_X t_A` over all views, where `W = Y^-1`: the translation
/// part of `C W = X A`, solved alike by Zhuang et al. 1994, Dornaika and Horaud 1998 and Shah 2013.
///
/// Returns `(t_W, t_X)`.
pub(super) fn robot_world_translations(
    a: &[Se3],
    c: &[Se3],
    x: &Matrix3<f64>,
) -> Result<(Vector3<f64>, Vector3<f64>), Error> {
    let mut matrix = DMatrix::zeros(3 * a.len(), 6);
    let mut rhs = DVector::zeros(3 * a.len());
    for (k, (a, c)) in a.iter().zip(c).enumerate() {
        matrix.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(&-c.rotation);
        matrix.fixed_view_mut::<3, 3>(3 * k, 3).copy_from(&Matrix3::identity());
        rhs.fixed_rows_mut::<3>(3 * k).copy_from(&(c.translation - x * a.translation));
    }
    let t = least_squares(matrix, rhs, "the translations of X and Y")?;
    Ok((t.fixed_rows::<3>(0).into_owned(), t.fixed_rows::<3>(3).into_owned()))
}
