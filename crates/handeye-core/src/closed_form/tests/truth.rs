//! The truth is found without noise, and nearly so with little noise.

use nalgebra::{Matrix3, Vector3, Vector6};
use proptest::prelude::*;

use super::{Scene, assert_close, turned};
use crate::closed_form::motion::MAX_PAIRS;
use crate::closed_form::{Estimate, Method, axis_spread, solve};
use crate::se3::{Se3, so3_exp};
use crate::testing::{Random, twist};

#[test]
fn every_method_finds_the_truth_without_noise() {
    let mut random = Random::new(11);
    for views in [3, 4, 10, 30] {
        for _ in 0..40 {
            let scene = Scene::random(&mut random, views, 2.5);
            // Sets of three with half turns between views are refused, see below.
            if axis_spread(&scene.a, &scene.c).unwrap().require_two_axes().is_err() {
                assert!(views == 3);
                continue;
            }
            for method in Method::ALL {
                assert_close(&scene, method, 1e-9);
            }
        }
    }
}

#[test]
fn every_method_finds_the_truth_from_three_views_turned_by_a_few_degrees() {
    let mut random = Random::new(12);
    for _ in 0..40 {
        let scene = Scene::random(&mut random, 3, 0.07);
        for method in Method::ALL {
            assert_close(&scene, method, 1e-9);
        }
    }
}

#[test]
fn swapped_or_inverted_inputs_give_the_matching_answer() {
    let scene = Scene::random(&mut Random::new(13), 8, 1.0);
    let Estimate { x, y } = scene.truth;
    let inverted = |list: &[Se3]| list.iter().map(Se3::inverse).collect::<Vec<_>>();
    for method in Method::ALL {
        // C^-1 = Y^-1 A^-1 X^-1, and A = X^-1 C Y^-1.
        let mirrored = Scene {
            truth: Estimate { x: y.inverse(), y: x.inverse() },
            a: inverted(&scene.a),
            c: inverted(&scene.c),
        };
        assert_close(&mirrored, method, 1e-9);
        let swapped = Scene {
            truth: Estimate { x: x.inverse(), y: y.inverse() },
            a: scene.c.clone(),
            c: scene.a.clone(),
        };
        assert_close(&swapped, method, 1e-9);
    }
}

#[test]
fn mountings_turned_by_half_a_turn_are_no_obstacle() {
    let mut random = Random::new(14);
    for axis in [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(0.6, 0.0, 0.8)] {
        let half_turn = Se3::new(so3_exp(&(axis * std::f64::consts::PI)), Vector3::new(0.01, -0.05, 0.1));
        let a: Vec<Se3> = (0..6).map(|_| turned(&mut random, 0.4, 0.6)).collect();
        for method in Method::ALL {
            assert_close(&Scene::new(half_turn, turned(&mut random, 1.0, 2.0), a.clone()), method, 1e-9);
            assert_close(&Scene::new(turned(&mut random, 0.1, 2.0), half_turn, a.clone()), method, 1e-9);
            assert_close(&Scene::new(half_turn, half_turn, a.clone()), method, 1e-9);
        }
    }
}

#[test]
fn poses_turned_by_half_a_turn_lose_nothing() {
    // Every camera pose itself is half a turn; relative to one another they are not.
    let mut random = Random::new(15);
    let a: Vec<Se3> = (0..6)
        .map(|_| {
            let axis = Vector3::new(random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4), 1.0).normalize();
            Se3::new(so3_exp(&(axis * std::f64::consts::PI)), turned(&mut random, 0.5, 1.0).translation)
        })
        .collect();
    let scene = Scene::new(Se3::new(Matrix3::identity(), Vector3::new(0.1, 0.0, 0.0)), Se3::identity(), a);
    for method in Method::ALL {
        assert_close(&scene, method, 1e-9);
    }
}

#[test]
fn a_thousand_views_use_a_limited_number_of_pairs() {
    let mut random = Random::new(16);
    let scene = Scene::random(&mut random, 1_000, 0.8);
    let pairs = axis_spread(&scene.a, &scene.c).unwrap().pairs;
    assert!((4_000..=MAX_PAIRS).contains(&pairs), "{pairs} pairs");
    for method in Method::ALL {
        assert_close(&scene, method, 1e-9);
    }
    // Only one view of the thousand has another axis: its pairs must not get lost.
    let mut a: Vec<Se3> = (0..999)
        .map(|_| so3_exp(&(Vector3::z() * random.uniform(-1.0, 1.0))))
        .map(|r| Se3::new(r, Vector3::new(0.1, 0.2, 0.3)))
        .collect();
    a.push(Se3::new(so3_exp(&Vector3::new(0.5, 0.0, 0.0)), Vector3::zeros()));
    let scene = Scene::new(scene.truth.x, scene.truth.y, a);
    assert_close(&scene, Method::ParkMartin, 1e-9);
}

#[test]
fn small_noise_gives_small_errors_that_shrink_with_it() {
    for method in Method::ALL {
        let mut totals = [0.0; 2];
        for (total, scale) in totals.iter_mut().zip([1.0, 0.1]) {
            let mut random = Random::new(26);
            for _ in 0..60 {
                let scene = Scene::random(&mut random, 12, 0.8).noisy(
                    &mut random,
                    (1e-4 * scale, 2e-4 * scale),
                    (5e-4 * scale, 1e-3 * scale),
                );
                let errors = scene.errors(&scene.solve(method).unwrap());
                assert!(errors[0] < 0.02 * scale && errors[2] < 0.02 * scale, "{} {errors:?}", method.name());
                assert!(errors[1] < 0.04 * scale && errors[3] < 0.04 * scale, "{} {errors:?}", method.name());
                *total += errors.iter().sum::<f64>();
            }
        }
        let ratio = totals[0] / totals[1];
        assert!(
            (8.0..12.5).contains(&ratio),
            "{}: ten times the noise, {ratio} times the error",
            method.name()
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever the views, a method answers with rigid finite transforms or with an error, and never panics.
    #[test]
    fn any_input_gives_a_rigid_answer_or_an_error(
        a in prop::collection::vec(twist(2.0, 3.1), 0..7),
        c in prop::collection::vec(twist(2.0, 3.1), 0..7),
    ) {
        let list = |xi: &[Vector6<f64>]| xi.iter().map(Se3::exp).collect::<Vec<_>>();
        for method in Method::ALL {
            if let Ok(found) = solve(method, &list(&a), &list(&c)) {
                for t in [found.x, found.y] {
                    prop_assert!((t.rotation.transpose() * t.rotation - Matrix3::identity()).amax() < 1e-9);
                    prop_assert!(t.rotation.determinant() > 0.0);
                    prop_assert!(t.translation.iter().all(|v| v.is_finite()));
                }
            }
        }
    }

    /// Moving the base, the flange, the camera or the target frame moves the answer with it.
    #[test]
    fn answers_follow_the_frames(base in twist(1.0, 3.0), target in twist(1.0, 3.0), seed in 0_u64..1000) {
        let scene = Scene::random(&mut Random::new(seed), 6, 0.9);
        let (base, target) = (Se3::exp(&base), Se3::exp(&target));
        let a: Vec<Se3> = scene.a.iter().map(|a| *a * base).collect();
        let c: Vec<Se3> = scene.c.iter().map(|c| *c * target).collect();
        let moved = Scene {
            truth: Estimate { x: scene.truth.x, y: base.inverse() * scene.truth.y * target },
            a,
            c,
        };
        for method in Method::ALL {
            assert_close(&moved, method, 1e-8);
        }
    }
}
