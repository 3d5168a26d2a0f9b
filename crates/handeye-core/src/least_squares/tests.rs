//! The solver on cells made up here, with truth known.

use nalgebra::{DMatrix, Matrix2, Vector2, Vector3, Vector6};

use super::*;
use crate::camera::{Camera, Feature, Lens};
use crate::se3::Se3;
use crate::testing::Random;

/// A made-up cell: truth and exact or noisy measurements.
pub(crate) struct Cell {
    pub camera: Camera,
    pub x: Se3,
    pub y: Se3,
    pub motions: Vec<Se3>,
    pub features: Vec<Feature>,
}

impl Cell {
    /// Views that look at a board of 8 x 6 points from 0.5 m to 0.9 m, tilted up to 40 degrees, rolled freely.
    pub fn new(seed: u64, views: usize) -> Self {
        let mut random = Random::new(seed);
        let camera =
            Camera::new(Lens::BrownConrady5, &[1400.0, 1390.0, 640.0, 512.0, -0.1, 0.05, 1e-3, -5e-4, 0.01])
                .unwrap();
        let x = random.transform(0.2, 2.0);
        let y = random.transform(1.0, 2.0);
        let features: Vec<Feature> = (0..48)
            .map(|i| Feature {
                position: Vector3::new(0.03 * f64::from(i % 8), 0.03 * f64::from(i / 8), 0.0),
                radius: 0.0,
            })
            .collect();
        let centre = Vector3::new(0.105, 0.075, 0.0);
        let motions = (0..views)
            .map(|_| {
                let tilt = Se3::exp(&Vector6::new(
                    0.0,
                    0.0,
                    0.0,
                    random.uniform(-0.7, 0.7),
                    random.uniform(-0.7, 0.7),
                    random.uniform(-1.5, 1.5),
                ));
                let distance = random.uniform(0.5, 0.9);
                let aim = Vector3::new(random.uniform(-0.03, 0.03), random.uniform(-0.03, 0.03), distance);
                let pose = Se3::new(tilt.rotation, aim - tilt.rotation * centre);
                x.inverse() * pose * y.inverse()
            })
            .collect();
        Self { camera, x, y, motions, features }
    }

    /// Pixels of all views, with noise of the given level.
    pub fn problem(&self, sigma_px: f64, seed: u64) -> Problem {
        self.problem_with(&self.motions, sigma_px, seed)
    }

    /// As [`Cell::problem`], but the arm reports `reported` in place of where it is.
    pub fn problem_with(&self, reported: &[Se3], sigma_px: f64, seed: u64) -> Problem {
        let mut random = Random::new(seed);
        let mut features = Vec::new();
        let mut pixels = Vec::new();
        let mut offsets = vec![0];
        for motion in &self.motions {
            let pose = self.x * *motion * self.y;
            for feature in &self.features {
                let pixel = self.camera.observe(&pose, feature).expect("in sight");
                features.push(*feature);
                pixels.push(pixel + Vector2::new(random.normal(), random.normal()) * sigma_px);
            }
            offsets.push(pixels.len());
        }
        Problem::new(self.camera, features, pixels, None, offsets, reported.to_vec()).unwrap()
    }

    /// A start off by the given rotation (radians) and translation (metres) on both unknowns.
    pub fn start(&self, radians: f64, metres: f64, seed: u64) -> Start {
        let mut random = Random::new(seed);
        let mut off = || {
            let mut axis = Vector3::new(random.normal(), random.normal(), random.normal());
            axis *= radians / axis.norm();
            let mut shift = Vector3::new(random.normal(), random.normal(), random.normal());
            shift *= metres / shift.norm();
            Se3::new(crate::se3::so3_exp(&axis), shift)
        };
        let dx = off();
        let dy = off();
        Start {
            x: Se3::new(dx.rotation * self.x.rotation, self.x.translation + dx.translation),
            y: Se3::new(dy.rotation * self.y.rotation, self.y.translation + dy.translation),
        }
    }
}

fn all(problem: &Problem) -> Vec<usize> {
    (0..problem.view_count()).collect()
}

fn error(cell: &Cell, solution: &Solution) -> f64 {
    (solution.x.to_matrix() - cell.x.to_matrix())
        .amax()
        .max((solution.y.to_matrix() - cell.y.to_matrix()).amax())
}

#[test]
fn finds_the_truth_from_twenty_degrees_and_a_hundred_millimetres_off() {
    let mut found = 0;
    for seed in 0..20 {
        let cell = Cell::new(seed, 8);
        let problem = cell.problem(0.0, seed);
        let start = cell.start(20_f64.to_radians(), 0.1, seed);
        for method in [Method::LevenbergMarquardt, Method::GaussNewton] {
            let options = Options { method, ..Options::default() };
            match solve(&problem, &Model::paper(8, 0.2), &start, &all(&problem), &options) {
                Ok(solution) if method == Method::LevenbergMarquardt => {
                    assert!(solution.ending.is_converged(), "seed {seed}: {:?}", solution.ending);
                    assert!(error(&cell, &solution) < 1e-8, "seed {seed}: {}", error(&cell, &solution));
                    found += 1;
                }
                // Undamped steps need not arrive from this far, but must not claim to have.
                Ok(solution) => {
                    assert!(!solution.ending.is_converged() || error(&cell, &solution) < 1e-6);
                }
                // Such a start can put the target behind the camera; it must be said.
                Err(e) => assert!(e.to_string().contains("out of the camera's sight"), "{e}"),
            }
        }
    }
    assert!(found >= 15, "only {found} of 20 starts had the target in sight");
}

#[test]
fn covariance_matches_the_spread_of_solutions() {
    let cell = Cell::new(3, 6);
    let start = Start { x: cell.x, y: cell.y };
    let trials = 400;
    let mut nees = 0.0;
    for seed in 0..trials {
        let problem = cell.problem(0.3, 1000 + seed);
        let solution =
            solve(&problem, &Model::paper(6, 0.3), &start, &all(&problem), &Options::default()).unwrap();
        let deviation = (solution.x * cell.x.inverse()).log();
        let covariance = solution.information.clone().cholesky().unwrap().inverse();
        let block = covariance.fixed_view::<6, 6>(0, 0).into_owned();
        nees += deviation.dot(&block.cholesky().unwrap().solve(&deviation));
    }
    let mean = nees / (6.0 * trials as f64);
    // The mean of chi-square with 6 degrees over 400 trials has a standard deviation of 0.029.
    assert!((mean - 1.0).abs() < 0.1, "{mean}");
}

#[test]
fn marginalised_robot_noise_gives_true_covariances_on_either_side() {
    for side in [Side::Left, Side::Right] {
        let cell = Cell::new(5, 10);
        let noise = RobotNoise::isotropic(side, 1e-3, 1e-3);
        let mut model = Model::paper(10, 0.1);
        model.robot = Some(noise.clone());
        let mut nees = 0.0;
        let trials = 300;
        for seed in 0..trials {
            let mut random = Random::new(77 + seed);
            let reported: Vec<Se3> = cell
                .motions
                .iter()
                .map(|a| {
                    let white = Vector6::from_fn(|_, _| random.normal());
                    // The arm is at exp(eps) A (or A exp(eps)) and reports A.
                    let error = Se3::exp(&(noise.square_root(0) * white)).inverse();
                    if side == Side::Left { error * *a } else { *a * error }
                })
                .collect();
            let problem = cell.problem_with(&reported, 0.1, seed);
            let start = Start { x: cell.x, y: cell.y };
            let solution = solve(&problem, &model, &start, &all(&problem), &Options::default()).unwrap();
            assert!(solution.ending.is_converged());
            let deviation = (solution.x * cell.x.inverse()).log();
            let covariance = solution.information.clone().cholesky().unwrap().inverse();
            let block = covariance.fixed_view::<6, 6>(0, 0).into_owned();
            nees += deviation.dot(&block.cholesky().unwrap().solve(&deviation));
        }
        let mean = nees / (6.0 * trials as f64);
        assert!((mean - 1.0).abs() < 0.12, "{side:?}: {mean}");
    }
}

#[test]
fn free_camera_and_board_scale_are_recovered() {
    let cell = Cell::new(11, 12);
    let mut problem = cell.problem(0.0, 1);
    let mut wrong = cell.camera.parameters;
    wrong[0] += 8.0;
    wrong[1] -= 5.0;
    wrong[2] += 4.0;
    wrong[4] += 0.02;
    let camera = Camera::new(Lens::BrownConrady5, &wrong[..9]).unwrap();
    let smaller: Vec<Feature> =
        problem.features().iter().map(|f| Feature { position: f.position / 1.01, radius: 0.0 }).collect();
    problem = Problem::new(
        camera,
        smaller,
        problem.pixels().to_vec(),
        None,
        (0..=12).map(|k| k * 48).collect(),
        cell.motions.clone(),
    )
    .unwrap();
    let mut model = Model::paper(12, 0.2);
    model.pixel_parameters = Some(PixelParameters {
        camera: vec![0, 1, 2, 3, 4],
        board_scale: true,
        prior_information: DMatrix::identity(6, 6) * 1e-12,
    });
    let start = Start { x: cell.x, y: cell.y };
    let solution = solve(&problem, &model, &start, &all(&problem), &Options::default()).unwrap();
    assert!(solution.ending.is_converged(), "{:?}", solution.ending);
    assert!(error(&cell, &solution) < 1e-6, "{}", error(&cell, &solution));
    assert!((solution.board_scale - 0.01).abs() < 1e-6);
    assert!((solution.camera.parameters[0] - 1400.0).abs() < 1e-3);
}

#[test]
fn kinematic_parameters_are_recovered() {
    let cell = Cell::new(12, 10);
    let mut random = Random::new(4);
    let jacobians: Vec<DMatrix<f64>> =
        (0..10).map(|_| DMatrix::from_fn(6, 2, |_, _| random.uniform(-1.0, 1.0))).collect();
    let q = nalgebra::DVector::from_vec(vec![0.004, -0.003]);
    let reported: Vec<Se3> = cell
        .motions
        .iter()
        .zip(&jacobians)
        .map(|(a, d)| {
            let twist = d * &q;
            Se3::exp(&Vector6::from_column_slice(twist.as_slice())).inverse() * *a
        })
        .collect();
    let problem = cell.problem_with(&reported, 0.0, 1);
    let mut model = Model::paper(10, 0.2);
    model.kinematic =
        Some(KinematicParameters { jacobians, prior_information: DMatrix::identity(2, 2) * 1e-9 });
    let start = Start { x: cell.x, y: cell.y };
    let solution = solve(&problem, &model, &start, &all(&problem), &Options::default()).unwrap();
    assert!((solution.kinematic.clone() - q).amax() < 1e-7, "{}", solution.kinematic);
    assert!(error(&cell, &solution) < 1e-7);
}

#[test]
fn parallel_axes_end_as_degenerate() {
    let cell = Cell::new(2, 5);
    // All motions turn about the flange's z axis only: the offset along it stays unknown.
    let mut random = Random::new(9);
    let first = cell.motions[0];
    let mut turned = Cell { motions: Vec::new(), ..Cell::new(2, 5) };
    for _ in 0..5 {
        let turn = Se3::exp(&Vector6::new(
            random.uniform(-0.01, 0.01),
            random.uniform(-0.01, 0.01),
            random.uniform(-0.01, 0.01),
            0.0,
            0.0,
            random.uniform(-0.1, 0.1),
        ));
        turned.motions.push(turn * first);
    }
    let problem = turned.problem(0.1, 0);
    let start = Start { x: cell.x, y: cell.y };
    let solution =
        solve(&problem, &Model::paper(5, 0.1), &start, &all(&problem), &Options::default()).unwrap();
    assert_eq!(solution.ending, Ending::Degenerate);
}

#[test]
fn a_robust_loss_forgives_a_gross_point() {
    let cell = Cell::new(21, 6);
    let clean = cell.problem(0.1, 5);
    let mut pixels = clean.pixels().to_vec();
    pixels[10] += Vector2::new(60.0, -40.0);
    let spoilt = Problem::new(
        cell.camera,
        clean.features().to_vec(),
        pixels,
        None,
        (0..=6).map(|k| k * 48).collect(),
        cell.motions.clone(),
    )
    .unwrap();
    let start = Start { x: cell.x, y: cell.y };
    let run = |problem: &Problem, loss| {
        let options = Options { loss, ..Options::default() };
        error(&cell, &solve(problem, &Model::paper(6, 0.1), &start, &all(problem), &options).unwrap())
    };
    let reference = run(&clean, Loss::Squared);
    assert!(run(&spoilt, Loss::Squared) > 5.0 * reference);
    for loss in [Loss::Huber(2.0), Loss::Cauchy(2.0), Loss::Tukey(5.0)] {
        assert!(run(&spoilt, loss) < 2.0 * reference, "{loss:?}");
    }
}

#[test]
fn point_covariances_weight_the_points() {
    let cell = Cell::new(22, 5);
    let exact = cell.problem(0.0, 0);
    let mut pixels = exact.pixels().to_vec();
    let mut covariances = vec![Matrix2::identity(); pixels.len()];
    for i in (0..pixels.len()).step_by(7) {
        pixels[i] += Vector2::new(3.0, 0.0);
        covariances[i] = Matrix2::new(1e10, 0.0, 0.0, 1.0);
    }
    let problem = Problem::new(
        cell.camera,
        exact.features().to_vec(),
        pixels,
        Some(&covariances),
        (0..=5).map(|k| k * 48).collect(),
        cell.motions.clone(),
    )
    .unwrap();
    let start = Start { x: cell.x, y: cell.y };
    let solution =
        solve(&problem, &Model::paper(5, 0.2), &start, &all(&problem), &Options::default()).unwrap();
    assert!(error(&cell, &solution) < 1e-6);
}

#[test]
fn wrong_input_is_named() {
    let cell = Cell::new(1, 4);
    let problem = cell.problem(0.1, 0);
    let start = Start { x: cell.x, y: cell.y };
    let options = Options::default();
    let too_few = solve(&problem, &Model::paper(4, 0.1), &start, &[0, 1], &options).unwrap_err();
    assert_eq!(too_few, crate::error::Error::TooFewViews { given: 2, needed: 3 });
    assert!(solve(&problem, &Model::paper(4, -1.0), &start, &[0, 1, 2], &options).is_err());
    assert!(solve(&problem, &Model::paper(3, 0.1), &start, &[0, 1, 2], &options).is_err());
    assert!(solve(&problem, &Model::paper(4, 0.1), &start, &[0, 1, 9], &options).is_err());
    let mut pixels = problem.pixels().to_vec();
    pixels[3].x = f64::NAN;
    let offsets = vec![0, 48, 96, 144, 192];
    let nan =
        Problem::new(cell.camera, problem.features().to_vec(), pixels, None, offsets, cell.motions.clone());
    assert!(nan.unwrap_err().to_string().contains("view 0, point 3"));
}
