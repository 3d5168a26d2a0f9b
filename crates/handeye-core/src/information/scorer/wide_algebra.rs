//! Measurements of more than the camera-frame twist, and criteria other than entropy, lanes = candidates.
//!
//! As [`super::algebra`], with sizes known only at run time: the covariance of `[eta; c]` is taken as `6 + n` scalar
//! causes, each of which multiplies the determinant and leaves less information for the others; what is left after
//! all of them is `(N^-1 + S)^-1`.

use super::algebra::{NULL_PIVOT, add_square, spread};
use super::block::{BLOCK, Block, Row};
use super::forms::{Form, Moved, Observed, OfArm, packed};
use crate::batched_algebra::{UPPER, load, upper};
use crate::simd::{Kernel, Simd, Vector};

/// What is wanted of a block.
pub(super) enum Outcome<'a> {
    /// `|I + scale N S|`.
    Determinant(&'a mut Row),
    /// Trace of `Z (N^-1 / scale + S)^-1 Z'`.
    Trace(&'a Observed, &'a mut Row),
    /// The upper triangle of `Z (N^-1 / scale + S)^-1 Z'` for six rows of `Z`.
    Decrease(&'a Observed, &'a mut [Row; UPPER]),
}

/// Takes the measurements of a block into account; at most `CAPACITY` of them, `PACKED` entries in their triangle.
pub(super) struct Wide<'a, const CAPACITY: usize, const PACKED: usize> {
    pub scale: f64,
    pub form: &'a Form,
    /// Rows of the information in the block, of which the form's come first.
    pub rows: usize,
    pub block: &'a Block,
    pub outcome: Outcome<'a>,
}

/// Parameters of interest at most: the chain.
const ROWS: usize = 12;

impl<const CAPACITY: usize, const PACKED: usize> Kernel for Wide<'_, CAPACITY, PACKED> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        let zero = simd.splat(0.0);
        let size = self.form.size;
        let scale = simd.splat(self.scale);
        let mut work = Work::<S::Vector, CAPACITY, PACKED> {
            size,
            information: [zero; PACKED],
            covariance: [zero; PACKED],
            floors: [zero; CAPACITY],
            direction: [zero; CAPACITY],
            spread: [zero; CAPACITY],
        };
        let mut observed_rows = [[zero; CAPACITY]; ROWS];
        for at in (0..BLOCK).step_by(S::LANES) {
            let mut place = 0;
            for i in 0..size {
                let line = &self.block.information[packed(self.rows, i, i)..][..size - i];
                for from in line {
                    work.information[place] = simd.load(&from[at..]) * scale;
                    place += 1;
                }
            }
            for (to, from) in work.covariance.iter_mut().zip(&self.form.constant) {
                *to = simd.splat(*from);
            }
            let before_y = load(simd, &self.block.before_y, at);
            if let Some(moved) = &self.form.moved {
                add_moved(simd, moved, &before_y, size, &mut work.covariance);
            }
            if let Some(arm) = &self.form.arm {
                add_arm(simd, arm, self.block, (at, &before_y), size, &mut work.covariance);
            }
            for k in 0..size {
                work.floors[k] = simd.splat(NULL_PIVOT) * work.covariance[packed(size, k, k)];
            }
            match &mut self.outcome {
                Outcome::Determinant(out) => {
                    let mut product = simd.splat(1.0);
                    for k in 0..size {
                        product = product * work.take(simd, k, k);
                    }
                    product.store(&mut out[at..]);
                }
                Outcome::Trace(observed, out) => {
                    for k in 0..size {
                        work.take(simd, k, 0);
                    }
                    let rows = &mut observed_rows[..observed.constant.len()];
                    observe(simd, observed, self.block, (at, &before_y), rows);
                    let mut trace = zero;
                    for row in rows {
                        work.weigh(simd, row);
                        for (z, weighted) in row[..size].iter().zip(&work.spread) {
                            trace = z.mul_add(*weighted, trace);
                        }
                    }
                    trace.store(&mut out[at..]);
                }
                Outcome::Decrease(observed, out) => {
                    for k in 0..size {
                        work.take(simd, k, 0);
                    }
                    let rows = &mut observed_rows[..6];
                    observe(simd, observed, self.block, (at, &before_y), rows);
                    for i in 0..6 {
                        work.weigh(simd, &rows[i]);
                        for j in i..6 {
                            let mut sum = zero;
                            for (z, weighted) in rows[j][..size].iter().zip(&work.spread) {
                                sum = z.mul_add(*weighted, sum);
                            }
                            sum.store(&mut out[upper(i, j)][at..]);
                        }
                    }
                }
            }
        }
    }
}

/// Adds `U U'`.
#[inline(always)]
fn add_moved<S: Simd>(
    simd: S,
    moved: &Moved,
    before_y: &[S::Vector; 12],
    size: usize,
    covariance: &mut [S::Vector],
) {
    let zero = simd.splat(0.0);
    let u = spread(simd, moved, before_y);
    let mut square = [zero; UPPER];
    add_square(&u, &mut square);
    for i in 0..6 {
        let row = &mut covariance[packed(size, i, i)..packed(size, i, i) + size - i];
        for j in i..6 {
            row[j - i] = row[j - i] + square[upper(i, j)];
        }
        for (entry, pixel) in row[6 - i..].iter_mut().zip(&moved.pixel) {
            let mut sum = *entry;
            for k in 0..6 {
                sum = u[i][k].mul_add(simd.splat(pixel[k]), sum);
            }
            *entry = sum;
        }
    }
}

/// Adds `U U'` of the arm's constants, and the covariance of its noise.
#[inline(always)]
fn add_arm<S: Simd>(
    simd: S,
    arm: &OfArm,
    block: &Block,
    (at, before_y): (usize, &[S::Vector; 12]),
    size: usize,
    covariance: &mut [S::Vector],
) {
    let zero = simd.splat(0.0);
    let mut square = [zero; UPPER];
    let mut u = [zero; 6];
    for (j, column) in arm.columns.iter().enumerate() {
        for (u, x) in u.iter_mut().zip(&column.of_x) {
            *u = simd.splat(*x);
        }
        add_turned(simd, &column.of_y, before_y, &mut u);
        for (row, moved) in arm.root.iter().zip(block.arm.chunks_exact(6)).skip(j) {
            let factor = simd.splat(row[j]);
            for (u, moved) in u.iter_mut().zip(moved) {
                *u = simd.load(&moved[at..]).mul_add(factor, *u);
            }
        }
        add_outer(&u, &mut square);
        for (i, u) in u.iter().enumerate() {
            let first = packed(size, i, 5) + 1;
            for (entry, pixel) in covariance[first..].iter_mut().zip(&column.pixel) {
                *entry = u.mul_add(simd.splat(*pixel), *entry);
            }
        }
    }
    let (constants, _) = block.arm_counts;
    for moved in block.arm.chunks_exact(6).skip(constants) {
        for (u, moved) in u.iter_mut().zip(moved) {
            *u = simd.load(&moved[at..]);
        }
        add_outer(&u, &mut square);
    }
    for i in 0..6 {
        for j in i..6 {
            let entry = &mut covariance[packed(size, i, j)];
            *entry = *entry + square[upper(i, j)];
        }
    }
}

/// Adds `u u'`.
#[inline(always)]
fn add_outer<V: Vector>(u: &[V; 6], square: &mut [V; UPPER]) {
    for i in 0..6 {
        for j in i..6 {
            square[upper(i, j)] = u[i].mul_add(u[j], square[upper(i, j)]);
        }
    }
}

/// Adds `C [a, b]`, `C = Ad(T)`: `[R a + t x R b, R b]`.
#[inline(always)]
fn add_turned<S: Simd>(simd: S, of_y: &[f64; 6], t: &[S::Vector; 12], to: &mut [S::Vector]) {
    let mut low = [simd.splat(0.0); 3];
    for i in 0..3 {
        for k in 0..3 {
            to[i] = t[3 * i + k].mul_add(simd.splat(of_y[k]), to[i]);
            low[i] = t[3 * i + k].mul_add(simd.splat(of_y[3 + k]), low[i]);
        }
    }
    for i in 0..3 {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        to[i] = t[9 + b].neg_mul_add(low[a], t[9 + a].mul_add(low[b], to[i]));
        to[3 + i] = to[3 + i] + low[i];
    }
}

/// `Z = constant + [of_y C' + of_arm E', 0]`.
#[inline(always)]
fn observe<S: Simd, const CAPACITY: usize>(
    simd: S,
    observed: &Observed,
    block: &Block,
    (at, t): (usize, &[S::Vector; 12]),
    rows: &mut [[S::Vector; CAPACITY]],
) {
    let parts = observed.constant.iter().zip(&observed.of_y).zip(&observed.of_arm);
    for (to, ((constant, of_y), of_arm)) in rows.iter_mut().zip(parts) {
        for (to, constant) in to.iter_mut().zip(constant) {
            *to = simd.splat(*constant);
        }
        add_turned(simd, of_y, t, to);
        for (value, moved) in of_arm.iter().zip(block.arm.chunks_exact(6)) {
            for (to, row) in to.iter_mut().zip(moved) {
                *to = simd.load(&row[at..]).mul_add(simd.splat(*value), *to);
            }
        }
    }
}

/// Working memory for a group of candidates.
struct Work<V, const CAPACITY: usize, const PACKED: usize> {
    size: usize,
    /// Upper triangles, row by row.
    information: [V; PACKED],
    covariance: [V; PACKED],
    /// Pivots of the covariance that are rounding.
    floors: [V; CAPACITY],
    /// A cause's direction `l`, and `N l`.
    direction: [V; CAPACITY],
    spread: [V; CAPACITY],
}

impl<V: Vector, const CAPACITY: usize, const PACKED: usize> Work<V, CAPACITY, PACKED> {
    /// Takes cause `k` into account in the rows of the information from `first` on; its factor `p = 1 + d l' N l`.
    #[inline(always)]
    fn take<S: Simd<Vector = V>>(&mut self, simd: S, k: usize, first: usize) -> V {
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        let size = self.size;
        let entries = size * (size + 1) / 2;
        // Pivot, direction, and what the factorisation leaves of the covariance.
        let start = packed(size, k, k);
        let (done, mut rest) = self.covariance[..entries].split_at_mut(start + size - k);
        let row = &done[start..];
        let counts = row[0].greater(self.floors[k]);
        let inverse = (one / row[0]).keep(counts);
        let d = row[0].keep(counts);
        let direction = &mut self.direction[k..size];
        direction[0] = one;
        for (l, entry) in direction[1..].iter_mut().zip(&row[1..]) {
            *l = *entry * inverse;
        }
        for i in 1..size - k {
            let (line, next) = rest.split_at_mut(size - k - i);
            for (entry, other) in line.iter_mut().zip(&row[i..]) {
                *entry = direction[i].neg_mul_add(*other, *entry);
            }
            rest = next;
        }
        // N l, row by row of the triangle: an entry serves twice.
        let direction = &self.direction[..size];
        let spread = &mut self.spread[..size];
        spread.fill(zero);
        let mut rest = &self.information[packed(size, first, first)..entries];
        for i in first..size {
            let (line, next) = rest.split_at(size - i);
            let mut sum = spread[i];
            if i < k {
                for (entry, l) in line[k - i..].iter().zip(&direction[k..]) {
                    sum = entry.mul_add(*l, sum);
                }
            } else {
                let l = direction[i];
                sum = line[0].mul_add(l, sum);
                for j in 1..line.len() {
                    sum = line[j].mul_add(direction[i + j], sum);
                    spread[i + j] = line[j].mul_add(l, spread[i + j]);
                }
            }
            spread[i] = sum;
            rest = next;
        }
        let mut information = zero;
        for (l, v) in direction[k..].iter().zip(&spread[k..]) {
            information = l.mul_add(*v, information);
        }
        let factor = d.mul_add(information, one);
        let weight = d / factor;
        // What is left for the others.
        let mut rest = &mut self.information[packed(size, first, first)..entries];
        for i in first..size {
            let (line, next) = rest.split_at_mut(size - i);
            let weighted = weight * spread[i];
            for (entry, v) in line.iter_mut().zip(&spread[i..]) {
                *entry = weighted.neg_mul_add(*v, *entry);
            }
            rest = next;
        }
        factor
    }

    /// The information times a row, into `spread`.
    #[inline(always)]
    fn weigh<S: Simd<Vector = V>>(&mut self, simd: S, row: &[V; CAPACITY]) {
        let size = self.size;
        let spread = &mut self.spread[..size];
        spread.fill(simd.splat(0.0));
        let mut rest = &self.information[..size * (size + 1) / 2];
        for i in 0..size {
            let (line, next) = rest.split_at(size - i);
            let mut sum = line[0].mul_add(row[i], spread[i]);
            for j in 1..line.len() {
                sum = line[j].mul_add(row[i + j], sum);
                spread[i + j] = line[j].mul_add(row[i], spread[i + j]);
            }
            spread[i] = sum;
            rest = next;
        }
    }
}
