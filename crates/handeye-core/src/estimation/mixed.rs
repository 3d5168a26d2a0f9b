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

use super::levels::{Level, LevelPrior};
use super::recurring::FUNCTIONS;
use super::station_covariances::{StationCovariances, StationFactors, Whiten};
use crate::positive::{Block, Factor};
use crate::simd::{MAX_LANES, VectorUnit, dispatch};

/// A prior on parameters.
#[derive(Clone)]
pub(super) struct Prior {
    pub of: &'static str,
    pub levels: Vec<usize>,
    /// First of the answer's parameters that it is about, or, where it recurs, of the columns of what recurs.
    pub first: usize,
    pub count: usize,
    /// `None`: the identity.
    pub information: Option<DMatrix<f64>>,
    pub mean: Option<DVector<f64>>,
    pub recurring: bool,
    /// Of recurring ones: values of the functions at the stations.
    pub functions: Vec<Block>,
    /// Of recurring ones: covariances of the stations at a deviation of one.
    pub squares: Vec<DMatrix<f64>>,
}

impl Prior {
    pub fn range(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.count
    }

    /// Information times a vector.
    pub fn times(&self, v: &DVector<f64>) -> DVector<f64> {
        self.information.as_ref().map_or_else(|| v.clone(), |m| m * v)
    }
}

/// Adds a multiple of a matrix of the same shape.
pub(super) fn add(to: &mut DMatrix<f64>, factor: f64, m: &DMatrix<f64>) {
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
    /// Of each root.
    pub columns: usize,
    /// Their squares: covariances at a deviation of one.
    pub squares: Vec<DMatrix<f64>>,
}

/// Rows of all stations in units of their noise.
pub(super) struct Whitened {
    /// Cholesky factors of the covariances.
    pub factors: StationFactors,
    /// Their rows, one after the other.
    pub rows: Vec<f64>,
}

/// Rows of a station, as the kernels want them.
#[derive(Clone)]
pub(super) struct Station {
    pub size: usize,
    /// Columns of what recurs and, from [`Mixed::lead`] on, `[B e]`, row by row, padded to whole vectors.
    pub rows: Vec<f64>,
    /// Roots of all noises side by side, row by row, padded to whole vectors.
    pub roots: Vec<f64>,
    pub pixels: DMatrix<f64>,
    /// Derivative of the twists in a twist of the flange, through which all acts that the arm does wrong.
    pub arm: DMatrix<f64>,
    /// Whether several measurements were reduced to six rows.
    pub reduced: bool,
}

/// Rows in units of a noise that is the same at all levels.
#[derive(Clone)]
pub(super) struct Settled {
    pub rows: usize,
    /// Information of the parameters in them.
    pub information: DMatrix<f64>,
    /// Twice what they add to minus the logarithm of the likelihood, whatever the parameters.
    pub constant: f64,
}

/// A cell linearised, with its components.
pub(super) struct Mixed {
    pub levels: Vec<Level>,
    /// All parameters.
    pub size: usize,
    /// Parameters of the answer: poses, cameras, boards, and constants of the arm.
    pub told: usize,
    /// Columns of what recurs, each with a coefficient per function.
    pub twists: usize,
    /// Names of the components, with the range of their levels.
    pub components: Vec<(&'static str, std::ops::Range<usize>)>,
    /// Names of the components, with the range of their constants.
    pub constants: Vec<(&'static str, std::ops::Range<usize>)>,
    /// Where the answer's columns begin in the rows of stations, and how wide these are.
    pub lead: usize,
    pub width: usize,
    pub stations: Vec<Station>,
    pub noises: Vec<Noise>,
    pub priors: Vec<Prior>,
    /// Of stations, noises and priors as they are here.
    pub covariances: StationCovariances,
    pub given: DMatrix<f64>,
    pub given_right: DVector<f64>,
    /// Rows whose noise is the same at all levels, summed up in what is given.
    pub settled: Settled,
    pub unit: VectorUnit,
}

/// Covariances of stations side by side.
pub(super) fn covariances(stations: &[Station], noises: &[Noise], priors: &[Prior]) -> StationCovariances {
    StationCovariances::of(
        &stations.iter().map(|station| &station.pixels).collect::<Vec<_>>(),
        noises.iter().map(|x| &x.squares[..]),
        priors.iter().map(|p| &p.squares[..]),
    )
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
    /// The parameters of the answer; not where the value alone was wanted.
    pub theta: DVector<f64>,
    /// Their covariance, where an answer was wanted.
    pub covariance: DMatrix<f64>,
    /// Their information under the working model, where an answer was wanted.
    pub information: DMatrix<f64>,
}

impl Mixed {
    /// The same model of some of the stations only; what all pixels say of camera and board stays.
    pub fn among(&self, chosen: &[usize]) -> Self {
        let of = |all: &[DMatrix<f64>]| -> Vec<DMatrix<f64>> {
            chosen.iter().filter_map(|k| all.get(*k)).cloned().collect()
        };
        let noise = |x: &Noise| Noise { roots: of(&x.roots), squares: of(&x.squares), ..x.clone() };
        let stations: Vec<Station> = chosen.iter().map(|k| self.stations[*k].clone()).collect();
        let noises: Vec<Noise> = self.noises.iter().map(noise).collect();
        let prior = |p: &Prior| {
            let functions = chosen.iter().filter_map(|k| p.functions.get(*k)).copied().collect();
            Prior { squares: of(&p.squares), functions, ..p.clone() }
        };
        let priors: Vec<Prior> = self.priors.iter().map(prior).collect();
        Self {
            levels: self.levels.clone(),
            components: self.components.clone(),
            constants: self.constants.clone(),
            covariances: covariances(&stations, &noises, &priors),
            stations,
            noises,
            priors,
            given: self.given.clone(),
            given_right: self.given_right.clone(),
            settled: self.settled.clone(),
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
        let rows = DMatrix::from_fn(station.size, self.told, |i, j| station.rows[i * self.width + j]);
        let e = DVector::from_fn(station.size, |i, _| station.rows[i * self.width + self.told]);
        (noise, e + &rows * theta, &rows * covariance * rows.transpose())
    }

    /// Width of the roots of all noises side by side.
    pub fn roots_across(&self) -> usize {
        self.noises.iter().map(|x| x.columns).sum::<usize>().next_multiple_of(MAX_LANES)
    }

    /// Logarithms of the levels to begin with.
    pub fn start(&self) -> DVector<f64> {
        DVector::from_iterator(self.levels.len(), self.levels.iter().map(|l| l.start.ln()))
    }

    /// The same where every error is as large as is usual at most.
    pub fn large_start(&self) -> DVector<f64> {
        let large = |l: &Level| match l.prior {
            LevelPrior::Deviation { size, .. } => size.ln(),
            LevelPrior::Ratio { .. } | LevelPrior::Known { .. } => l.start.ln(),
        };
        DVector::from_iterator(self.levels.len(), self.levels.iter().map(large))
    }

    pub fn deviation(levels: &[usize], t: &DVector<f64>) -> f64 {
        levels.iter().map(|l| t[*l]).sum::<f64>().exp()
    }

    /// The model at levels `exp(t)`; `None` where it is singular or not finite.
    pub fn evaluate(&self, t: &DVector<f64>, wanted: Wanted) -> Option<Evaluation> {
        let noise: Vec<f64> = self.noises.iter().map(|x| Self::deviation(&x.levels, t)).collect();
        let prior: Vec<f64> = self.priors.iter().map(|x| Self::deviation(&x.levels, t)).collect();
        let (whitened, log_determinant) = self.whitened(&noise, None)?;
        let mut constant = self.settled.constant + log_determinant;
        let (mut given, mut right) = (self.given.clone(), self.given_right.clone());
        for (p, s) in self.priors.iter().zip(&prior) {
            constant += if p.recurring {
                2.0 * (FUNCTIONS * p.count) as f64 * s.ln()
            } else {
                Self::add_prior(p, *s, &mut given, &mut right)
            };
        }
        let (system, squared) = self.system(&whitened.rows, (&given, &right), &prior);
        let apart = self.twists > 0;
        let told = self.told;
        let information = if wanted == Wanted::Answer && !apart {
            let width = system.len() / told * MAX_LANES;
            DMatrix::from_fn(told, told, |i, j| system.as_flattened()[i.min(j) * width + i.max(j)])
        } else {
            DMatrix::zeros(0, 0)
        };
        let factor = Factor::carrying(self.size, system)?;
        constant += squared + factor.log_determinant() - factor.carried();
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
        let mut evaluation = Evaluation {
            value,
            slope,
            curvature,
            theta: DVector::zeros(0),
            covariance: DMatrix::zeros(0, 0),
            information,
        };
        match wanted {
            Wanted::Value => {}
            Wanted::Slope => self.differentiate(&whitened, &factor, (&noise, &prior), &mut evaluation),
            Wanted::Answer if apart => {
                self.answer_apart((&noise, &prior), (given, right), &mut evaluation)?;
            }
            Wanted::Answer => {
                evaluation.theta = -DVector::from_vec(factor.solution());
                evaluation.covariance = factor.inverse();
            }
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
            let pull = p.times(mean) * weight;
            constant += pull.dot(mean);
            let mut view = right.rows_mut(p.first, p.count);
            view += pull;
        }
        constant
    }

    /// All stations' rows, whitened, and the logarithm of the determinant of their covariances. With `prior`, recurring
    /// errors count as new at every station.
    pub fn whitened(&self, noise: &[f64], prior: Option<&[f64]>) -> Option<(Whitened, f64)> {
        let (factors, log_determinant) = self.covariances.factorised(self.unit, noise, prior)?;
        let rows = self.whiten(&factors, |station| &station.rows, self.width);
        Some((Whitened { factors, rows }, log_determinant))
    }

    /// `L^-1` times rows of all stations.
    pub fn whiten(&self, factors: &StationFactors, rows: fn(&Station) -> &[f64], width: usize) -> Vec<f64> {
        let mut out = vec![0.0; self.rows() * width];
        if width > 0 {
            let rows: Vec<&[f64]> = self.stations.iter().map(rows).collect();
            dispatch(self.unit, Whiten { factors, rows: &rows, width, out: &mut out });
        }
        out
    }
}

impl Station {
    /// Columns of a prior's parameters.
    pub fn columns(&self, p: &Prior, width: usize) -> DMatrix<f64> {
        DMatrix::from_fn(self.size, p.count, |i, j| self.rows[i * width + p.first + j])
    }
}
