//! From a cell to the answer: linearise, find the levels, move, and average over what the levels may be.

use nalgebra::{DMatrix, DVector, Matrix6xX};

use super::cell::Cell;
use super::component::Component;
use super::components::{self, Assumptions};
use super::degrees_of_freedom::degrees_of_freedom;
use super::linearisation::{Guess, linearise};
use super::mixed::{Evaluation, Mixed, Wanted};
use super::nodes::Axes;
use super::weak_prior::WeakPrior;
use crate::error::Error;
use crate::interrupt;
use crate::se3::Se3;
use crate::threads;

/// How an estimate is made.
#[derive(Clone, Debug)]
pub struct Options {
    /// What is assumed of the cell.
    pub assumptions: Assumptions,
    /// What is believed of the poses beforehand.
    pub weak: WeakPrior,
    /// Pairs of nodes that the answer is averaged over.
    pub pairs: usize,
    /// Most linearisations.
    pub most_rounds: usize,
    /// Levels to begin with, by name, those of one name in order; others begin as usual.
    pub levels: Vec<(String, f64)>,
}

/// The model at one set of levels.
#[derive(Clone, Debug)]
pub struct Node {
    /// Its share.
    pub weight: f64,
    /// The levels, in the order of [`Posterior::level_names`].
    pub levels: Vec<f64>,
    /// Parameters there, relative to the point of linearisation.
    pub theta: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
}

/// What is believed after the measurements.
#[derive(Clone, Debug)]
pub struct Posterior {
    /// `X` of each camera.
    pub x: Vec<Se3>,
    /// `Y` of each target.
    pub y: Vec<Se3>,
    /// All parameters: twists of `X` and `Y` (zero), cameras, boards, constants of the arm.
    pub theta: DVector<f64>,
    /// Their covariance, averaged.
    pub covariance: DMatrix<f64>,
    /// Components with constants, and where theirs stand in `theta`.
    pub constants: Vec<(&'static str, std::ops::Range<usize>)>,
    /// Names of the levels.
    pub level_names: Vec<&'static str>,
    /// The model at the mode of the levels, first, and around it.
    pub nodes: Vec<Node>,
    /// Degrees of freedom of the covariance of each `X`.
    pub degrees_of_freedom: Vec<f64>,
    /// Minus the logarithm of the posterior density of the levels at their mode.
    pub value: f64,
    /// Components of the error: by how much the likelihood falls without each, and how far each moves the measurements
    /// in standard deviations of the pixels, squared.
    pub attribution: Vec<Attribution>,
    /// By how much the likelihood falls where the robot is taken as exact.
    pub robot_loss: f64,
    /// Information at the mode of the levels, recurring errors taken as new at every station: what that of a further
    /// station adds to.
    pub information: DMatrix<f64>,
    /// Linearisations.
    pub rounds: usize,
    /// Steps of the levels in all rounds.
    pub steps: usize,
    /// Whether poses and levels came to rest.
    pub converged: bool,
}

impl Posterior {
    /// Degrees of freedom of the covariance of six linear combinations of the parameters.
    #[must_use]
    pub fn degrees_of_freedom_of(&self, combinations: &Matrix6xX<f64>) -> f64 {
        degrees_of_freedom(shares(&self.nodes), |all| combinations * all * combinations.transpose())
    }
}

/// Share and covariance of each node.
fn shares(nodes: &[Node]) -> impl Iterator<Item = (f64, &DMatrix<f64>)> {
    nodes.iter().map(|node| (node.weight, &node.covariance))
}

/// What a component of the error explains.
#[derive(Clone, Debug)]
pub struct Attribution {
    /// Its name.
    pub name: &'static str,
    /// By how much the logarithm of the likelihood falls without it.
    pub loss: f64,
    /// Mean square displacement of the measurements in standard deviations of the pixels.
    pub misfit: f64,
}

/// A step of the poses below this share of its standard deviation is the last.
const AT_REST: f64 = 1e-2;
/// Steps of the levels in one round.
const MOST_STEPS: usize = 30;
/// A step that lowers the penalised likelihood by less is the last.
const FLAT: f64 = 1e-3;
/// The same in the first round of several cameras.
const ROUGHLY_FLAT: f64 = 0.1;
/// Longest step of a level, in its logarithm.
const LONGEST_STEP: f64 = 1.5;

/// An arm that stood farther off than this (metres, radians) bends what cameras see of each other: what a linearisation
/// leaves out of a metre is about the square of it, 10 micrometres.
const BENDS: f64 = 3e-3;

/// Estimates a cell from a guess of its poses.
///
/// # Errors
/// [`Error::InvalidInput`] for a cell that does not fit together, [`Error::Numerical`] where the model is singular.
pub fn estimate(cell: &Cell, start: (Vec<Se3>, Vec<Se3>), options: &Options) -> Result<Posterior, Error> {
    cell.check()?;
    let components = components::all(cell, &options.assumptions)?;
    let mut guess = Guess { x: start.0, y: start.1, away: vec![] };
    let (mut levels, mut steps, mut rounds) = (None, 0, 0);
    let at = |guess: &Guess| assemble(cell, guess, &components, &options.weak).reduced().ok_or_else(singular);
    let mut mixed = at(&guess)?;
    let away = if mixed.settled.rows > 0 { mixed.flange_twists(None) } else { vec![] };
    let bent = away.iter().any(|twist| twist.amax() > BENDS);
    if bent {
        guess.away = away;
        mixed = at(&guess)?;
    }
    let mut mode = None;
    while rounds < options.most_rounds {
        rounds += 1;
        let found = match levels {
            Some(levels) => find_mode(&mixed, levels)?,
            None => first_mode(&mixed, options, cell.is_unseen(), bent)?,
        };
        steps += found.steps;
        let answer = answer_at(&mixed, &found.t)?;
        let moved = largest_share(&answer, 6 * (cell.cameras.len() + cell.targets.len()));
        levels = Some(found.t.clone());
        if moved < AT_REST {
            mode = Some((found, answer));
            break;
        }
        guess = guess.moved(answer.theta.as_slice());
        guess.away = mixed.flange_twists(Some((&found.t, &answer.theta)));
        mixed = at(&guess)?;
    }
    let converged = mode.is_some();
    let (found, at_mode) = if let Some(mode) = mode {
        mode
    } else {
        let found = find_mode(&mixed, levels.unwrap_or_else(|| mixed.start()))?;
        let answer = answer_at(&mixed, &found.t)?;
        (found, answer)
    };
    let nodes = average(&mixed, &found, &at_mode, options.pairs);
    gather(cell, &guess, &mixed, (nodes, &at_mode), &found, (rounds, steps, converged && found.at_rest))
}

pub(super) fn assemble(
    cell: &Cell,
    guess: &Guess,
    components: &[Box<dyn Component>],
    weak: &WeakPrior,
) -> Mixed {
    let linearisation = linearise(cell, guess);
    let end = cell.columns().end;
    let mut information = DMatrix::zeros(end, end);
    let mut right = DVector::zeros(end);
    for (c, x) in guess.x.iter().enumerate() {
        let (of_x, pull) = weak.of_x(x);
        information.view_mut((6 * c, 6 * c), (6, 6)).copy_from(&of_x);
        right.rows_mut(6 * c, 6).copy_from(&pull);
    }
    for t in 0..guess.y.len() {
        let at = 6 * (guess.x.len() + t);
        information.view_mut((at, at), (6, 6)).copy_from(&weak.of_y());
    }
    Mixed::new(&linearisation, components, (&information, &right), cell)
}

pub(super) fn singular() -> Error {
    Error::numerical("the model of the measurements is singular")
}

fn answer_at(mixed: &Mixed, t: &DVector<f64>) -> Result<Evaluation, Error> {
    mixed.evaluate(t, Wanted::Answer).ok_or_else(singular)
}

/// Largest step of the poses, in standard deviations.
fn largest_share(answer: &Evaluation, poses: usize) -> f64 {
    (0..poses)
        .map(|i| answer.theta[i].abs() / answer.covariance[(i, i)].max(f64::MIN_POSITIVE).sqrt())
        .fold(0.0, f64::max)
}

pub(super) struct Mode {
    pub t: DVector<f64>,
    pub value: f64,
    pub curvature: DMatrix<f64>,
    steps: usize,
    at_rest: bool,
}

/// The mode of the levels before any is known.
///
/// Where measurements of a station see each other free of the arm, an arm that is far off bends them (`bent`) as long as the
/// poses are: until these are better, lenses and boards are taken as they are said to be.
///
/// Without pictures an error of the arm passes for one of the detector, and the likelihood can have a mode for either:
/// the search begins small and large, and the better end counts.
fn first_mode(mixed: &Mixed, options: &Options, unseen: bool, bent: bool) -> Result<Mode, Error> {
    let mut start = mixed.start();
    let mut left: Vec<_> = options.levels.iter().collect();
    for (t, level) in start.iter_mut().zip(&mixed.levels) {
        if let Some(i) = left.iter().position(|(name, _)| name == level.name) {
            *t = left.remove(i).1.ln();
        }
    }
    let of_pictures = mixed.components.iter().filter(|(name, _)| !components::is_of_robot(name));
    let held: Vec<usize> =
        if bent { of_pictures.flat_map(|(_, range)| range.clone()).collect() } else { vec![] };
    // Where the chains are linearised again, the first round need not end exactly.
    let flat = if mixed.settled.rows > 0 { ROUGHLY_FLAT } else { FLAT };
    let small = search(mixed, start, &held, flat)?;
    if !unseen {
        return Ok(small);
    }
    let large = search(mixed, mixed.large_start(), &held, flat)?;
    let steps = small.steps + large.steps;
    Ok(Mode { steps, ..if large.value < small.value { large } else { small } })
}

/// The mode of the levels, none of them held.
pub(super) fn find_mode(mixed: &Mixed, start: DVector<f64>) -> Result<Mode, Error> {
    search(mixed, start, &[], FLAT)
}

/// Newton's method on the levels but those that are held, damped until the penalised likelihood falls by less than `flat`.
fn search(mixed: &Mixed, start: DVector<f64>, held: &[usize], flat: f64) -> Result<Mode, Error> {
    let mut t = start;
    let mut now = mixed.evaluate(&t, Wanted::Slope).ok_or_else(singular)?;
    let mut damping = 1e-2;
    let mut at_rest = false;
    let mut steps = 0;
    while steps < MOST_STEPS && !at_rest {
        interrupt::check();
        steps += 1;
        let mut taken = false;
        for _ in 0..8 {
            let step = damped_step(&now, damping, held);
            let promised = -0.5 * step.dot(&now.slope);
            if promised < flat * 0.1 {
                at_rest = true;
                break;
            }
            let there = &t + &step;
            match mixed.evaluate(&there, Wanted::Slope) {
                Some(next) if next.value < now.value => {
                    at_rest = now.value - next.value < flat;
                    t = there;
                    now = next;
                    damping = (damping * 0.2).max(1e-4);
                    taken = true;
                    break;
                }
                _ => damping = (damping * 10.0).max(1e-1),
            }
        }
        if !taken {
            at_rest = true;
        }
    }
    Ok(Mode { t, value: now.value, curvature: now.curvature, steps, at_rest })
}

/// Step of the levels by a curvature made positive.
fn damped_step(now: &Evaluation, damping: f64, held: &[usize]) -> DVector<f64> {
    let (mut slope, mut curvature) = (now.slope.clone(), now.curvature.clone());
    for l in held {
        slope[*l] = 0.0;
        curvature.row_mut(*l).fill(0.0);
        curvature.column_mut(*l).fill(0.0);
    }
    let eigen = nalgebra::SymmetricEigen::new(curvature);
    let along = eigen.eigenvectors.tr_mul(&slope);
    let scaled =
        DVector::from_fn(along.len(), |i, _| -along[i] / (eigen.eigenvalues[i].abs().max(0.05) + damping));
    let mut step = &eigen.eigenvectors * scaled;
    let longest = step.amax();
    if longest > LONGEST_STEP {
        step *= LONGEST_STEP / longest;
    }
    step
}

/// The nodes with their shares, the mode first.
fn average(mixed: &Mixed, mode: &Mode, at_mode: &Evaluation, pairs: usize) -> Vec<Node> {
    let value = |t: &DVector<f64>| mixed.evaluate(t, Wanted::Value).map_or(f64::INFINITY, |at| at.value);
    let points = Axes::of(&mode.t, &mode.curvature).measured(|t| value(t) - mode.value).points(pairs);
    // Levels at which the model is singular have no share.
    let node = |t: &DVector<f64>, density: f64, answer: &Evaluation| Node {
        weight: mode.value - answer.value - density,
        levels: t.iter().map(|t| t.exp()).collect(),
        theta: answer.theta.rows(0, mixed.told).into_owned(),
        covariance: answer.covariance.view((0, 0), (mixed.told, mixed.told)).into_owned(),
    };
    let at = |points: &[(DVector<f64>, f64)]| -> Vec<Node> {
        let found =
            |(t, density): &(DVector<f64>, f64)| Some(node(t, *density, &mixed.evaluate(t, Wanted::Answer)?));
        points.iter().filter_map(found).collect()
    };
    let threads = threads::available();
    let around = &points[1..];
    let (own, others) = around.split_at(around.len().div_ceil(threads));
    let mut nodes = vec![node(&mode.t, points[0].1, at_mode)];
    std::thread::scope(|scope| {
        let others: Vec<_> =
            others.chunks(own.len().max(1)).map(|points| scope.spawn(|| at(points))).collect();
        nodes.extend(at(own));
        for thread in others {
            nodes.extend(thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        }
    });
    let most = nodes.iter().map(|node| node.weight).fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = nodes.iter().map(|node| (node.weight - most).exp()).sum();
    for node in &mut nodes {
        node.weight = (node.weight - most).exp() / total;
    }
    nodes
}

fn gather(
    cell: &Cell,
    guess: &Guess,
    mixed: &Mixed,
    (nodes, at_mode): (Vec<Node>, &Evaluation),
    mode: &Mode,
    (rounds, steps, converged): (usize, usize, bool),
) -> Result<Posterior, Error> {
    let told = mixed.told;
    let mut theta = DVector::zeros(told);
    for node in &nodes {
        theta.axpy(node.weight, &node.theta, 1.0);
    }
    let mut covariance = DMatrix::zeros(told, told);
    for node in &nodes {
        let away = &node.theta - &theta;
        covariance += &node.covariance * node.weight;
        covariance.ger(node.weight, &away, &away, 1.0);
    }
    covariance = (&covariance + covariance.transpose()) * 0.5;
    let degrees_of_freedom = (0..cell.cameras.len())
        .map(|c| degrees_of_freedom(shares(&nodes), |all| all.fixed_view::<6, 6>(6 * c, 6 * c).into_owned()))
        .collect();
    let moved = guess.moved(theta.as_slice());
    let poses = 6 * (cell.cameras.len() + cell.targets.len());
    theta.rows_mut(0, poses).fill(0.0);
    let attribution = attribution(mixed, mode, &at_mode.theta)?;
    let of_robot: Vec<&str> =
        attribution.iter().map(|a| a.name).filter(|n| components::is_of_robot(n)).collect();
    let without = mixed.value_without(&of_robot, &mode.t).ok_or_else(singular)?;
    Ok(Posterior {
        x: moved.x,
        y: moved.y,
        theta,
        covariance,
        constants: mixed.constants.iter().filter(|(_, range)| range.end <= told).cloned().collect(),
        level_names: mixed.levels.iter().map(|l| l.name).collect(),
        nodes,
        degrees_of_freedom,
        value: mode.value,
        attribution,
        robot_loss: without - mode.value,
        information: at_mode.information.clone(),
        rounds,
        steps,
        converged,
    })
}

fn attribution(mixed: &Mixed, mode: &Mode, theta: &DVector<f64>) -> Result<Vec<Attribution>, Error> {
    let misfit = mixed.misfit(&mode.t, theta).ok_or_else(singular)?;
    misfit
        .into_iter()
        .map(|(name, misfit)| {
            let without = mixed.value_without(&[name], &mode.t).ok_or_else(singular)?;
            Ok(Attribution { name, loss: without - mode.value, misfit })
        })
        .collect()
}
