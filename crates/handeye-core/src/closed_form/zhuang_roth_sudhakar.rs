//! Zhuang, Roth and Sudhakar: a linear system in both quaternions, then both translations.

use nalgebra::{DMatrix, DVector, Matrix3, Vector4};

use super::dornaika_horaud::NO_SIGNS;
use super::estimate::Estimate;
use super::linear::{least_squares, singular_of_stack};
use super::motion::consistent_signs;
use super::quaternion::{conjugate, half_turns, multiply, to_rotation, vector_part};
use super::translation::robot_world_translations;
use crate::error::Error;
use crate::se3::{Se3, hat};

pub(super) const PAPER: &str = "H. Zhuang, Z. S. Roth and R. Sudhakar, \"Simultaneous robot/world and \
    tool/flange calibration by solving homogeneous transformation equations of the form AX = YB\", IEEE \
    Transactions on Robotics and Automation 10(4), 1994";

/// A frame other than the paper's own must have this many times its smallest singular value to be preferred.
const CLEARLY_BETTER: f64 = 2.0;

/// `X` and `Y` of `C = X A Y`, as the paper's `A X = Y B`: `C W = X A` with `W = Y^-1`.
///
/// With quaternions `c w = x a`, each split into real and vector part, the real part of `w` is eliminated
/// through the real equation and all is divided by the real part of `x`: three linear equations per view for
/// the six unknowns `w_vec / x_0` and `x_vec / x_0`. The paper divides by the real part of each `c`; here the
/// equations are multiplied by it instead, so that a view turned by half a turn loses weight rather than
/// dividing by zero. Where `x` itself is near half a turn (a usual way to mount a camera) or all views are,
/// the camera or target frame is turned by half a turn about one of its axes and the answer turned back.
/// Translation: linear least squares.
pub(super) fn solve(a: &[Se3], c: &[Se3]) -> Result<Estimate, Error> {
    let (q_a, q_c) = consistent_signs(a, c).ok_or_else(|| Error::degenerate(NO_SIGNS))?;
    let turned = |camera: &Vector4<f64>, target: &Vector4<f64>| -> Vec<Vector4<f64>> {
        q_c.iter().map(|q| multiply(&multiply(camera, q), target)).collect()
    };
    let mut best: Option<(f64, Vector4<f64>, Vector4<f64>)> = None;
    for (camera, target) in half_turns().into_iter().flat_map(|p| half_turns().map(|q| (p, q))) {
        let (matrix, _) = equations(&turned(&camera, &target), &q_a);
        let smallest = singular_of_stack(matrix)?.values[5];
        if best.is_none_or(|(other, ..)| smallest > CLEARLY_BETTER * other) {
            best = Some((smallest, camera, target));
        }
    }
    let (camera, target) = best.map_or((Vector4::x(), Vector4::x()), |(_, camera, target)| (camera, target));
    let q_c = turned(&camera, &target);
    let (matrix, rhs) = equations(&q_c, &q_a);
    let ratio = least_squares(matrix, rhs, "the rotations of X and Y")?;
    // From the ratios to the quaternions: x is fixed by its unit length, the real part of w by the real
    // equations.
    let x = Vector4::new(1.0, ratio[3], ratio[4], ratio[5]);
    let w_vector = ratio.fixed_rows::<3>(0).into_owned();
    let (mut numerator, mut denominator) = (0.0, 0.0);
    for (a, c) in q_a.iter().zip(&q_c) {
        let real = x[0] * a[0] - vector_part(&x).dot(&vector_part(a)) + vector_part(c).dot(&w_vector);
        numerator += c[0] * real;
        denominator += c[0] * c[0];
    }
    let w = Vector4::new(numerator / denominator, w_vector.x, w_vector.y, w_vector.z);

    // Solved were `target^-1 w` and `camera x`.
    let w = to_rotation(&multiply(&target, &w));
    let x = to_rotation(&multiply(&conjugate(&camera), &x));
    let (t_w, t_x) = robot_world_translations(a, c, &x)?;
    Ok(Estimate { x: Se3::new(x, t_x), y: Se3::new(w, t_w).inverse() })
}

/// `c_0` times the vector equations with the real part of `w` eliminated, for `[w_vec; x_vec] / x_0`.
fn equations(q_c: &[Vector4<f64>], q_a: &[Vector4<f64>]) -> (DMatrix<f64>, DVector<f64>) {
    let mut matrix = DMatrix::zeros(3 * q_c.len(), 6);
    let mut rhs = DVector::zeros(3 * q_c.len());
    for (k, (c, a)) in q_c.iter().zip(q_a).enumerate() {
        let (c0, c_vector) = (c[0], vector_part(c));
        let (a0, a_vector) = (a[0], vector_part(a));
        let w_block = (Matrix3::identity() * c0 + hat(&c_vector)) * c0 + c_vector * c_vector.transpose();
        let x_block = (hat(&a_vector) - Matrix3::identity() * a0) * c0 - c_vector * a_vector.transpose();
        matrix.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(&w_block);
        matrix.fixed_view_mut::<3, 3>(3 * k, 3).copy_from(&x_block);
        rhs.fixed_rows_mut::<3>(3 * k).copy_from(&(a_vector * c0 - c_vector * a0));
    }
    (matrix, rhs)
}
