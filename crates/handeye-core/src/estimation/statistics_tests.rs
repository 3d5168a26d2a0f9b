//! Rules of statistics, each against what it stands for: an integral, a density, a simulation.

use nalgebra::{DMatrix, DVector, Matrix6};

use super::agreement::Agreement;
use super::components;
use super::degrees_of_freedom::degrees_of_freedom;
use super::linearisation::Guess;
use super::mixed::{Mixed, Prior, Wanted};
use super::posterior::assemble;
use super::recurring::FUNCTIONS;
use super::tests::{Truth, made, mixed_of, options};
use super::*;
use crate::se3::Se3;

/// One camera on the arm and one board beside it.
fn one_camera(seed: u64, stations: usize, flange: f64) -> Truth {
    made(seed, (&[Body::Flange], &[Body::Base]), stations, flange, false)
}

#[test]
fn an_inflated_prior_is_a_wider_density() {
    let m = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 3.0]);
    let mean = DVector::from_row_slice(&[0.5, -1.0]);
    let theta = DVector::from_row_slice(&[7.0, 0.3, -0.2, 5.0]);
    for inflation in [1.0, 2.5_f64] {
        let prior = Prior {
            of: "camera",
            levels: vec![0],
            first: 1,
            count: 2,
            information: Some(m.clone()),
            mean: Some(mean.clone()),
            recurring: false,
            functions: vec![],
            squares: vec![],
        };
        let (mut information, mut right) = (DMatrix::zeros(4, 4), DVector::zeros(4));
        let constant = Mixed::add_prior(&prior, inflation, &mut information, &mut right);
        let found = theta.dot(&(&information * &theta)) - 2.0 * right.dot(&theta) + constant;
        let away = theta.rows(1, 2) - &mean;
        let expected = away.dot(&(&m * &away)) / inflation.powi(2) + 4.0 * inflation.ln();
        assert!((found - expected).abs() < 1e-12, "{inflation}: {found} {expected}");
    }
}

#[test]
fn the_weak_prior_draws_to_its_mean() {
    let weak = WeakPrior { x_translation_m: [0.1, 0.2, -0.3].into(), ..WeakPrior::default() };
    let at = |place: [f64; 3]| Se3::new(nalgebra::Matrix3::identity(), place.into());
    assert!(weak.of_x(&at([0.1, 0.2, -0.3])).1.norm() < 1e-15);
    let (information, right) = weak.of_x(&at([0.1, 0.2, 0.7]));
    let step = information.cholesky().unwrap().solve(&right);
    assert!((step[2] + 1.0).abs() < 1e-9 && step.norm() < 1.5, "{step}");
}

#[test]
fn nodes_and_their_shares_are_an_integral_over_the_levels() {
    let mut truth = one_camera(5, 6, 0.0);
    // A stated camera that is four deviations off: how much wider than stated is all that is not known.
    let prior = CameraPrior {
        information: DMatrix::identity(1, 1) * 100.0,
        mean: DVector::from_element(1, 0.4),
        inflated: true,
    };
    truth.cell.cameras[0].prior = Some(prior);
    let mut asked = Options { pairs: 64, ..options(false) };
    asked.assumptions.exact_robot = true;
    let posterior = estimate(&truth.cell, (truth.x.clone(), truth.y.clone()), &asked).unwrap();
    assert_eq!(posterior.level_names, ["camera_inflation"]);
    let moments = |shares: &mut dyn Iterator<Item = (f64, f64)>| {
        let all: Vec<_> = shares.collect();
        let total: f64 = all.iter().map(|(share, _)| share).sum();
        let mean = all.iter().map(|(share, t)| share * t).sum::<f64>() / total;
        (mean, all.iter().map(|(share, t)| share * (t - mean).powi(2)).sum::<f64>() / total)
    };
    let (mean, variance) = moments(&mut posterior.nodes.iter().map(|n| (n.weight, n.levels[0].ln())));
    let all = components::all(&truth.cell, &asked.assumptions).unwrap();
    let guess = Guess { x: posterior.x.clone(), y: posterior.y.clone(), away: vec![] };
    let mixed = assemble(&truth.cell, &guess, &all, &asked.weak);
    let (wanted_mean, wanted) = moments(&mut (0..600).map(|i| {
        let t = -3.0 + 0.01 * f64::from(i);
        let value = mixed.evaluate(&DVector::from_element(1, t), Wanted::Value).unwrap().value;
        ((posterior.value - value).exp(), t)
    }));
    assert!((mean - wanted_mean).abs() < 0.1 * wanted.sqrt(), "{mean} {wanted_mean} {wanted}");
    assert!((variance / wanted - 1.0).abs() < 0.15, "{variance} {wanted}");
    // What nodes answer differently is not known either.
    let theta: f64 = posterior.nodes.iter().map(|n| n.weight * n.theta[12]).sum();
    let between: f64 = posterior.nodes.iter().map(|n| n.weight * (n.theta[12] - theta).powi(2)).sum();
    let within: f64 = posterior.nodes.iter().map(|n| n.weight * n.covariance[(12, 12)]).sum();
    assert!(between > 1e-3 * within, "{between} {within}");
    assert!((posterior.covariance[(12, 12)] / (between + within) - 1.0).abs() < 1e-9);
}

#[test]
fn degrees_of_freedom_follow_from_how_much_nodes_differ() {
    let of = |spread: f64| {
        let nodes = [spread, -spread].map(|t| (0.5, DMatrix::identity(6, 6) * t.exp()));
        degrees_of_freedom(nodes.iter().map(|(w, c)| (*w, c)), |all| Matrix6::from_fn(|i, j| all[(i, j)]))
    };
    // A variance of nu degrees of freedom spreads by 2 / nu in its logarithm.
    assert!((of(0.5) - 8.0).abs() < 1e-9);
    assert!((of(0.2) - 50.0).abs() < 1e-9);
    assert!((of(3.0) - 4.5).abs() < 1e-12);
    assert!(of(0.0) > 1e6);
}

/// Probabilities of twists as unusual as those of one station, by others, in many cells.
fn p_values(stations: usize, members: usize, of_member: bool) -> Vec<f64> {
    (0..60)
        .map(|seed| {
            let truth = one_camera(100 + seed, stations, 1e-3);
            let agreement = Agreement::new(&truth.cell, (truth.x.clone(), truth.y.clone())).unwrap();
            let all: Vec<usize> = (0..members).collect();
            let fit = agreement.fit(&all, None, 16).unwrap();
            fit.predictions[if of_member { 0 } else { stations - 1 }].p_value
        })
        .collect()
}

#[test]
fn good_stations_are_as_unusual_as_chance_has_it() {
    for (members, of_member) in [(4, false), (8, false), (4, true), (8, true)] {
        let found = p_values(9, members, of_member);
        let mean = found.iter().sum::<f64>() / found.len() as f64;
        // Of four stations levels are hardly known.
        assert!((0.3..0.65).contains(&mean), "{members} {of_member}: {mean}");
    }
}

#[test]
fn a_station_that_took_part_is_expected_as_by_the_others_alone() {
    let (mut off, mut chain) = (vec![], vec![]);
    for seed in 0..30 {
        let truth = one_camera(300 + seed, 7, 1e-3);
        let agreement = Agreement::new(&truth.cell, (truth.x.clone(), truth.y.clone())).unwrap();
        let all: Vec<usize> = (0..7).collect();
        let inside = agreement.fit(&all, None, 32).unwrap();
        let outside = agreement.fit(&all[1..], None, 32).unwrap();
        let (by_all, by_others) = (&inside.predictions[0], &outside.predictions[0]);
        off.push(by_all.log_density - by_others.log_density);
        // The chain rule of densities.
        chain.push(outside.log_evidence + by_others.log_density - inside.log_evidence);
    }
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    assert!(median(off).abs() < 0.06);
    assert!(median(chain).abs() < 0.06);
}

/// Sum of a matrix per station, each in its own rows of all; of `same` all products of two stations too.
fn in_all(parts: &[DMatrix<f64>], same: bool) -> DMatrix<f64> {
    let mut all =
        DMatrix::zeros(parts.iter().map(DMatrix::nrows).sum(), parts.iter().map(DMatrix::nrows).sum());
    let mut first = 0;
    for part in parts {
        let mut next = if same { 0 } else { first };
        for other in if same { parts } else { std::slice::from_ref(part) } {
            let product = part * other.transpose();
            all.view_mut((first, next), product.shape()).copy_from(&product);
            next += other.nrows();
        }
        first += part.nrows();
    }
    all
}

#[test]
fn what_recurs_is_as_its_covariance_written_out() {
    let truth = one_camera(9, 9, 1e-3);
    let mixed = mixed_of(&truth, false);
    // Large enough to matter beside the pixels.
    let t = mixed.start().map(|t| t + 2.0 + 0.3 * t.sin());
    let deviation = |levels: &[usize]| levels.iter().map(|l| t[*l]).sum::<f64>().exp();
    let roots: Vec<_> = mixed.stations.iter().map(|s| s.pixels.clone().cholesky().unwrap().l()).collect();
    // Of the stations alone, as it is, and as if all were new at every station.
    let mut alone = in_all(&roots, false);
    for x in &mixed.noises {
        alone += in_all(&x.roots, false) * deviation(&x.levels).powi(2);
    }
    let (mut truly, mut working) = (alone.clone(), alone);
    for p in mixed.priors.iter().filter(|p| p.recurring) {
        let columns: Vec<_> = mixed.stations.iter().map(|s| s.columns(p, mixed.width)).collect();
        for i in 0..FUNCTIONS {
            let of = columns.iter().zip(&p.functions).map(|(m, f)| m * f[i]).collect::<Vec<_>>();
            truly += in_all(&of, true) * deviation(&p.levels).powi(2);
            working += in_all(&of, false) * deviation(&p.levels).powi(2);
        }
    }
    let (told, width) = (mixed.told, mixed.width);
    let rows = mixed.stations.iter().flat_map(|s| s.rows.chunks_exact(width)).map(|row| &row[mixed.lead..]);
    let rows: Vec<&[f64]> = rows.collect();
    let b = DMatrix::from_fn(rows.len(), told, |i, j| rows[i][j]);
    let e = DVector::from_fn(rows.len(), |i, _| rows[i][told]);
    let fit = |covariance: &DMatrix<f64>| {
        let inverse = covariance.clone().try_inverse().unwrap();
        let information = &mixed.given + b.transpose() * &inverse * &b;
        let right = &mixed.given_right - b.transpose() * &inverse * &e;
        (inverse, information, right)
    };
    let logarithm = |m: &DMatrix<f64>| 2.0 * m.clone().cholesky().unwrap().l().diagonal().map(f64::ln).sum();
    let (inverse, information, right) = fit(&truly);
    let theta = information.clone().try_inverse().unwrap() * &right;
    let penalty: f64 = mixed.levels.iter().zip(t.iter()).map(|(l, t)| l.penalty(*t).0).sum();
    let twice = logarithm(&truly) + e.dot(&(inverse * &e)) + logarithm(&information) - right.dot(&theta);
    let found = mixed.evaluate(&t, Wanted::Slope).unwrap();
    assert!((found.value - 0.5 * twice - penalty).abs() < 1e-7 * twice.abs(), "{} {twice}", found.value);
    assert!((&found.theta - &theta).amax() < 1e-7 * theta.amax());
    // The answer as if all were new, its covariance as all is.
    let (weight, information, right) = fit(&working);
    let bread = information.clone().try_inverse().unwrap();
    let meat = &mixed.given + b.transpose() * &weight * truly * weight * &b;
    let covariance = &bread * meat * &bread;
    let found = mixed.evaluate(&t, Wanted::Answer).unwrap();
    assert!((&found.theta - &bread * right).amax() < 1e-7 * found.theta.amax());
    let close = |a: &DMatrix<f64>, b: &DMatrix<f64>| {
        let unit = b.diagonal().map(f64::sqrt);
        (a - b).component_div(&(&unit * unit.transpose())).amax() < 1e-6
    };
    assert!(close(&found.covariance, &covariance));
    assert!(close(&found.information, &information));
}
