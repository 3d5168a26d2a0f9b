//! Many hypotheses at once, lanes = hypotheses: what the views say under each noise, and the restricted likelihood.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use nalgebra::{DMatrix, Matrix6};

use super::hypotheses::Hypothesis;
use super::smooth::SmoothError;
use crate::batched_algebra::{UPPER, factorise, log_pivots, triangle, upper};
use crate::least_squares::Side;
use crate::simd::{Kernel, MAX_LANES, Simd, Vector, VectorUnit, dispatch};

/// Causes of error with a variance of their own: translation and rotation on the left, on the right, and the joints.
const CAUSES: usize = 5;

/// Views linearised at `X` and `Y`, whitening left open.
pub(super) struct View {
    /// `[I, Ad(X A), camera, joint offsets, e]`, six rows.
    rows: DMatrix<f64>,
    /// Covariance of the pose in the image.
    of_pixels: [f64; UPPER],
    /// Covariance that each cause gives the pose at unit variance.
    of_causes: [[f64; UPPER]; CAUSES],
    /// How twists on the left and on the right of the motion move the pose.
    maps: [Matrix6<f64>; 2],
}

impl View {
    /// `joints`: covariance in the camera frame of joints that are noisy by one radian.
    pub fn new(
        rows: DMatrix<f64>,
        of_pixels: &Matrix6<f64>,
        maps: &[Matrix6<f64>; 2],
        joints: Option<&Matrix6<f64>>,
    ) -> Self {
        let [left, right] = maps;
        let part = |map: &Matrix6<f64>, first: usize| {
            let columns = map.fixed_columns::<3>(first);
            triangle(&(columns * columns.transpose()))
        };
        let of_joints = joints.map_or([0.0; UPPER], triangle);
        let of_causes = [part(left, 0), part(left, 3), part(right, 0), part(right, 3), of_joints];
        Self { rows, of_pixels: triangle(of_pixels), of_causes, maps: *maps }
    }

    /// `[I, Ad(X A), camera, joint offsets, e]`, six rows.
    pub fn rows(&self) -> &DMatrix<f64> {
        &self.rows
    }

    /// Covariance of the pose in the image.
    pub fn pixel_covariance(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|i, j| self.of_pixels[upper(i.min(j), i.max(j))])
    }

    /// How twists on the left of the motion move the pose.
    pub fn left(&self) -> &Matrix6<f64> {
        &self.maps[0]
    }
}

/// The whitened views summed up under each of some noises, whatever the offsets of the joints.
pub(super) struct Sums {
    /// Parameters and the error.
    size: usize,
    stride: usize,
    /// One row of `stride` noises per entry of the products' upper triangle, and one of `sum ln |Sigma_k|`, not a
    /// number where that does not exist.
    rows: Vec<f64>,
}

impl Sums {
    /// Under the noises of some hypotheses, all of them smooth errors or none.
    pub fn new(
        views: &[View],
        noises: &[&Hypothesis],
        smooth: Option<&SmoothError>,
        unit: VectorUnit,
    ) -> Self {
        let size = views.first().map_or(0, |view| view.rows.ncols());
        let stride = noises.len().next_multiple_of(MAX_LANES);
        let mut variances = vec![0.0; CAUSES * stride];
        for (i, noise) in noises.iter().enumerate() {
            let side = match noise.side {
                _ if noise.joint_rad > 0.0 => {
                    variances[4 * stride + i] = noise.joint_rad.powi(2);
                    continue;
                }
                None => continue,
                Some(Side::Left) => 0,
                Some(Side::Right) => 2,
            };
            variances[side * stride + i] = noise.translation_m.powi(2);
            variances[(side + 1) * stride + i] = noise.rotation_rad.powi(2);
        }
        let mut sums = Self { size, stride, rows: vec![0.0; (size * (size + 1) / 2 + 1) * stride] };
        dispatch(unit, SumUp { views, variances: &variances, smooth, sums: &mut sums });
        sums
    }

    /// Writes the equations of hypotheses at `places` with the noises they go with, and the constants of their
    /// likelihoods: `sum ln |Sigma_k| + e' Sigma^-1 e`.
    pub fn fill(&self, places: &[(usize, usize)], equations: &mut Equations, constants: &mut [f64]) {
        let copy = |from: &[f64], to: &mut [f64], sign: f64| {
            for (place, noise) in places {
                to[*place] = sign * from[*noise];
            }
        };
        let mut rows = self.rows.chunks_exact(self.stride);
        let n = self.size - 1;
        for i in 0..n {
            for (j, from) in (i..=n).zip(&mut rows) {
                if j < n {
                    copy(from, equations.information_row(i, j), 1.0);
                } else {
                    copy(from, equations.right_row(i), -1.0);
                }
            }
        }
        copy(rows.next().unwrap_or_default(), constants, 1.0);
        let log_determinants = rows.next().unwrap_or_default();
        for (place, noise) in places {
            constants[*place] += log_determinants[*noise];
        }
    }
}

struct SumUp<'a> {
    views: &'a [View],
    /// One row of noises per cause.
    variances: &'a [f64],
    smooth: Option<&'a SmoothError>,
    sums: &'a mut Sums,
}

impl Kernel for SumUp<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let zero = simd.splat(0.0);
        let (size, stride) = (self.sums.size, self.sums.stride);
        let coefficients = self.smooth.map_or(0, SmoothError::coefficients);
        // Coefficients of the smooth error come first: eliminating them is then the start of a factorisation.
        let all = coefficients + size;
        let mut products = vec![zero; all * (all + 1) / 2];
        let mut inverses = vec![zero; coefficients];
        let mut whitened = Whitened { columns: vec![[zero; 6]; size], weighted: vec![[zero; 6]; size] };
        for at in (0..stride).step_by(S::LANES) {
            let mut variances = [zero; CAUSES];
            for (to, from) in variances.iter_mut().zip(self.variances.chunks_exact(stride)) {
                *to = simd.load(&from[at..]);
            }
            products.fill(zero);
            let mut log_determinant = zero;
            let mut regular = simd.splat(1.0).greater(zero);
            for (k, view) in self.views.iter().enumerate() {
                let own = simd.splat(self.smooth.map_or(1.0, |s| s.own(k)));
                let mut covariance = [zero; UPPER];
                for (entry, pixels) in covariance.iter_mut().zip(&view.of_pixels) {
                    *entry = simd.splat(*pixels);
                }
                for (variance, cause) in variances.iter().zip(&view.of_causes) {
                    let variance = *variance * own;
                    for (entry, unit) in covariance.iter_mut().zip(cause) {
                        *entry = variance.mul_add(simd.splat(*unit), *entry);
                    }
                }
                let mut pivots = [zero; 6];
                regular = regular & factorise(simd, 6, &mut covariance, &mut pivots);
                log_determinant = log_determinant + log_pivots(simd, 6, (0, 6), &covariance);
                for (c, column) in view.rows.column_iter().enumerate() {
                    let mut rows = [zero; 6];
                    for (to, from) in rows.iter_mut().zip(column.iter()) {
                        *to = simd.splat(*from);
                    }
                    whitened.set(c, rows, &covariance, &pivots);
                }
                if let Some(smooth) = self.smooth {
                    let mut causes = [[zero; 6]; 6];
                    for (i, cause) in causes.iter_mut().enumerate() {
                        let [left, right] = [variances[i / 3].sqrt(), variances[2 + i / 3].sqrt()];
                        for (row, entry) in cause.iter_mut().enumerate() {
                            let one = left * simd.splat(view.maps[0][(row, i)]);
                            *entry = right.mul_add(simd.splat(view.maps[1][(row, i)]), one);
                        }
                        *cause = forward(*cause, &covariance, &pivots);
                    }
                    whitened.add_smooth(simd, smooth.functions(k), &causes, &pivots, &mut products);
                }
                whitened.add(&mut products[(all * (all + 1) - size * (size + 1)) / 2..]);
            }
            // Integrate the coefficients out, each of variance one beforehand.
            for i in 0..coefficients {
                let diagonal = &mut products[i * all - i * (i + 1) / 2 + i];
                *diagonal = *diagonal + simd.splat(1.0);
            }
            regular = regular & factorise(simd, all, &mut products, &mut inverses);
            log_determinant = log_determinant + log_pivots(simd, all, (0, coefficients), &products);
            let left = &products[(all * (all + 1) - size * (size + 1)) / 2..];
            for (to, from) in self.sums.rows.chunks_exact_mut(stride).zip(left) {
                from.store(&mut to[at..]);
            }
            let last = self.sums.rows.len() - stride + at;
            log_determinant.keep_or(regular, simd.splat(f64::NAN)).store(&mut self.sums.rows[last..]);
        }
    }
}

/// `L^-1` times six rows, for a covariance `L D L'` factorised with the inverses of `D`.
#[inline(always)]
fn forward<V: Vector>(mut rows: [V; 6], factor: &[V; UPPER], pivots: &[V; 6]) -> [V; 6] {
    for k in 0..6 {
        let scaled = rows[k] * pivots[k];
        for i in k + 1..6 {
            rows[i] = factor[upper(k, i)].neg_mul_add(scaled, rows[i]);
        }
    }
    rows
}

/// The rows of a view as `L^-1 rows` and `D^-1 L^-1 rows`.
struct Whitened<V> {
    columns: Vec<[V; 6]>,
    weighted: Vec<[V; 6]>,
}

impl<V: Vector> Whitened<V> {
    #[inline(always)]
    fn set(&mut self, c: usize, rows: [V; 6], factor: &[V; UPPER], pivots: &[V; 6]) {
        let column = forward(rows, factor, pivots);
        self.columns[c] = column;
        for k in 0..6 {
            self.weighted[c][k] = column[k] * pivots[k];
        }
    }

    /// Adds the products of the columns to an upper triangle.
    #[inline(always)]
    fn add(&self, products: &mut [V]) {
        let mut rest = products;
        for (i, column) in self.columns.iter().enumerate() {
            let (line, next) = rest.split_at_mut(self.columns.len() - i);
            for (sum, weighted) in line.iter_mut().zip(&self.weighted[i..]) {
                *sum = dot(column, weighted, *sum);
            }
            rest = next;
        }
    }

    /// Adds the products of the coefficients of a smooth error with each other and with the columns, where a unit
    /// of cause does `causes` and the functions have these `values` at the view.
    #[inline(always)]
    fn add_smooth<S: Simd<Vector = V>>(
        &self,
        simd: S,
        values: &[f64],
        causes: &[[V; 6]; 6],
        pivots: &[V; 6],
        products: &mut [V],
    ) {
        let zero = simd.splat(0.0);
        let mut weighted = *causes;
        for cause in &mut weighted {
            for (entry, pivot) in cause.iter_mut().zip(pivots) {
                *entry = *entry * *pivot;
            }
        }
        let mut each = [[zero; 6]; 6];
        for i in 0..6 {
            for j in 0..6 {
                each[i][j] = dot(&causes[i], &weighted[j], zero);
            }
        }
        let count = values.len();
        let all = 6 * count + self.columns.len();
        let mut rest = products;
        for (j, value) in values.iter().enumerate() {
            for a in 0..6 {
                let (line, next) = rest.split_at_mut(all - 6 * j - a);
                let (same, others) = line.split_at_mut(6 - a);
                let square = simd.splat(value * value);
                for (sum, entry) in same.iter_mut().zip(&each[a][a..]) {
                    *sum = square.mul_add(*entry, *sum);
                }
                let (others, columns) = others.split_at_mut(6 * (count - j - 1));
                for (block, other) in others.chunks_exact_mut(6).zip(&values[j + 1..]) {
                    let product = simd.splat(value * other);
                    for (sum, entry) in block.iter_mut().zip(&each[a]) {
                        *sum = product.mul_add(*entry, *sum);
                    }
                }
                let value = simd.splat(*value);
                for (sum, column) in columns.iter_mut().zip(&self.columns) {
                    *sum = value.mul_add(dot(&weighted[a], column, zero), *sum);
                }
                rest = next;
            }
        }
    }
}

#[inline(always)]
fn dot<V: Vector>(a: &[V; 6], b: &[V; 6], start: V) -> V {
    let mut sum = start;
    for (a, b) in a.iter().zip(b) {
        sum = a.mul_add(*b, sum);
    }
    sum
}

/// Normal equations of many hypotheses, and their solutions: rows of `stride` hypotheses.
pub(super) struct Equations {
    size: usize,
    stride: usize,
    /// Upper triangle of the information, row by row.
    information: Vec<f64>,
    right: Vec<f64>,
    theta: Vec<f64>,
    /// `ln |Lambda| - theta' right`; not a number where the information is not positive definite.
    value: Vec<f64>,
}

impl Equations {
    pub fn new(size: usize, count: usize) -> Self {
        let stride = count.next_multiple_of(MAX_LANES);
        let rows = |n: usize| vec![0.0; n * stride];
        Self {
            size,
            stride,
            information: rows(size * (size + 1) / 2),
            right: rows(size),
            theta: rows(size),
            value: rows(1),
        }
    }

    /// Parameters.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Entry `(i, j)`, `i <= j`, of the information of all hypotheses.
    pub fn information_row(&mut self, i: usize, j: usize) -> &mut [f64] {
        let at = (i * self.size - i * (i + 1) / 2 + j) * self.stride;
        &mut self.information[at..at + self.stride]
    }

    /// Entry `i` of the right side of all hypotheses.
    pub fn right_row(&mut self, i: usize) -> &mut [f64] {
        &mut self.right[i * self.stride..(i + 1) * self.stride]
    }

    pub fn solve(&mut self, unit: VectorUnit) {
        dispatch(unit, Solve { equations: self });
    }

    pub fn theta(&self, hypothesis: usize) -> impl Iterator<Item = f64> {
        self.theta.chunks_exact(self.stride).map(move |row| row[hypothesis])
    }

    pub fn value(&self, hypothesis: usize) -> f64 {
        self.value[hypothesis]
    }

    pub fn information(&self, hypothesis: usize) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.size, self.size);
        let mut entries = self.information.chunks_exact(self.stride).map(|row| row[hypothesis]);
        for i in 0..self.size {
            for j in i..self.size {
                let entry = entries.next().unwrap_or(f64::NAN);
                matrix[(i, j)] = entry;
                matrix[(j, i)] = entry;
            }
        }
        matrix
    }
}

struct Solve<'a> {
    equations: &'a mut Equations,
}

impl Kernel for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let zero = simd.splat(0.0);
        let Equations { size, stride, information, right, theta, value } = self.equations;
        let (size, stride) = (*size, *stride);
        let mut triangle = vec![zero; size * (size + 1) / 2];
        let mut inverses = vec![zero; size];
        let mut solved = vec![zero; size];
        for at in (0..stride).step_by(S::LANES) {
            for (to, from) in triangle.iter_mut().zip(information.chunks_exact(stride)) {
                *to = simd.load(&from[at..]);
            }
            for (to, from) in solved.iter_mut().zip(right.chunks_exact(stride)) {
                *to = simd.load(&from[at..]);
            }
            let regular = factorise(simd, size, &mut triangle, &mut inverses);
            let mut result = log_pivots(simd, size, (0, size), &triangle);
            let mut rest = &triangle[..];
            for k in 0..size {
                let (row, below) = rest.split_at(size - k);
                let scaled = solved[k] * inverses[k];
                result = solved[k].neg_mul_add(scaled, result);
                for (entry, factor) in solved[k + 1..].iter_mut().zip(&row[1..]) {
                    *entry = factor.neg_mul_add(scaled, *entry);
                }
                rest = below;
            }
            for k in (0..size).rev() {
                let row = &triangle[k * size - k * (k + 1) / 2 + k..];
                let mut sum = solved[k];
                for (factor, later) in row[1..].iter().zip(&solved[k + 1..]) {
                    sum = factor.neg_mul_add(*later, sum);
                }
                solved[k] = sum * inverses[k];
            }
            for (to, from) in theta.chunks_exact_mut(stride).zip(&solved) {
                from.store(&mut to[at..]);
            }
            result.keep_or(regular, simd.splat(f64::NAN)).store(&mut value[at..]);
        }
    }
}
