//! What the tests look at: a camera, a board, candidates, and a belief.

use nalgebra::{DMatrix, Matrix6, Vector3, Vector6};
use proptest::prelude::*;

use crate::camera::{Camera, Feature, Lens};
use crate::information::criteria::Criterion;
use crate::information::{Belief, CandidateModel, Execution, Motions, RobotError, Visibility};
use crate::least_squares::PixelParameters;
use crate::se3::Se3;
use crate::simd::VectorUnit;
use crate::testing::Random;

fn camera(lens: Lens) -> Camera {
    let all = [
        1400.0, 1350.0, 630.0, 520.0, -0.12, 0.06, 1e-3, -6e-4, 0.01, 0.03, -0.02, 0.005, 2e-3, -1e-3, 1e-3,
        5e-4,
    ];
    let fisheye = [500.0, 490.0, 630.0, 520.0, 0.01, -0.02, 0.003, -0.001];
    match lens {
        Lens::KannalaBrandt => Camera::new(lens, &fisheye).unwrap(),
        Lens::Division => Camera::new(lens, &all[..5]).unwrap(),
        _ => Camera::new(lens, &all[..lens.parameter_count()]).unwrap(),
    }
}

/// A board of 5 x 4 points, or scattered points off any plane.
fn features(random: &mut Random, scattered: bool, radius: f64) -> Vec<Feature> {
    (0..20)
        .map(|i| {
            let mut position = Vector3::new(f64::from(i % 5) * 0.03, f64::from(i / 5) * 0.03, 0.0);
            if scattered {
                position += Vector3::new(
                    random.uniform(0.0, 0.02),
                    random.uniform(0.0, 0.02),
                    random.uniform(0.0, 0.05),
                );
            }
            Feature { position, radius }
        })
        .collect()
}

pub(super) struct Scene {
    pub camera: Camera,
    pub x: Se3,
    pub y: Se3,
    pub features: Vec<Feature>,
    pub robot: RobotError,
    pub pixel_parameters: Option<PixelParameters>,
    pub kinematic_count: usize,
    pub visibility: Visibility,
    pub belief: Belief,
    pub motions: Vec<Se3>,
}

impl Scene {
    /// Candidates of which some see all of the target, some a part, some nothing, some have it behind them.
    pub fn new(random: &mut Random, lens: Lens, count: usize, scattered: bool, radius: f64) -> Self {
        let camera = camera(lens);
        let (x, y) = (random.transform(0.2, 2.0), random.transform(1.0, 2.0));
        let features = features(random, scattered, radius);
        let motions = (0..count)
            .map(|i| {
                let mut view = random.transform(0.05, 0.6);
                view.translation += view.rotation * -Vector3::new(0.06, 0.045, 0.0);
                view.translation += match i % 5 {
                    0 => Vector3::new(
                        random.uniform(-0.4, 0.4),
                        random.uniform(-0.3, 0.3),
                        random.uniform(0.3, 0.9),
                    ),
                    1 if i % 3 == 0 => Vector3::new(0.0, 0.0, random.uniform(-0.6, 0.05)),
                    _ => Vector3::new(0.0, 0.0, random.uniform(0.35, 0.9)),
                };
                x.inverse() * view * y.inverse()
            })
            .collect();
        let visibility = Visibility { image: Some([1280.0, 1024.0]), margin_px: 8.0, fewest: 4 };
        let mut scene = Self {
            camera,
            x,
            y,
            features,
            robot: RobotError::default(),
            pixel_parameters: None,
            kinematic_count: 0,
            visibility,
            belief: Belief::new(DMatrix::identity(12, 12)).unwrap(),
            motions,
        };
        scene.belief = scene.start();
        scene
    }

    /// Leaves out candidates with points that all but touch the camera: their information is ill-conditioned, either
    /// way.
    pub fn keep_distance(&mut self) {
        let depth = |motion: &Se3, f: &Feature| (self.x * *motion * self.y).act(&f.position).z;
        let near = |motion: &Se3| self.features.iter().any(|f| (0.0..0.05).contains(&depth(motion, f)));
        self.motions = self.motions.iter().copied().filter(|motion| !near(motion)).collect();
    }

    /// What eight views around the target would tell.
    pub fn start(&self) -> Belief {
        let mut random = Random::new(5);
        let n = self.model().parameter_count();
        // A lens is known to a hundredth before: many of its coefficients do much the same in one image.
        let prior = |i: usize| if i < 12 { 1e-2 } else { 1e4 };
        let mut information = DMatrix::from_fn(n, n, |i, j| if i == j { prior(i) } else { 0.0 });
        for _ in 0..8 {
            let mut view = random.transform(0.03, 0.7);
            view.translation -= view.rotation * Vector3::new(0.06, 0.045, 0.0);
            view.translation.z += 0.6;
            let motion = self.x.inverse() * view * self.y.inverse();
            if let Some(candidate) = self.model().candidate(&motion, None) {
                information += &candidate.factor * candidate.factor.transpose();
            }
        }
        Belief::new(information).unwrap()
    }

    pub fn model(&self) -> CandidateModel<'_> {
        CandidateModel {
            camera: &self.camera,
            x: self.x,
            y: self.y,
            features: &self.features,
            pixel_sigma: 0.2,
            robot: self.robot,
            pixel_parameters: self.pixel_parameters.as_ref(),
            kinematic_count: self.kinematic_count,
            visibility: self.visibility,
        }
    }

    /// By the factor of each candidate's information: another way round in every step.
    pub fn expected(&self, criterion: &dyn Criterion) -> Vec<f64> {
        let prepared = criterion.prepare(&self.belief).unwrap();
        let model = self.model();
        self.motions
            .iter()
            .map(|motion| model.candidate(motion, None).map_or(f64::NAN, |c| prepared.gain(&c.factor)))
            .collect()
    }

    pub fn check(&self, criterion: &dyn Criterion, tolerance: f64) -> Result<Vec<f64>, TestCaseError> {
        let expected = self.expected(criterion);
        for unit in VectorUnit::ALL.into_iter().filter(|unit| unit.is_available()) {
            for threads in [1, 3] {
                let found = self
                    .model()
                    .gains_by(
                        &self.belief,
                        criterion,
                        Motions::Transforms(&self.motions),
                        None,
                        &Execution { unit, threads },
                    )
                    .unwrap();
                prop_assert_eq!(found.len(), expected.len());
                for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
                    let close = (found - expected).abs() <= tolerance * expected.abs().max(0.1);
                    prop_assert!(
                        close || (found.is_nan() && expected.is_nan()),
                        "{} in {}: candidate {}: {} for {}",
                        criterion.name(),
                        unit.name(),
                        i,
                        found,
                        expected
                    );
                }
            }
        }
        Ok(expected)
    }
}

pub(super) fn robot_root(random: &mut Random) -> Matrix6<f64> {
    let scale = Matrix6::from_diagonal(&Vector6::new(5e-4, 1e-3, 7e-4, 8e-4, 4e-4, 6e-4));
    scale * Matrix6::from_fn(|i, j| if i == j { 1.0 } else { random.uniform(-0.4, 0.4) })
}
