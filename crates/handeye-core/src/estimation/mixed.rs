//! The linear mixed model: its restricted likelihood and the answer, at given levels.
//!
//! With `e = -B theta + noise`, noise of covariance `V = blockdiag(V_k)` that is new at every station and a Gaussian
//! prior on `theta`, minus the logarithm of the marginal likelihood is, up to a constant,
//!
//! ```text
//! 1/2 ( ln|V| + ln|prior^-1| + ln|H| + e' V^-1 e + mean' prior mean - b' H^-1 b ),   H = prior + B' V^-1 B
//! ```
//!
//! (Harville 1977).

use nalgebra::{DMatrix, DVector};

use super::component::Component;
pub(super) use super::component::{Effect, Term};
use super::levels::{Level, LevelPrior};
use super::linearisation::Linearisation;
use super::products::{Accumulate, TOGETHER, Whiten};
use crate::positive::Factor;
use crate::simd::{MAX_LANES, VectorUnit, dispatch};

/// A prior on parameters.
#[derive(Clone)]
pub(super) struct Prior {
    pub of: &'static str,
    pub levels: Vec<usize>,
    pub first: usize,
    pub count: usize,
    /// `None`: the identity.
    pub information: Option<DMatrix<f64>>,
    pub mean: Option<DVector<f64>>,
    pub recurring: bool,
    /// Of recurring ones: covariances of the stations at a deviation of one.
    squares: Vec<DMatrix<f64>>,
}

impl Prior {
    /// Of new parameters with columns of their own, whose place is not known yet.
    fn of_columns(of: &'static str, levels: Vec<usize>, columns: &[DMatrix<f64>], recurring: bool) -> Self {
        let count = columns.first().map_or(0, DMatrix::ncols);
        let squares = if recurring { columns.iter().map(square).collect() } else { vec![] };
        Self { of, levels, first: 0, count, information: None, mean: None, recurring, squares }
    }

    pub fn range(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.count
    }

    /// Information times a vector.
    pub fn times(&self, v: &[f64]) -> Vec<f64> {
        match &self.information {
            None => v.to_vec(),
            Some(m) => (m * DVector::from_column_slice(v)).as_slice().to_vec(),
        }
    }
}

/// `m m'`.
fn square(m: &DMatrix<f64>) -> DMatrix<f64> {
    m * m.transpose()
}

/// Adds a multiple of a matrix of the same shape.
fn add(to: &mut DMatrix<f64>, factor: f64, m: &DMatrix<f64>) {
    for (to, m) in to.as_mut_slice().iter_mut().zip(m.as_slice()) {
        *to += factor * m;
    }
}

/// Noise that is new at every station.
#[derive(Clone)]
pub(super) struct Noise {
    pub of: &'static str,
    pub levels: Vec<usize>,
    pub roots: Vec<DMatrix<f64>>,
    /// Their squares: covariances at a deviation of one.
    squares: Vec<DMatrix<f64>>,
}

/// Rows of all stations in units of their noise.
pub(super) struct Whitened {
    /// Cholesky factor of the covariance of each.
    pub factors: Vec<DMatrix<f64>>,
    /// Their rows, one after the other.
    pub rows: Vec<f64>,
}

/// Rows of a station, as the kernels want them.
#[derive(Clone)]
pub(super) struct Station {
    pub size: usize,
    /// `[B e]` row by row, padded to whole vectors.
    pub rows: Vec<f64>,
    pub pixels: DMatrix<f64>,
}

/// A cell linearised, with its components.
pub(super) struct Mixed {
    pub levels: Vec<Level>,
    /// Parameters of the answer: poses, cameras, boards, and constants of the arm.
    pub size: usize,
    /// Those of them before the recurring ones.
    pub told: usize,
    /// Names of the components, with the range of their levels.
    pub components: Vec<(&'static str, std::ops::Range<usize>)>,
    /// Names of the components, with the range of their constants.
    pub constants: Vec<(&'static str, std::ops::Range<usize>)>,
    pub width: usize,
    pub stations: Vec<Station>,
    pub noises: Vec<Noise>,
    pub priors: Vec<Prior>,
    pub given: DMatrix<f64>,
    pub given_right: DVector<f64>,
    pub unit: VectorUnit,
}

/// How much of [`Mixed::evaluate`] is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// The penalised likelihood alone.
    Value,
    /// Its slope and curvature too.
    Slope,
    /// The answer instead of slopes.
    Answer,
}

/// The model at given levels.
pub(super) struct Evaluation {
    /// Minus the logarithm of the posterior density of the levels.
    pub value: f64,
    /// Its slope in the logarithms of the levels.
    pub slope: DVector<f64>,
    /// Its curvature.
    pub curvature: DMatrix<f64>,
    /// The parameters.
    pub theta: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Their information under the working model, where an answer was wanted.
    pub information: DMatrix<f64>,
}

impl Mixed {
    /// A linearised cell with its components; `weak` is information and right side of what is believed of the poses.
    pub fn new(
        linearisation: &Linearisation,
        components: &[Box<dyn Component + '_>],
        weak: (&DMatrix<f64>, &DVector<f64>),
        cell: &super::cell::Cell,
    ) -> Self {
        let mut levels = Vec::new();
        let mut owners = Vec::new();
        let (mut noises, mut priors, mut constants) = (Vec::new(), Vec::new(), Vec::new());
        let mut blocks: Vec<(Prior, Vec<DMatrix<f64>>)> = Vec::new();
        for component in components {
            let first = levels.len();
            levels.extend(component.levels());
            owners.push((component.name(), first..levels.len()));
            for term in component.terms(cell, linearisation) {
                let of: Vec<usize> = term.levels.iter().map(|l| first + l).collect();
                match term.effect {
                    Effect::Noise(roots) => {
                        let squares = roots.iter().map(square).collect();
                        noises.push(Noise { of: component.name(), levels: of, roots, squares });
                    }
                    Effect::Constant(columns) => {
                        blocks.push((Prior::of_columns(component.name(), of, &columns, false), columns));
                    }
                    Effect::Recurring(columns) => {
                        blocks.push((Prior::of_columns(component.name(), of, &columns, true), columns));
                    }
                    Effect::Prior { first, information, mean } => priors.push(Prior {
                        of: component.name(),
                        levels: of,
                        first,
                        count: mean.len(),
                        information: Some(information),
                        mean: Some(mean),
                        recurring: false,
                        squares: vec![],
                    }),
                }
            }
        }
        // Recurring parameters come last: the answer does not name them.
        blocks.sort_by_key(|(prior, _)| prior.recurring);
        let poses = linearisation.information.nrows();
        let mut size = poses;
        let mut told = poses;
        for (prior, _) in &mut blocks {
            prior.first = size;
            constants.push((prior.of, prior.range()));
            size += prior.count;
            if !prior.recurring {
                told = size;
            }
        }
        let width = (size + 1).next_multiple_of(MAX_LANES);
        let stations = linearisation
            .stations
            .iter()
            .enumerate()
            .map(|(k, from)| {
                let rows_of = from.e.len();
                let mut rows = vec![0.0; rows_of * width];
                for (r, row) in rows.chunks_exact_mut(width).enumerate() {
                    for (j, entry) in row[..poses].iter_mut().enumerate() {
                        *entry = from.b[(r, j)];
                    }
                    let mut at = poses;
                    for (_, columns) in &blocks {
                        for j in 0..columns[k].ncols() {
                            row[at] = columns[k][(r, j)];
                            at += 1;
                        }
                    }
                    row[size] = from.e[r];
                }
                Station { size: rows_of, rows, pixels: from.pixels.clone() }
            })
            .collect();
        priors.extend(blocks.into_iter().map(|(prior, _)| prior));
        let mut given = DMatrix::zeros(size, size);
        let mut given_right = DVector::zeros(size);
        given.view_mut((0, 0), (poses, poses)).copy_from(&(&linearisation.information + weak.0));
        given_right.rows_mut(0, poses).copy_from(&(&linearisation.gradient + weak.1));
        Self {
            levels,
            size,
            told,
            components: owners,
            constants,
            width,
            stations,
            noises,
            priors,
            given,
            given_right,
            unit: VectorUnit::widest(),
        }
    }

    /// The same model of some of the stations only; what all pixels say of camera and board stays.
    pub fn among(&self, chosen: &[usize]) -> Self {
        let of = |all: &[DMatrix<f64>]| -> Vec<DMatrix<f64>> {
            chosen.iter().filter_map(|k| all.get(*k)).cloned().collect()
        };
        let noise = |x: &Noise| Noise { roots: of(&x.roots), squares: of(&x.squares), ..x.clone() };
        Self {
            levels: self.levels.clone(),
            components: self.components.clone(),
            constants: self.constants.clone(),
            stations: chosen.iter().map(|k| self.stations[*k].clone()).collect(),
            noises: self.noises.iter().map(noise).collect(),
            priors: self.priors.iter().map(|p| Prior { squares: of(&p.squares), ..p.clone() }).collect(),
            given: self.given.clone(),
            given_right: self.given_right.clone(),
            ..*self
        }
    }

    /// Number of stations.
    pub fn stations(&self) -> usize {
        self.stations.len()
    }

    /// Number of rows of all stations.
    pub fn rows(&self) -> usize {
        self.stations.iter().map(|station| station.size).sum()
    }

    /// Noise of a station's twists at levels `exp(t)`, and what parameters theta with their covariance leave of the
    /// twists: their mean, and the covariance that comes from the parameters alone. Nothing may recur.
    pub fn residual(
        &self,
        k: usize,
        t: &DVector<f64>,
        (theta, covariance): (&DVector<f64>, &DMatrix<f64>),
    ) -> (DMatrix<f64>, DVector<f64>, DMatrix<f64>) {
        let station = &self.stations[k];
        let mut noise = station.pixels.clone();
        for x in &self.noises {
            add(&mut noise, Self::deviation(&x.levels, t).powi(2), &x.squares[k]);
        }
        let rows = DMatrix::from_fn(station.size, self.size, |i, j| station.rows[i * self.width + j]);
        let e = DVector::from_fn(station.size, |i, _| station.rows[i * self.width + self.size]);
        (noise, e + &rows * theta, &rows * covariance * rows.transpose())
    }

    /// Logarithms of the levels to begin with.
    pub fn start(&self) -> DVector<f64> {
        DVector::from_iterator(self.levels.len(), self.levels.iter().map(|l| l.start.ln()))
    }

    /// The same where every error is as large as is usual at most.
    pub fn large_start(&self) -> DVector<f64> {
        let large = |l: &Level| match l.prior {
            LevelPrior::Deviation { size, .. } => size.ln(),
            LevelPrior::Ratio { .. } => l.start.ln(),
        };
        DVector::from_iterator(self.levels.len(), self.levels.iter().map(large))
    }

    pub fn deviation(levels: &[usize], t: &DVector<f64>) -> f64 {
        levels.iter().map(|l| t[*l]).sum::<f64>().exp()
    }

    /// The model at levels `exp(t)`; `None` where it is singular or not finite.
    pub fn evaluate(&self, t: &DVector<f64>, wanted: Wanted) -> Option<Evaluation> {
        let n = self.size;
        let noise: Vec<f64> = self.noises.iter().map(|x| Self::deviation(&x.levels, t)).collect();
        let prior: Vec<f64> = self.priors.iter().map(|x| Self::deviation(&x.levels, t)).collect();
        let mut sum = vec![0.0; (n + 1).next_multiple_of(TOGETHER) * self.width];
        let mut constant = 0.0;
        let (whitened, log_determinant) = self.whitened(&noise, None)?;
        constant += log_determinant;
        dispatch(
            self.unit,
            Accumulate { rows: &whitened.rows, width: self.width, size: n + 1, sum: &mut sum },
        );
        let entry = |i: usize, j: usize| sum[i.min(j) * self.width + i.max(j)];
        constant += entry(n, n);
        let mut information = self.given.clone();
        let mut right = self.given_right.clone();
        for i in 0..n {
            right[i] -= entry(i, n);
            for j in i..n {
                let value = entry(i, j);
                information[(i, j)] += value;
                if i != j {
                    information[(j, i)] += value;
                }
            }
        }
        for (p, s) in self.priors.iter().zip(&prior) {
            constant += Self::add_prior(p, *s, &mut information, &mut right);
        }
        let factor = Factor::new(&information)?;
        let theta = DVector::from_vec(factor.solve(right.as_slice()));
        constant += factor.log_determinant() - right.dot(&theta);
        let mut value = 0.5 * constant;
        let count = self.levels.len();
        let mut slope = DVector::zeros(count);
        let mut curvature = DMatrix::zeros(count, count);
        for (i, (level, t)) in self.levels.iter().zip(t.iter()).enumerate() {
            let (penalty, first, second) = level.penalty(*t);
            value += penalty;
            slope[i] = first;
            curvature[(i, i)] = second;
        }
        if !value.is_finite() {
            return None;
        }
        let apart = wanted == Wanted::Answer && self.told < n;
        let covariance = match wanted {
            Wanted::Slope => factor.inverse(),
            Wanted::Answer if !apart => factor.inverse(),
            _ => DMatrix::zeros(0, 0),
        };
        let mut evaluation =
            Evaluation { value, slope, curvature, theta, covariance, information: DMatrix::zeros(0, 0) };
        match wanted {
            Wanted::Value => {}
            Wanted::Slope => self.differentiate(&whitened, &noise, &prior, &mut evaluation),
            Wanted::Answer if apart => self.answer_apart(&noise, &prior, &mut evaluation)?,
            Wanted::Answer => evaluation.information = information,
        }
        Some(evaluation)
    }

    /// Adds a prior at deviation `s`; what it adds to twice the value.
    pub fn add_prior(p: &Prior, s: f64, information: &mut DMatrix<f64>, right: &mut DVector<f64>) -> f64 {
        let weight = s.powi(-2);
        let mut constant = 2.0 * p.count as f64 * s.ln();
        match &p.information {
            None => {
                for i in p.range() {
                    information[(i, i)] += weight;
                }
            }
            Some(m) => {
                let mut view = information.view_mut((p.first, p.first), (p.count, p.count));
                view += m * weight;
            }
        }
        if let Some(mean) = &p.mean {
            let pull = DVector::from_vec(p.times(mean.as_slice())) * weight;
            constant += pull.dot(mean);
            let mut view = right.rows_mut(p.first, p.count);
            view += pull;
        }
        constant
    }

    /// All stations' rows, whitened, and the logarithm of the determinant of their covariances; `prior` as in `factor`.
    pub fn whitened(&self, noise: &[f64], prior: Option<&[f64]>) -> Option<(Whitened, f64)> {
        let rows = self.stations.iter().map(|station| station.rows.len()).sum();
        let mut all =
            Whitened { factors: Vec::with_capacity(self.stations.len()), rows: Vec::with_capacity(rows) };
        let mut constant = 0.0;
        for (k, station) in self.stations.iter().enumerate() {
            let (factor, log_determinant) = self.factor(station, k, noise, prior)?;
            constant += log_determinant;
            let first = all.rows.len();
            all.rows.extend_from_slice(&station.rows);
            let rows = &mut all.rows[first..];
            dispatch(self.unit, Whiten { factor: &factor, rows, width: self.width });
            all.factors.push(factor);
        }
        Some((all, constant))
    }

    /// Cholesky factor of a station's covariance, and the logarithm of its determinant. With `prior`, recurring errors
    /// count as new at the station.
    fn factor(
        &self,
        station: &Station,
        k: usize,
        noise: &[f64],
        prior: Option<&[f64]>,
    ) -> Option<(DMatrix<f64>, f64)> {
        let mut covariance = station.pixels.clone();
        for (x, s) in self.noises.iter().zip(noise) {
            add(&mut covariance, s * s, &x.squares[k]);
        }
        if let Some(prior) = prior {
            for (p, s) in self.priors.iter().zip(prior).filter(|(p, _)| p.recurring) {
                add(&mut covariance, s * s, &p.squares[k]);
            }
        }
        let factor = covariance.cholesky()?.unpack();
        let log_determinant = 2.0 * factor.diagonal().iter().map(|x| x.ln()).sum::<f64>();
        Some((factor, log_determinant))
    }
}

impl Station {
    /// Columns of a prior's parameters.
    pub fn columns(&self, p: &Prior, width: usize) -> DMatrix<f64> {
        DMatrix::from_fn(self.size, p.count, |i, j| self.rows[i * width + p.first + j])
    }
}
