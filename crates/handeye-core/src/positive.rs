//! Positive definite matrices of any size, whatever the units of their rows.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use nalgebra::DMatrix;

use crate::simd::{Kernel, MAX_LANES, Simd, Vector, VectorUnit, dispatch};

/// Neighbours in a row that every unit takes in whole vectors.
pub(crate) type Block = [f64; MAX_LANES];

/// `U' D^-1 U` of a positive definite matrix, `D` the diagonal of the upper triangular `U`.
#[derive(Clone, Debug)]
pub(crate) struct Factor {
    size: usize,
    /// Blocks of a row.
    blocks: usize,
    /// `U` row by row, what was carried along behind it; what lies below the diagonal means nothing.
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
        Self::carrying(size, upper)
    }

    /// By the upper triangle of a matrix, row by row, each with an entry of a right side behind it: see
    /// [`Self::carried`] and [`Self::solution`].
    pub fn carrying(size: usize, upper: Vec<Block>) -> Option<Self> {
        let mut factor = Self { size, blocks: upper.len() / size.max(1), upper, unit: VectorUnit::widest() };
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

    /// `right' m^-1 right` of the right side that was carried along.
    pub fn carried(&self) -> f64 {
        self.carried_entries().zip(self.pivots()).map(|(entry, pivot)| entry * entry / pivot).sum()
    }

    /// `m^-1 right` of the right side that was carried along.
    pub fn solution(&self) -> Vec<f64> {
        let mut solution = vec![[0.0; MAX_LANES]; self.blocks];
        let eliminated = &self.carried_entries().collect::<Vec<_>>()[..];
        dispatch(self.unit, Backward { factor: self, eliminated, solution: &mut solution });
        solution.as_flattened()[..self.size].to_vec()
    }

    fn carried_entries(&self) -> impl Iterator<Item = f64> {
        self.upper.chunks_exact(self.blocks).map(|row| row.as_flattened()[self.size])
    }

    /// `R` with `R R' = m^-1`: `U^-1 D^1/2`, row by row in rows of `across`, whole blocks; zero below the diagonal.
    pub fn inverse_root(&self, across: usize) -> Vec<f64> {
        let mut root = vec![0.0; self.size * across];
        dispatch(self.unit, Root { factor: self, across, out: &mut root });
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

/// Vectors of a row that are summed together.
const VECTORS: usize = 3;

/// Adds products of factors with other rows to vectors of a few rows.
#[inline(always)]
fn add<S: Simd, const COUNT: usize>(
    simd: S,
    rows: &mut [f64],
    across: usize,
    at: usize,
    (factors, others): (&[[f64; TOGETHER]], &[f64]),
) {
    let mut totals = [[simd.splat(0.0); COUNT]; TOGETHER];
    for (line, row) in totals.iter_mut().zip(rows.chunks_exact(across)) {
        for (v, total) in line.iter_mut().enumerate() {
            *total = simd.load(&row[at + v * S::LANES..]);
        }
    }
    for (factors, other) in factors.iter().zip(others.chunks_exact(across)) {
        let other = &other[at..at + COUNT * S::LANES];
        let mut values = [simd.splat(0.0); COUNT];
        for (v, value) in values.iter_mut().enumerate() {
            *value = simd.load(&other[v * S::LANES..]);
        }
        for (line, factor) in totals.iter_mut().zip(factors) {
            let factor = simd.splat(*factor);
            for (total, value) in line.iter_mut().zip(values) {
                *total = factor.mul_add(value, *total);
            }
        }
    }
    for (line, row) in totals.iter().zip(rows.chunks_exact_mut(across)) {
        for (v, total) in line.iter().enumerate() {
            total.store(&mut row[at + v * S::LANES..]);
        }
    }
}

/// Eliminates a few rows at a time; whether every pivot is positive and finite.
struct Eliminate<'a> {
    factor: &'a mut Factor,
}

impl Kernel for Eliminate<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> bool {
        let Factor { size, blocks, upper, .. } = self.factor;
        let (size, across) = (*size, *blocks * MAX_LANES);
        let mut inverses = Vec::with_capacity(size);
        let mut factors: Vec<[f64; TOGETHER]> = Vec::with_capacity(size);
        for k in (0..size).step_by(TOGETHER) {
            let end = (k + TOGETHER).min(size);
            let (done, rest) = upper.as_flattened_mut().split_at_mut(k * across);
            let rows = &mut rest[..(end - k) * across];
            factors.clear();
            for (row, inverse) in done.chunks_exact(across).zip(&inverses) {
                // Of rows that are missing nothing is kept.
                factors.push(std::array::from_fn(|r| -row[k..k + TOGETHER][r] * inverse));
            }
            let mut at = k / S::LANES * S::LANES;
            while at + VECTORS * S::LANES <= across {
                add::<S, VECTORS>(simd, rows, across, at, (&factors, done));
                at += VECTORS * S::LANES;
            }
            while at < across {
                add::<S, 1>(simd, rows, across, at, (&factors, done));
                at += S::LANES;
            }
            for p in k..end {
                let (row, others) = rows[(p - k) * across..].split_at_mut(across);
                if !(f64::MIN_POSITIVE..f64::INFINITY).contains(&row[p]) {
                    return false;
                }
                let inverse = 1.0 / row[p];
                inverses.push(inverse);
                for (other, i) in others.chunks_exact_mut(across).zip(p + 1..) {
                    let factor = simd.splat(row[i] * inverse);
                    for at in (i / S::LANES * S::LANES..across).step_by(S::LANES) {
                        let left = factor.neg_mul_add(simd.load(&row[at..]), simd.load(&other[at..]));
                        left.store(&mut other[at..]);
                    }
                }
            }
        }
        true
    }
}

/// `U^-1 D^1/2` in rows of `across`, from the last; zero before.
struct Root<'a> {
    factor: &'a Factor,
    across: usize,
    out: &'a mut [f64],
}

impl Kernel for Root<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { factor: Factor { size, blocks, upper, .. }, across, out } = self;
        let width = *blocks * MAX_LANES;
        let upper = upper.as_flattened();
        let filled = size.next_multiple_of(S::LANES);
        let mut factors: Vec<[f64; TOGETHER]> = Vec::with_capacity(*size);
        for k in (0..*size).step_by(TOGETHER).rev() {
            let end = (k + TOGETHER).min(*size);
            let (rows, done) = out[k * across..].split_at_mut((end - k) * across);
            // Of rows that are missing the last again: it is not stored.
            let of: [&[f64]; TOGETHER] =
                std::array::from_fn(|r| &upper[(k + r).min(end - 1) * width..][..width]);
            factors.clear();
            factors.extend((end..*size).map(|p| of.map(|row| -row[p])));
            // Of each vector the rows that reach it.
            let products = |last: usize| (&factors[..last.min(*size).saturating_sub(end)], &*done);
            let mut at = k / S::LANES * S::LANES;
            while at + VECTORS * S::LANES <= filled {
                add::<S, VECTORS>(simd, rows, across, at, products(at + VECTORS * S::LANES));
                at += VECTORS * S::LANES;
            }
            while at < filled {
                add::<S, 1>(simd, rows, across, at, products(at + S::LANES));
                at += S::LANES;
            }
            for p in (k..end).rev() {
                let (others, row) = rows.split_at_mut((p - k) * across);
                let pivot = of[p - k][p];
                row[p] = pivot.sqrt();
                let inverse = simd.splat(1.0 / pivot);
                for at in (p / S::LANES * S::LANES..filled).step_by(S::LANES) {
                    let value = simd.load(&row[at..]) * inverse;
                    value.store(&mut row[at..]);
                    for (other, of) in others.chunks_exact_mut(across).zip(of) {
                        let left = simd.splat(of[p]).neg_mul_add(value, simd.load(&other[at..]));
                        left.store(&mut other[at..]);
                    }
                }
            }
        }
    }
}

/// `U^-1 eliminated`; the solution is zero before.
struct Backward<'a> {
    factor: &'a Factor,
    eliminated: &'a [f64],
    solution: &'a mut [Block],
}

impl Kernel for Backward<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Factor { blocks, upper, .. } = self.factor;
        for (k, row) in upper.chunks_exact(*blocks).enumerate().rev() {
            let mut known = simd.splat(0.0);
            // What is not known yet is zero.
            for (row, solution) in row.iter().zip(&*self.solution).skip(k / MAX_LANES) {
                for at in (0..MAX_LANES).step_by(S::LANES) {
                    known = simd.load(&row[at..]).mul_add(simd.load(&solution[at..]), known);
                }
            }
            let value = (self.eliminated[k] - known.sum()) / row.as_flattened()[k];
            self.solution.as_flattened_mut()[k] = value;
        }
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
mod tests;
