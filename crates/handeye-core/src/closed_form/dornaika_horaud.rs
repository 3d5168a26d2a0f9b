//! Dornaika and Horaud: both unit quaternions at once, then both translations (the closed-form one of their
//! methods).

use nalgebra::DMatrix;

use super::estimate::Estimate;
use super::linear::null_vector;
use super::motion::consistent_signs;
use super::quaternion::{left, right, to_rotation};
use super::translation::robot_world_translations;
use crate::error::Error;
use crate::se3::Se3;

pub(super) const PAPER: &str = "F. Dornaika and R. Horaud, \"Simultaneous robot-world and hand-eye \
    calibration\", IEEE Transactions on Robotics and Automation 14(4), 1998";

/// What is said when quaternion signs cannot be told.
pub(super) const NO_SIGNS: &str = "the views fall into groups that are half a turn (within 2.9 deg) apart, \
    and the quaternions of one group could as well have the opposite sign: add views in between";

/// `X` and `Y` of `C = X A Y`, as `C W = X A` with `W = Y^-1`.
///
/// Rotation: over unit quaternions, `sum |Q(q_C) w - W(q_A) x|^2` is smallest where `w' (sum Q(q_C)' W(q_A))
/// x` is largest: the first pair of singular vectors of that 4 x 4 sum. The same pair is the null vector of
/// the stacked rows `[Q(q_C), -W(q_A)]` and is taken from there, for with small rotations the two largest
/// singular values of the sum differ by little and digits are lost. The paper assumes that the quaternions
/// come with signs that fit; here they are made to. Translation: linear least squares.
pub(super) fn solve(a: &[Se3], c: &[Se3]) -> Result<Estimate, Error> {
    let (q_a, q_c) = consistent_signs(a, c).ok_or_else(|| Error::degenerate(NO_SIGNS))?;
    let mut matrix = DMatrix::zeros(4 * a.len(), 8);
    for (k, (a, c)) in q_a.iter().zip(&q_c).enumerate() {
        matrix.fixed_view_mut::<4, 4>(4 * k, 0).copy_from(&left(c));
        matrix.fixed_view_mut::<4, 4>(4 * k, 4).copy_from(&-right(a));
    }
    let null = null_vector(matrix, "the rotations of X and Y")?;
    let w = to_rotation(&null.fixed_rows::<4>(0).into_owned());
    let x = to_rotation(&null.fixed_rows::<4>(4).into_owned());
    let (t_w, t_x) = robot_world_translations(a, c, &x)?;
    Ok(Estimate { x: Se3::new(x, t_x), y: Se3::new(w, t_w).inverse() })
}
