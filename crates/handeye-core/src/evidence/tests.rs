//! Levels found, sides told apart, and regions that hold the truth.

use nalgebra::{DMatrix, Vector6};

use super::*;
use crate::least_squares::tests::Cell;
use crate::least_squares::{RobotNoise, Side};
use crate::planar_pose::planar_pose;
use crate::se3::Se3;
use crate::testing::Random;

fn compressed(cell: &Cell, reported: &[Se3], sigma_px: f64, seed: u64) -> Vec<CompressedView> {
    let problem = cell.problem_with(reported, sigma_px, seed);
    (0..problem.view_count())
        .map(|k| {
            let range = problem.samples(k);
            let pose =
                planar_pose(&cell.camera, &problem.features()[range.clone()], &problem.pixels()[range])
                    .unwrap();
            compress(&problem, k, &cell.camera, &pose.best.t_camera_target, None).unwrap()
        })
        .collect()
}

fn run(views: &[CompressedView]) -> Posterior {
    let views: Vec<&CompressedView> = views.iter().collect();
    let variances = shrunk_variances(&views, 20.0, 1e-12);
    let motions: Vec<Se3> = views.iter().map(|v| v.motion).collect();
    let poses: Vec<Se3> = views.iter().map(|v| v.pose).collect();
    let covariances: Vec<_> = views
        .iter()
        .zip(&variances)
        .map(|(v, s)| v.covariance * *s + nalgebra::Matrix6::identity() * 1e-7)
        .collect();
    let start = start_from_poses(&motions, &poses, &covariances, &WeakPrior::default(), None).unwrap();
    let options = EvidenceOptions {
        prior: WeakPrior::default(),
        camera_prior: DMatrix::zeros(0, 0),
        linearisations: 4,
    };
    estimate(&views, &variances, &LevelPrior::default().grid(), (start.x, start.y), &options).unwrap()
}

fn noisy(cell: &Cell, noise: Option<&RobotNoise>, seed: u64) -> Vec<Se3> {
    let mut random = Random::new(seed);
    cell.motions
        .iter()
        .map(|a| {
            let Some(noise) = noise else { return *a };
            let white = Vector6::from_fn(|_, _| random.normal());
            let error = Se3::exp(&(noise.square_root(0) * white));
            if noise.side == Side::Left { error * *a } else { *a * error }
        })
        .collect()
}

#[test]
fn the_start_is_found_from_any_three_views() {
    for seed in 0..20 {
        let cell = Cell::new(seed, 3);
        let views = compressed(&cell, &cell.motions, 0.0, seed);
        let posterior = run(&views);
        let error = (posterior.x * cell.x.inverse()).log();
        assert!(error.amax() < 1e-3, "seed {seed}: {error}");
    }
}

#[test]
fn sides_and_levels_are_told_apart() {
    let hypotheses = LevelPrior::default().grid();
    for (truth, seed) in [(None, 1), (Some(Side::Left), 2), (Some(Side::Right), 3)] {
        let cell = Cell::new(seed, 20);
        let noise = truth.map(|side| RobotNoise::isotropic(side, 1e-3, 2e-3));
        let views = compressed(&cell, &noisy(&cell, noise.as_ref(), seed), 0.1, seed);
        let posterior = run(&views);
        let probability: f64 =
            hypotheses.iter().zip(&posterior.weights).filter(|(h, _)| h.side == truth).map(|(_, w)| w).sum();
        assert!(probability > 0.9, "{truth:?}: {probability}");
        if truth.is_some() {
            let level: f64 = hypotheses
                .iter()
                .zip(&posterior.weights)
                .filter(|(_, w)| **w > 0.0)
                .map(|(h, w)| h.rotation_rad.max(1e-12).ln() * w)
                .sum::<f64>()
                .exp();
            assert!((1.2e-3..3e-3).contains(&level), "{truth:?}: {level}");
        }
    }
}

#[test]
fn regions_hold_the_truth() {
    for noise in [
        None,
        Some(RobotNoise::isotropic(Side::Left, 1e-3, 5e-4)),
        Some(RobotNoise::isotropic(Side::Right, 1e-3, 5e-4)),
    ] {
        let trials = 200;
        let mut nees = 0.0;
        for seed in 0..trials {
            let cell = Cell::new(1000 + seed, 10);
            let views = compressed(&cell, &noisy(&cell, noise.as_ref(), seed), 0.1, seed);
            let posterior = run(&views);
            let error = (posterior.x * cell.x.inverse()).log();
            let block = posterior.covariance.fixed_view::<6, 6>(0, 0).into_owned();
            nees += error.dot(&block.cholesky().unwrap().solve(&error)) / (6 * trials) as f64;
        }
        assert!((0.8..1.2).contains(&nees), "{:?}: {nees}", noise.map(|n| n.side));
    }
}
