//! Every hypothesis weighed by its restricted likelihood, and the answer averaged over them.
//!
//! With the chain linearised, the twist `e_k` between chain and pose of view k is Gaussian: mean
//! `-[I, Ad(X A_k), D_k] theta`, covariance `sigma_k^2 M_k^-1 + S_k`. Integrating `theta` out (flat but for the
//! priors) leaves the restricted likelihood of the levels,
//! `-2 ln p = sum ln |Sigma_k| + e' Sigma^-1 e - theta' r + ln |Lambda|` (Patterson and Thompson 1971).

use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

use super::chain::WeakPrior;
use super::compressed::CompressedView;
use super::hypotheses::Hypothesis;
use crate::error::Error;
use crate::least_squares::Side;
use crate::se3::Se3;

/// How to estimate.
#[derive(Clone, Debug)]
pub struct EvidenceOptions {
    /// Belief that keeps the information regular.
    pub prior: WeakPrior,
    /// Information of the camera parameters around their calibrated values, `n_c x n_c`.
    pub camera_prior: DMatrix<f64>,
    /// Most re-linearisations.
    pub linearisations: usize,
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
    /// Probability of each hypothesis.
    pub weights: Vec<f64>,
    /// Information of `[xi_x, xi_y, c]` under each hypothesis.
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

struct Linear {
    information: DMatrix<f64>,
    theta: DVector<f64>,
    minus_two_log_likelihood: f64,
}

/// Views linearised at `X` and `Y`, whitening left open.
struct View {
    /// `[I, Ad(X A), D, e]`.
    rows: DMatrix<f64>,
    pixel_covariance: Matrix6<f64>,
    left: Matrix6<f64>,
    right: Matrix6<f64>,
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
    if views.len() != variances_px2.len() || views.is_empty() || hypotheses.is_empty() {
        return Err(Error::invalid("views and pixel variances must be as many, and hypotheses at least one"));
    }
    if views.iter().any(|v| v.sensitivity.ncols() != n_c) {
        return Err(Error::invalid(format!("views compressed with other than {n_c} camera parameters")));
    }
    let (mut x, mut y) = start;
    let mut focus: Option<Vec<usize>> = None;
    let mut outcome = None;
    // Linearise under the likeliest hypotheses first; the whole grid is weighed once the chain stands.
    for round in 0..=options.linearisations {
        let last = round == options.linearisations;
        let all: Vec<usize> = (0..hypotheses.len()).collect();
        let chosen = if last { all } else { focus.clone().unwrap_or(all) };
        let prepared = prepare(views, variances_px2, &x, &y);
        let camera = camera_terms(views, variances_px2, &options.camera_prior);
        let evaluated: Vec<(usize, Linear, f64)> = chosen
            .iter()
            .filter_map(|i| {
                let linear = linearise(&prepared, &hypotheses[*i], &x, options, &camera)?;
                let log = hypotheses[*i].log_prior - 0.5 * linear.minus_two_log_likelihood;
                log.is_finite().then_some((*i, linear, log))
            })
            .collect();
        let best = evaluated.iter().map(|e| e.2).fold(f64::NEG_INFINITY, f64::max);
        if evaluated.is_empty() || !best.is_finite() {
            return Err(Error::numerical("no noise level explains these views"));
        }
        let total: f64 = evaluated.iter().map(|e| (e.2 - best).exp()).sum();
        let mut mean = DVector::zeros(12 + n_c);
        for (_, linear, log) in &evaluated {
            mean += &linear.theta * ((log - best).exp() / total);
        }
        if last {
            outcome = Some((evaluated, mean, best, total));
            break;
        }
        let step = mean.rows(0, 12).amax();
        x = Se3::exp(&Vector6::from_column_slice(&mean.as_slice()[0..6])) * x;
        y = Se3::exp(&Vector6::from_column_slice(&mean.as_slice()[6..12])) * y;
        let mut order: Vec<(usize, f64)> = evaluated.iter().map(|e| (e.0, e.2)).collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        focus = Some(order.iter().take(8).map(|o| o.0).collect());
        if step < STEP_TOLERANCE && round > 0 {
            // The chain stands: go to the last round, which weighs the whole grid.
            focus = None;
        }
    }
    let (evaluated, mean, best, total) = outcome.ok_or_else(|| Error::numerical("no linearisation"))?;
    finish(hypotheses.len(), &evaluated, &mean, best, total, x, y)
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
        informations[*i] = linear.information.clone();
        if weight < NEGLIGIBLE {
            continue;
        }
        let Some(factor) = linear.information.clone().cholesky() else { continue };
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
        camera_delta: mean.rows(12, n - 12).into_owned(),
        weights,
        informations,
        covariance,
        // A variance known with nu degrees of freedom has a logarithm with variance 2 / nu.
        degrees_of_freedom: if spread > 0.0 { 2.0 / spread } else { f64::INFINITY },
        log_evidence: best + total.ln(),
    })
}

fn prepare(views: &[&CompressedView], variances: &[f64], x: &Se3, y: &Se3) -> Vec<View> {
    views
        .iter()
        .zip(variances)
        .map(|(view, variance)| {
            let forward = *x * view.motion;
            let error = (forward * *y * view.pose.inverse()).log();
            let to_y = forward.adjoint();
            let n_c = view.sensitivity.ncols();
            let mut rows = DMatrix::zeros(6, 13 + n_c);
            rows.view_mut((0, 0), (6, 6)).fill_with_identity();
            rows.view_mut((0, 6), (6, 6)).copy_from(&to_y);
            rows.view_mut((0, 12), (6, n_c)).copy_from(&view.sensitivity);
            rows.set_column(12 + n_c, &error);
            View { rows, pixel_covariance: view.covariance * *variance, left: x.adjoint(), right: to_y }
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

/// Covariance of the robot's error of a hypothesis in the camera frame.
fn robot_covariance(view: &View, hypothesis: &Hypothesis) -> Option<Matrix6<f64>> {
    let map = match hypothesis.side? {
        Side::Left => &view.left,
        Side::Right => &view.right,
    };
    let mut root = *map;
    for column in 0..6 {
        let sigma = if column < 3 { hypothesis.translation_m } else { hypothesis.rotation_rad };
        root.column_mut(column).scale_mut(sigma);
    }
    Some(root * root.transpose())
}

fn linearise(
    views: &[View],
    hypothesis: &Hypothesis,
    x: &Se3,
    options: &EvidenceOptions,
    camera: &(DMatrix<f64>, DVector<f64>),
) -> Option<Linear> {
    let n = 12 + camera.1.len();
    let mut sums = DMatrix::zeros(n + 1, n + 1);
    let mut log_determinant = 0.0;
    let mut whitened = DMatrix::zeros(6, n + 1);
    for view in views {
        let mut covariance = view.pixel_covariance;
        if let Some(robot) = robot_covariance(view, hypothesis) {
            covariance += robot;
        }
        let factor = covariance.cholesky()?;
        let lower = factor.l_dirty();
        log_determinant += 2.0 * (0..6).map(|i| lower[(i, i)].ln()).sum::<f64>();
        whitened.copy_from(&view.rows);
        for column in 0..=n {
            for i in 0..6 {
                let mut value = whitened[(i, column)];
                for j in 0..i {
                    value -= lower[(i, j)] * whitened[(j, column)];
                }
                whitened[(i, column)] = value / lower[(i, i)];
            }
        }
        sums.gemm_tr(1.0, &whitened, &whitened, 1.0);
    }
    let mut information = sums.view((0, 0), (n, n)).into_owned();
    let mut right = -sums.view((0, n), (n, 1)).into_owned().column(0).into_owned();
    let (weak, pull) = options.prior.normal(x);
    let mut block = information.view_mut((0, 0), (12, 12));
    block += &weak;
    let mut rows = right.rows_mut(0, 12);
    rows += &pull;
    let mut block = information.view_mut((12, 12), (n - 12, n - 12));
    block += &camera.0;
    let mut rows = right.rows_mut(12, n - 12);
    rows += &camera.1;
    let (theta, information_log_determinant) = solve_scaled(&information, &right)?;
    let minus_two_log_likelihood =
        log_determinant + sums[(n, n)] - theta.dot(&right) + information_log_determinant;
    Some(Linear { information, theta, minus_two_log_likelihood })
}

/// Solution and log-determinant of a positive definite system whose units differ by orders of magnitude.
fn solve_scaled(m: &DMatrix<f64>, right: &DVector<f64>) -> Option<(DVector<f64>, f64)> {
    let n = m.nrows();
    let scale: Vec<f64> = (0..n).map(|i| m[(i, i)].sqrt().recip()).collect();
    let factor = DMatrix::from_fn(n, n, |i, j| m[(i, j)] * scale[i] * scale[j]).cholesky()?;
    let mut theta = DVector::from_fn(n, |i, _| right[i] * scale[i]);
    factor.solve_mut(&mut theta);
    for i in 0..n {
        theta[i] *= scale[i];
    }
    let log = (0..n).map(|i| factor.l_dirty()[(i, i)].ln() - scale[i].ln()).sum::<f64>() * 2.0;
    Some((theta, log))
}
