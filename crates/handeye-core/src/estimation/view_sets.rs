//! Evidence of sets of views under many levels of the robot's noise, lanes = levels.
//!
//! With the chain linearised, the twist between chain and image of view `k` is `e_k = noise - B_k theta`, the noise
//! of covariance `C_k + a P_k + b Q_k`: that of the image, and those of unit errors of the robot in translation and in
//! rotation times their variances. A Gaussian prior on theta is integrated out together with the views.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]
#![expect(clippy::needless_range_loop, reason = "indices of matrices: several are read at the same place")]

use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

use super::systems::{eliminate, entries_of, invert_column, substitute};
use crate::batched_algebra::{UPPER, load, triangle, upper};
use crate::error::Error;
use crate::least_squares::Side;
use crate::positive::Factor;
use crate::simd::{Kernel, MAX_LANES, Simd, Vector, VectorUnit, dispatch, ln};

/// A pivot is no smaller than this share of its diagonal entry: below is rounding.
const SMALLEST_PIVOT: f64 = 1e-15;

/// A level of the robot's noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseLevel {
    /// Where its errors act.
    pub side: Side,
    /// Standard deviation per axis of the translation, metres.
    pub translation_m: f64,
    /// Standard deviation per axis of the rotation, radians.
    pub rotation_rad: f64,
}

/// One view, linearised.
#[derive(Clone, Debug)]
pub struct LinearisedView {
    /// `e_k`.
    pub deviation: Vector6<f64>,
    /// `B_k`, 6 x n.
    pub rows: DMatrix<f64>,
    /// `C_k`.
    pub covariance: Matrix6<f64>,
    /// What an error of the robot on the left and on the right of its motion is as a twist of the view.
    pub from_robot: [Matrix6<f64>; 2],
}

/// Views, and what is believed of theta without them.
#[derive(Clone, Debug)]
pub struct ViewSets {
    size: usize,
    views: Vec<Flat>,
    prior: DMatrix<f64>,
    prior_right: DVector<f64>,
    prior_log_determinant: f64,
}

/// A view as the kernel reads it.
#[derive(Clone, Debug)]
struct Flat {
    /// `[B_k, e_k]` row by row.
    augmented: Vec<f64>,
    covariance: [f64; UPPER],
    /// Translation and rotation on the left, then on the right.
    unit_errors: [[f64; UPPER]; 4],
}

/// What a set of views says under each level.
#[derive(Clone, Debug)]
pub struct SetFit {
    /// Covariances of theta, each `n x n` row by row.
    pub covariances: Vec<f64>,
    /// Means of theta, `n` for each level.
    pub means: Vec<f64>,
    /// Log-likelihood of the set under each level.
    pub log_likelihoods: Vec<f64>,
}

impl ViewSets {
    /// Views, with information and right side of the prior on theta.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] where sizes disagree or the prior is not positive definite.
    pub fn new(
        views: &[LinearisedView],
        prior: DMatrix<f64>,
        prior_right: DVector<f64>,
    ) -> Result<Self, Error> {
        let size = prior_right.len();
        if prior.shape() != (size, size) || views.iter().any(|view| view.rows.shape() != (6, size)) {
            return Err(Error::invalid(format!("views and prior must be of {size} parameters")));
        }
        let prior_log_determinant = Factor::new(&prior)
            .ok_or_else(|| Error::invalid("the prior is not positive definite"))?
            .log_determinant();
        Ok(Self {
            size,
            views: views.iter().map(Flat::new).collect(),
            prior,
            prior_right,
            prior_log_determinant,
        })
    }

    /// Number of views.
    pub fn len(&self) -> usize {
        self.views.len()
    }

    /// Whether there are no views.
    pub fn is_empty(&self) -> bool {
        self.views.is_empty()
    }

    /// Number of parameters in theta.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Weighs a set of views under each level.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for a view that is not there.
    pub fn fit(&self, levels: &[NoiseLevel], members: &[usize]) -> Result<SetFit, Error> {
        if let Some(k) = members.iter().find(|k| **k >= self.len()) {
            return Err(Error::invalid(format!("view {k} of {}", self.len())));
        }
        let (n, count) = (self.size, levels.len());
        let mut fit = SetFit {
            covariances: vec![0.0; count * n * n],
            means: vec![0.0; count * n],
            log_likelihoods: vec![0.0; count],
        };
        dispatch(VectorUnit::widest(), Weigh { sets: self, levels, members, fit: &mut fit });
        Ok(fit)
    }
}

impl Flat {
    fn new(view: &LinearisedView) -> Self {
        let width = view.rows.ncols() + 1;
        let mut augmented = vec![0.0; 6 * width];
        for (i, row) in augmented.chunks_exact_mut(width).enumerate() {
            for (j, entry) in row[..width - 1].iter_mut().enumerate() {
                *entry = view.rows[(i, j)];
            }
            row[width - 1] = view.deviation[i];
        }
        let [left, right] = view.from_robot.map(|from_robot| {
            [0, 3].map(|at| {
                let half = from_robot.fixed_columns::<3>(at);
                triangle(&(half * half.transpose()))
            })
        });
        Self {
            augmented,
            covariance: triangle(&view.covariance),
            unit_errors: [left[0], left[1], right[0], right[1]],
        }
    }
}

struct Weigh<'a> {
    sets: &'a ViewSets,
    levels: &'a [NoiseLevel],
    members: &'a [usize],
    fit: &'a mut SetFit,
}

impl Kernel for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { sets, levels, members, fit } = self;
        let n = sets.size;
        let zero = simd.splat(0.0);
        let mut room = Room {
            white: vec![[zero; 6]; members.len() * (n + 1)],
            normal: vec![zero; entries_of(n)],
            inverses: vec![zero; n],
            mean: vec![zero; n],
            column: vec![zero; n],
        };
        for (group, levels) in levels.chunks(S::LANES).enumerate() {
            // Lanes without a level repeat the last.
            let mut variances = [[0.0; MAX_LANES]; 4];
            for lane in 0..S::LANES {
                let level = &levels[lane.min(levels.len() - 1)];
                let at = if level.side == Side::Left { 0 } else { 2 };
                variances[at][lane] = level.translation_m * level.translation_m;
                variances[at + 1][lane] = level.rotation_rad * level.rotation_rad;
            }
            let variances = load(simd, &variances, 0);
            let likelihood = weigh(simd, sets, members, &variances, &mut room);
            let first = group * S::LANES;
            scatter(likelihood, &mut fit.log_likelihoods[first..first + levels.len()], 1);
            for (i, mean) in room.mean.iter().enumerate() {
                scatter(*mean, &mut fit.means[first * n + i..(first + levels.len()) * n], n);
            }
            let covariances = &mut fit.covariances[first * n * n..(first + levels.len()) * n * n];
            for i in 0..n {
                invert_column(simd, n, i, &room.normal, &room.inverses, &mut room.column);
                for j in i..n {
                    scatter(room.column[j], &mut covariances[i * n + j..], n * n);
                    scatter(room.column[j], &mut covariances[j * n + i..], n * n);
                }
            }
        }
    }
}

/// What is needed for a vector of levels.
struct Room<V> {
    /// Columns of `[B_k, e_k]` of each view, whitened.
    white: Vec<[V; 6]>,
    /// Upper triangle of the information of theta with minus its right side as a last column, row by row; factorised.
    normal: Vec<V>,
    /// Inverse pivots.
    inverses: Vec<V>,
    mean: Vec<V>,
    /// A column of the covariance from the diagonal on.
    column: Vec<V>,
}

/// Writes lanes `stride` apart, as many as there is place for, which is for no more than there are.
#[inline(always)]
fn scatter<V: Vector>(vector: V, out: &mut [f64], stride: usize) {
    let mut lanes = [0.0; MAX_LANES];
    vector.store(&mut lanes);
    for (place, lane) in out.iter_mut().step_by(stride).zip(&lanes) {
        *place = *lane;
    }
}

/// Factorises the information of theta and finds its mean; the log-likelihood of the views.
#[inline(always)]
fn weigh<S: Simd>(
    simd: S,
    sets: &ViewSets,
    members: &[usize],
    variances: &[S::Vector; 4],
    room: &mut Room<S::Vector>,
) -> S::Vector {
    let (n, width) = (sets.size, sets.size + 1);
    let zero = simd.splat(0.0);
    let mut at = 0;
    for i in 0..n {
        for j in i..n {
            room.normal[at] = simd.splat(sets.prior[(i, j)]);
            at += 1;
        }
        room.normal[at] = simd.splat(-sets.prior_right[i]);
        at += 1;
    }
    let mut log_determinant = simd.splat(-sets.prior_log_determinant);
    for (white, k) in room.white.chunks_exact_mut(width).zip(members) {
        log_determinant = log_determinant + whiten(simd, &sets.views[*k], variances, white);
        let mut at = 0;
        for i in 0..n {
            let row = white[i];
            for column in &white[i..] {
                let mut sum = room.normal[at];
                for r in 0..6 {
                    sum = row[r].mul_add(column[r], sum);
                }
                room.normal[at] = sum;
                at += 1;
            }
        }
    }
    log_determinant =
        log_determinant + eliminate(simd, n, SMALLEST_PIVOT, &mut room.normal, &mut room.inverses);
    substitute(n, &room.normal, &room.inverses, &mut room.mean);
    // The squares summed one by one: what the normal equations leave of them is rounding where views are far off.
    let mut squares = zero;
    for white in room.white.chunks_exact(width) {
        let mut left = white[n];
        for (column, theta) in white[..n].iter().zip(&room.mean) {
            for r in 0..6 {
                left[r] = column[r].mul_add(*theta, left[r]);
            }
        }
        for r in 0..6 {
            squares = left[r].mul_add(left[r], squares);
        }
    }
    for i in 0..n {
        let mut sum = simd.splat(-2.0 * sets.prior_right[i]);
        for j in 0..n {
            sum = simd.splat(sets.prior[(i, j)]).mul_add(room.mean[j], sum);
        }
        squares = room.mean[i].mul_add(sum, squares);
    }
    let constant = 6.0 * members.len() as f64 * std::f64::consts::TAU.ln();
    simd.splat(-0.5) * (log_determinant + squares + simd.splat(constant))
}

/// Columns of a view times the inverse root of its covariance; the logarithm of the covariance's determinant.
#[inline(always)]
fn whiten<S: Simd>(
    simd: S,
    view: &Flat,
    variances: &[S::Vector; 4],
    white: &mut [[S::Vector; 6]],
) -> S::Vector {
    let one = simd.splat(1.0);
    let mut root = [one; UPPER];
    for (i, entry) in root.iter_mut().enumerate() {
        *entry = simd.splat(view.covariance[i]);
        for (variance, unit) in variances.iter().zip(&view.unit_errors) {
            *entry = variance.mul_add(simd.splat(unit[i]), *entry);
        }
    }
    // L' above the diagonal, inverses of that of L.
    let mut inverses = [one; 6];
    let mut product = one;
    for k in 0..6 {
        product = product * root[upper(k, k)];
        inverses[k] = one / root[upper(k, k)].sqrt();
        for i in k + 1..6 {
            root[upper(k, i)] = root[upper(k, i)] * inverses[k];
        }
        for i in k + 1..6 {
            for j in i..6 {
                root[upper(i, j)] = root[upper(k, i)].neg_mul_add(root[upper(k, j)], root[upper(i, j)]);
            }
        }
    }
    for (j, column) in white.iter_mut().enumerate() {
        for i in 0..6 {
            let mut sum = simd.splat(view.augmented[i * white_width(view) + j]);
            for k in 0..i {
                sum = root[upper(k, i)].neg_mul_add(column[k], sum);
            }
            column[i] = sum * inverses[i];
        }
    }
    ln(simd, product)
}

#[inline(always)]
fn white_width(view: &Flat) -> usize {
    view.augmented.len() / 6
}
