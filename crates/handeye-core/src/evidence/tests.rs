//! Levels found, sides told apart, and regions that hold the truth.

use nalgebra::{DMatrix, Vector6};

use super::*;
use crate::least_squares::Side;
use crate::least_squares::tests::Cell;
use crate::planar_pose::planar_pose;
use crate::se3::Se3;
use crate::testing::Random;

/// Error of the robot's poses with the same deviations on every axis.
struct RobotNoise {
    side: Side,
    translation_m: f64,
    rotation_rad: f64,
}

impl RobotNoise {
    fn isotropic(side: Side, translation_m: f64, rotation_rad: f64) -> Self {
        Self { side, translation_m, rotation_rad }
    }
}

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
    run_with(views, None, &LevelPrior::default().grid())
}

fn run_with(views: &[CompressedView], joints: Option<JointErrors>, hypotheses: &[Hypothesis]) -> Posterior {
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
        joints,
        smooth: None,
        links: None,
        linearisations: 4,
    };
    estimate(&views, &variances, hypotheses, (start.x, start.y), &options).unwrap()
}

fn noisy(cell: &Cell, noise: Option<&RobotNoise>, seed: u64) -> Vec<Se3> {
    let mut random = Random::new(seed);
    cell.motions
        .iter()
        .map(|a| {
            let Some(noise) = noise else { return *a };
            let sigma = |i| if i < 3 { noise.translation_m } else { noise.rotation_rad };
            let error = Se3::exp(&Vector6::from_fn(|i, _| sigma(i) * random.normal()));
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

/// An arm made up: any Jacobians will do, as long as they differ from view to view.
fn arm(seed: u64, views: usize) -> JointErrors {
    let mut random = Random::new(seed);
    JointErrors {
        jacobians: (0..views).map(|_| DMatrix::from_fn(6, 5, |_, _| random.uniform(-0.7, 0.7))).collect(),
        scales: vec![1.0, 1.0, 0.5, 1.0, 1.0],
        free: vec![1, 2, 3],
    }
}

/// What the arm reports where joints are off by `noise` per view and by `offsets` (of the free joints) in all.
fn misread(cell: &Cell, arm: &JointErrors, noise: f64, offsets: &[f64], seed: u64) -> Vec<Se3> {
    let mut random = Random::new(seed);
    let motions = cell.motions.iter().zip(&arm.jacobians);
    motions
        .map(|(a, d)| {
            let mut dq = nalgebra::DVector::from_fn(5, |i, _| random.normal() * noise * arm.scales[i]);
            for (joint, offset) in arm.free.iter().zip(offsets) {
                dq[*joint] += offset;
            }
            // The motion is exp(D dq) A where A is reported.
            Se3::exp(&Vector6::from_column_slice((d * dq).as_slice())).inverse() * *a
        })
        .collect()
}

fn joint_grid() -> Vec<Hypothesis> {
    let prior = JointPrior::default();
    let noise = LevelPrior::default().grid_with(&[Side::Left, Side::Right], Some(&prior.noise), None);
    prior.with_offsets(&noise)
}

#[test]
fn noise_and_offsets_of_joints_are_found_and_regions_hold_the_truth() {
    let hypotheses = joint_grid();
    for (noise, offset) in [(4e-4, 0.0), (0.0, 1e-3), (3e-4, 1e-3)] {
        let trials = 40;
        let (mut nees, mut of_joints, mut gain) = (0.0, 0.0, 0.0);
        for seed in 0..trials {
            let cell = Cell::new(2000 + seed, 9);
            let arm = arm(seed, 9);
            let mut random = Random::new(seed + 77);
            let offsets: Vec<f64> =
                arm.free.iter().map(|j| random.normal() * offset * arm.scales[*j]).collect();
            let views = compressed(&cell, &misread(&cell, &arm, noise, &offsets, seed), 0.1, seed);
            let posterior = run_with(&views, Some(arm.clone()), &hypotheses);
            let error = (posterior.x * cell.x.inverse()).log();
            let block = posterior.covariance.fixed_view::<6, 6>(0, 0).into_owned();
            nees += error.dot(&block.cholesky().unwrap().solve(&error)) / (6 * trials) as f64;
            let weights = hypotheses.iter().zip(&posterior.weights);
            of_joints += weights.filter(|(h, _)| h.joint_rad > 0.0).map(|(_, w)| w).sum::<f64>();
            let blind = run(&views);
            let without = (blind.x * cell.x.inverse()).log();
            gain += (without.norm() / error.norm()).ln() / trials as f64;
            if noise == 0.0 {
                for (found, truth) in posterior.joint_offsets.iter().zip(&offsets) {
                    assert!((found - truth).abs() < 2e-4, "{found} {truth}");
                }
            }
        }
        of_joints /= trials as f64;
        assert!((0.75..1.25).contains(&nees), "{noise} {offset}: {nees}");
        assert_eq!(of_joints > 0.9, noise > 0.0, "{noise} {offset}: {of_joints}");
        // Twists of the right size say nearly as much as joints; offsets that are known are worth far more.
        assert!(gain.exp() > if noise == 0.0 { 4.0 } else { 0.95 }, "{noise} {offset}: {}", gain.exp());
    }
}

#[test]
fn joint_errors_that_do_not_fit_are_refused() {
    let cell = Cell::new(1, 4);
    let views = compressed(&cell, &cell.motions, 0.1, 1);
    let views: Vec<&CompressedView> = views.iter().collect();
    let try_with = |joints: Option<JointErrors>| {
        let camera_prior = DMatrix::zeros(0, 0);
        let options = EvidenceOptions {
            prior: WeakPrior::default(),
            camera_prior,
            joints,
            smooth: None,
            links: None,
            linearisations: 2,
        };
        estimate(&views, &[0.01; 4], &joint_grid(), (cell.x, cell.y), &options)
    };
    assert!(try_with(Some(arm(1, 4))).is_ok());
    assert!(try_with(None).unwrap_err().to_string().contains("Jacobians"));
    assert!(try_with(Some(arm(1, 3))).is_err());
    assert!(try_with(Some(JointErrors { free: vec![5], ..arm(1, 4) })).is_err());
    assert!(try_with(Some(JointErrors { scales: vec![0.0; 5], ..arm(1, 4) })).is_err());
}

/// Half of the views in one posture, half in another: what a smooth error makes of them.
#[test]
fn smooth_errors_are_told_from_white_ones_and_widen_the_region() {
    let prior = LevelPrior { smooth_odds: SMOOTH_ODDS, ..LevelPrior::default() };
    let hypotheses = prior.grid_of(&[Side::Left, Side::Right]);
    let total: f64 = hypotheses.iter().map(|h| h.log_prior.exp()).sum();
    assert!((total - 1.0).abs() < 1e-12);
    // Four postures, each taken five times.
    let group = |k: usize| k / 5;
    let likeness = DMatrix::from_fn(20, 20, |i, j| {
        if i == j { 1.0 } else { (-0.5 * (group(i) as f64 - group(j) as f64).powi(2)).exp() }
    });
    let smooth = SmoothError::new(&likeness).unwrap();
    let probability = |shared: bool, seed: u64| {
        let cell = Cell::new(seed, 20);
        let mut random = Random::new(seed);
        let twists: Vec<Vector6<f64>> =
            (0..20).map(|_| Vector6::from_fn(|_, _| 2e-3 * random.normal())).collect();
        let reported: Vec<Se3> = cell
            .motions
            .iter()
            .enumerate()
            .map(|(k, a)| Se3::exp(&twists[if shared { group(k) } else { k }]) * *a)
            .collect();
        let views = compressed(&cell, &reported, 0.1, seed);
        let white = run(&views);
        let views: Vec<&CompressedView> = views.iter().collect();
        let variances = shrunk_variances(&views, 20.0, 1e-12);
        let options = EvidenceOptions {
            prior: WeakPrior::default(),
            camera_prior: DMatrix::zeros(0, 0),
            joints: None,
            smooth: Some(smooth.clone()),
            links: None,
            linearisations: 4,
        };
        let posterior = estimate(&views, &variances, &hypotheses, (white.x, white.y), &options).unwrap();
        let moved = (posterior.x * white.x.inverse()).log().amax();
        assert!(moved < 1e-6, "the answer stays that of white errors: {moved}");
        let wider = posterior.covariance.fixed_view::<6, 6>(0, 0).trace()
            / white.covariance.fixed_view::<6, 6>(0, 0).trace();
        let weights = hypotheses.iter().zip(&posterior.weights);
        (weights.filter(|(h, _)| h.nature == Nature::Smooth).map(|(_, w)| w).sum::<f64>(), wider)
    };
    for seed in 0..5 {
        let (smooth, wider) = probability(true, seed);
        assert!(smooth > 0.9 && wider > 1.5, "{smooth} {wider}");
        let (smooth, wider) = probability(false, seed);
        assert!(smooth < 0.1 && wider < 1.3, "{smooth} {wider}");
    }
}

#[test]
fn likenesses_that_are_none_are_refused() {
    assert!(SmoothError::new(&DMatrix::from_element(2, 2, 1.0)).is_ok());
    assert!(SmoothError::new(&DMatrix::from_row_slice(2, 2, &[1.0, 0.5, 0.4, 1.0])).is_err());
    assert!(SmoothError::new(&DMatrix::from_row_slice(2, 2, &[2.0, 0.0, 0.0, 1.0])).is_err());
    assert!(SmoothError::new(&DMatrix::from_row_slice(2, 2, &[1.0, 1.5, 1.5, 1.0])).is_err());
    assert!(SmoothError::new(&DMatrix::from_element(2, 3, 1.0)).is_err());
}

/// An arm whose joints are displaced: the hypothesis wins, the answer is better, and so is what is said of the links.
#[test]
fn displaced_joints_are_told_from_other_errors_and_predicted() {
    let (views, ways) = (12, 10);
    let grid =
        LevelPrior::default().grid_with(&[Side::Left, Side::Right], None, Some(&LevelPrior::of_links()));
    let (mut of_links, mut better, mut explained) = (0.0, 0.0, 0.0);
    let trials = 12;
    for seed in 0..trials {
        let cell = Cell::new(3000 + seed, views);
        let mut random = Random::new(seed);
        let links = LinkErrors {
            jacobians: (0..views)
                .map(|_| DMatrix::from_fn(6, ways, |_, _| random.uniform(-0.7, 0.7)))
                .collect(),
            lengths: (0..ways).map(|i| i % 2 == 0).collect(),
        };
        let truth: Vec<f64> =
            links.lengths.iter().map(|long| random.normal() * if *long { 5e-4 } else { 1e-3 }).collect();
        let twist = nalgebra::DVector::from_column_slice(&truth);
        let reported: Vec<Se3> = cell
            .motions
            .iter()
            .zip(&links.jacobians)
            .map(|(a, l)| Se3::exp(&Vector6::from_column_slice((l * &twist).as_slice())).inverse() * *a)
            .collect();
        let seen = compressed(&cell, &reported, 0.1, seed);
        let chosen: Vec<&CompressedView> = seen.iter().collect();
        let variances = shrunk_variances(&chosen, 20.0, 1e-12);
        let options = EvidenceOptions {
            prior: WeakPrior::default(),
            camera_prior: DMatrix::zeros(0, 0),
            joints: None,
            smooth: None,
            links: Some(links),
            linearisations: 4,
        };
        let posterior = estimate(&chosen, &variances, &grid, (cell.x, cell.y), &options).unwrap();
        let probability = |h: &&Hypothesis| h.nature == Nature::Links;
        of_links +=
            grid.iter().zip(&posterior.weights).filter(|(h, _)| probability(h)).map(|(_, w)| w).sum::<f64>()
                / trials as f64;
        let error = (posterior.x * cell.x.inverse()).log().norm();
        let blind = (run(&seen).x * cell.x.inverse()).log().norm();
        better += (blind / error).ln() / trials as f64;
        explained += (&posterior.link_twists - &twist).norm() / twist.norm() / trials as f64;
    }
    assert!(of_links > 0.9, "{of_links}");
    assert!(better > 1.0, "{better}");
    assert!(explained < 0.3, "{explained}");
}

#[test]
fn links_that_do_not_fit_the_views_are_refused() {
    let cell = Cell::new(1, 5);
    let views = compressed(&cell, &cell.motions, 0.1, 1);
    let chosen: Vec<&CompressedView> = views.iter().collect();
    let grid = [Hypothesis::links(1e-3, 1e-3, 0.01, 0.0)];
    for links in [None, Some(LinkErrors { jacobians: vec![DMatrix::zeros(6, 2); 4], lengths: vec![true; 2] })]
    {
        let options = EvidenceOptions {
            prior: WeakPrior::default(),
            camera_prior: DMatrix::zeros(0, 0),
            joints: None,
            smooth: None,
            links,
            linearisations: 2,
        };
        let error = estimate(&chosen, &[0.01; 5], &grid, (cell.x, cell.y), &options).unwrap_err();
        assert!(error.to_string().contains("link"), "{error}");
    }
}
