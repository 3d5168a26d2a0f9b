//! Covariances of all stations and their Cholesky factors, lanes = stations.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use nalgebra::DMatrix;

use crate::simd::{Kernel, MAX_LANES, Mask, Simd, Vector, VectorUnit, dispatch, ln};

/// Where entry `(i, j)` of a lower triangle stands, row by row.
fn packed(i: usize, j: usize) -> usize {
    i * (i + 1) / 2 + j
}

/// Terms of the covariances of all stations: each entry of a lower triangle, of all stations side by side.
#[derive(Clone)]
pub(super) struct StationCovariances {
    /// Rows of the largest; what smaller ones lack is of unit variance and shared with nothing.
    order: usize,
    /// Stations, up to whole vectors.
    across: usize,
    /// Rows of each station.
    pub sizes: Vec<usize>,
    pixels: Vec<f64>,
    noises: Vec<Vec<f64>>,
    /// Of recurring priors; empty for others.
    priors: Vec<Vec<f64>>,
}

impl StationCovariances {
    /// From what the pixels give each station, and what each noise and each prior adds at a deviation of one; nothing of
    /// priors that do not recur.
    pub fn of<'a>(
        pixels: &[&DMatrix<f64>],
        noises: impl Iterator<Item = &'a [DMatrix<f64>]>,
        priors: impl Iterator<Item = &'a [DMatrix<f64>]>,
    ) -> Self {
        let sizes: Vec<usize> = pixels.iter().map(|m| m.nrows()).collect();
        let order = sizes.iter().copied().max().unwrap_or(0);
        let across = sizes.len().next_multiple_of(MAX_LANES);
        let in_lanes = |all: &mut dyn Iterator<Item = &DMatrix<f64>>| -> Vec<f64> {
            let mut entries = vec![0.0; packed(order, 0) * across];
            for (k, m) in all.enumerate() {
                for i in 0..m.nrows() {
                    for j in 0..=i {
                        entries[packed(i, j) * across + k] = m[(i, j)];
                    }
                }
            }
            entries
        };
        let mut of_pixels = in_lanes(&mut pixels.iter().copied());
        for k in 0..across {
            for i in sizes.get(k).copied().unwrap_or(0)..order {
                of_pixels[packed(i, i) * across + k] = 1.0;
            }
        }
        let of = |all: &[DMatrix<f64>]| if all.is_empty() { vec![] } else { in_lanes(&mut all.iter()) };
        Self {
            order,
            across,
            pixels: of_pixels,
            noises: noises.map(of).collect(),
            priors: priors.map(of).collect(),
            sizes,
        }
    }

    /// Cholesky factors at the deviations of the noises and, where recurring errors count as new at every station, of
    /// the priors; with them the logarithm of all determinants. `None` where one is not positive definite.
    pub fn factorised(
        &self,
        unit: VectorUnit,
        noise: &[f64],
        prior: Option<&[f64]>,
    ) -> Option<(StationFactors, f64)> {
        let new = self.noises.iter().zip(noise);
        let again = self.priors.iter().zip(prior.unwrap_or_default()).filter(|(p, _)| !p.is_empty());
        let terms: Vec<(&[f64], f64)> = new.chain(again).map(|(of, s)| (&of[..], s * s)).collect();
        let mut factors = StationFactors { across: self.across, entries: vec![0.0; self.pixels.len()] };
        let kernel = Factorise { given: self, terms: &terms, out: &mut factors.entries };
        let log_determinant = dispatch(unit, kernel)?;
        Some((factors, log_determinant))
    }
}

/// Lower triangles `L` of all stations, the inverses of their diagonals in place of these.
pub(super) struct StationFactors {
    across: usize,
    entries: Vec<f64>,
}

impl StationFactors {
    /// The triangle of a station, row by row in rows of `size`.
    #[inline(always)]
    fn copy(&self, k: usize, size: usize, triangle: &mut Vec<f64>) {
        triangle.clear();
        triangle.resize(size * size, 0.0);
        for (i, row) in triangle.chunks_exact_mut(size.max(1)).enumerate() {
            for (j, entry) in row[..=i].iter_mut().enumerate() {
                *entry = self.entries[packed(i, j) * self.across + k];
            }
        }
    }
}

struct Factorise<'a> {
    given: &'a StationCovariances,
    terms: &'a [(&'a [f64], f64)],
    out: &'a mut [f64],
}

impl Kernel for Factorise<'_> {
    type Output = Option<f64>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Option<f64> {
        let Self { given: StationCovariances { order, across, pixels, .. }, terms, out } = self;
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        let mut logarithms = zero;
        for at in (0..*across).step_by(S::LANES) {
            let place = |i: usize, j: usize| packed(i, j) * across + at;
            for first in (at..out.len()).step_by(*across) {
                let mut value = simd.load(&pixels[first..]);
                for (square, variance) in terms {
                    value = simd.splat(*variance).mul_add(simd.load(&square[first..]), value);
                }
                value.store(&mut out[first..]);
            }
            for j in 0..*order {
                for i in j..*order {
                    let mut value = simd.load(&out[place(i, j)..]);
                    for q in 0..j {
                        let (a, b) = (simd.load(&out[place(i, q)..]), simd.load(&out[place(j, q)..]));
                        value = a.neg_mul_add(b, value);
                    }
                    if i > j {
                        value = value * simd.load(&out[place(j, j)..]);
                    } else {
                        if !value.greater(zero).all() {
                            return None;
                        }
                        logarithms = logarithms + ln(simd, value);
                        value = one / value.sqrt();
                    }
                    value.store(&mut out[place(i, j)..]);
                }
            }
        }
        let sum = logarithms.sum();
        sum.is_finite().then_some(sum)
    }
}

/// `L^-1` times the rows of all stations, one after the other.
pub(super) struct Whiten<'a> {
    pub factors: &'a StationFactors,
    /// Of each station.
    pub rows: &'a [&'a [f64]],
    pub width: usize,
    pub out: &'a mut [f64],
}

impl Kernel for Whiten<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { factors, rows, width, mut out } = self;
        let mut triangle = Vec::new();
        for (k, from) in rows.iter().enumerate() {
            let (to, rest) = out.split_at_mut(from.len());
            out = rest;
            let size = from.len() / width;
            factors.copy(k, size, &mut triangle);
            match size {
                3 => whiten_few::<S, 3>(simd, &triangle, from, width, to),
                6 => whiten_few::<S, 6>(simd, &triangle, from, width, to),
                _ => whiten_many(simd, &triangle, from, width, to),
            }
        }
    }
}

/// Rows of a touch or of one picture, kept in registers.
#[inline(always)]
fn whiten_few<S: Simd, const ROWS: usize>(
    simd: S,
    triangle: &[f64],
    from: &[f64],
    width: usize,
    to: &mut [f64],
) {
    for at in (0..width).step_by(S::LANES) {
        let mut values = [simd.splat(0.0); ROWS];
        for i in 0..ROWS {
            let mut value = simd.load(&from[i * width + at..]);
            for j in 0..i {
                value = simd.splat(triangle[i * ROWS + j]).neg_mul_add(values[j], value);
            }
            values[i] = value * simd.splat(triangle[i * ROWS + i]);
            values[i].store(&mut to[i * width + at..]);
        }
    }
}

/// Rows of several measurements.
#[inline(always)]
fn whiten_many<S: Simd>(simd: S, triangle: &[f64], from: &[f64], width: usize, to: &mut [f64]) {
    let size = from.len() / width;
    let lines = from.chunks_exact(width).zip(triangle.chunks_exact(size.max(1)));
    for (i, (from, factors)) in lines.enumerate() {
        let (done, row) = to.split_at_mut(i * width);
        let inverse = simd.splat(factors[i]);
        for at in (0..width).step_by(S::LANES) {
            let mut value = simd.load(&from[at..]);
            for (done, factor) in done.chunks_exact(width).zip(factors) {
                value = simd.splat(*factor).neg_mul_add(simd.load(&done[at..]), value);
            }
            (value * inverse).store(&mut row[at..]);
        }
    }
}
