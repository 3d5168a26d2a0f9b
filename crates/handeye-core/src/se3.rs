//! Rigid transforms: the group SE(3), its exponential, logarithm, adjoint and Jacobians.
//!
//! A twist is `[rho; phi]`: translation first (metres), rotation second (radians).
//! Perturbations act on the left: `T <- exp(xi) T`.
//! Formulas follow Barfoot, "State Estimation for Robotics" (2nd ed., 2024), chapter 8.

mod batched;

use nalgebra::{Matrix3, Matrix4, Matrix6, Vector3, Vector6};

use crate::error::Error;

pub(crate) use batched::{entries, left_product, right_product};

/// Largest deviation of `R' R` from the identity that is taken as rounding and repaired.
pub const RIGID_TOLERANCE: f64 = 1e-4;

/// A rigid transform `T_a_b`: maps coordinates in frame `b` to frame `a`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Se3 {
    /// Rotation part, a proper orthogonal 3 x 3 matrix.
    pub rotation: Matrix3<f64>,
    /// Translation part, metres.
    pub translation: Vector3<f64>,
}

/// The skew-symmetric matrix with `hat(v) w = v x w`.
#[inline]
pub fn hat(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// `(sin a)/a`, `(1 - cos a)/a^2`, `(a - sin a)/a^3`, stable at zero.
#[inline]
fn sinc_terms(angle: f64) -> (f64, f64, f64) {
    let a2 = angle * angle;
    if a2 < 1e-6 {
        (
            1.0 - a2 / 6.0 + a2 * a2 / 120.0,
            0.5 - a2 / 24.0 + a2 * a2 / 720.0,
            1.0 / 6.0 - a2 / 120.0 + a2 * a2 / 5040.0,
        )
    } else {
        let (s, c) = angle.sin_cos();
        (s / angle, (1.0 - c) / a2, (angle - s) / (a2 * angle))
    }
}

/// Rotation matrix of the rotation vector `phi` (Rodrigues).
pub fn so3_exp(phi: &Vector3<f64>) -> Matrix3<f64> {
    let (a, b, _) = sinc_terms(phi.norm());
    let k = hat(phi);
    Matrix3::identity() + k * a + k * k * b
}

/// Rotation vector of a rotation matrix, its angle in `[0, pi]`.
pub fn so3_log(r: &Matrix3<f64>) -> Vector3<f64> {
    let axis_sin = Vector3::new(r.m32 - r.m23, r.m13 - r.m31, r.m21 - r.m12) * 0.5;
    let sin = axis_sin.norm();
    let cos = (r.trace() - 1.0) * 0.5;
    let angle = sin.atan2(cos);
    if cos > 0.0 || sin > 1e-3 {
        if sin < 1e-7 {
            return axis_sin * (1.0 + sin * sin / 6.0);
        }
        return axis_sin * (angle / sin);
    }
    // Near pi the antisymmetric part vanishes: read the axis off the symmetric part.
    let symmetric = (r + r.transpose()) * 0.5;
    let outer = (symmetric - Matrix3::identity() * cos) / (1.0 - cos);
    let i = outer.diagonal().imax();
    let mut axis = outer.column(i).into_owned();
    axis /= axis.norm();
    if axis.dot(&axis_sin) < 0.0 {
        axis = -axis;
    }
    axis * angle
}

/// Left Jacobian of SO(3).
pub fn so3_left_jacobian(phi: &Vector3<f64>) -> Matrix3<f64> {
    let (_, b, c) = sinc_terms(phi.norm());
    let k = hat(phi);
    Matrix3::identity() + k * b + k * k * c
}

/// Inverse of the left Jacobian of SO(3); valid for angles below `2 pi`.
pub fn so3_left_jacobian_inverse(phi: &Vector3<f64>) -> Matrix3<f64> {
    let angle = phi.norm();
    let a2 = angle * angle;
    let coefficient = if a2 < 1e-6 {
        1.0 / 12.0 + a2 / 720.0
    } else {
        let half = 0.5 * angle;
        (1.0 - half * half.cos() / half.sin()) / a2
    };
    let k = hat(phi);
    Matrix3::identity() - k * 0.5 + k * k * coefficient
}

/// The rotation nearest to `m` in the Frobenius norm.
///
/// # Errors
/// [`Error::NotRigid`] where the singular value decomposition does not exist (NaN) or `m` is singular.
pub fn nearest_rotation(m: &Matrix3<f64>) -> Result<Matrix3<f64>, Error> {
    if !m.iter().all(|x| x.is_finite()) {
        return Err(Error::NotRigid { deviation: f64::NAN });
    }
    let svd = m.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return Err(Error::NotRigid { deviation: f64::NAN });
    };
    let sign = (u.determinant() * v_t.determinant()).signum();
    if svd.singular_values.min() <= 1e-12 * svd.singular_values.max() {
        return Err(Error::NotRigid { deviation: 1.0 });
    }
    Ok(u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t)
}

impl Se3 {
    /// A transform from its parts; the rotation is taken as it is.
    #[inline]
    pub fn new(rotation: Matrix3<f64>, translation: Vector3<f64>) -> Self {
        Self { rotation, translation }
    }

    /// The transform that changes nothing.
    pub fn identity() -> Self {
        Self::new(Matrix3::identity(), Vector3::zeros())
    }

    /// A transform from a homogeneous 4 x 4 matrix; rounding in the rotation is repaired.
    ///
    /// # Errors
    /// [`Error::NotRigid`] if an entry is not finite, the last row is not `0 0 0 1`, or the
    /// rotation deviates from orthogonality by more than [`RIGID_TOLERANCE`].
    pub fn from_matrix(m: &Matrix4<f64>) -> Result<Self, Error> {
        Self::from_row_major(m.transpose().as_slice())
    }

    /// As [`Se3::from_matrix`], from the 16 entries of the matrix row by row.
    ///
    /// # Errors
    /// As [`Se3::from_matrix`], and if there are fewer entries.
    pub fn from_row_major(entries: &[f64]) -> Result<Self, Error> {
        let Some(m) = entries.first_chunk::<16>() else {
            return Err(Error::NotRigid { deviation: f64::NAN });
        };
        if !m.iter().fold(true, |fine, x| fine & x.is_finite()) {
            return Err(Error::NotRigid { deviation: f64::NAN });
        }
        let rotation = Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
        let gram = rotation.transpose() * rotation;
        let deviation = (gram - Matrix3::identity())
            .iter()
            .chain(&[m[12], m[13], m[14], m[15] - 1.0])
            .fold(0.0, |largest: f64, x| largest.max(x.abs()));
        if deviation > RIGID_TOLERANCE || rotation.determinant() < 0.0 {
            return Err(Error::NotRigid { deviation });
        }
        let translation = Vector3::new(m[3], m[7], m[11]);
        // Newton-Schulz squares the deviation: two steps reach rounding from RIGID_TOLERANCE, without an SVD.
        let polished = |r: Matrix3<f64>, gram: Matrix3<f64>| r * (Matrix3::identity() * 1.5 - gram * 0.5);
        let mut rotation = rotation;
        if deviation > 1e-15 {
            rotation = polished(rotation, gram);
            rotation = polished(rotation, rotation.transpose() * rotation);
        }
        Ok(Self::new(rotation, translation))
    }

    /// Whether the 16 entries of a matrix, row by row, are a rigid transform as they stand: last row exact, rotation
    /// orthogonal to `tolerance`, not mirrored.
    pub fn is_rigid(entries: &[f64; 16], tolerance: f64) -> bool {
        let m = entries;
        let rotation = Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
        let off = rotation.transpose() * rotation - Matrix3::identity();
        m[12..] == [0.0, 0.0, 0.0, 1.0]
            && off.iter().all(|x| x.abs() <= tolerance)
            && rotation.determinant() > 0.0
    }

    /// The homogeneous 4 x 4 matrix.
    pub fn to_matrix(&self) -> Matrix4<f64> {
        let mut m = Matrix4::identity();
        m.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.rotation);
        m.fixed_view_mut::<3, 1>(0, 3).copy_from(&self.translation);
        m
    }

    /// Exponential map of the twist `[rho; phi]`.
    pub fn exp(xi: &Vector6<f64>) -> Self {
        let rho = xi.fixed_rows::<3>(0).into_owned();
        let phi = xi.fixed_rows::<3>(3).into_owned();
        let (a, b, c) = sinc_terms(phi.norm());
        let k = hat(&phi);
        let k2 = k * k;
        let jacobian = Matrix3::identity() + k * b + k2 * c;
        Self::new(Matrix3::identity() + k * a + k2 * b, jacobian * rho)
    }

    /// Twist `[rho; phi]` with `exp(log(T)) = T`; the rotation angle lies in `[0, pi]`.
    pub fn log(&self) -> Vector6<f64> {
        let phi = so3_log(&self.rotation);
        let rho = so3_left_jacobian_inverse(&phi) * self.translation;
        Vector6::new(rho.x, rho.y, rho.z, phi.x, phi.y, phi.z)
    }

    /// `T_b_a` of `T_a_b`.
    #[inline]
    pub fn inverse(&self) -> Self {
        let rt = self.rotation.transpose();
        Self::new(rt, -(rt * self.translation))
    }

    /// Coordinates of a point of frame `b` in frame `a`.
    #[inline]
    pub fn act(&self, p: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * p + self.translation
    }

    /// Adjoint: `exp(Ad(T) xi) = T exp(xi) T^-1`.
    #[inline]
    pub fn adjoint(&self) -> Matrix6<f64> {
        let mut ad = Matrix6::zeros();
        ad.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.rotation);
        ad.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.rotation);
        ad.fixed_view_mut::<3, 3>(0, 3).copy_from(&(hat(&self.translation) * self.rotation));
        ad
    }

    /// Left Jacobian of SE(3): `exp(xi + d) ~ exp(J d) exp(xi)`.
    pub fn left_jacobian(xi: &Vector6<f64>) -> Matrix6<f64> {
        let (rho, phi) = (xi.fixed_rows::<3>(0).into_owned(), xi.fixed_rows::<3>(3).into_owned());
        let j = so3_left_jacobian(&phi);
        block_upper(&j, &q_block(&rho, &phi))
    }

    /// Inverse of [`Se3::left_jacobian`].
    pub fn left_jacobian_inverse(xi: &Vector6<f64>) -> Matrix6<f64> {
        let (rho, phi) = (xi.fixed_rows::<3>(0).into_owned(), xi.fixed_rows::<3>(3).into_owned());
        let j = so3_left_jacobian_inverse(&phi);
        block_upper(&j, &(-(j * q_block(&rho, &phi) * j)))
    }

    /// Rotation angle in radians, in `[0, pi]`.
    pub fn angle(&self) -> f64 {
        so3_log(&self.rotation).norm()
    }
}

fn block_upper(diagonal: &Matrix3<f64>, corner: &Matrix3<f64>) -> Matrix6<f64> {
    let mut m = Matrix6::zeros();
    m.fixed_view_mut::<3, 3>(0, 0).copy_from(diagonal);
    m.fixed_view_mut::<3, 3>(3, 3).copy_from(diagonal);
    m.fixed_view_mut::<3, 3>(0, 3).copy_from(corner);
    m
}

/// The off-diagonal block Q of the left Jacobian (Barfoot 2024, eq. 8.91).
fn q_block(rho: &Vector3<f64>, phi: &Vector3<f64>) -> Matrix3<f64> {
    let a = phi.norm();
    let (rx, px) = (hat(rho), hat(phi));
    let a2 = a * a;
    let (c1, c2, c3) = if a2 < 1e-4 {
        (1.0 / 6.0 - a2 / 120.0, 1.0 / 24.0 - a2 / 720.0, 1.0 / 120.0 - a2 / 2520.0)
    } else {
        let (s, c) = a.sin_cos();
        (
            (a - s) / (a2 * a),
            (a2 + 2.0 * c - 2.0) / (2.0 * a2 * a2),
            (2.0 * a - 3.0 * s + a * c) / (2.0 * a2 * a2 * a),
        )
    };
    rx * 0.5
        + (px * rx + rx * px + px * rx * px) * c1
        + (px * px * rx + rx * px * px - px * rx * px * 3.0) * c2
        + (px * rx * px * px + px * px * rx * px) * c3
}

impl std::ops::Mul for Se3 {
    type Output = Se3;

    #[inline]
    fn mul(self, other: Se3) -> Se3 {
        Se3::new(self.rotation * other.rotation, self.rotation * other.translation + self.translation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{numerical_jacobian, twist};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn exponential_inverts_logarithm(xi in twist(3.0, 3.1)) {
            let back = Se3::exp(&xi).log();
            prop_assert!((back - xi).amax() < 1e-8, "{back} {xi}");
        }

        #[test]
        fn logarithm_near_half_turns(axis in twist(1.0, 1.0), gap in 0.0..1e-2_f64) {
            let phi = axis.fixed_rows::<3>(3).into_owned();
            prop_assume!(phi.norm() > 1e-3);
            let phi = phi / phi.norm() * (std::f64::consts::PI - gap);
            let r = so3_exp(&phi);
            let back = so3_exp(&so3_log(&r));
            prop_assert!((back - r).amax() < 1e-8);
        }

        #[test]
        fn adjoint_moves_twists_through(a in twist(2.0, 3.0), b in twist(1.0, 1.0)) {
            let t = Se3::exp(&a);
            let left = Se3::exp(&(t.adjoint() * b));
            let right = t * Se3::exp(&b) * t.inverse();
            prop_assert!((left.to_matrix() - right.to_matrix()).amax() < 1e-10);
        }

        #[test]
        fn left_jacobian_matches_differences(xi in twist(1.0, 2.5)) {
            let numeric = numerical_jacobian::<6, 6>(&Vector6::zeros(), |d| {
                (Se3::exp(&(xi + d)) * Se3::exp(&xi).inverse()).log()
            });
            let analytic = Se3::left_jacobian(&xi);
            prop_assert!((numeric - analytic).amax() < 1e-6);
            let product = analytic * Se3::left_jacobian_inverse(&xi);
            prop_assert!((product - Matrix6::identity()).amax() < 1e-8);
        }
    }

    #[test]
    fn rounding_in_a_rotation_is_repaired() {
        let mut m = Se3::exp(&Vector6::new(1.0, 2.0, 3.0, 0.3, -0.8, 1.2)).to_matrix();
        m[(0, 1)] += 2e-5;
        m[(2, 2)] -= 1e-5;
        let repaired = Se3::from_matrix(&m).unwrap().rotation;
        assert!((repaired.transpose() * repaired - Matrix3::identity()).amax() < 1e-14);
        let given: Matrix3<f64> = m.fixed_view::<3, 3>(0, 0).into_owned();
        assert!((repaired - nearest_rotation(&given).unwrap()).amax() < 1e-8);
    }

    #[test]
    fn reflections_and_nan_are_refused() {
        let mut m = Matrix4::identity();
        m[(0, 0)] = -1.0;
        assert!(Se3::from_matrix(&m).is_err());
        m[(0, 0)] = f64::NAN;
        assert!(Se3::from_matrix(&m).is_err());
        m[(0, 0)] = 1.01;
        assert!(Se3::from_matrix(&m).is_err());
    }
}
