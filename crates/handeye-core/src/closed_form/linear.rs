//! Stacked linear systems: least squares and null spaces through QR and singular values.
//!
//! Normal equations would be shorter but square the condition number, which small rotations already make
//! large. The singular values come from one-sided Jacobi rotations (Hestenes 1958; Demmel and Veselic 1992):
//! a few lines, accurate to rounding for matrices this small, while the iterative decomposition of `nalgebra`
//! 0.35 loses up to eight digits on some of them.

use nalgebra::{DMatrix, DVector};

use crate::error::Error;

/// Smallest singular value, relative to the largest, below which a direction is taken as undetermined.
///
/// The spread of the rotation axes has been checked before, so this only catches what is special to one
/// method.
pub(super) const RANK_TOLERANCE: f64 = 1e-10;

/// Cosine between two columns that counts as orthogonal: rounding of a dot product of up to 24 terms.
const ORTHOGONAL: f64 = 8.0 * f64::EPSILON;

/// Sweeps after which the rotations have long converged; six to ten are usual.
const MAX_SWEEPS: usize = 60;

/// `matrix = left diag(values) right'`, singular values in falling order, vectors as columns.
pub(super) struct Singular {
    /// Falling.
    pub values: DVector<f64>,
    /// Left singular vectors; of a singular value zero the column is zero.
    pub left: DMatrix<f64>,
    /// Right singular vectors, orthogonal.
    pub right: DMatrix<f64>,
}

/// Singular values and vectors of a matrix with at least as many rows as columns.
///
/// # Errors
/// [`Error::Numerical`] if an entry is not finite.
pub(super) fn singular(matrix: &DMatrix<f64>) -> Result<Singular, Error> {
    let columns = matrix.ncols();
    let mut work = matrix.clone();
    let mut right = DMatrix::identity(columns, columns);
    let negligible = (f64::EPSILON * matrix.norm()).powi(2);
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for p in 0..columns {
            for q in p + 1..columns {
                let (pp, qq) = (work.column(p).norm_squared(), work.column(q).norm_squared());
                let pq = work.column(p).dot(&work.column(q));
                if pp.min(qq) <= negligible || pq.abs() <= ORTHOGONAL * (pp * qq).sqrt() {
                    continue;
                }
                rotated = true;
                // The smaller of the two rotations that make the columns orthogonal.
                let zeta = (qq - pp) / (2.0 * pq);
                let tangent = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
                let cos = 1.0 / tangent.hypot(1.0);
                rotate_columns(&mut work, p, q, cos, cos * tangent);
                rotate_columns(&mut right, p, q, cos, cos * tangent);
            }
        }
        if !rotated {
            return Ok(sorted(&work, &right));
        }
    }
    Err(Error::numerical("singular values did not converge: the equations hold entries that are not finite"))
}

fn rotate_columns(m: &mut DMatrix<f64>, p: usize, q: usize, cos: f64, sin: f64) {
    for row in 0..m.nrows() {
        let (x, y) = (m[(row, p)], m[(row, q)]);
        m[(row, p)] = cos * x - sin * y;
        m[(row, q)] = sin * x + cos * y;
    }
}

/// From orthogonal columns to unit columns in the order of falling length.
fn sorted(work: &DMatrix<f64>, right: &DMatrix<f64>) -> Singular {
    let lengths: Vec<f64> = work.column_iter().map(|column| column.norm()).collect();
    let mut order: Vec<usize> = (0..lengths.len()).collect();
    order.sort_by(|&p, &q| lengths[q].total_cmp(&lengths[p]));
    let mut left = work.select_columns(&order);
    for (mut column, &k) in left.column_iter_mut().zip(&order) {
        if lengths[k] > 0.0 {
            column /= lengths[k];
        }
    }
    Singular {
        values: DVector::from_iterator(order.len(), order.iter().map(|&k| lengths[k])),
        left,
        right: right.select_columns(&order),
    }
}

/// Singular values and right vectors of a tall matrix.
///
/// # Errors
/// [`Error::Numerical`] if an entry is not finite.
pub(super) fn singular_of_stack(matrix: DMatrix<f64>) -> Result<Singular, Error> {
    singular(&matrix.qr().r())
}

/// The unit vector `x` that minimises `|matrix x|`; `unknown` says in words what `x` is.
///
/// # Errors
/// [`Error::Degenerate`] if another vector does as well, [`Error::Numerical`] if an entry is not finite.
pub(super) fn null_vector(matrix: DMatrix<f64>, unknown: &str) -> Result<DVector<f64>, Error> {
    let last = matrix.ncols() - 1;
    let Singular { values, right, .. } = singular_of_stack(matrix)?;
    let (second, smallest, largest) = (values[last - 1], values[last], values[0]);
    if second - smallest <= RANK_TOLERANCE * largest {
        return Err(Error::degenerate(format!(
            "these views do not determine {unknown}: smallest singular values {second:.3e} and \
             {smallest:.3e} against {largest:.1e}"
        )));
    }
    Ok(right.column(last).into_owned())
}

/// The `x` that minimises `|matrix x - rhs|`; `unknown` says in words what `x` is.
///
/// # Errors
/// [`Error::Degenerate`] if the rank is not full, [`Error::Numerical`] if an entry is not finite.
pub(super) fn least_squares(
    matrix: DMatrix<f64>,
    mut rhs: DVector<f64>,
    unknown: &str,
) -> Result<DVector<f64>, Error> {
    let columns = matrix.ncols();
    let qr = matrix.qr();
    qr.q_tr_mul(&mut rhs);
    let Singular { values, left, right } = singular(&qr.r())?;
    let (smallest, largest) = (values[columns - 1], values[0]);
    if smallest <= RANK_TOLERANCE * largest {
        return Err(Error::degenerate(format!(
            "these views do not determine {unknown}: smallest singular value {smallest:.1e} against \
             {largest:.1e}"
        )));
    }
    Ok(right * (left.tr_mul(&rhs.rows(0, columns))).component_div(&values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn decomposition_is_exact_to_rounding() {
        let mut random = Random::new(1);
        for size in [3, 4, 6, 9, 24] {
            for _ in 0..2_000 / size {
                let matrix = DMatrix::from_fn(size + 2, size, |_, _| random.uniform(-1.0, 1.0));
                let Singular { values, left, right } = singular(&matrix).unwrap();
                let identity = DMatrix::<f64>::identity(size, size);
                assert!((left.tr_mul(&left) - &identity).amax() < 1e-12);
                assert!((right.tr_mul(&right) - &identity).amax() < 1e-13);
                assert!(
                    (&left * DMatrix::from_diagonal(&values) * right.transpose() - &matrix).amax() < 1e-13
                );
                assert!(values.as_slice().windows(2).all(|pair| pair[0] >= pair[1]));
            }
        }
    }

    #[test]
    fn rank_and_nan_are_noticed() {
        let matrix = DMatrix::from_fn(6, 3, |i, j| if j == 2 { 2.0 * i as f64 } else { (i + j) as f64 });
        let singular = singular(&matrix).unwrap();
        assert!(singular.values[2] < 1e-14 * singular.values[0]);
        let rhs = DVector::zeros(6);
        let refused = least_squares(matrix.clone(), rhs.clone(), "the test");
        assert!(matches!(refused, Err(Error::Degenerate { what }) if what.contains("the test")));
        assert!(least_squares(matrix * f64::NAN, rhs, "the test").is_err());
    }

    #[test]
    fn least_squares_leaves_an_orthogonal_residual() {
        let mut random = Random::new(2);
        for _ in 0..200 {
            let matrix = DMatrix::from_fn(12, 6, |_, _| random.uniform(-1.0, 1.0));
            let rhs = DVector::from_fn(12, |_, _| random.uniform(-1.0, 1.0));
            let x = least_squares(matrix.clone(), rhs.clone(), "the test").unwrap();
            assert!(matrix.tr_mul(&(&matrix * x - rhs)).amax() < 1e-12);
        }
    }
}
