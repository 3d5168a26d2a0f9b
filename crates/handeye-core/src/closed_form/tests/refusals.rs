//! Views that do not determine the answer are refused in words, others are not.

use nalgebra::Vector3;

use super::{Scene, assert_close, turned};
use crate::closed_form::degeneracy::MIN_SPREAD_RAD;
use crate::closed_form::{Method, axis_spread, solve};
use crate::error::Error;
use crate::se3::{Se3, so3_exp};
use crate::testing::Random;

fn assert_refused(scene: &Scene, words: &str) {
    for method in Method::ALL {
        match scene.solve(method) {
            Err(Error::Degenerate { what }) => {
                assert!(what.contains(words), "{}: expected {words:?} in {what:?}", method.name());
                assert!(what.contains("deg"), "no evidence in {what:?}");
            }
            other => panic!("{}: expected a refusal, got {other:?}", method.name()),
        }
    }
}

#[test]
fn unusable_lists_are_refused() {
    let scene = Scene::random(&mut Random::new(17), 5, 1.0);
    for method in Method::ALL {
        assert_eq!(
            solve(method, &scene.a[..2], &scene.c[..2]),
            Err(Error::TooFewViews { given: 2, needed: 3 })
        );
        assert!(matches!(solve(method, &[], &[]), Err(Error::TooFewViews { given: 0, .. })));
        assert!(matches!(solve(method, &scene.a, &scene.c[..4]), Err(Error::InvalidInput { .. })));
        for bad in [f64::NAN, f64::INFINITY] {
            let mut c = scene.c.clone();
            c[3].translation.y = bad;
            let Err(Error::InvalidInput { what }) = solve(method, &scene.a, &c) else { panic!() };
            assert!(what.contains("C[3]"), "{what}");
            let mut a = scene.a.clone();
            a[0].rotation.m12 = bad;
            let Err(Error::InvalidInput { what }) = solve(method, &a, &scene.c) else { panic!() };
            assert!(what.contains("A[0]"), "{what}");
        }
    }
}

/// Views about one axis, as a four-axis arm gives them.
fn about_one_axis(random: &mut Random, views: usize) -> Scene {
    let axis = Vector3::from_fn(|_, _| random.normal()).normalize();
    let home = turned(random, 1.0, 3.0);
    let a = (0..views)
        .map(|_| {
            let translation = Vector3::from_fn(|_, _| random.uniform(-0.5, 0.5));
            Se3::new(so3_exp(&(axis * random.uniform(-1.5, 1.5))), translation) * home
        })
        .collect();
    Scene::new(turned(random, 0.2, 3.0), turned(random, 1.0, 3.0), a)
}

#[test]
fn parallel_axes_are_refused_and_named() {
    let mut random = Random::new(18);
    for views in [3, 4, 10] {
        let scene = about_one_axis(&mut random, views);
        assert_refused(&scene, "parallel");
        // A noisy camera alone cannot make them look different,
        assert_refused(&scene.noisy(&mut random, (0.0, 0.0), (1e-3, 5e-3)), "parallel");
    }
    let turns = [0.0, 0.5, 1.2, -0.4];
    let a = turns.map(|t| Se3::new(so3_exp(&Vector3::new(0.0, t, 0.0)), Vector3::new(t, 0.1, 0.0))).to_vec();
    let scene = Scene::new(turned(&mut random, 0.1, 1.0), Se3::identity(), a);
    assert_refused(&scene, "(0.000, 1.000, 0.000)");
}

#[test]
fn a_second_axis_that_only_one_side_reports_does_not_count() {
    // Wobble across the common axis, which the rotation angles hardly show.
    let mut random = Random::new(29);
    let wobbled = |list: &[Se3], random: &mut Random, frame: &Se3| -> Vec<Se3> {
        let mut wobble = || Vector3::new(random.uniform(-0.03, 0.03), random.uniform(-0.03, 0.03), 0.0);
        let frame = Se3::new(frame.rotation, Vector3::zeros());
        list.iter()
            .map(|t| frame * Se3::new(so3_exp(&wobble()), Vector3::zeros()) * frame.inverse() * *t)
            .collect()
    };
    for views in [3, 8] {
        let a = (0..views).map(|k| Se3::new(so3_exp(&(Vector3::z() * 0.4 * f64::from(k))), Vector3::x()));
        let scene = Scene::new(turned(&mut random, 0.1, 2.0), turned(&mut random, 1.0, 2.0), a.collect());
        let wobbling_robot =
            Scene { a: wobbled(&scene.a, &mut random, &Se3::identity()), c: scene.c.clone(), ..scene };
        assert_refused(&wobbling_robot, "do not report the same rotations");
        let c = wobbled(&scene.c, &mut random, &scene.truth.x);
        assert_refused(&Scene { c, ..scene }, "parallel");
    }
}

#[test]
fn noise_of_hand_and_eye_does_not_pass_for_a_second_axis() {
    let mut random = Random::new(19);
    let mut fooled = [0; 2];
    for _ in 0..500 {
        for (count, views) in fooled.iter_mut().zip([3, 8]) {
            let scene = about_one_axis(&mut random, views).noisy(&mut random, (1e-3, 1e-3), (2e-3, 3e-3));
            *count += usize::from(scene.solve(Method::Shah).is_ok());
        }
    }
    assert!(fooled[0] <= 15 && fooled[1] == 0, "of 500 sets of 3 and of 8 views {fooled:?} passed");
}

#[test]
fn small_legitimate_rotations_are_not_refused() {
    let mut random = Random::new(20);
    let mut refused = 0;
    for _ in 0..500 {
        let scene = Scene::random(&mut random, 3, 0.07).noisy(&mut random, (2e-4, 3e-4), (5e-4, 7e-4));
        refused += usize::from(scene.solve(Method::Shah).is_err());
    }
    assert!(refused <= 25, "{refused} of 500 sets of three views turned by 1.2 to 4 deg were refused");
}

#[test]
fn pure_translation_and_equal_views_are_refused() {
    let mut random = Random::new(21);
    let (x, y) = (turned(&mut random, 0.2, 3.0), turned(&mut random, 1.0, 3.0));
    let home = turned(&mut random, 1.0, 3.0);
    for views in [3, 4, 10] {
        let moved: Vec<Se3> = (0..views)
            .map(|_| Se3::new(home.rotation, Vector3::from_fn(|_, _| random.uniform(-0.5, 0.5))))
            .collect();
        let scene = Scene::new(x, y, moved);
        assert_refused(&scene, "translation only");
        assert_refused(&scene.noisy(&mut random, (1e-5, 1e-5), (1e-3, 1e-4)), "translation only");
        assert_refused(&Scene::new(x, y, vec![home; views]), "alike");
        assert_refused(
            &Scene::new(x, y, vec![home; views]).noisy(&mut random, (0.0, 0.0), (1e-3, 1e-3)),
            "alike",
        );
    }
}

#[test]
fn half_turns_between_all_views_are_refused() {
    // About orthogonal axes there are four answers, all exact.
    let half = |axis: Vector3<f64>| Se3::new(so3_exp(&(axis * std::f64::consts::PI)), axis * 0.3);
    let a = vec![Se3::identity(), half(Vector3::x()), half(Vector3::y())];
    let mut random = Random::new(22);
    let scene = Scene::new(turned(&mut random, 0.2, 2.0), turned(&mut random, 0.2, 2.0), a);
    for method in Method::ALL {
        let Err(Error::Degenerate { what }) = scene.solve(method) else {
            panic!("{} answered", method.name())
        };
        assert!(what.contains("half a turn"), "{what}");
    }
}

#[test]
fn poses_paired_with_the_wrong_images_are_refused() {
    let mut random = Random::new(23);
    let mut scene = Scene::random(&mut random, 12, 0.6);
    scene.c.rotate_left(5);
    for method in Method::ALL {
        let Err(Error::Degenerate { what }) = scene.solve(method) else {
            panic!("{} answered", method.name())
        };
        assert!(what.contains("paired wrongly"), "{what}");
    }
}

#[test]
fn one_bad_view_of_ten_is_not_taken_for_degenerate() {
    let mut random = Random::new(24);
    for _ in 0..50 {
        let mut scene = Scene::random(&mut random, 10, 0.6).noisy(&mut random, (1e-4, 2e-4), (5e-4, 1e-3));
        scene.c[4] =
            scene.c[4] * Se3::new(so3_exp(&Vector3::new(0.0, 0.0, std::f64::consts::PI)), Vector3::zeros());
        for method in Method::ALL {
            match (method, scene.solve(method)) {
                // Two see that their linear solution is no rotation, which is for the best.
                (_, Ok(_)) | (Method::Andreff | Method::LiWangWu, Err(Error::Numerical { .. })) => {}
                (_, Err(error)) => panic!("{}: {error}", method.name()),
            }
        }
    }
}

#[test]
fn methods_that_need_translation_refuse_where_there_is_none() {
    let mut random = Random::new(25);
    let x = turned(&mut random, 0.1, 2.0);
    let y = Se3::new(turned(&mut random, 0.1, 2.0).rotation, Vector3::zeros());
    // The camera turns about its centre: C has no translation, which two methods need for the scale.
    let about = |random: &mut Random| Se3::new(turned(random, 0.0, 1.0).rotation, Vector3::zeros());
    let a = (0..6).map(|_| x.inverse() * about(&mut random)).collect();
    let scene = Scene::new(x, y, a);
    let noisy = scene.noisy(&mut random, (1e-4, 1e-4), (1e-4, 1e-4));
    for method in Method::ALL {
        if matches!(method, Method::Andreff | Method::LiWangWu) {
            assert!(matches!(scene.solve(method), Err(Error::Degenerate { .. })), "{}", method.name());
            assert!(matches!(noisy.solve(method), Err(Error::Numerical { .. })), "{}", method.name());
        } else {
            assert_close(&scene, method, 1e-9);
            assert_close(&noisy, method, 1e-2);
        }
    }
}

#[test]
fn spread_measures_what_it_says() {
    // Two views turned by 0.2 rad about z and one by 0.02 rad about x.
    let turn = |v: Vector3<f64>| Se3::new(so3_exp(&v), v);
    let a = vec![turn(Vector3::zeros()), turn(Vector3::z() * 0.2), turn(Vector3::x() * 0.02)];
    let scene = Scene::new(turned(&mut Random::new(28), 0.1, 2.0), Se3::identity(), a);
    let spread = axis_spread(&scene.a, &scene.c).unwrap();
    assert_eq!((spread.pairs, spread.half_turns), (3, 0));
    assert!((spread.largest_rotation_rad - 0.201).abs() < 1e-3);
    assert!((spread.dominant_rad - 0.2 * (2.0_f64 / 3.0).sqrt()).abs() < 1e-3, "{spread:?}");
    // About x: 0.02 twice, less what the fitted dominant axis takes over.
    assert!((spread.spread_rad - 0.02 / 2.0_f64.sqrt()).abs() < 3e-3, "{spread:?}");
    assert!(spread.noise_rad < 1e-12);
    assert!((spread.needed_rad() - MIN_SPREAD_RAD).abs() < 1e-12);
}
