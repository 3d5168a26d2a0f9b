//! Factors against other factorisations.

use nalgebra::{DMatrix, DVector};

use super::*;
use crate::testing::Random;

/// A positive definite matrix whose rows differ by orders of magnitude.
fn positive(random: &mut Random, size: usize) -> DMatrix<f64> {
    let root = DMatrix::from_fn(size, size + 3, |i, _| random.normal() * 10_f64.powf((i % 7) as f64 - 3.0));
    &root * root.transpose()
}

#[test]
fn inverses_and_determinants_are_those_of_other_factorisations() {
    let random = &mut Random::new(3);
    for size in 1..24 {
        let m = positive(random, size);
        let factor = Factor::new(&m).unwrap();
        let scale = DMatrix::from_diagonal(&m.diagonal().map(|d| d.sqrt().recip()));
        let correlation = &scale * &m * &scale;
        let expected = &scale * correlation.clone().lu().try_inverse().unwrap() * &scale;
        let inverse = factor.inverse();
        let across = size.next_multiple_of(MAX_LANES);
        let root = DMatrix::from_row_slice(size, across, &factor.inverse_root(across));
        let squared = &root * root.transpose();
        for i in 0..size {
            for j in 0..size {
                let unit = (expected[(i, i)] * expected[(j, j)]).sqrt();
                assert!((inverse[(i, j)] - expected[(i, j)]).abs() < 1e-9 * unit);
                assert!((squared[(i, j)] - expected[(i, j)]).abs() < 1e-9 * unit);
                assert!(i <= j || root[(i, j)] == 0.0);
            }
        }
        let right: Vec<f64> = (0..size).map(|_| random.normal()).collect();
        // A right side behind the rows of the upper triangle.
        let blocks = (size + 1).div_ceil(MAX_LANES);
        let mut rows = vec![[0.0; MAX_LANES]; size * blocks];
        for (i, row) in rows.as_flattened_mut().chunks_exact_mut(blocks * MAX_LANES).enumerate() {
            for j in i..size {
                row[j] = m[(i, j)];
            }
            row[size] = right[i];
        }
        let carrying = Factor::carrying(size, rows).unwrap();
        let solution = DVector::from_vec(carrying.solution());
        let (back, right) = (&m * &solution, DVector::from_vec(right));
        for (i, (a, b)) in back.iter().zip(&right).enumerate() {
            assert!((a - b).abs() < 1e-8 * m[(i, i)].sqrt().max(1.0), "{a} {b}");
        }
        assert!((carrying.carried() / right.dot(&solution) - 1.0).abs() < 1e-9);
        let log = correlation.lu().determinant().ln() - 2.0 * scale.diagonal().map(f64::ln).sum();
        assert!((factor.log_determinant() - log).abs() < 1e-9);
    }
}

#[test]
fn what_is_not_positive_definite_is_refused() {
    let m = positive(&mut Random::new(4), 5);
    assert!(Factor::new(&-&m).is_none());
    for (i, value) in [(0, f64::NAN), (4, f64::INFINITY), (2, 0.0), (3, -1e-9)] {
        let mut broken = m.clone();
        broken[(i, i)] = value;
        assert!(Factor::new(&broken).is_none(), "{i} {value}");
    }
    let one = DMatrix::from_element(3, 3, 1.0);
    assert!(Factor::new(&one).is_none());
}
