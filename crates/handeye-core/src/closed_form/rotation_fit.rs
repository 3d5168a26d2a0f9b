//! The rotation that best maps one list of vectors to another.

use std::ops::RangeInclusive;

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::linear::{RANK_TOLERANCE, singular};
use crate::error::Error;

/// Singular values of a matrix that may pass for a rotation seen through noise.
const ROTATION_LIKE: RangeInclusive<f64> = 0.5..=2.0;

/// Singular values and vectors of `sum p q'`, third vectors completed to right-handed bases.
pub(super) struct Correlation {
    /// Falling, the third with the sign of the determinant.
    pub values: Vector3<f64>,
    /// A rotation whose columns are the directions of the `p`.
    pub left: Matrix3<f64>,
    /// A rotation whose columns are the directions of the `q`.
    pub right: Matrix3<f64>,
}

impl Correlation {
    /// # Errors
    /// [`Error::Numerical`] if an entry is not finite.
    pub fn of(sum: &Matrix3<f64>) -> Result<Self, Error> {
        let svd = singular(&DMatrix::from_column_slice(3, 3, sum.as_slice()))?;
        let basis = |m: &DMatrix<f64>| {
            let (first, second) = (m.fixed_view::<3, 1>(0, 0), m.fixed_view::<3, 1>(0, 1));
            Matrix3::from_columns(&[first.into_owned(), second.into_owned(), first.cross(&second)])
        };
        let (left, right) = (basis(&svd.left), basis(&svd.right));
        let third = left.column(2).dot(&(sum * right.column(2)));
        Ok(Self { values: Vector3::new(svd.values[0], svd.values[1], third), left, right })
    }

    /// `s2 + sign(det) s3`: positive exactly if one rotation maps the `q` to the `p` best.
    pub fn uniqueness(&self) -> f64 {
        self.values[1] + self.values[2]
    }
}

/// The rotation `R` that minimises `sum |p - R q|^2`, given `sum p q'` (Kabsch 1978; Umeyama 1991, lemma).
///
/// Never a reflection, also where the third singular value is nothing but noise (three views, small
/// rotations).
///
/// # Errors
/// [`Error::Degenerate`] if the vectors lie on one line, [`Error::Numerical`] if an entry is not finite.
pub(super) fn rotation_from_correlation(sum: &Matrix3<f64>) -> Result<Matrix3<f64>, Error> {
    let correlation = Correlation::of(sum)?;
    if correlation.uniqueness() <= RANK_TOLERANCE * correlation.values[0] {
        let [first, second, third] = correlation.values.into();
        return Err(Error::degenerate(format!(
            "these views do not determine a rotation: singular values {second:.1e} and {third:.1e} against \
             {first:.1e}"
        )));
    }
    Ok(correlation.left * correlation.right.transpose())
}

/// The rotation nearest to a matrix that is a rotation times a scale of either sign, such as a singular
/// vector: `sign(det M) / |det M|^(1/3) M`, then made orthogonal.
///
/// # Errors
/// [`Error::Numerical`] if the matrix is too near to singular to be meant as a rotation.
pub(super) fn rotation_of_either_sign(m: &Matrix3<f64>) -> Result<Matrix3<f64>, Error> {
    let determinant = m.determinant();
    let size = m.norm();
    // Of a scaled rotation the determinant is (size / sqrt 3)^3.
    if size.is_nan() || determinant.abs() <= RANK_TOLERANCE * size.powi(3) {
        return Err(Error::numerical(format!(
            "the linear solution is no rotation: determinant {determinant:.1e} at size {size:.1e}"
        )));
    }
    rotation_from_correlation(&(m * determinant.signum()))
}

/// The rotation nearest to a matrix that a linear solution says is one.
///
/// # Errors [`Error::Numerical`] if it is far from one: its singular values, all 1 for a rotation, must lie
/// in [`ROTATION_LIKE`]. A linear system that takes the scale from the translations ends near zero where they
/// are nothing but noise, and what direction is left there is noise too.
pub(super) fn rotation_of_unit_scale(m: &Matrix3<f64>) -> Result<Matrix3<f64>, Error> {
    let correlation = Correlation::of(m)?;
    if correlation.values.iter().all(|value| ROTATION_LIKE.contains(value)) {
        return Ok(correlation.left * correlation.right.transpose());
    }
    let [first, second, third] = correlation.values.into();
    Err(Error::numerical(format!(
        "the linear solution is no rotation: its singular values are {first:.3}, {second:.3} and {third:.3} \
         instead of 1; the translations of these views say too little about the scale"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn the_best_rotation_is_never_a_reflection() {
        let mut random = Random::new(1);
        for third in [0.3, 0.0, -0.3] {
            let (u, v) = (random.transform(0.0, 2.0).rotation, random.transform(0.0, 2.0).rotation);
            let sum = u * Matrix3::from_diagonal(&Vector3::new(2.0, 1.0, third)) * v.transpose();
            let found = rotation_from_correlation(&sum).unwrap();
            assert!((found - u * v.transpose()).amax() < 1e-13);
        }
    }

    #[test]
    fn what_two_rotations_fit_equally_is_refused() {
        for third in [-1.0, -1.0 + 1e-12] {
            let sum = Matrix3::from_diagonal(&Vector3::new(2.0, 1.0, third));
            assert!(matches!(rotation_from_correlation(&sum), Err(Error::Degenerate { .. })));
        }
        let line = Matrix3::from_diagonal(&Vector3::new(2.0, 0.0, 0.0));
        assert!(matches!(rotation_from_correlation(&line), Err(Error::Degenerate { .. })));
        assert!(rotation_from_correlation(&Matrix3::zeros()).is_err());
        assert!(rotation_from_correlation(&(line * f64::NAN)).is_err());
    }

    #[test]
    fn a_matrix_far_from_a_rotation_is_not_taken_for_one() {
        let r = Random::new(2).transform(0.0, 2.0).rotation;
        assert!((rotation_of_unit_scale(&(r * 0.9)).unwrap() - r).amax() < 1e-13);
        assert!((rotation_of_either_sign(&(r * -0.01)).unwrap() - r).amax() < 1e-13);
        for bad in [r * 0.1, r * -1.0, r * 3.0, r * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.1))] {
            assert!(matches!(rotation_of_unit_scale(&bad), Err(Error::Numerical { .. })));
        }
        assert!(rotation_of_either_sign(&Matrix3::from_element(1.0)).is_err());
    }
}
