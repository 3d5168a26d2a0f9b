//! Positive definite matrices of any size, whatever the units of their rows.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use nalgebra::DMatrix;

use crate::simd::{Kernel, MAX_LANES, Simd, Vector, VectorUnit, dispatch};

/// Neighbours in a row that every unit takes in whole vectors.
type Block = [f64; MAX_LANES];

/// `U' D^-1 U` of a positive definite matrix, `D` the diagonal of the upper triangular `U`.
#[derive(Clone, Debug)]
pub(crate) struct Factor {
    size: usize,
    /// Blocks of a row.
    blocks: usize,
    /// `U` row by row; what lies below the diagonal means nothing.
    upper: Vec<Block>,
    unit: VectorUnit,
}

impl Factor {
    /// By the lower triangle of a matrix; `None` if it is not positive definite or not finite.
    pub fn new(m: &DMatrix<f64>) -> Option<Self> {
        let size = m.nrows();
        let blocks = size.div_ceil(MAX_LANES);
        let mut upper = vec![[0.0; MAX_LANES]; size * blocks];
        // Columns of a symmetric matrix are its rows.
        for (row, column) in upper.chunks_exact_mut(blocks).zip(m.as_slice().chunks_exact(size)) {
            row.as_flattened_mut()[..size].copy_from_slice(column);
        }
        let mut factor = Self { size, blocks, upper, unit: VectorUnit::widest() };
        dispatch(factor.unit, Eliminate { factor: &mut factor }).then_some(factor)
    }

    /// Pivots in the order of elimination: what is left of a diagonal entry when those before it are known.
    pub fn pivots(&self) -> impl Iterator<Item = f64> {
        self.upper.chunks_exact(self.blocks).enumerate().map(|(k, row)| row.as_flattened()[k])
    }

    /// `ln |m|`.
    pub fn log_determinant(&self) -> f64 {
        // One logarithm for as many pivots as a number can hold.
        const SAFE: std::ops::Range<f64> = 1e-100..1e100;
        let (mut sum, mut product) = (0.0, 1.0);
        for pivot in self.pivots() {
            product *= pivot;
            if !SAFE.contains(&product) {
                sum += f64::ln(product);
                product = 1.0;
            }
        }
        sum + product.ln()
    }

    /// `m^-1 right`.
    pub fn solve(&self, right: &[f64]) -> Vec<f64> {
        let rows: Vec<&[f64]> = self.upper.chunks_exact(self.blocks).map(<[Block]>::as_flattened).collect();
        let mut solution = right.to_vec();
        for k in 0..self.size {
            let value = solution[k] / rows[k][k];
            for i in k + 1..self.size {
                solution[i] -= rows[k][i] * value;
            }
        }
        for k in (0..self.size).rev() {
            let mut value = solution[k];
            for i in k + 1..self.size {
                value -= rows[k][i] * solution[i];
            }
            solution[k] = value / rows[k][k];
        }
        solution
    }

    /// `m^-1`; not finite where it overflows.
    pub fn inverse(&self) -> DMatrix<f64> {
        let mut rows = vec![[0.0; MAX_LANES]; 2 * self.size * self.blocks];
        let (lower, inverse) = rows.split_at_mut(self.size * self.blocks);
        dispatch(self.unit, Invert { factor: self, lower, inverse });
        let mut matrix = DMatrix::zeros(self.size, self.size);
        let columns = matrix.as_mut_slice();
        for (i, row) in inverse.chunks_exact(self.blocks).enumerate() {
            for (j, entry) in row.as_flattened()[..=i].iter().enumerate() {
                columns[i * self.size + j] = *entry;
                columns[j * self.size + i] = *entry;
            }
        }
        matrix
    }
}

/// `row - factor * other`, block by block.
#[inline(always)]
fn take_off<S: Simd>(simd: S, row: &mut [Block], factor: f64, other: &[Block]) {
    let factor = simd.splat(factor);
    for (block, other) in row.iter_mut().zip(other) {
        for at in (0..MAX_LANES).step_by(S::LANES) {
            let left = factor.neg_mul_add(simd.load(&other[at..]), simd.load(&block[at..]));
            left.store(&mut block[at..]);
        }
    }
}

/// Eliminates row by row; whether every pivot is positive and finite.
struct Eliminate<'a> {
    factor: &'a mut Factor,
}

impl Kernel for Eliminate<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> bool {
        let Factor { size, blocks, upper, .. } = self.factor;
        for k in 0..*size {
            let (done, rest) = upper.split_at_mut((k + 1) * *blocks);
            let row = &done[k * *blocks..];
            let entries = row.as_flattened();
            if !(f64::MIN_POSITIVE..f64::INFINITY).contains(&entries[k]) {
                return false;
            }
            let inverse = 1.0 / entries[k];
            for (line, (i, entry)) in
                rest.chunks_exact_mut(*blocks).zip(entries.iter().enumerate().skip(k + 1))
            {
                let first = i / MAX_LANES;
                take_off(simd, &mut line[first..], entry * inverse, &row[first..]);
            }
        }
        true
    }
}

/// `L^-1` and `(L^-1)' D^-1 L^-1` for `U = D L'`, lower triangles row by row; both zero before.
struct Invert<'a> {
    factor: &'a Factor,
    lower: &'a mut [Block],
    inverse: &'a mut [Block],
}

impl Kernel for Invert<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Factor { size, blocks, upper, .. } = self.factor;
        for (k, row) in self.lower.chunks_exact_mut(*blocks).enumerate() {
            row.as_flattened_mut()[k] = 1.0;
        }
        for k in 0..*size {
            // This row is done: off those below, which do not wait for each other.
            let (done, rest) = self.lower.split_at_mut((k + 1) * *blocks);
            let row = &done[k * *blocks..];
            let line = upper[k * *blocks..].as_flattened();
            let inverse = 1.0 / line[k];
            let filled = k / MAX_LANES + 1;
            for (other, entry) in rest.chunks_exact_mut(*blocks).zip(&line[k + 1..]) {
                take_off(simd, other, entry * inverse, &row[..filled]);
            }
            let sums = self.inverse.chunks_exact_mut(*blocks);
            for (i, (sum, entry)) in sums.zip(row.as_flattened()).enumerate().take(k + 1) {
                take_off(simd, sum, -entry * inverse, &row[..=i / MAX_LANES]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::testing::Random;

    /// A positive definite matrix whose rows differ by orders of magnitude.
    fn positive(random: &mut Random, size: usize) -> DMatrix<f64> {
        let root =
            DMatrix::from_fn(size, size + 3, |i, _| random.normal() * 10_f64.powf((i % 7) as f64 - 3.0));
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
            for i in 0..size {
                for j in 0..size {
                    let unit = (expected[(i, i)] * expected[(j, j)]).sqrt();
                    assert!((inverse[(i, j)] - expected[(i, j)]).abs() < 1e-9 * unit);
                }
            }
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
}
