//! One piece of work, done as often as asked, for a tool that counts instructions: `counted CASE REPEATS`.
//!
//! Without arguments it names the cases. See `tools/count_instructions.py`. `counted gains UNIT` writes what is scored
//! there instead, 17 digits a candidate, for `tools/compare_gains.py`: two machines must agree.

#![expect(clippy::disallowed_methods, clippy::disallowed_macros, reason = "a program, not the library")]

use std::hint::black_box;

use handeye_core::camera::{Camera, Feature, Lens};
use handeye_core::information::criteria::Entropy;
use handeye_core::information::{Belief, CandidateModel, Execution, Motions, RobotError, Visibility};
use handeye_core::least_squares::{Model, Options, Problem, Solution, Start, solve};
use handeye_core::se3::Se3;
use handeye_core::simd::VectorUnit;
use handeye_core::testing::Random;
use nalgebra::{Matrix6, Vector3};

const SIGMA_PX: f64 = 0.2;
const CANDIDATES: usize = 1000;

struct Scene {
    camera: Camera,
    x: Se3,
    y: Se3,
    features: Vec<Feature>,
    random: Random,
}

impl Scene {
    fn new(distorted: bool, points: u32) -> Self {
        let coefficients: &[f64] = if distorted { &[-0.1, 0.05, 1e-3, -5e-4, 0.01] } else { &[] };
        let parameters = [&[1400.0, 1400.0, 640.0, 512.0], coefficients].concat();
        let lens = if distorted { Lens::BrownConrady5 } else { Lens::Pinhole };
        let columns = if points == 16 { 4 } else { 11 };
        let at = |i: u32| Vector3::new(f64::from(i % columns) * 0.03, f64::from(i / columns) * 0.03, 0.0);
        let mut random = Random::new(7);
        Self {
            camera: Camera::new(lens, &parameters).expect("valid parameters"),
            x: random.transform(0.1, 1.0),
            y: random.transform(1.0, 1.0),
            features: (0..points).map(|i| Feature::new(at(i), 0.0).expect("a point")).collect(),
            random,
        }
    }

    /// Motions at which the target is in view.
    fn motions(&mut self, count: usize) -> Vec<Se3> {
        let middle =
            self.features.iter().map(|f| f.position).sum::<Vector3<f64>>() / self.features.len() as f64;
        (0..count)
            .map(|_| {
                let mut view = self.random.transform(0.02, 0.4);
                view.translation -= view.rotation * middle;
                view.translation.z += self.random.uniform(0.5, 0.8);
                self.x.inverse() * view * self.y.inverse()
            })
            .collect()
    }

    fn problem(&mut self, views: usize) -> (Problem, Start) {
        let motions = self.motions(views);
        let mut pixels = Vec::new();
        for motion in &motions {
            let pose = self.x * *motion * self.y;
            for feature in &self.features {
                let seen = self.camera.project(&pose.act(&feature.position)).expect("in view");
                pixels.push(seen.map(|c| c + SIGMA_PX * self.random.normal()));
            }
        }
        let offsets = (0..=views).map(|k| k * self.features.len()).collect();
        let features = self.features.repeat(views);
        let start = Start {
            x: self.random.transform(0.02, 0.05) * self.x,
            y: self.random.transform(0.02, 0.05) * self.y,
        };
        let problem = Problem::new(self.camera, features, pixels, offsets, motions);
        (problem.expect("consistent"), start)
    }
}

fn solved(problem: &Problem, start: &Start) -> Solution {
    let model = Model::paper(problem.view_count(), SIGMA_PX);
    let options = Options { cost_tolerance: 1e-6, ..Options::default() };
    solve(problem, &model, start, &options).expect("in sight")
}

fn count_solve(repeats: usize, views: usize, points: u32, distorted: bool) {
    let (problem, start) = Scene::new(distorted, points).problem(views);
    for _ in 0..repeats {
        let solution = solved(black_box(&problem), black_box(&start));
        assert!(solution.ending.is_converged(), "not solved");
        black_box(solution);
    }
}

fn count_score(repeats: usize, points: u32, distorted: bool, noisy: bool, unit: VectorUnit) {
    score(points, distorted, noisy, unit, &mut |gains| {
        for _ in 0..repeats {
            black_box(gains());
        }
    });
}

/// Sets up a case and hands over what scores it.
fn score(
    points: u32,
    distorted: bool,
    noisy: bool,
    unit: VectorUnit,
    run: &mut dyn FnMut(&dyn Fn() -> Vec<f64>),
) {
    let mut scene = Scene::new(distorted, points);
    let (problem, start) = scene.problem(8);
    let solution = solved(&problem, &start);
    let belief = Belief::new(solution.information).expect("determined");
    let motions: Vec<f64> = scene
        .motions(CANDIDATES)
        .iter()
        .flat_map(|m| m.to_matrix().transpose().as_slice().to_vec())
        .collect();
    let model = CandidateModel {
        camera: &scene.camera,
        x: solution.x,
        y: solution.y,
        features: &scene.features,
        pixel_sigma: SIGMA_PX,
        robot: RobotError { left: noisy.then(|| Matrix6::identity() * 5e-4), right: None },
        pixel_parameters: None,
        kinematic_count: 0,
        visibility: Visibility {
            image: Some([1280.0, 1024.0]),
            margin_px: 0.0,
            fewest: scene.features.len(),
        },
    };
    let execution = Execution { unit, threads: 1 };
    run(&|| {
        let gains =
            model.gains_by(&belief, &Entropy, Motions::Matrices(black_box(&motions)), None, &execution);
        gains.expect("rigid motions")
    });
}

fn print_gains(unit: &str) {
    let unit = VectorUnit::ALL.into_iter().find(|u| u.name() == unit).expect("the name of a unit");
    for (points, distorted, noisy) in
        [(16, false, false), (88, false, false), (88, true, false), (88, true, true)]
    {
        score(points, distorted, noisy, unit, &mut |gains| {
            for gain in gains() {
                println!("{gain:.16e}");
            }
        });
    }
}

type Case = (&'static str, fn(usize));

const CASES: [Case; 10] = [
    ("solve_3x16", |n| count_solve(n, 3, 16, false)),
    ("solve_8x16", |n| count_solve(n, 8, 16, false)),
    ("solve_30x88", |n| count_solve(n, 30, 88, false)),
    ("solve_30x88_distorted", |n| count_solve(n, 30, 88, true)),
    ("score_16", |n| count_score(n, 16, false, false, VectorUnit::Avx2)),
    ("score_88", |n| count_score(n, 88, false, false, VectorUnit::Avx2)),
    ("score_88_distorted", |n| count_score(n, 88, true, false, VectorUnit::Avx2)),
    ("score_88_robot_noise", |n| count_score(n, 88, false, true, VectorUnit::Avx2)),
    ("score_16_portable", |n| count_score(n, 16, false, false, VectorUnit::Portable)),
    ("score_88_portable", |n| count_score(n, 88, false, false, VectorUnit::Portable)),
];

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if arguments.len() == 1 {
        for (name, _) in CASES {
            println!("{name}");
        }
        return;
    }
    let [_, name, repeats] = &arguments[..] else { panic!("counted CASE REPEATS") };
    if name == "gains" {
        return print_gains(repeats);
    }
    let (_, run) = CASES.iter().find(|(case, _)| case == name).expect("a case that counted names");
    run(repeats.parse().expect("a number"));
}
