//! Shah: both rotations as singular vectors of a sum of Kronecker products, then both translations.

use nalgebra::{DMatrix, Matrix3, SMatrix};

use super::estimate::Estimate;
use super::linear::null_vector;
use super::rotation_fit::rotation_of_either_sign;
use super::translation::robot_world_translations;
use crate::error::Error;
use crate::se3::Se3;

pub(super) const PAPER: &str = "M. Shah, \"Solving the robot-world/hand-eye calibration problem using the \
    Kronecker product\", Journal of Mechanisms and Robotics 5(3), 2013";

/// `X` and `Y` of `C = X A Y`, as `C W = X A` with `W = Y^-1`.
///
/// Rotation: with `K = sum R_A (x) R_C`, `vec(R_W)` and `vec(R_X)` (by columns) are proportional to the right
/// and left singular vector of the largest singular value, which is the number of views n if there is no
/// noise. The same pair is the null vector of the stacked rows `[R_A (x) R_C, -I]`, whose normal matrix is
/// `[n I, -K'; -K, n I]`; it is taken from there, for with small rotations the two largest singular values of
/// K differ by little and digits are lost. Scaled and made orthogonal; no signs of quaternions to worry
/// about. Translation: linear least squares.
pub(super) fn solve(a: &[Se3], c: &[Se3]) -> Result<Estimate, Error> {
    let mut matrix = DMatrix::zeros(9 * a.len(), 18);
    for (k, (a, c)) in a.iter().zip(c).enumerate() {
        let block: SMatrix<f64, 9, 9> = a.rotation.kronecker(&c.rotation);
        matrix.fixed_view_mut::<9, 9>(9 * k, 0).copy_from(&block);
        matrix.fixed_view_mut::<9, 9>(9 * k, 9).copy_from(&-SMatrix::<f64, 9, 9>::identity());
    }
    let null = null_vector(matrix, "the rotations of X and Y")?;
    let rotation = |first: usize| {
        rotation_of_either_sign(&Matrix3::from_column_slice(&null.as_slice()[first..first + 9]))
    };
    let (w, x) = (rotation(0)?, rotation(9)?);
    let (t_w, t_x) = robot_world_translations(a, c, &x)?;
    Ok(Estimate { x: Se3::new(x, t_x), y: Se3::new(w, t_w).inverse() })
}
