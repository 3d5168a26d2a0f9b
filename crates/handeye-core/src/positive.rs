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
        let mut left = vec![[0.0; MAX_LANES]; self.blocks];
        left.as_flattened_mut()[..self.size].copy_from_slice(right);
        let mut solution = vec![[0.0; MAX_LANES]; self.blocks];
        dispatch(self.unit, Solve { factor: self, left: &mut left, solution: &mut solution });
        solution.as_flattened()[..self.size].to_vec()
    }

    /// `R` with `R R' = m^-1`: `D^-1/2 L^-1`, transposed, row by row in rows of `across`; zero below the diagonal.
    pub fn inverse_root(&self, across: usize) -> Vec<f64> {
        let mut lower = vec![[0.0; MAX_LANES]; self.size * self.blocks];
        dispatch(self.unit, Invert { factor: self, lower: &mut lower, inverse: &mut [] });
        let mut root = vec![0.0; self.size * across];
        for (j, (row, pivot)) in lower.chunks_exact(self.blocks).zip(self.pivots()).enumerate() {
            let scale = 1.0 / pivot.sqrt();
            for (i, entry) in row.as_flattened()[..=j].iter().enumerate() {
                root[i * across + j] = scale * entry;
            }
        }
        root
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

/// Rows that are taken off together.
const TOGETHER: usize = 4;

/// `row - sum of factors * others`, block by block.
#[inline(always)]
fn take_off<S: Simd, const COUNT: usize>(
    simd: S,
    row: &mut [Block],
    factors: [f64; COUNT],
    others: [&[Block]; COUNT],
) {
    for (b, block) in row.iter_mut().enumerate() {
        for at in (0..MAX_LANES).step_by(S::LANES) {
            let mut left = simd.load(&block[at..]);
            for (factor, other) in factors.iter().zip(others) {
                left = simd.splat(*factor).neg_mul_add(simd.load(&other[b][at..]), left);
            }
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
        let (size, blocks) = (*size, *blocks);
        for k in (0..size).step_by(TOGETHER) {
            let end = (k + TOGETHER).min(size);
            let (done, rest) = upper.split_at_mut(end * blocks);
            let done = &mut done[k * blocks..];
            let mut inverses = [0.0; TOGETHER];
            for p in k..end {
                let (row, others) = done[(p - k) * blocks..].split_at_mut(blocks);
                let entries = row.as_flattened();
                if !(f64::MIN_POSITIVE..f64::INFINITY).contains(&entries[p]) {
                    return false;
                }
                inverses[p - k] = 1.0 / entries[p];
                for (other, i) in others.chunks_exact_mut(blocks).zip(p + 1..) {
                    let first = i / MAX_LANES;
                    take_off(simd, &mut other[first..], [entries[i] * inverses[p - k]], [&row[first..]]);
                }
            }
            // Rows are left below only where the block is full.
            let rows: [&[Block]; TOGETHER] =
                std::array::from_fn(|p| done.get(p * blocks..(p + 1) * blocks).unwrap_or_default());
            for (line, i) in rest.chunks_exact_mut(blocks).zip(end..) {
                let first = i / MAX_LANES;
                let factors = std::array::from_fn(|p| rows[p].as_flattened()[i] * inverses[p]);
                take_off(simd, &mut line[first..], factors, rows.map(|row| &row[first..]));
            }
        }
        true
    }
}

/// `m^-1 left`; the solution is zero before.
struct Solve<'a> {
    factor: &'a Factor,
    left: &'a mut [Block],
    solution: &'a mut [Block],
}

impl Kernel for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Factor { size, blocks, upper, .. } = self.factor;
        let mut eliminated = Vec::with_capacity(*size);
        for (k, row) in upper.chunks_exact(*blocks).enumerate() {
            let (first, value) = (k / MAX_LANES, self.left.as_flattened()[k]);
            eliminated.push(value);
            // What stands before it in its block has been read already.
            take_off(simd, &mut self.left[first..], [value / row.as_flattened()[k]], [&row[first..]]);
        }
        for (k, row) in upper.chunks_exact(*blocks).enumerate().rev() {
            let mut known = simd.splat(0.0);
            // What is not known yet is zero.
            for (row, solution) in row.iter().zip(&*self.solution).skip(k / MAX_LANES) {
                for at in (0..MAX_LANES).step_by(S::LANES) {
                    known = simd.load(&row[at..]).mul_add(simd.load(&solution[at..]), known);
                }
            }
            let value = (eliminated[k] - known.sum()) / row.as_flattened()[k];
            self.solution.as_flattened_mut()[k] = value;
        }
    }
}

/// `L^-1` and, where there is room for it, `(L^-1)' D^-1 L^-1` for `U = D L'`, lower triangles row by row; both zero
/// before.
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
        let (size, blocks) = (*size, *blocks);
        for k in (0..size).step_by(TOGETHER) {
            let end = (k + TOGETHER).min(size);
            let (done, rest) = self.lower.split_at_mut(end * blocks);
            let done = &mut done[k * blocks..];
            let pivots = |p: usize| upper[p * blocks..(p + 1) * blocks].as_flattened();
            for p in k..end {
                let (row, others) = done[(p - k) * blocks..].split_at_mut(blocks);
                for (other, i) in others.chunks_exact_mut(blocks).zip(p + 1..) {
                    let factor = pivots(p)[i] / pivots(p)[p];
                    take_off(simd, &mut other[..=p / MAX_LANES], [factor], [row]);
                }
            }
            // These rows are done: off those below, which do not wait for each other. Missing ones weigh nothing.
            let mut rows: [&[Block]; TOGETHER] = [&done[..blocks]; TOGETHER];
            let mut inverses = [0.0; TOGETHER];
            for p in k..end {
                rows[p - k] = &done[(p - k) * blocks..(p - k + 1) * blocks];
                inverses[p - k] = 1.0 / pivots(p)[p];
            }
            let filled = (end - 1) / MAX_LANES + 1;
            for (other, i) in rest.chunks_exact_mut(blocks).zip(end..) {
                let factors = std::array::from_fn(|p| pivots(k + p)[i] * inverses[p]);
                take_off(simd, &mut other[..filled], factors, rows);
            }
            for (i, sum) in self.inverse.chunks_exact_mut(blocks).enumerate().take(end) {
                let factors = std::array::from_fn(|p| -rows[p].as_flattened()[i] * inverses[p]);
                take_off(simd, &mut sum[..=i / MAX_LANES], factors, rows);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

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
            let root = DMatrix::from_row_slice(size, size, &factor.inverse_root(size));
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
            let solution = &m * DVector::from_vec(factor.solve(&right));
            for (i, (a, b)) in solution.iter().zip(&right).enumerate() {
                assert!((a - b).abs() < 1e-8 * m[(i, i)].sqrt().max(1.0), "{a} {b}");
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
