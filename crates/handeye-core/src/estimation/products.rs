//! Products of tall matrices, row by row in whole vectors.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use crate::simd::{Kernel, Simd, Vector};

/// Columns whose products are summed together.
pub(super) const TOGETHER: usize = 4;
/// Rows that stay in the nearest cache while all their products are summed.
const NEAR: usize = 32;

/// Adds the products of columns of one matrix with columns of another, whose rows lie side by side: whole vectors, row
/// by row; of a matrix with itself (`upper`) those of the upper triangle.
pub(super) struct Accumulate<'a> {
    pub left: &'a [f64],
    pub width: usize,
    /// Columns of the left that take part.
    pub size: usize,
    pub right: &'a [f64],
    pub across: usize,
    pub upper: bool,
    pub sum: &'a mut [f64],
}

impl<'a> Accumulate<'a> {
    /// All pairs of the first columns of one matrix.
    pub fn pairs(rows: &'a [f64], width: usize, size: usize, sum: &'a mut [f64]) -> Self {
        Self { left: rows, width, size, right: rows, across: width, upper: true, sum }
    }
}

impl Kernel for Accumulate<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { width, size, across, upper, sum, .. } = self;
        let pieces = self.left.chunks(NEAR * width).zip(self.right.chunks(NEAR * across));
        for (left, right) in pieces {
            for i in (0..size).step_by(TOGETHER) {
                let mut at = if upper { i / S::LANES * S::LANES } else { 0 };
                let rows = || left.chunks_exact(width).map(|row| &row[i..i + TOGETHER]);
                while at + 2 * S::LANES <= across {
                    add_products::<S, 2>(simd, rows(), right, across, at, &mut sum[i * across..]);
                    at += 2 * S::LANES;
                }
                while at < across {
                    add_products::<S, 1>(simd, rows(), right, across, at, &mut sum[i * across..]);
                    at += S::LANES;
                }
            }
        }
    }
}

/// Adds the products of a few columns of one matrix with as many whole vectors of another, kept in registers.
#[inline(always)]
fn add_products<'a, S: Simd, const VECTORS: usize>(
    simd: S,
    left: impl Iterator<Item = &'a [f64]>,
    right: &[f64],
    across: usize,
    at: usize,
    sum: &mut [f64],
) {
    let mut totals = [[simd.splat(0.0); VECTORS]; TOGETHER];
    for (left, right) in left.zip(right.chunks_exact(across)) {
        let mut values = [simd.splat(0.0); VECTORS];
        for (v, value) in values.iter_mut().enumerate() {
            *value = simd.load(&right[at + v * S::LANES..]);
        }
        for (k, line) in totals.iter_mut().enumerate() {
            let factor = simd.splat(left[k]);
            for (total, value) in line.iter_mut().zip(values) {
                *total = factor.mul_add(value, *total);
            }
        }
    }
    for (line, sum) in totals.iter().zip(sum.chunks_mut(across)) {
        for (v, total) in line.iter().enumerate() {
            let sum = &mut sum[at + v * S::LANES..];
            (simd.load(sum) + *total).store(sum);
        }
    }
}

/// Rows times a matrix, whole vectors at a time.
pub(super) struct Product<'a> {
    pub rows: &'a [f64],
    pub width: usize,
    /// Row by row, `across` apart; as many rows as columns of the rows take part.
    pub matrix: &'a [f64],
    pub across: usize,
    /// First columns of the matrix that are zero below the diagonal.
    pub triangular: usize,
    pub out: &'a mut [f64],
}

/// Rows that are multiplied together.
const ROWS: usize = 6;

impl Kernel for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let count = self.rows.len() / self.width;
        for first in (0..count).step_by(ROWS) {
            for at in (0..self.across).step_by(S::LANES) {
                let mut totals = [simd.splat(0.0); ROWS];
                let end = at + S::LANES;
                let rows = if end <= self.triangular { end } else { usize::MAX };
                for (i, line) in self.matrix.chunks_exact(self.across).enumerate().take(rows) {
                    let values = simd.load(&line[at..]);
                    for (k, total) in totals.iter_mut().enumerate() {
                        // Where rows run out, the last of them again.
                        let row = (first + k).min(count - 1);
                        *total = simd.splat(self.rows[row * self.width + i]).mul_add(values, *total);
                    }
                }
                for (k, total) in totals.iter().enumerate().take(count - first) {
                    total.store(&mut self.out[(first + k) * self.across + at..]);
                }
            }
        }
    }
}

/// Products of all rows of one matrix with all of another, over their first `width` columns.
pub(super) struct RowProducts<'a> {
    pub left: &'a [f64],
    pub across: usize,
    pub right: &'a [f64],
    pub width: usize,
    pub out: &'a mut [f64],
}

impl Kernel for RowProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let count = self.right.len() / self.width;
        for (left, out) in self.left.chunks_exact(self.across).zip(self.out.chunks_exact_mut(count)) {
            for (right, out) in self.right.chunks_exact(self.width).zip(out) {
                let mut total = simd.splat(0.0);
                for at in (0..self.width).step_by(S::LANES) {
                    total = simd.load(&left[at..]).mul_add(simd.load(&right[at..]), total);
                }
                *out = total.sum();
            }
        }
    }
}
