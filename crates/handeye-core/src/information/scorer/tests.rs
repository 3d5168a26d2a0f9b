//! Lanes against one candidate at a time, in every vector unit of this machine.

use nalgebra::{DMatrix, Vector3, Vector6};
use proptest::prelude::*;

use crate::camera::Lens;
use crate::information::criteria::{
    Criterion, EigenvalueSum, Entropy, EntropyHandEye, MinEigenvalue, Over, ToolPoint, Trace,
};
use crate::information::{ArmColumns, Belief, Execution, Motions, RobotError};
use crate::least_squares::PixelParameters;
use crate::se3::Se3;
use crate::simd::VectorUnit;
use crate::testing::Random;

use super::test_scene::{Scene, robot_root};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn lanes_agree_with_one_at_a_time(
        seed in any::<u64>(),
        lens in prop::sample::select(Lens::ALL.to_vec()),
        count in 0..100_usize,
        scattered in any::<bool>(),
        noisy in 0..3_u8,
        fewest in prop::sample::select(vec![0, 8, 20]),
    ) {
        let random = &mut Random::new(seed);
        let mut scene = Scene::new(random, lens, count, scattered, 0.0);
        scene.robot = match noisy {
            0 => RobotError::default(),
            1 => RobotError::on_left(robot_root(random)),
            _ => RobotError::on_right(robot_root(random)),
        };
        scene.visibility.fewest = fewest;
        // Few points may lie on one line, whose information is singular but for rounding.
        let tolerance = if fewest < 8 { 1e-7 } else { 1e-10 };
        scene.check(&Entropy, tolerance)?;
        scene.check(&EntropyHandEye, tolerance)?;
    }

    #[test]
    fn without_an_image_all_that_the_lens_sees_counts(
        seed in any::<u64>(),
        lens in prop::sample::select(Lens::ALL.to_vec()),
    ) {
        let mut scene = Scene::new(&mut Random::new(seed), lens, 60, false, 0.0);
        scene.visibility.image = None;
        scene.keep_distance();
        scene.check(&Entropy, 1e-8)?;
    }
}

fn criteria() -> Vec<Box<dyn Criterion>> {
    vec![
        Box::new(Entropy),
        Box::new(EntropyHandEye),
        Box::new(Trace::default()),
        Box::new(EigenvalueSum::default()),
        Box::new(MinEigenvalue::default()),
        Box::new(ToolPoint::new(&[Vector3::new(0.0, 0.1, 0.6)], Over::Mean).unwrap()),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn lanes_agree_whatever_is_free(
        seed in any::<u64>(),
        lens in prop::sample::select(Lens::ALL.to_vec()),
        free in prop::collection::vec(any::<bool>(), 16),
        board_scale in any::<bool>(),
        kinematic_count in 0..3_usize,
        noisy in 0..3_u8,
        radius in prop::sample::select(vec![0.0, 0.0, 0.0, 0.008]),
    ) {
        let random = &mut Random::new(seed);
        let mut scene = Scene::new(random, lens, 37, false, radius);
        scene.robot = match noisy {
            0 => RobotError::default(),
            1 => RobotError::on_left(robot_root(random)),
            _ => RobotError::on_right(robot_root(random)),
        };
        let camera: Vec<usize> = (0..lens.parameter_count()).filter(|i| free[*i]).collect();
        let count = camera.len() + usize::from(board_scale);
        scene.pixel_parameters = (count > 0).then_some(PixelParameters {
            camera,
            board_scale,
        });
        scene.kinematic_count = kinematic_count;
        scene.visibility.fewest = 8;
        scene.belief = scene.start();
        scene.keep_distance();
        let tolerance = if count > 6 { 1e-7 } else { 1e-8 };
        for criterion in criteria() {
            scene.check(criterion.as_ref(), tolerance)?;
        }
    }
}

/// Parameters of a camera without distortion, in any order.
#[test]
fn moments_of_a_plane_serve_the_camera_too() {
    for (seed, camera) in [vec![0, 1, 2, 3], vec![3, 0, 2], vec![1], vec![2, 1, 3, 0]].into_iter().enumerate()
    {
        let random = &mut Random::new(20 + seed as u64);
        let mut scene = Scene::new(random, Lens::Pinhole, 90, seed % 2 == 1, 0.0);
        scene.robot = if seed > 1 { RobotError::on_right(robot_root(random)) } else { RobotError::default() };
        scene.pixel_parameters = Some(PixelParameters { camera, board_scale: false });
        scene.belief = scene.start();
        scene.visibility.fewest = 8;
        scene.keep_distance();
        for criterion in criteria() {
            scene.check(criterion.as_ref(), 1e-9).unwrap();
        }
    }
}

/// Where all points lie on one line of the image, or nearly.
#[test]
fn boards_are_seen_from_the_side_too() {
    for pixel in [false, true] {
        let random = &mut Random::new(31);
        let mut scene = Scene::new(random, Lens::Pinhole, 0, false, 0.0);
        if pixel {
            let camera = vec![0, 2];
            scene.pixel_parameters = Some(PixelParameters { camera, board_scale: false });
            scene.belief = scene.start();
        }
        for round in 0..60 {
            let slant = [0.0, 1e-8, 1e-5, 3e-4, 1e-2, 0.1][round % 6];
            let tilt = Vector6::new(0.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2 - slant, 0.0, 0.0);
            let roll = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, random.uniform(-3.0, 3.0));
            let mut view = Se3::exp(&roll) * Se3::exp(&tilt);
            view.translation = view.rotation * -Vector3::new(0.06, 0.045, 0.0);
            view.translation.z += random.uniform(0.4, 0.9);
            scene.motions.push(scene.x.inverse() * view * scene.y.inverse());
        }
        let gains = scene.check(&Entropy, 1e-9).unwrap();
        assert!(gains.iter().filter(|g| g.is_finite()).count() > 40);
    }
}

#[test]
fn errors_of_the_arm_are_taken_in_lanes_too() {
    for (lens, noise) in
        [(Lens::Pinhole, 6), (Lens::BrownConrady5, 0), (Lens::BrownConrady5, 5), (Lens::KannalaBrandt, 6)]
    {
        let random = &mut Random::new(30);
        let mut scene = Scene::new(random, lens, 70, false, 0.0);
        scene.kinematic_count = 9;
        if lens == Lens::BrownConrady5 {
            scene.pixel_parameters = Some(PixelParameters { camera: vec![0, 2, 4], board_scale: true });
        }
        scene.belief = scene.start();
        scene.robot =
            if noise == 5 { RobotError::default() } else { RobotError::on_right(robot_root(random)) };
        let count = scene.motions.len();
        let largest = |i| if i % (9 + noise) < 9 { 1.0 } else { 5e-4 };
        let entries: Vec<f64> =
            (0..count * 6 * (9 + noise)).map(|i| largest(i) * random.uniform(-1.0, 1.0)).collect();
        let arm = ArmColumns { entries: &entries, counts: (9, noise) };
        let model = scene.model();
        for criterion in criteria() {
            let criterion = criterion.as_ref();
            let prepared = criterion.prepare(&scene.belief).unwrap();
            let expected = scene.motions.iter().enumerate().map(|(i, motion)| {
                model.candidate(motion, Some(&arm.of(i))).map_or(f64::NAN, |c| prepared.gain(&c.factor))
            });
            let expected: Vec<f64> = expected.collect();
            assert!(expected.iter().filter(|gain| gain.is_finite()).count() > 20);
            for threads in [1, 3] {
                let execution = Execution { unit: VectorUnit::widest(), threads };
                let motions = Motions::Transforms(&scene.motions);
                let found = model.gains_by(&scene.belief, criterion, motions, Some(arm), &execution).unwrap();
                for (found, expected) in found.iter().zip(&expected) {
                    let close = (found - expected).abs() <= 1e-7 * expected.abs().max(0.1);
                    let name = criterion.name();
                    assert!(close || (found.is_nan() && expected.is_nan()), "{name}: {found} for {expected}");
                }
            }
        }
    }
}

#[test]
fn what_is_in_sight_is_what_has_a_gain() {
    for lens in [Lens::Pinhole, Lens::BrownConrady5, Lens::KannalaBrandt] {
        let scene = Scene::new(&mut Random::new(5), lens, 150, false, 0.0);
        let model = scene.model();
        let gains = model.gains(&scene.belief, &Entropy, &scene.motions).unwrap();
        let seen = model.in_sight(Motions::Transforms(&scene.motions), &Execution::default()).unwrap();
        assert_eq!(seen, gains.iter().map(|gain| !gain.is_nan()).collect::<Vec<_>>());
        assert!(seen.contains(&true) && seen.contains(&false));
    }
}

#[test]
fn candidates_are_of_every_kind() {
    let scene = Scene::new(&mut Random::new(3), Lens::Pinhole, 400, false, 0.0);
    let model = scene.model();
    let kinds = scene.motions.iter().map(|m| model.sum(&(scene.x * *m * scene.y), &mut model.sums()));
    let (mut none, mut some, mut all) = (0, 0, 0);
    for seen in kinds {
        match seen {
            0 => none += 1,
            20 => all += 1,
            _ => some += 1,
        }
    }
    assert!(none > 20 && some > 20 && all > 200, "{none} {some} {all}");
}

#[test]
fn circles_go_feature_by_feature() {
    let mut scene = Scene::new(&mut Random::new(8), Lens::BrownConrady5, 45, false, 0.01);
    scene.check(&Entropy, 1e-10).unwrap();
    scene.robot = RobotError::on_right(robot_root(&mut Random::new(1)));
    scene.check(&EntropyHandEye, 1e-10).unwrap();
}

#[test]
fn few_points_in_sight_leave_directions_open() {
    // One or two points: an information of rank two or four.
    let mut scene = Scene::new(&mut Random::new(11), Lens::Pinhole, 200, false, 0.0);
    scene.features.truncate(2);
    scene.visibility.fewest = 1;
    let gains = scene.check(&Entropy, 1e-9).unwrap();
    assert!(gains.iter().filter(|g| g.is_finite()).count() > 100);
}

#[test]
fn a_weak_belief_gives_no_nan() {
    // A metre and a radian of prior, and nothing else: the covariance of a view spans fourteen orders.
    let mut scene = Scene::new(&mut Random::new(12), Lens::Pinhole, 200, false, 0.0);
    scene.belief = Belief::new(DMatrix::identity(12, 12)).unwrap();
    let gains = scene.check(&Entropy, 1e-9).unwrap();
    assert!(gains.iter().filter(|g| g.is_finite()).count() > 100);
}

#[test]
fn matrices_are_repaired_or_refused() {
    let scene = Scene::new(&mut Random::new(4), Lens::Pinhole, 70, false, 0.0);
    let mut random = Random::new(9);
    let mut matrices: Vec<f64> =
        scene.motions.iter().flat_map(|m| m.to_matrix().transpose().as_slice().to_vec()).collect();
    for entry in matrices.iter_mut().step_by(16) {
        *entry += random.uniform(-1e-5, 1e-5);
    }
    let model = scene.model();
    let repaired: Vec<Se3> = matrices
        .chunks_exact(16)
        .map(|m| Se3::from_matrix(&nalgebra::Matrix4::from_row_slice(m)).unwrap())
        .collect();
    let expected = model.gains(&scene.belief, &Entropy, &repaired).unwrap();
    for unit in VectorUnit::ALL {
        let execution = Execution { unit, threads: 1 };
        let run = |matrices: &[f64]| {
            model.gains_by(&scene.belief, &Entropy, Motions::Matrices(matrices), None, &execution)
        };
        for (found, expected) in run(&matrices).unwrap().iter().zip(&expected) {
            let close = (found - expected).abs() < 1e-10 * expected.abs();
            assert!(close || (found.is_nan() && expected.is_nan()), "{found} for {expected}");
        }
        for (place, value) in
            [(0, 1.1), (3, f64::NAN), (7, f64::INFINITY), (10, f64::NAN), (12, 0.1), (15, 0.0)]
        {
            for index in [0, 31, 69] {
                let mut broken = matrices.clone();
                broken[16 * index + place] = value;
                assert!(matches!(run(&broken), Err(crate::error::Error::NotRigid { .. })), "{place} {value}");
            }
        }
        // A reflection.
        let mut broken = matrices.clone();
        broken[16 * 40..16 * 40 + 3].iter_mut().for_each(|x| *x = -*x);
        assert!(run(&broken).is_err());
        // Absurdly far away, but rigid.
        let mut far = matrices.clone();
        far[16 * 40 + 3] = 1e300;
        assert!(run(&far).unwrap()[40].is_nan());
    }
}
