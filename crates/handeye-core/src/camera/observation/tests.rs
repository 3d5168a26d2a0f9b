//! Tests of circles against a dense integration, and of the derivatives of both kinds of features.

use nalgebra::{SVector, Vector2, Vector3, Vector6};
use proptest::prelude::*;

use crate::camera::Feature;
use crate::camera::tests::camera;
use crate::camera::{Camera, Lens, MAX_PARAMETERS, ParameterJacobian};
use crate::se3::Se3;
use crate::testing::{Random, numerical_jacobian};

/// The area centroid by brute force: a dense rule over the disc (Gauss-Legendre in the squared radius, equal steps
/// in the angle), weighted by the area of each piece's image.
fn integrated(camera: &Camera, t: &Se3, feature: &Feature) -> Option<Vector2<f64>> {
    const SECTORS: usize = 48;
    const NODES: [(f64, f64); 5] = [
        (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let (mut area, mut moment) = (0.0, Vector2::zeros());
    for (node, weight) in NODES {
        let radius = feature.radius * (0.5 + 0.5 * node).sqrt();
        for sector in 0..SECTORS {
            let angle = std::f64::consts::TAU * sector as f64 / SECTORS as f64;
            let offset = Vector3::new(radius * angle.cos(), radius * angle.sin(), 0.0);
            let seen = camera.project_with_derivatives(&t.act(&(feature.position + offset)))?;
            let along = seen.d_point * t.rotation.fixed_columns::<2>(0);
            let piece = along.determinant().abs() * weight;
            area += piece;
            moment += seen.pixel * piece;
        }
    }
    Some(moment / area)
}

/// A target tilted by up to 60 deg at 0.4 to 0.8 m, its point somewhere in the view.
fn pose(random: &mut Random, tilt: f64) -> Se3 {
    let angle = random.uniform(0.0, std::f64::consts::TAU);
    let turn = Vector3::new(angle.cos(), angle.sin(), 0.0) * random.uniform(0.0, tilt);
    let z = random.uniform(0.4, 0.8);
    let mut t = Se3::exp(&Vector6::new(0.0, 0.0, 0.0, turn.x, turn.y, turn.z));
    t.translation = Vector3::new(random.uniform(-0.4, 0.4) * z, random.uniform(-0.3, 0.3) * z, z);
    t
}

/// Largest error of the centroid over many poses, in pixels.
fn worst_error(lens: Lens, radius: f64, trials: usize) -> (f64, f64) {
    let mut random = Random::new(7);
    let camera = camera(lens, 1.0);
    let (mut worst, mut bias) = (0.0_f64, 0.0_f64);
    for _ in 0..trials {
        let t = pose(&mut random, 60_f64.to_radians());
        let feature = Feature::new(Vector3::new(0.01, -0.02, 0.0), radius).unwrap();
        let Some(truth) = integrated(&camera, &t, &feature) else { continue };
        let centre = camera.project(&t.act(&feature.position)).unwrap();
        worst = worst.max((camera.observe(&t, &feature).unwrap() - truth).norm());
        bias = bias.max((centre - truth).norm());
    }
    (worst, bias)
}

#[test]
fn the_centroid_matches_a_dense_integration() {
    for lens in Lens::ALL {
        let (worst, bias) = worst_error(lens, 0.01, 40);
        assert!(worst < 1e-4, "{}: {worst} px", lens.name());
        assert!(bias > 0.1, "{}: the projected centre is off by only {bias} px", lens.name());
    }
}

#[test]
fn large_circles_stay_accurate() {
    for lens in Lens::ALL {
        let (worst, bias) = worst_error(lens, 0.05, 40);
        assert!(worst < 2e-3 && bias > 3.0, "{}: {worst} px of {bias} px", lens.name());
    }
}

#[test]
fn tiny_circles_are_points() {
    let mut random = Random::new(3);
    for lens in Lens::ALL {
        let camera = camera(lens, 1.0);
        let t = pose(&mut random, 0.5);
        let point = Feature::new(Vector3::new(0.01, 0.02, 0.0), 0.0).unwrap();
        let dot = Feature { radius: 1e-9, ..point };
        let (a, b) = (camera.observe(&t, &point).unwrap(), camera.observe(&t, &dot).unwrap());
        assert!((a - b).norm() < 1e-8, "{a} {b}");
    }
}

#[test]
fn circles_not_wholly_in_view_are_not_seen() {
    let camera = camera(Lens::BrownConrady5, 1.0);
    let circle = Feature::new(Vector3::zeros(), 0.1).unwrap();
    let at = |z: f64, tilt: f64| {
        let mut t = Se3::exp(&Vector6::new(0.0, 0.0, 0.0, tilt, 0.0, 0.0));
        t.translation.z = z;
        t
    };
    assert!(camera.observe(&at(0.5, 0.3), &circle).is_some());
    // Half of it behind the camera.
    assert!(camera.observe(&at(0.05, 1.5), &circle).is_none());
    // Edge-on.
    assert!(camera.observe(&at(0.5, std::f64::consts::FRAC_PI_2), &circle).is_none());
    assert!(camera.observe(&at(-0.5, 0.3), &circle).is_none());
    for radius in [-0.1, f64::NAN, f64::INFINITY] {
        let broken = Feature { radius, ..circle };
        assert!(camera.observe(&at(0.5, 0.3), &broken).is_none());
        assert!(Feature::new(Vector3::zeros(), radius).is_err());
    }
    assert!(Feature::new(Vector3::new(0.0, f64::NAN, 0.0), 0.0).is_err());
}

proptest! {
    #[test]
    fn derivatives_match_differences(
        lens in prop::sample::select(Lens::ALL.to_vec()),
        seed in any::<u64>(),
        radius in prop::sample::select(vec![0.0, 0.002, 0.01, 0.04]),
    ) {
        let camera = camera(lens, 1.0);
        let t = pose(&mut Random::new(seed), 1.1);
        let feature = Feature::new(Vector3::new(0.02, -0.01, 0.0), radius).unwrap();
        let Some(seen) = camera.observe_with_derivatives(&t, &feature) else { return Ok(()) };
        prop_assert_eq!(Some(seen.pixel), camera.observe(&t, &feature));
        let short = camera.observe_with_twist_derivative(&t, &feature).unwrap();
        prop_assert_eq!(short, (seen.pixel, seen.d_twist));
        let numeric = numerical_jacobian::<2, 6>(&Vector6::zeros(), |xi| {
            camera.observe(&(Se3::exp(xi) * t), &feature).unwrap()
        });
        prop_assert!((numeric - seen.d_twist).amax() < 1e-4, "{} {}", numeric, seen.d_twist);
        let numeric: ParameterJacobian = numerical_jacobian(&SVector::<f64, MAX_PARAMETERS>::zeros(), |d| {
            camera.plus(d.as_slice()).unwrap().observe(&t, &feature).unwrap()
        });
        prop_assert!((numeric - seen.d_parameters).amax() < 1e-5, "{} {}", numeric, seen.d_parameters);
    }
}
