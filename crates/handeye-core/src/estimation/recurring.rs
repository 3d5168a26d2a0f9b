//! Sums over stations where parameters are coefficients of functions that the stations share.
//!
//! What recurs moves a station by columns `c` of its own times functions of the stations: the column of coefficient
//! `(c, i)` at station `k` is `f_i(k) c_k`. Sums over the stations of products with it are `sum_k f_i(k) G_k` of products
//! `G_k` with the few `c_k` alone, and so are rows times a matrix of all coefficients.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use super::products::{Accumulate, ROWS, multiply};
use crate::positive::Block;
use crate::simd::{Kernel, MAX_LANES, Simd, Vector};

/// Functions of an error that recurs; where there are fewer, the others are zero.
pub(super) const FUNCTIONS: usize = 6;

/// Values of the functions at each station, for each column of what recurs.
pub(super) type Functions<'a> = [&'a [Block]];

/// Sum of squares of what functions are at a station.
pub(super) fn squared(functions: &Block) -> f64 {
    functions.iter().map(|f| f * f).sum()
}

/// Products of the first columns of each station's rows with others of its rows, station by station.
pub(super) struct EachStation<'a> {
    pub sizes: &'a [usize],
    pub left: &'a [f64],
    pub width: usize,
    /// Columns of the left.
    pub count: usize,
    pub right: &'a [f64],
    pub across: usize,
    /// First column of the right that is wanted, and whether of the first columns only later ones are.
    pub from: usize,
    pub upper: bool,
    /// `count` rows of `across` per station, zero before.
    pub out: &'a mut [f64],
}

impl Kernel for EachStation<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { sizes, mut left, width, count, mut right, across, from, upper, out } = self;
        for (size, sum) in sizes.iter().zip(out.chunks_exact_mut(count * across)) {
            let (rows, after) = left.split_at(size * width);
            let (others, others_after) = right.split_at(size * across);
            (left, right) = (after, others_after);
            let of_rows = Accumulate {
                left: rows,
                width,
                first: 0,
                size: count,
                right: others,
                across,
                from,
                upper,
                sum,
            };
            of_rows.run(simd);
        }
    }
}

/// Sums over the stations of products of every coefficient with other columns, from those of [`EachStation`]: rows of
/// coefficients, `width` apart.
pub(super) struct OverStations<'a> {
    pub functions: &'a Functions<'a>,
    pub products: &'a [f64],
    pub across: usize,
    /// Columns of the products that are summed as they are, in whole vectors from the first, and where they come to stand.
    pub plain: std::ops::Range<usize>,
    pub to: usize,
    /// Whether products of coefficients with those of the same column and later ones come first in the rows.
    pub pairs: bool,
    pub out: &'a mut [f64],
    pub width: usize,
}

impl Kernel for OverStations<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { functions, products, across, plain, to, pairs, out, width } = self;
        let apart = functions.len() * across;
        for (a, lines) in out.chunks_exact_mut(FUNCTIONS * width).enumerate().take(functions.len()) {
            let own = || functions[a].iter().zip(products[a * across..].chunks(apart));
            for b in if pairs { a..functions.len() } else { 0..0 } {
                for part in (0..MAX_LANES).step_by(S::LANES) {
                    let mut totals = [simd.splat(0.0); FUNCTIONS];
                    for ((of, products), other) in own().zip(functions[b]) {
                        let values = simd.splat(products[b]) * simd.load(&other[part..]);
                        for (total, f) in totals.iter_mut().zip(of) {
                            *total = simd.splat(*f).mul_add(values, *total);
                        }
                    }
                    // What stands beyond its functions is written over by what comes next.
                    for (total, line) in totals.iter().zip(lines.chunks_exact_mut(width)) {
                        total.store(&mut line[FUNCTIONS * b + part..]);
                    }
                }
            }
            for at in plain.clone().step_by(S::LANES) {
                let mut totals = [simd.splat(0.0); FUNCTIONS];
                for (of, products) in own() {
                    let values = simd.load(&products[at..]);
                    for (total, f) in totals.iter_mut().zip(of) {
                        *total = simd.splat(*f).mul_add(values, *total);
                    }
                }
                for (total, line) in totals.iter().zip(lines.chunks_exact_mut(width)) {
                    total.store(&mut line[to + at - plain.start..]);
                }
            }
        }
    }
}

/// Rows of all stations times a matrix of all parameters, coefficients first, that is zero below its diagonal.
pub(super) struct Through<'a> {
    pub functions: &'a Functions<'a>,
    pub sizes: &'a [usize],
    pub rows: &'a [f64],
    pub width: usize,
    /// Where the other parameters' columns begin in the rows.
    pub lead: usize,
    pub matrix: &'a [f64],
    pub wide: usize,
    pub out: &'a mut [f64],
}

impl Kernel for Through<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let wide = self.wide;
        let told = self.matrix.len() / wide - FUNCTIONS * self.functions.len();
        // What is in a few columns for the columns of a station: near at hand for all of them.
        let mut near = vec![0.0; (self.lead + told) * 2 * S::LANES];
        let mut this = self;
        let mut at = 0;
        while at + 2 * S::LANES <= wide {
            this.columns::<S, 2>(simd, at, &mut near);
            at += 2 * S::LANES;
        }
        while at < wide {
            this.columns::<S, 1>(simd, at, &mut near);
            at += S::LANES;
        }
    }
}

impl Through<'_> {
    #[inline(always)]
    fn columns<S: Simd, const VECTORS: usize>(&mut self, simd: S, at: usize, near: &mut [f64]) {
        let Self { functions, sizes, rows, width, lead, matrix, wide, out } = self;
        let (width, lead, wide) = (*width, *lead, *wide);
        let (mut rows, mut out) = (*rows, &mut **out);
        let (of_recurring, of_told) = matrix.split_at(FUNCTIONS * functions.len() * wide);
        let across = VECTORS * S::LANES;
        let near = &mut near[..(lead + of_told.len() / wide) * across];
        for (near, row) in near[lead * across..].chunks_exact_mut(across).zip(of_told.chunks_exact(wide)) {
            near.copy_from_slice(&row[at..at + across]);
        }
        // Below the diagonal there is nothing.
        let reached = functions.len().min((at + across).div_ceil(FUNCTIONS));
        let beyond = (at + across).saturating_sub(FUNCTIONS * functions.len());
        let height = if beyond > 0 { lead + beyond } else { reached };
        for (station, size) in sizes.iter().enumerate() {
            for (a, (functions, near)) in
                functions.iter().zip(near.chunks_exact_mut(across)).enumerate().take(reached)
            {
                let mut totals = [simd.splat(0.0); VECTORS];
                for (i, f) in functions[station].iter().enumerate().take(FUNCTIONS) {
                    let row = &of_recurring[(FUNCTIONS * a + i) * wide + at..][..across];
                    for (v, total) in totals.iter_mut().enumerate() {
                        *total = simd.splat(*f).mul_add(simd.load(&row[v * S::LANES..]), *total);
                    }
                }
                for (v, total) in totals.iter().enumerate() {
                    total.store(&mut near[v * S::LANES..]);
                }
            }
            let (here, rows_after) = rows.split_at(size * width);
            let (to, out_after) = out.split_at_mut(size * wide);
            (rows, out) = (rows_after, out_after);
            for (here, to) in here.chunks(ROWS * width).zip(to.chunks_mut(ROWS * wide)) {
                multiply::<S, VECTORS>(simd, (here, width), (near, across, 0), height, (to, wide, at));
            }
        }
    }
}
