//! `Y` when `X` is known: the mean of what each view says.

use nalgebra::{Matrix3, Vector3};

use super::rotation_fit::rotation_from_correlation;
use crate::error::Error;
use crate::se3::Se3;

/// The mean of `Y[k] = A[k]^-1 X^-1 C[k]`.
///
/// Rotation: the chordal mean, nearest to all in the Frobenius norm (Hartley, Trumpf, Dai and Li 2013).
/// Translation: the arithmetic mean, which is also the least-squares solution of `t_C = R_X (R_A t_Y + t_A) +
/// t_X`.
///
/// # Errors
/// [`Error::Degenerate`] if the views contradict each other so much that no mean rotation exists.
pub(super) fn remaining_transform(x: &Se3, a: &[Se3], c: &[Se3]) -> Result<Se3, Error> {
    let x_inverse = x.inverse();
    let mut rotation = Matrix3::zeros();
    let mut translation = Vector3::zeros();
    for (a, c) in a.iter().zip(c) {
        let y = a.inverse() * x_inverse * *c;
        rotation += y.rotation;
        translation += y.translation;
    }
    Ok(Se3::new(rotation_from_correlation(&rotation)?, translation / a.len() as f64))
}
