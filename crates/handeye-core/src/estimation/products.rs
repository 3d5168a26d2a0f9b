//! Products of tall matrices, row by row in whole vectors.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use nalgebra::DMatrix;

use crate::simd::{Kernel, Simd, Vector, VectorUnit, dispatch};

/// `L^-1` times rows, in place.
pub(super) struct Whiten<'a> {
    pub factor: &'a DMatrix<f64>,
    pub rows: &'a mut [f64],
    pub width: usize,
}

impl Kernel for Whiten<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let size = self.factor.nrows();
        for i in 0..size {
            let (done, rest) = self.rows.split_at_mut(i * self.width);
            let row = &mut rest[..self.width];
            let inverse = simd.splat(1.0 / self.factor[(i, i)]);
            for at in (0..self.width).step_by(S::LANES) {
                let mut value = simd.load(&row[at..]);
                for j in 0..i {
                    let factor = simd.splat(self.factor[(i, j)]);
                    value = factor.neg_mul_add(simd.load(&done[j * self.width + at..]), value);
                }
                (value * inverse).store(&mut row[at..]);
            }
        }
    }
}

/// Columns whose products are summed together.
pub(super) const TOGETHER: usize = 4;

/// Adds the products of all pairs of columns: whole vectors of the upper triangle, row by row.
pub(super) struct Accumulate<'a> {
    pub rows: &'a [f64],
    pub width: usize,
    pub size: usize,
    pub sum: &'a mut [f64],
}

impl Kernel for Accumulate<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        for i in (0..self.size).step_by(TOGETHER) {
            let first = i / S::LANES * S::LANES;
            for at in (first..self.width).step_by(S::LANES) {
                let mut totals = [simd.splat(0.0); TOGETHER];
                for (k, total) in totals.iter_mut().enumerate() {
                    *total = simd.load(&self.sum[(i + k) * self.width + at..]);
                }
                for row in self.rows.chunks_exact(self.width) {
                    let values = simd.load(&row[at..]);
                    for (k, total) in totals.iter_mut().enumerate() {
                        *total = simd.splat(row[i + k]).mul_add(values, *total);
                    }
                }
                for (k, total) in totals.iter().enumerate() {
                    total.store(&mut self.sum[(i + k) * self.width + at..]);
                }
            }
        }
    }
}

/// Rows (of `width`, the first `n` entries) times a symmetric matrix, column by column.
pub(super) fn product_with(
    unit: VectorUnit,
    rows: &[f64],
    width: usize,
    size: usize,
    matrix: &DMatrix<f64>,
) -> Vec<f64> {
    let mut out = vec![0.0; size * matrix.ncols()];
    dispatch(unit, Product { rows, width, size, matrix, out: &mut out });
    out
}

struct Product<'a> {
    rows: &'a [f64],
    width: usize,
    size: usize,
    matrix: &'a DMatrix<f64>,
    out: &'a mut [f64],
}

impl Kernel for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let n = self.matrix.ncols();
        let whole = n / S::LANES * S::LANES;
        for (j, column) in self.matrix.as_slice().chunks_exact(n).enumerate() {
            for (r, row) in self.rows.chunks_exact(self.width).enumerate() {
                let mut total = simd.splat(0.0);
                for at in (0..whole).step_by(S::LANES) {
                    total = simd.load(&row[at..]).mul_add(simd.load(&column[at..]), total);
                }
                let mut value = total.sum();
                for at in whole..n {
                    value += row[at] * column[at];
                }
                self.out[j * self.size + r] = value;
            }
        }
    }
}
