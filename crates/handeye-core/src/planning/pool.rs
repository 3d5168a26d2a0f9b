//! The informations of a pool side by side, lanes = views: what each is worth on top of a total, and how far each
//! leans on a gradient.
//!
//! A total is factorised with the hand-eye last: the product of all pivots is its determinant, that of the last six
//! the determinant of the hand-eye with everything else marginalised, and the last six rows factorise the inverse of
//! its covariance.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use nalgebra::{DMatrix, Matrix6};

use super::objective::Objective;
use crate::batched_algebra::{factorise, log_pivots};
use crate::information::semidefinite_root;
use crate::simd::{Kernel, MAX_LANES, Simd, Vector, VectorUnit, dispatch};

/// Parameters of the hand-eye.
const HAND_EYE: usize = 6;

/// Informations as structure of arrays.
pub(super) struct Pool<'a> {
    informations: &'a [DMatrix<f64>],
    size: usize,
    /// Views, up to a multiple of every unit's lanes.
    stride: usize,
    /// Upper triangle row by row, hand-eye last; one row of `stride` views per entry.
    entries: Vec<f64>,
    unit: VectorUnit,
}

impl<'a> Pool<'a> {
    pub fn new(informations: &'a [DMatrix<f64>], unit: VectorUnit) -> Self {
        let size = informations.first().map_or(0, DMatrix::nrows);
        let stride = informations.len().next_multiple_of(MAX_LANES);
        let mut entries = vec![0.0; size * (size + 1) / 2 * stride];
        for (view, information) in informations.iter().enumerate() {
            for (at, (i, j)) in places(size).enumerate() {
                entries[at * stride + view] = information[(i, j)];
            }
        }
        Self { informations, size, stride, entries, unit }
    }

    /// Number of views.
    pub fn len(&self) -> usize {
        self.informations.len()
    }

    pub fn information(&self, view: usize) -> &DMatrix<f64> {
        &self.informations[view]
    }

    /// `tr(G I_j)` of every view, for a symmetric `G`.
    pub fn lean(&self, gradient: &DMatrix<f64>, out: &mut Vec<f64>) {
        let weights: Vec<f64> = places(self.size)
            .map(|(i, j)| if i == j { gradient[(i, j)] } else { 2.0 * gradient[(i, j)] })
            .collect();
        out.resize(self.stride, 0.0);
        dispatch(self.unit, Lean { pool: self, weights: &weights, out });
        out.truncate(self.len());
    }

    /// `phi(total + I_j)` of every view; minus infinity where that is not positive definite.
    pub fn worth(&self, total: &DMatrix<f64>, objective: &Objective, out: &mut Vec<f64>) {
        let total: Vec<f64> = places(self.size).map(|place| total[place]).collect();
        let mut root = Matrix6::zeros();
        let value = match objective {
            Objective::Entropy => Value::Pivots { first: 0 },
            Objective::EntropyHandEye => Value::Pivots { first: self.size - HAND_EYE },
            Objective::ToolPoint(q) => {
                root.copy_from(&semidefinite_root(q.clone()));
                Value::Trace(&root)
            }
        };
        out.resize(self.stride, 0.0);
        dispatch(self.unit, Worth { pool: self, total: &total, value, out });
        out.truncate(self.len());
    }
}

/// Places of the upper triangle, row by row, of a matrix of `size` rows whose hand-eye has been moved to its end.
fn places(size: usize) -> impl Iterator<Item = (usize, usize)> {
    let parameter = move |i: usize| (i + HAND_EYE) % size;
    (0..size).flat_map(move |i| (i..size).map(move |j| (parameter(i), parameter(j))))
}

struct Lean<'a> {
    pool: &'a Pool<'a>,
    weights: &'a [f64],
    out: &'a mut [f64],
}

impl Kernel for Lean<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let stride = self.pool.stride;
        for at in (0..stride).step_by(S::LANES) {
            let mut sums = [simd.splat(0.0); 2];
            for (k, (row, weight)) in self.pool.entries.chunks_exact(stride).zip(self.weights).enumerate() {
                sums[k % 2] = simd.load(&row[at..]).mul_add(simd.splat(*weight), sums[k % 2]);
            }
            (sums[0] + sums[1]).store(&mut self.out[at..]);
        }
    }
}

/// What is read off a factorised total.
enum Value<'a> {
    /// The logarithm of the product of the pivots from `first` on.
    Pivots { first: usize },
    /// `-tr(Q Sigma)` of the hand-eye, by the columns of a root of `Q`.
    Trace(&'a Matrix6<f64>),
}

struct Worth<'a> {
    pool: &'a Pool<'a>,
    total: &'a [f64],
    value: Value<'a>,
    out: &'a mut [f64],
}

impl Kernel for Worth<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let (size, stride) = (self.pool.size, self.pool.stride);
        let mut triangle = vec![simd.splat(0.0); self.total.len()];
        let mut inverses = vec![simd.splat(0.0); size];
        for at in (0..stride).step_by(S::LANES) {
            for ((to, total), row) in
                triangle.iter_mut().zip(self.total).zip(self.pool.entries.chunks_exact(stride))
            {
                *to = simd.load(&row[at..]) + simd.splat(*total);
            }
            let regular = factorise(simd, size, &mut triangle, &mut inverses);
            let value = match self.value {
                Value::Pivots { first } => log_pivots(simd, size, (first, size), &triangle),
                Value::Trace(root) => -trace(simd, root, size, &triangle, &inverses),
            };
            value.keep_or(regular, simd.splat(f64::NEG_INFINITY)).store(&mut self.out[at..]);
        }
    }
}

/// `tr(R' S^-1 R)` of the last six rows `S` of what is factorised.
#[inline(always)]
fn trace<S: Simd>(
    simd: S,
    root: &Matrix6<f64>,
    size: usize,
    triangle: &[S::Vector],
    inverses: &[S::Vector],
) -> S::Vector {
    let last = &triangle[triangle.len() - HAND_EYE * (HAND_EYE + 1) / 2..];
    let inverses = &inverses[size - HAND_EYE..];
    let mut sum = simd.splat(0.0);
    for column in root.column_iter() {
        let mut solved = [simd.splat(0.0); HAND_EYE];
        for (to, from) in solved.iter_mut().zip(column.iter()) {
            *to = simd.splat(*from);
        }
        let mut rest = last;
        for k in 0..HAND_EYE {
            let (row, below) = rest.split_at(HAND_EYE - k);
            let weighted = solved[k] * inverses[k];
            sum = solved[k].mul_add(weighted, sum);
            for i in 1..row.len() {
                solved[k + i] = row[i].neg_mul_add(weighted, solved[k + i]);
            }
            rest = below;
        }
    }
    sum
}
