//! How well stations agree: what some of them predict of each, under the model of the estimate.
//!
//! Everything that the robot does wrong is taken as new at every station (the working model of the estimate): then the
//! density of what was measured at a station, given others, is that of a regression with its levels averaged over. A
//! station that took part is taken out of the answer again in closed form (Cook and Weisberg 1982, section 2.2), and
//! nodes are weighed again without it.

use nalgebra::{DMatrix, DVector};

use super::cell::Cell;
use super::components;
use super::linearisation::Guess;
use super::mixed::{Mixed, Wanted};
use super::nodes::{Axes, LEAST_CURVATURE};
use super::posterior::{assemble, find_mode, singular};
use super::weak_prior::WeakPrior;
use crate::error::Error;
use crate::se3::Se3;

/// Squared distances beyond this have a probability of zero.
const FARTHEST: f64 = 1400.0;

/// Of so few members each is predicted from the others fitted again; of more it is taken out of the answer.
const FEW: usize = 5;
/// A covariance that grows by more when a member is taken out is rounding.
const MOST_GROWTH: f64 = 1e6;

/// Stations linearised at a guess of the poses.
pub struct Agreement {
    mixed: Mixed,
    guess: Guess,
}

/// What a set of stations says of every station: of its members, what the other members say.
#[derive(Clone, Debug)]
pub struct SetFit {
    /// Logarithm of the marginal likelihood of the set (Laplace's approximation over the levels), up to a constant that
    /// all sets share.
    pub log_evidence: f64,
    /// Names and values of the levels at their mode.
    pub levels: Vec<(&'static str, f64)>,
    /// `X` of each camera.
    pub x: Vec<Se3>,
    /// `Y` of each target.
    pub y: Vec<Se3>,
    /// Parameters beside the poses: of the cameras, then the scales of the boards, relative to what was given.
    pub constants: Vec<f64>,
    /// Expected of each station.
    pub predictions: Vec<Prediction>,
}

/// What is expected of the twists of a station, and how they fit that.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// The twists between chain and measurements, with what the set says of all constants.
    pub deviation: DVector<f64>,
    /// Covariance expected of them.
    pub covariance: DMatrix<f64>,
    /// Logarithm of their density.
    pub log_density: f64,
    /// Probability of twists at least as unusual.
    pub p_value: f64,
}

/// The model at one set of levels.
struct Node {
    t: DVector<f64>,
    log_weight: f64,
    theta: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Agreement {
    /// A cell linearised at a guess.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for a cell that does not fit together.
    pub fn new(cell: &Cell, (x, y): (Vec<Se3>, Vec<Se3>)) -> Result<Self, Error> {
        cell.check()?;
        let guess = Guess { x, y, away: vec![] };
        let mixed = assemble(cell, &guess, &components::independent(cell), &WeakPrior::default());
        Ok(Self { mixed, guess })
    }

    /// Number of stations.
    pub fn stations(&self) -> usize {
        self.mixed.stations()
    }

    /// Fits the levels to a set of stations, from `levels` on where these are given, and predicts all of them, averaged
    /// over `pairs` pairs of nodes and the mode.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for a station that is not there, [`Error::Numerical`] where the model is singular.
    pub fn fit(&self, members: &[usize], levels: Option<&[f64]>, pairs: usize) -> Result<SetFit, Error> {
        if let Some(k) = members.iter().find(|k| **k >= self.stations()) {
            return Err(Error::invalid(format!("station {k} of {}", self.stations())));
        }
        let set = self.mixed.among(members);
        let start = match levels {
            Some(levels) if levels.len() == set.levels.len() => {
                DVector::from_iterator(levels.len(), levels.iter().map(|l| l.ln()))
            }
            Some(levels) => return Err(Error::invalid(format!("{} levels", levels.len()))),
            None => set.start(),
        };
        let mode = find_mode(&set, start)?;
        let mut nodes = Vec::with_capacity(2 * pairs + 1);
        for (t, density) in Axes::of(&mode.t, &mode.curvature).points(pairs) {
            // Levels at which the model is singular have no share.
            let Some(at) = set.evaluate(&t, Wanted::Answer) else { continue };
            let log_weight = mode.value - at.value - density;
            nodes.push(Node { t, log_weight, theta: at.theta, covariance: at.covariance });
        }
        let log_total = log_sum(nodes.iter().map(|n| n.log_weight));
        if !log_total.is_finite() {
            return Err(singular());
        }
        let mut theta = DVector::zeros(self.mixed.told);
        for node in &mut nodes {
            node.log_weight -= log_total;
            theta.axpy(node.log_weight.exp(), &node.theta, 1.0);
        }
        let curvature = (&mode.curvature + mode.curvature.transpose()) * 0.5;
        let spread: f64 = curvature.symmetric_eigenvalues().iter().map(|e| e.max(LEAST_CURVATURE).ln()).sum();
        let rows = set.rows() as f64;
        let poses = 6 * (self.guess.x.len() + self.guess.y.len());
        let moved = self.guess.moved(theta.as_slice());
        let predictions = (0..self.stations())
            .map(|k| self.predict(k, members, &nodes).ok_or_else(singular))
            .collect::<Result<_, _>>()?;
        Ok(SetFit {
            log_evidence: -mode.value - 0.5 * spread - 0.5 * rows * std::f64::consts::TAU.ln(),
            levels: set.levels.iter().zip(mode.t.iter()).map(|(level, t)| (level.name, t.exp())).collect(),
            constants: theta.as_slice()[poses..].to_vec(),
            x: moved.x,
            y: moved.y,
            predictions,
        })
    }

    fn predict(&self, k: usize, members: &[usize], nodes: &[Node]) -> Option<Prediction> {
        let inside = members.contains(&k);
        let others = || self.mixed.among(&members.iter().copied().filter(|m| *m != k).collect::<Vec<_>>());
        let without = (inside && members.len() <= FEW).then(others);
        let mut each = Vec::with_capacity(nodes.len());
        for node in nodes {
            let expected = match &without {
                Some(set) => self.expected_of_others(k, set, node),
                None if inside => {
                    self.taken_out(k, node).or_else(|| self.expected_of_others(k, &others(), node))
                }
                None => Some(self.expected(k, &node.t, (&node.theta, &node.covariance))),
            };
            let (mean, covariance) = expected?;
            let covariance = (&covariance + covariance.transpose()) * 0.5;
            let factor = covariance.clone().cholesky()?;
            let distance = mean.dot(&factor.solve(&mean));
            let log_determinant = 2.0 * factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>();
            let rows = mean.len() as f64;
            let density = -0.5 * (distance + log_determinant + rows * std::f64::consts::TAU.ln());
            let weight = node.log_weight - if inside { density } else { 0.0 };
            each.push((weight, density, distance, mean, covariance));
        }
        let total = log_sum(each.iter().map(|e| e.0));
        let size = each.first()?.3.len();
        let mut prediction = Prediction {
            deviation: DVector::zeros(size),
            covariance: DMatrix::zeros(size, size),
            log_density: log_sum(each.iter().map(|e| e.0 - total + e.1)),
            p_value: 0.0,
        };
        for (weight, _, distance, mean, covariance) in &each {
            let share = (weight - total).exp();
            prediction.deviation.axpy(share, mean, 1.0);
            prediction.covariance += covariance * share;
            prediction.p_value += share * beyond(*distance, size);
        }
        Some(prediction)
    }

    /// Mean and covariance of the twists of a station that took no part.
    fn expected(
        &self,
        k: usize,
        t: &DVector<f64>,
        answer: (&DVector<f64>, &DMatrix<f64>),
    ) -> (DVector<f64>, DMatrix<f64>) {
        let (noise, mean, spread) = self.mixed.residual(k, t, answer);
        (mean, noise + spread)
    }

    /// The same of a member, from the others fitted again at the same levels.
    fn expected_of_others(
        &self,
        k: usize,
        others: &Mixed,
        node: &Node,
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let at = others.evaluate(&node.t, Wanted::Answer)?;
        Some(self.expected(k, &node.t, (&at.theta, &at.covariance)))
    }

    /// The same of a member, taken out of the answer: what is left of its noise is (I - H) V. `None` where the others
    /// hardly determine the answer, as the difference is then all rounding.
    fn taken_out(&self, k: usize, node: &Node) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let (noise, mean, spread) = self.mixed.residual(k, &node.t, (&node.theta, &node.covariance));
        let remaining = (&noise - &spread).cholesky()?;
        let taken_out = remaining.solve(&noise).transpose();
        let covariance = &taken_out * &noise;
        (covariance.trace() < MOST_GROWTH * noise.trace()).then(|| (&taken_out * mean, covariance))
    }
}

/// Probability of a chi-square with an even number of degrees of freedom beyond `distance`.
fn beyond(distance: f64, degrees: usize) -> f64 {
    let half = 0.5 * distance.min(FARTHEST);
    let mut term = 1.0;
    let mut sum = 1.0;
    for i in 1..degrees / 2 {
        term *= half / i as f64;
        sum += term;
    }
    (-half).exp() * sum
}

/// Logarithm of a sum of exponentials.
fn log_sum(logs: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    if most.is_finite() { most + logs.map(|l| (l - most).exp()).sum::<f64>().ln() } else { most }
}
