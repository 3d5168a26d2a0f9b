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
    /// First column of the left that takes part, and how many do.
    pub first: usize,
    pub size: usize,
    pub right: &'a [f64],
    pub across: usize,
    /// First column of the right that is wanted.
    pub from: usize,
    pub upper: bool,
    pub sum: &'a mut [f64],
}

impl<'a> Accumulate<'a> {
    /// All pairs of columns of one matrix from `first` on, with `sum` in rows as wide.
    pub fn pairs(rows: &'a [f64], width: usize, first: usize, size: usize, sum: &'a mut [f64]) -> Self {
        Self { left: rows, width, first, size, right: rows, across: width, from: 0, upper: true, sum }
    }
}

impl Kernel for Accumulate<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { width, first, size, across, from: start, upper, sum, .. } = self;
        let pieces = self.left.chunks(NEAR * width).zip(self.right.chunks(NEAR * across));
        for (left, right) in pieces {
            for i in (0..size).step_by(TOGETHER) {
                let from = first + i;
                let mut at = if upper { from / S::LANES * S::LANES } else { start };
                let rows = || left.chunks_exact(width).map(|row| &row[from..from + TOGETHER]);
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
    pub out: &'a mut [f64],
}

/// Rows that are multiplied together.
pub(super) const ROWS: usize = 6;

impl Kernel for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { rows, width, matrix, across, out } = self;
        for (rows, out) in rows.chunks(ROWS * width).zip(out.chunks_mut(ROWS * across)) {
            let mut at = 0;
            while at + 2 * S::LANES <= across {
                multiply::<S, 2>(simd, (rows, width), (matrix, across, at), usize::MAX, (out, across, at));
                at += 2 * S::LANES;
            }
            while at < across {
                multiply::<S, 1>(simd, (rows, width), (matrix, across, at), usize::MAX, (out, across, at));
                at += S::LANES;
            }
        }
    }
}

/// A few rows times a few whole vectors of the first rows of a matrix; where they are in it, and where they come to stand.
#[inline(always)]
pub(super) fn multiply<S: Simd, const VECTORS: usize>(
    simd: S,
    (rows, width): (&[f64], usize),
    (matrix, across, at): (&[f64], usize, usize),
    height: usize,
    (out, out_across, to): (&mut [f64], usize, usize),
) {
    let height = height.min(matrix.len() / across);
    // Where rows run out, the last of them again.
    let last = rows.len() / width - 1;
    let rows: [&[f64]; ROWS] = std::array::from_fn(|k| &rows[k.min(last) * width..][..height]);
    let mut totals = [[simd.splat(0.0); VECTORS]; ROWS];
    for (i, line) in matrix.chunks_exact(across).enumerate().take(height) {
        let mut values = [simd.splat(0.0); VECTORS];
        for (v, value) in values.iter_mut().enumerate() {
            *value = simd.load(&line[at + v * S::LANES..]);
        }
        for (total, row) in totals.iter_mut().zip(&rows) {
            let factor = simd.splat(row[i]);
            for (total, value) in total.iter_mut().zip(values) {
                *total = factor.mul_add(value, *total);
            }
        }
    }
    for (total, line) in totals.iter().zip(out.chunks_exact_mut(out_across)) {
        for (v, total) in total.iter().enumerate() {
            total.store(&mut line[to + v * S::LANES..]);
        }
    }
}

/// Products of all rows of a matrix with each other, over their first `width` columns: whole vectors.
pub(super) struct RowSquares<'a> {
    pub rows: &'a [f64],
    pub across: usize,
    pub width: usize,
    pub out: &'a mut [f64],
}

impl Kernel for RowSquares<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { rows, across, width, out } = self;
        let count = rows.len() / across;
        for (i, row) in rows.chunks_exact(across).enumerate() {
            for (j, other) in rows.chunks_exact(across).enumerate().take(i + 1) {
                let mut total = simd.splat(0.0);
                for at in (0..width).step_by(S::LANES) {
                    total = simd.load(&row[at..]).mul_add(simd.load(&other[at..]), total);
                }
                let total = total.sum();
                out[i * count + j] = total;
                out[j * count + i] = total;
            }
        }
    }
}
