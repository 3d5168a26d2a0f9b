//! Quaternions as plain vectors `[w, x, y, z]`, and their product as matrices, as the papers write them.

use nalgebra::{Matrix3, Matrix4, Quaternion, Rotation3, UnitQuaternion, Vector3, Vector4};

/// The unit quaternion of a rotation matrix; its sign is not fixed.
pub(super) fn from_rotation(r: &Matrix3<f64>) -> Vector4<f64> {
    let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*r));
    Vector4::new(q.w, q.i, q.j, q.k)
}

/// The unit quaternion of a rotation matrix with `w >= 0`: rotation angle in `[0, pi]`.
pub(super) fn positive_from_rotation(r: &Matrix3<f64>) -> Vector4<f64> {
    let q = from_rotation(r);
    if q[0] < 0.0 { -q } else { q }
}

/// The rotation matrix of a quaternion that need not have unit length.
pub(super) fn to_rotation(q: &Vector4<f64>) -> Matrix3<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3])).to_rotation_matrix().into_inner()
}

/// `[x, y, z]`.
pub(super) fn vector_part(q: &Vector4<f64>) -> Vector3<f64> {
    Vector3::new(q[1], q[2], q[3])
}

/// `Q(q)` with `Q(q) p = q p`.
pub(super) fn left(q: &Vector4<f64>) -> Matrix4<f64> {
    let (w, x, y, z) = (q[0], q[1], q[2], q[3]);
    Matrix4::new(w, -x, -y, -z, x, w, -z, y, y, z, w, -x, z, -y, x, w)
}

/// `W(q)` with `W(q) p = p q`.
pub(super) fn right(q: &Vector4<f64>) -> Matrix4<f64> {
    let (w, x, y, z) = (q[0], q[1], q[2], q[3]);
    Matrix4::new(w, -x, -y, -z, x, w, z, -y, y, -z, w, x, z, y, -x, w)
}

/// The product `p q`.
pub(super) fn multiply(p: &Vector4<f64>, q: &Vector4<f64>) -> Vector4<f64> {
    left(p) * q
}

/// The conjugate, for a unit quaternion its inverse.
pub(super) fn conjugate(q: &Vector4<f64>) -> Vector4<f64> {
    Vector4::new(q[0], -q[1], -q[2], -q[3])
}

/// No rotation and the half turns about x, y and z.
///
/// A parametrisation by `vector / w` breaks down at half a turn. Of `p q` for these four `p` at least one has
/// `|w| >= 1/2`, since their `|w|` are the four components of `q`.
pub(super) fn half_turns() -> [Vector4<f64>; 4] {
    [Vector4::x(), Vector4::y(), Vector4::z(), Vector4::w()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn products_follow_rotation_matrices() {
        let mut random = Random::new(1);
        for _ in 0..50 {
            let (r, s) = (random.transform(0.0, 2.0).rotation, random.transform(0.0, 2.0).rotation);
            let (p, q) = (from_rotation(&r), from_rotation(&s));
            assert!((to_rotation(&multiply(&p, &q)) - r * s).amax() < 1e-14);
            assert!((right(&q) * p - left(&p) * q).amax() < 1e-15);
            assert!((to_rotation(&conjugate(&p)) - r.transpose()).amax() < 1e-14);
            assert!(half_turns().iter().any(|h| multiply(h, &q)[0].abs() >= 0.5));
        }
    }
}
