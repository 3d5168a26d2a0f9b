//! Daniilidis: dual quaternions, rotation and translation at once.

use nalgebra::{DMatrix, Vector3, Vector4};

use super::linear::singular_of_stack;
use super::motion::Motion;
use super::quaternion::{conjugate, multiply, to_rotation, vector_part};
use crate::error::Error;
use crate::se3::{Se3, hat};

pub(super) const PAPER: &str = "K. Daniilidis, \"Hand-eye calibration using dual quaternions\", \
    International Journal of Robotics Research 18(3), 1999";

/// `Z` of `hand Z = Z eye`.
///
/// Six rows per motion (eq. 31) act on the eight components of the dual quaternion of `Z`. Their null space
/// has two dimensions; the unit condition (eq. 34 and 35) picks the combination. With noise the quadratic
/// equation may have no real root; then the double root nearest to it is taken and the dual part made
/// orthogonal to the real part, the unit dual quaternion next to it.
///
/// Rotation and translation share one least-squares problem, so the answer depends on the unit of length
/// (here metres, as for others).
pub(super) fn solve(motions: &[Motion]) -> Result<Se3, Error> {
    let mut matrix = DMatrix::zeros(6 * motions.len(), 8);
    for (k, m) in motions.iter().enumerate() {
        let (a, a_dual) = screw(&m.hand_quaternion, &m.hand.translation);
        let (b, b_dual) = screw(&m.eye_quaternion, &m.eye.translation);
        let (row, dual_row) = (6 * k, 6 * k + 3);
        for (row, column, vector, sum) in [
            (row, 0, a - b, a + b),
            (dual_row, 0, a_dual - b_dual, a_dual + b_dual),
            (dual_row, 4, a - b, a + b),
        ] {
            matrix.fixed_view_mut::<3, 1>(row, column).copy_from(&vector);
            matrix.fixed_view_mut::<3, 3>(row, column + 1).copy_from(&hat(&sum));
        }
    }
    let null = singular_of_stack(matrix)?.right;
    let half = |row: usize, column: usize| null.fixed_view::<4, 1>(row, column).into_owned();
    let (u1, v1, u2, v2) = (half(0, 6), half(4, 6), half(0, 7), half(4, 7));

    let (l1, l2) = combination([u1.dot(&v1), u1.dot(&v2) + u2.dot(&v1), u2.dot(&v2)], &u1, &u2)?;
    let real = u1 * l1 + u2 * l2;
    let length = real.norm();
    let real = real / length;
    let dual = (v1 * l1 + v2 * l2) / length;
    // Exact roots leave nothing to remove here.
    let dual = dual - real * real.dot(&dual);
    let translation = vector_part(&multiply(&dual, &conjugate(&real))) * 2.0;
    Ok(Se3::new(to_rotation(&real), translation))
}

/// Vector parts of the dual quaternion of a motion: those of `q` and of `t q / 2`.
fn screw(q: &Vector4<f64>, translation: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let t = Vector4::new(0.0, translation.x, translation.y, translation.z);
    (vector_part(q), vector_part(&multiply(&t, q)) * 0.5)
}

/// `(l1, l2)`, up to scale, with `a l1^2 + b l1 l2 + c l2^2 = 0` and, of the two roots, the larger real part
/// `|l1 u1 + l2 u2|` (section on the unit condition; the other root is the translation-only null direction).
fn combination([a, b, c]: [f64; 3], u1: &Vector4<f64>, u2: &Vector4<f64>) -> Result<(f64, f64), Error> {
    let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
    // The two roots without cancellation, as directions: each stays defined where `a` or `c` vanishes.
    let q = -0.5 * (b + root.copysign(b));
    let candidates = [(q, a), (c, q)];
    let real_share = |&(l1, l2): &(f64, f64)| (u1 * l1 + u2 * l2).norm() / l1.hypot(l2);
    candidates
        .into_iter()
        .filter(|candidate| real_share(candidate) > 1e-9)
        .max_by(|p, q| real_share(p).total_cmp(&real_share(q)))
        .ok_or_else(|| Error::numerical("the null space holds no dual quaternion with a rotation part"))
}
