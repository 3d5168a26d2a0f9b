//! Every hypothesis weighed by its restricted likelihood, and the answer averaged over them.
//!
//! With the chain linearised, the twist `e_k` between chain and pose of view k is Gaussian: mean
//! `-[I, Ad(X A_k), C_k, Ad(X) D_k] theta` (chain, camera, joint offsets), covariance `sigma_k^2 M_k^-1 + S_k`.
//! Integrating `theta` out (flat but for the priors) leaves the restricted likelihood of the levels,
//! `-2 ln p = sum ln |Sigma_k| + e' Sigma^-1 e - theta' r + ln |Lambda|` (Patterson and Thompson 1971).

use nalgebra::{DMatrix, DVector, Vector6};

use crate::estimation::WeakPrior;
use crate::estimation::PoseMeasurement as CompressedView;
use super::hypotheses::{Hypothesis, Nature};
use super::joints::JointErrors;
use super::links::LinkErrors;
use super::smooth::SmoothError;
use super::weigh::{Equations, Sums, View};
use super::weigh_links::LinkSums;
use crate::error::Error;
use crate::positive::Factor;
use crate::se3::Se3;
use crate::simd::VectorUnit;

/// How to estimate.
#[derive(Clone, Debug)]
pub struct EvidenceOptions {
    /// Belief that keeps the information regular.
    pub prior: WeakPrior,
    /// Information of the camera parameters around their calibrated values, `n_c x n_c`.
    pub camera_prior: DMatrix<f64>,
    /// How errors of the joints move the motions, where the arm's kinematics are known.
    pub joints: Option<JointErrors>,
    /// How alike smooth errors are between the views, where such are supposed.
    pub smooth: Option<SmoothError>,
    /// How displaced joints move the motions, where the arm's kinematics are known and its links are in doubt.
    pub links: Option<LinkErrors>,
    /// Most re-linearisations.
    pub linearisations: usize,
}

impl EvidenceOptions {
    fn offset_count(&self) -> usize {
        self.joints.as_ref().map_or(0, JointErrors::offset_count)
    }
}

/// What is believed after the views, under all hypotheses together.
#[derive(Clone, Debug)]
pub struct Posterior {
    /// `X`, averaged.
    pub x: Se3,
    /// `Y`, averaged.
    pub y: Se3,
    /// Camera parameters relative to their calibrated values, averaged.
    pub camera_delta: DVector<f64>,
    /// Offsets of the free joints, true minus read, radians or metres, averaged.
    pub joint_offsets: DVector<f64>,
    /// By how much the joints are displaced on their links, metres and radians, averaged; empty without links.
    pub link_twists: DVector<f64>,
    /// Probability of each hypothesis.
    pub weights: Vec<f64>,
    /// Information of `[xi_x, xi_y, c, joint offsets]` under each hypothesis that is worth it, else of no rows.
    pub informations: Vec<DMatrix<f64>>,
    /// Covariance of the parameters: mean of the hypotheses' and the spread between their answers.
    pub covariance: DMatrix<f64>,
    /// Degrees of freedom of the covariance of `X`, from how much the hypotheses disagree about its size.
    pub degrees_of_freedom: f64,
    /// Logarithm of the evidence of all hypotheses, up to a constant of the data.
    pub log_evidence: f64,
}

/// Converged when no parameter of the chain moves by more than this between linearisations.
const STEP_TOLERANCE: f64 = 1e-9;
/// Hypotheses less likely than this share of the best are not worth their covariance.
const NEGLIGIBLE: f64 = 1e-6;
/// Logarithm of a ratio of probabilities beyond which a hypothesis is not looked at again.
const HOPELESS: f64 = 50.0;

struct Linear {
    /// Of no rows where it is of no use.
    information: DMatrix<f64>,
    theta: DVector<f64>,
    /// By how much the joints are most likely displaced, where that is the hypothesis.
    link_twists: Option<DVector<f64>>,
}

/// Estimates `X`, `Y` and the camera from compressed views with pixel variances, averaged over the hypotheses.
///
/// # Errors
/// [`Error::InvalidInput`] for lists that do not fit, [`Error::Numerical`] if no hypothesis can be evaluated.
pub fn estimate(
    views: &[&CompressedView],
    variances_px2: &[f64],
    hypotheses: &[Hypothesis],
    start: (Se3, Se3),
    options: &EvidenceOptions,
) -> Result<Posterior, Error> {
    let n_c = options.camera_prior.nrows();
    let n_q = options.offset_count();
    if views.len() != variances_px2.len() || views.is_empty() {
        return Err(Error::invalid("views and pixel variances must be as many, at least one"));
    }
    if hypotheses.iter().all(|h| h.nature == Nature::Smooth) {
        return Err(Error::invalid("at least one hypothesis must not be smooth"));
    }
    if views.iter().any(|v| v.sensitivity.ncols() != n_c) {
        return Err(Error::invalid(format!("views compressed with other than {n_c} camera parameters")));
    }
    match &options.joints {
        Some(joints) => joints.check(views.len())?,
        None if hypotheses.iter().any(|h| h.joint_rad > 0.0) => {
            return Err(Error::invalid("noise of the joints needs the arm's Jacobians"));
        }
        None => {}
    }
    match &options.smooth {
        Some(smooth) => smooth.check(views.len())?,
        None if hypotheses.iter().any(|h| h.nature == Nature::Smooth) => {
            return Err(Error::invalid("smooth errors need to know how alike the postures are"));
        }
        None => {}
    }
    match &options.links {
        Some(links) => links.check(views.len())?,
        None if hypotheses.iter().any(|h| h.nature == Nature::Links) => {
            return Err(Error::invalid("errors of the links need the arm's Jacobians"));
        }
        None => {}
    }
    let smooth = |i: &usize| hypotheses[*i].nature == Nature::Smooth;
    let (mut x, mut y) = start;
    let mut focus: Option<Vec<usize>> = None;
    let mut worth: Vec<usize> = (0..hypotheses.len()).collect();
    let mut outcome = None;
    // Linearise under the likeliest hypotheses first; the whole grid is weighed once the chain stands.
    for round in 0..=options.linearisations {
        let last = round == options.linearisations;
        let mut chosen = if last { worth.clone() } else { focus.clone().unwrap_or_else(|| worth.clone()) };
        if !last {
            // Smooth errors say how far the answer may be off, not what it is.
            chosen.retain(|i| !smooth(i));
        }
        let prepared = prepare(views, variances_px2, &x, &y, options.joints.as_ref());
        let camera = camera_terms(views, variances_px2, &options.camera_prior);
        let evaluated = weigh(&prepared, hypotheses, &chosen, &x, options, &camera, last);
        let best = evaluated.iter().map(|e| e.2).fold(f64::NEG_INFINITY, f64::max);
        if evaluated.is_empty() || !best.is_finite() {
            return Err(Error::numerical("no noise level explains these views"));
        }
        if round == 0 && options.joints.is_some() {
            // Offsets multiply the grid; what is hopeless at the first linearisation stays so.
            worth = evaluated.iter().filter(|e| e.2 > best - HOPELESS).map(|e| e.0).collect();
            worth.extend((0..hypotheses.len()).filter(smooth));
        }
        let total: f64 = evaluated.iter().map(|e| (e.2 - best).exp()).sum();
        let mean = average(&evaluated, hypotheses, 12 + n_c + n_q);
        if last {
            outcome = Some((evaluated, mean, best, total));
            break;
        }
        let step = mean.rows(0, 12).amax();
        x = Se3::exp(&Vector6::from_column_slice(&mean.as_slice()[0..6])) * x;
        y = Se3::exp(&Vector6::from_column_slice(&mean.as_slice()[6..12])) * y;
        let mut order: Vec<(usize, f64)> = evaluated.iter().map(|e| (e.0, e.2)).collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        focus = Some(order.iter().map(|o| o.0).filter(|i| !smooth(i)).take(8).collect());
        if step < STEP_TOLERANCE && round > 0 {
            // The chain stands: go to the last round, which weighs the whole grid.
            focus = None;
        }
    }
    let (evaluated, mean, best, total) = outcome.ok_or_else(|| Error::numerical("no linearisation"))?;
    let posterior = finish(hypotheses.len(), &evaluated, &mean, best, total, x, y)?;
    Ok(Posterior {
        camera_delta: mean.rows(12, n_c).into_owned(),
        joint_offsets: mean.rows(12 + n_c, n_q).into_owned(),
        link_twists: expected_links(&evaluated, hypotheses, options.links.as_ref()),
        ..posterior
    })
}

/// Weights in the answer: all hypotheses count but those of errors that are smooth for reasons unknown.
///
/// What of a smooth error all views share cannot be told from `X` and `Y`, and the robot errs so again when it goes
/// where the views were: taking it up predicts better than leaving it out (held-out views of real arms). How far the
/// truth may be from such an answer is in the covariance, which counts all hypotheses. Where it is known how the
/// links move the arm, their errors come out as such and can be put right in every pose.
fn answering<'a>(
    evaluated: &'a [(usize, Linear, f64)],
    hypotheses: &'a [Hypothesis],
) -> impl Iterator<Item = (&'a Linear, f64)> {
    let chosen = || evaluated.iter().filter(|e| hypotheses[e.0].nature != Nature::Smooth);
    let best = chosen().map(|e| e.2).fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = chosen().map(|e| (e.2 - best).exp()).sum();
    chosen().map(move |(_, linear, log)| (linear, (log - best).exp() / total))
}

fn average(evaluated: &[(usize, Linear, f64)], hypotheses: &[Hypothesis], n: usize) -> DVector<f64> {
    answering(evaluated, hypotheses)
        .fold(DVector::zeros(n), |mean, (linear, weight)| mean + &linear.theta * weight)
}

/// By how much the joints are displaced: averaged as the answer is, nothing where the links are exact.
fn expected_links(
    evaluated: &[(usize, Linear, f64)],
    hypotheses: &[Hypothesis],
    links: Option<&LinkErrors>,
) -> DVector<f64> {
    let none = DVector::zeros(links.map_or(0, LinkErrors::coefficients));
    answering(evaluated, hypotheses).fold(none, |mean, (linear, weight)| match &linear.link_twists {
        Some(twists) => mean + twists * weight,
        None => mean,
    })
}

fn finish(
    count: usize,
    evaluated: &[(usize, Linear, f64)],
    mean: &DVector<f64>,
    best: f64,
    total: f64,
    x: Se3,
    y: Se3,
) -> Result<Posterior, Error> {
    let n = mean.len();
    let mut weights = vec![0.0; count];
    let mut informations = vec![DMatrix::zeros(0, 0); count];
    let mut covariance = DMatrix::zeros(n, n);
    let mut sizes = Vec::new();
    for (i, linear, log) in evaluated {
        let weight = (log - best).exp() / total;
        weights[*i] = weight;
        if weight < NEGLIGIBLE {
            continue;
        }
        informations[*i] = linear.information.clone();
        let Some(factor) = Factor::new(&linear.information) else { continue };
        let inverse = factor.inverse();
        let block = inverse.fixed_view::<6, 6>(0, 0).into_owned();
        sizes.push((weight, block.determinant().max(f64::MIN_POSITIVE).ln() / 6.0));
        let deviation = &linear.theta - mean;
        covariance += inverse * weight + &deviation * deviation.transpose() * weight;
    }
    let mass: f64 = sizes.iter().map(|s| s.0).sum();
    if mass <= 0.0 {
        return Err(Error::degenerate("the views do not determine the answer under any noise level"));
    }
    let average = sizes.iter().map(|s| s.0 * s.1).sum::<f64>() / mass;
    let spread = sizes.iter().map(|s| s.0 * (s.1 - average).powi(2)).sum::<f64>() / mass;
    Ok(Posterior {
        x: Se3::exp(&Vector6::from_column_slice(&mean.as_slice()[0..6])) * x,
        y: Se3::exp(&Vector6::from_column_slice(&mean.as_slice()[6..12])) * y,
        camera_delta: DVector::zeros(0),
        joint_offsets: DVector::zeros(0),
        link_twists: DVector::zeros(0),
        weights,
        informations,
        covariance,
        // A variance known with nu degrees of freedom has a logarithm with variance 2 / nu.
        degrees_of_freedom: if spread > 0.0 { 2.0 / spread } else { f64::INFINITY },
        log_evidence: best + total.ln(),
    })
}

fn prepare(
    views: &[&CompressedView],
    variances: &[f64],
    x: &Se3,
    y: &Se3,
    joints: Option<&JointErrors>,
) -> Vec<View> {
    let n_q = joints.map_or(0, JointErrors::offset_count);
    views
        .iter()
        .zip(variances)
        .enumerate()
        .map(|(k, (view, variance))| {
            let forward = *x * view.motion;
            let error = (forward * *y * view.pose.inverse()).log();
            let to_y = forward.adjoint();
            let n_c = view.sensitivity.ncols();
            let mut rows = DMatrix::zeros(6, 13 + n_c + n_q);
            rows.view_mut((0, 0), (6, 6)).fill_with_identity();
            rows.view_mut((0, 6), (6, 6)).copy_from(&to_y);
            rows.view_mut((0, 12), (6, n_c)).copy_from(&view.sensitivity);
            rows.set_column(12 + n_c + n_q, &error);
            let left = x.adjoint();
            if let Some(joints) = joints {
                rows.view_mut((0, 12 + n_c), (6, n_q)).copy_from(&(left * joints.offset_columns(k)));
            }
            let noisy_joints = joints.map(|j| left * j.unit_covariance(k) * left.transpose());
            View::new(rows, &(view.covariance * *variance), &[left, to_y], noisy_joints.as_ref())
        })
        .collect()
}

/// What the residuals of the views and the prior say of the camera alone.
fn camera_terms(
    views: &[&CompressedView],
    variances: &[f64],
    prior: &DMatrix<f64>,
) -> (DMatrix<f64>, DVector<f64>) {
    let mut information = prior.clone();
    let mut gradient = DVector::zeros(prior.nrows());
    for (view, variance) in views.iter().zip(variances) {
        information += &view.camera_information / *variance;
        gradient += &view.camera_gradient / *variance;
    }
    (information, gradient)
}

/// Each of the chosen hypotheses that has a likelihood, with the logarithm of its probability; the informations of
/// those that are not negligible only where they are `wanted`.
fn weigh(
    views: &[View],
    hypotheses: &[Hypothesis],
    chosen: &[usize],
    x: &Se3,
    options: &EvidenceOptions,
    camera: &(DMatrix<f64>, DVector<f64>),
    wanted: bool,
) -> Vec<(usize, Linear, f64)> {
    let unit = VectorUnit::widest();
    let mut equations = Equations::new(12 + camera.1.len() + options.offset_count(), chosen.len());
    let mut constants = vec![f64::NAN; chosen.len()];
    for nature in [Nature::White, Nature::Smooth] {
        // Hypotheses that differ only in the offsets stand side by side and share the sums over views.
        let mut noises: Vec<&Hypothesis> = Vec::new();
        let mut places = Vec::new();
        for (place, i) in chosen.iter().enumerate().filter(|(_, i)| hypotheses[**i].nature == nature) {
            let hypothesis = &hypotheses[*i];
            if !noises.last().is_some_and(|last| last.same_noise(hypothesis)) {
                noises.push(hypothesis);
            }
            places.push((place, noises.len() - 1));
        }
        if !noises.is_empty() {
            let smooth = options.smooth.as_ref().filter(|_| nature == Nature::Smooth);
            let sums = Sums::new(views, &noises, smooth, unit);
            sums.fill(&places, &mut equations, &mut constants);
        }
    }
    let displaced = |i: usize| options.links.as_ref().filter(|_| hypotheses[i].nature == Nature::Links);
    let links: Vec<Option<LinkSums>> = chosen
        .iter()
        .enumerate()
        .map(|(place, i)| {
            let sums = LinkSums::new(views, &hypotheses[*i], displaced(*i)?)?;
            sums.fill(place, &mut equations, &mut constants);
            Some(sums)
        })
        .collect();
    add_beliefs(hypotheses, chosen, x, options, camera, (&mut equations, &mut constants));
    equations.solve(unit);
    let mut weighed: Vec<(usize, usize, f64)> = Vec::with_capacity(chosen.len());
    for (place, i) in chosen.iter().enumerate() {
        let log = hypotheses[*i].log_prior - 0.5 * (constants[place] + equations.value(place));
        if log.is_finite() {
            weighed.push((place, *i, log));
        }
    }
    let best = weighed.iter().map(|w| w.2).fold(f64::NEG_INFINITY, f64::max);
    weighed
        .into_iter()
        .map(|(place, i, log)| {
            let theta = DVector::from_iterator(equations.size(), equations.theta(place));
            let link_twists = links[place].as_ref().map(|sums| sums.displacements(&theta));
            let useful = wanted && (log - best).exp() >= NEGLIGIBLE;
            let information = if useful { equations.information(place) } else { DMatrix::zeros(0, 0) };
            (i, Linear { information, theta, link_twists }, log)
        })
        .collect()
}

/// Adds what is believed of the chain, the camera and the offsets of the joints besides the poses.
fn add_beliefs(
    hypotheses: &[Hypothesis],
    chosen: &[usize],
    x: &Se3,
    options: &EvidenceOptions,
    camera: &(DMatrix<f64>, DVector<f64>),
    (equations, constants): (&mut Equations, &mut [f64]),
) {
    let (weak, pull) = options.prior.normal(x);
    let (n_c, count) = (camera.1.len(), chosen.len());
    for i in 0..12 {
        for j in i..12 {
            equations.information_row(i, j)[..count].iter_mut().for_each(|entry| *entry += weak[(i, j)]);
        }
        equations.right_row(i)[..count].iter_mut().for_each(|entry| *entry += pull[i]);
    }
    for i in 0..n_c {
        for j in i..n_c {
            let row = equations.information_row(12 + i, 12 + j);
            row[..count].iter_mut().for_each(|entry| *entry += camera.0[(i, j)]);
        }
        equations.right_row(12 + i)[..count].iter_mut().for_each(|entry| *entry += camera.1[i]);
    }
    let Some(joints) = &options.joints else { return };
    for (i, joint) in joints.free.iter().enumerate() {
        let row = equations.information_row(12 + n_c + i, 12 + n_c + i);
        for ((entry, constant), hypothesis) in row.iter_mut().zip(constants.iter_mut()).zip(chosen) {
            let sigma = hypotheses[*hypothesis].offset_rad * joints.scales[*joint];
            *entry += sigma.powi(-2);
            // The prior's normalisation depends on the level.
            *constant += 2.0 * sigma.ln();
        }
    }
}
