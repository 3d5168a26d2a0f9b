//! The solver on cells made up here, with truth known.

use nalgebra::{Vector2, Vector3, Vector6};

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
        Problem::new(self.camera, features, pixels, offsets, reported.to_vec()).unwrap()
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
        match solve(&problem, &Model::paper(8, 0.2), &start, &Options::default()) {
            Ok(solution) => {
                assert!(solution.ending.is_converged(), "seed {seed}: {:?}", solution.ending);
                assert!(error(&cell, &solution) < 1e-8, "seed {seed}: {}", error(&cell, &solution));
                found += 1;
            }
            // Such a start can put the target behind the camera; it must be said.
            Err(e) => assert!(e.to_string().contains("out of the camera's sight"), "{e}"),
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
        let solution = solve(&problem, &Model::paper(6, 0.3), &start, &Options::default()).unwrap();
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
    let solution = solve(&problem, &Model::paper(5, 0.1), &start, &Options::default()).unwrap();
    assert_eq!(solution.ending, Ending::Degenerate);
}

#[test]
fn wrong_input_is_named() {
    let cell = Cell::new(1, 4);
    let problem = cell.problem(0.1, 0);
    let start = Start { x: cell.x, y: cell.y };
    let options = Options::default();
    let few = Cell::new(1, 2);
    let too_few = solve(&few.problem(0.1, 0), &Model::paper(2, 0.1), &start, &options).unwrap_err();
    assert_eq!(too_few, crate::error::Error::TooFewViews { given: 2, needed: 3 });
    assert!(solve(&problem, &Model::paper(4, -1.0), &start, &options).is_err());
    assert!(solve(&problem, &Model::paper(3, 0.1), &start, &options).is_err());
    let mut pixels = problem.pixels().to_vec();
    pixels[3].x = f64::NAN;
    let offsets = vec![0, 48, 96, 144, 192];
    let nan = Problem::new(cell.camera, problem.features().to_vec(), pixels, offsets, cell.motions.clone());
    assert!(nan.unwrap_err().to_string().contains("view 0, point 3"));
}
