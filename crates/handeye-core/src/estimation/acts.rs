//! What each term of the covariance does to what was measured: `dV P y`.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use super::mixed::Mixed;
use super::products::{Product, RowSquares};
use super::recurring::Through;
use crate::simd::{Kernel, MAX_LANES, Simd};

/// `dV P y` of each term, whitened, in the rows of the stations; of each noise, twice its slope.
pub(super) struct Acts<'a> {
    pub mixed: &'a Mixed,
    /// Whitened rows of all stations.
    pub rows: &'a [f64],
    /// Whitened roots of all noises, `columns` wide.
    pub roots: &'a [f64],
    pub columns: usize,
    /// Deviations of the noises.
    pub noise: &'a [f64],
    /// Side by side, `wide` across: a root of the covariance of the parameters, theta, and deviations from each prior.
    pub matrix: &'a [f64],
    pub wide: usize,
}

impl Kernel for Acts<'_> {
    type Output = (Vec<f64>, Vec<f64>);

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> (Vec<f64>, Vec<f64>) {
        let Self { mixed, mut rows, mut roots, columns, noise, matrix, wide } = self;
        let (n, width, noises) = (mixed.size, mixed.width, mixed.noises.len());
        let terms = noises + mixed.priors.len();
        let across = terms.next_multiple_of(MAX_LANES);
        let mut all = vec![0.0; rows.len() / width * across];
        let mut rest = &mut all[..];
        let sizes = &mixed.covariances.sizes[..];
        let functions = &mixed.functions()[..];
        let mut through = vec![0.0; rows.len() / width * wide];
        Through { functions, sizes, rows, width, lead: mixed.lead, matrix, wide, out: &mut through }
            .run(simd);
        let mut through = &mut through[..];
        let largest = sizes.iter().copied().max().unwrap_or(0);
        let mut spread = vec![0.0; largest * largest];
        let mut turned = vec![0.0; largest * columns];
        let mut q = vec![0.0; largest];
        let mut along = vec![0.0; columns];
        let mut slopes = vec![0.0; columns];
        for size in sizes.iter().copied() {
            let (here, after) = rows.split_at(size * width);
            let (acts, acts_after) = rest.split_at_mut(size * across);
            let (root, roots_after) = roots.split_at(size * columns);
            let (moved, through_after) = through.split_at_mut(size * wide);
            (rows, rest, roots, through) = (after, acts_after, roots_after, through_after);
            if size == 0 {
                continue;
            }
            let lines = here.chunks_exact(width).zip(moved.chunks_exact_mut(wide));
            for (((row, through), acts), q) in lines.zip(acts.chunks_exact_mut(across)).zip(&mut q) {
                // Whitened P y.
                *q = row[mixed.lead + mixed.told] + through[n];
                for (act, moved) in acts[noises..terms].iter_mut().zip(&through[n + 1..]) {
                    *act = -2.0 * moved;
                }
                // Of the root alone the products are wanted.
                through[n..].fill(0.0);
            }
            if columns == 0 {
                continue;
            }
            let spread = &mut spread[..size * size];
            RowSquares { rows: moved, across: wide, width: n.next_multiple_of(MAX_LANES), out: spread }
                .run(simd);
            let turned = &mut turned[..size * columns];
            Product { rows: spread, width: size, matrix: root, across: columns, out: turned }.run(simd);
            along.fill(0.0);
            for ((root, turned), q) in root.chunks_exact(columns).zip(turned.chunks_exact(columns)).zip(&q) {
                for (((root, turned), along), slope) in
                    root.iter().zip(turned).zip(&mut along).zip(&mut slopes)
                {
                    *along += root * q;
                    *slope += root * (root - turned);
                }
            }
            for (slope, along) in slopes.iter_mut().zip(&along) {
                *slope -= along * along;
            }
            for (root, acts) in root.chunks_exact(columns).zip(acts.chunks_exact_mut(across)) {
                let mut pairs = root.iter().zip(&along);
                for ((x, s), act) in mixed.noises.iter().zip(noise).zip(acts) {
                    *act = 2.0 * s * s * pairs.by_ref().take(x.columns).map(|(a, b)| a * b).sum::<f64>();
                }
            }
        }
        let mut by_column = slopes.into_iter();
        let of_noise = mixed.noises.iter().zip(noise);
        let slopes = of_noise.map(|(x, s)| s * s * by_column.by_ref().take(x.columns).sum::<f64>());
        let slopes = slopes.chain(std::iter::repeat_n(0.0, mixed.priors.len())).collect();
        (all, slopes)
    }
}
