//! Tests of all lenses together: derivatives, round trips, limits, hostile values.

use nalgebra::{SVector, Vector2, Vector3};
use proptest::prelude::*;

use super::{Camera, Lens, MAX_PARAMETERS, ParameterJacobian};
use crate::testing::numerical_jacobian;

/// A lens with coefficients of usual size, `strength` in [0, 1].
pub(super) fn camera(lens: Lens, strength: f64) -> Camera {
    let brown = [-0.28, 0.11, 1.2e-3, -0.8e-3, -0.02, 0.05, -0.03, 0.01, 2e-3, -1e-3, -1.5e-3, 0.7e-3];
    let fisheye = [0.06, -0.02, 0.008, -0.002];
    let coefficients: &[f64] = match lens {
        Lens::KannalaBrandt => &fisheye,
        Lens::Division => &[-0.2],
        _ => &brown,
    };
    let count = lens.parameter_count();
    let mut parameters = vec![1400.0, 1390.0, 640.0, 480.0];
    parameters.extend(coefficients[..count - 4].iter().map(|k| k * strength));
    Camera::new(lens, &parameters).expect("a usual camera")
}

fn lens() -> impl Strategy<Value = Lens> {
    prop::sample::select(Lens::ALL.to_vec())
}

/// Any number a caller could come up with.
fn hostile() -> impl Strategy<Value = f64> {
    prop_oneof![
        prop::num::f64::ANY,
        -1e3..1e3_f64,
        prop::sample::select(vec![0.0, -0.0, f64::NAN, f64::INFINITY, 1e-310, 1e300, f64::MIN_POSITIVE]),
    ]
}

proptest! {
    #[test]
    fn derivatives_match_differences(
        lens in lens(), strength in 0.0..1.0_f64, x in -0.5..0.5_f64, y in -0.5..0.5_f64, z in 0.3..2.0_f64,
    ) {
        let camera = camera(lens, strength);
        let point = Vector3::new(x * z, y * z, z);
        let projection = camera.project_with_derivatives(&point).expect("in view");
        prop_assert_eq!(Some(projection.pixel), camera.project(&point));
        let numeric = numerical_jacobian(&point, |p| camera.project(p).expect("in view"));
        prop_assert!((numeric - projection.d_point).amax() < 1e-4 / z, "{} {}", numeric, projection.d_point);

        let numeric: ParameterJacobian = numerical_jacobian(&SVector::<f64, MAX_PARAMETERS>::zeros(), |d| {
            camera.plus(d.as_slice()).expect("still a camera").project(&point).expect("in view")
        });
        let error = (numeric - projection.d_parameters).amax();
        prop_assert!(error < 1e-5, "{} {}", numeric, projection.d_parameters);
    }

    #[test]
    fn rays_project_to_their_pixel(
        lens in lens(), strength in 0.0..1.0_f64, x in -0.7..0.7_f64, y in -0.7..0.7_f64,
    ) {
        let camera = camera(lens, strength);
        let ray = Vector3::new(x, y, 1.0).normalize();
        let pixel = camera.project(&(ray * 3.0)).expect("in view");
        let back = camera.unproject(&pixel).expect("has a ray");
        prop_assert!((back - ray).amax() < 1e-11, "{} {}", back, ray);
        prop_assert!((back.norm() - 1.0).abs() < 1e-15);
    }

    /// Whatever the coefficients: what is seen has a pixel of its own, which leads back to it.
    #[test]
    fn no_two_rays_share_a_pixel(
        lens in lens(),
        k in prop::array::uniform12(-1.0..1.0_f64),
        strength in 0.0..0.1_f64,
        part in 0.0..1.0_f64,
        angle in 0.0..std::f64::consts::TAU,
    ) {
        let mut parameters = vec![1000.0, 1000.0, 500.0, 500.0];
        // Radial terms of any size, decentring and prism larger than real lenses have them.
        let size = |i: usize| if matches!(i, 2 | 3 | 8..=11) && lens != Lens::KannalaBrandt { strength } else { 1.0 };
        parameters.extend((0..lens.parameter_count() - 4).map(|i| k[i] * size(i)));
        let camera = Camera::new(lens, &parameters).expect("finite");
        let radius = camera.max_squared_radius.min(9.0).sqrt() * part;
        let ray = Vector3::new(radius * angle.cos(), radius * angle.sin(), 1.0);
        let projection = camera.project_with_derivatives(&ray).expect("inside the region");
        let back = camera.unproject(&projection.pixel).expect("has a ray");
        let stretch = projection.d_point.fixed_view::<2, 2>(0, 0).singular_values().min() / 1000.0;
        let error = (back / back.z - ray).norm();
        prop_assert!(error * stretch < 1e-11, "{} {} {}", error, stretch, ray);
    }

    #[test]
    fn hostile_values_never_give_nan(
        lens in lens(),
        parameters in prop::array::uniform16(hostile()),
        focal in 1e-3..1e6_f64,
        point in prop::array::uniform3(hostile()),
        pixel in prop::array::uniform2(hostile()),
    ) {
        let mut parameters = parameters;
        parameters[0] = focal;
        parameters[1] = focal;
        let Ok(camera) = Camera::new(lens, &parameters[..lens.parameter_count()]) else {
            return Ok(());
        };
        let point = Vector3::from(point);
        let plain = camera.project(&point);
        let full = camera.project_with_derivatives(&point);
        prop_assert_eq!(plain.is_some(), full.is_some());
        if let Some(p) = full {
            prop_assert!(p.pixel.iter().all(|v| v.is_finite()));
            prop_assert!(p.d_point.iter().all(|v| v.is_finite()));
            prop_assert!(p.d_parameters.iter().all(|v| v.is_finite()));
        }
        if let Some(ray) = camera.unproject(&Vector2::from(pixel)) {
            prop_assert!((ray.norm() - 1.0).abs() < 1e-9);
        }
    }
}

#[test]
fn names_lead_back_to_the_lens() {
    for lens in Lens::ALL {
        assert_eq!(Lens::from_name(lens.name()), Ok(lens));
    }
    assert!(Lens::from_name("brown").unwrap_err().to_string().contains("brown_conrady_5"));
}

#[test]
fn unusable_parameters_are_refused() {
    let new = |p: &[f64]| Camera::new(Lens::Pinhole, p);
    assert!(new(&[500.0, 500.0, 320.0, 240.0]).is_ok());
    assert!(new(&[500.0, 500.0, 320.0]).is_err());
    assert!(new(&[500.0, 500.0, 320.0, 240.0, 0.0]).is_err());
    assert!(new(&[0.0, 500.0, 320.0, 240.0]).is_err());
    assert!(new(&[500.0, -1.0, 320.0, 240.0]).is_err());
    assert!(new(&[500.0, f64::NAN, 320.0, 240.0]).is_err());
    assert!(new(&[500.0, 500.0, f64::INFINITY, 240.0]).is_err());
}

#[test]
fn nothing_is_seen_behind_the_camera() {
    for lens in Lens::ALL {
        let camera = camera(lens, 1.0);
        assert!(camera.project(&Vector3::new(0.1, 0.1, 1.0)).is_some());
        assert!(camera.project(&Vector3::new(0.1, 0.1, 0.0)).is_none());
        assert!(camera.project(&Vector3::new(-0.1, -0.1, -1.0)).is_none());
    }
}

#[test]
fn the_fold_of_barrel_distortion_ends_the_view() {
    // r (1 - r^2 / 3) turns back at r = 1.
    let lens = Lens::BrownConrady4;
    let camera = Camera::new(lens, &[1000.0, 1000.0, 0.0, 0.0, -1.0 / 3.0, 0.0, 0.0, 0.0]).unwrap();
    assert!((camera.max_squared_radius - 1.0).abs() < 1e-12);
    assert!(camera.project(&Vector3::new(0.999, 0.0, 1.0)).is_some());
    assert!(camera.project(&Vector3::new(1.001, 0.0, 1.0)).is_none());
    // Far outside the fold the polynomial maps into the image again.
    assert!(camera.project(&Vector3::new(1.7, 0.0, 1.0)).is_none());
    assert!(camera.unproject(&Vector2::new(666.0, 0.0)).is_some());
    assert!(camera.unproject(&Vector2::new(667.0, 0.0)).is_none());
}

#[test]
fn the_pole_of_the_rational_model_ends_the_view() {
    // 1 / (1 - r^2 / 4): rises up to the pole at r = 2 and comes back from minus infinity beyond.
    let mut parameters = [1000.0, 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.25, 0.0, 0.0];
    let camera = Camera::new(Lens::BrownConrady8, &parameters).unwrap();
    assert!((camera.max_squared_radius - 4.0).abs() < 1e-12);
    assert!(camera.project(&Vector3::new(1.99, 0.0, 1.0)).is_some());
    assert!(camera.project(&Vector3::new(2.01, 0.0, 1.0)).is_none());
    // 1 / (1 + r^2): turns back at r = 1.
    parameters[9] = 1.0;
    let camera = Camera::new(Lens::BrownConrady8, &parameters).unwrap();
    assert!((camera.max_squared_radius - 1.0).abs() < 1e-12);
}

#[test]
fn the_fisheye_ends_where_its_angle_turns_back() {
    // theta - theta^3 / 3 turns back at 1 rad.
    let camera =
        Camera::new(Lens::KannalaBrandt, &[300.0, 300.0, 0.0, 0.0, -1.0 / 3.0, 0.0, 0.0, 0.0]).unwrap();
    let at = |theta: f64| Vector3::new(theta.sin(), 0.0, theta.cos());
    assert!(camera.project(&at(0.999)).is_some());
    assert!(camera.project(&at(1.001)).is_none());
    assert!(camera.unproject(&Vector2::new(199.9, 0.0)).is_some());
    assert!(camera.unproject(&Vector2::new(200.1, 0.0)).is_none());
    // Without coefficients it sees the half space.
    let camera = Camera::new(Lens::KannalaBrandt, &[300.0, 300.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
    let pixel = camera.project(&at(1.56)).unwrap();
    assert!((pixel.x - 300.0 * 1.56).abs() < 1e-9);
}

#[test]
fn decentring_may_fold_before_the_radius_does() {
    // x + 3 p2 x^2 turns back at x = -1 / (6 p2) although the radial part never does.
    let camera = Camera::new(Lens::BrownConrady4, &[1000.0, 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.2]).unwrap();
    assert!(camera.project(&Vector3::new(-0.83, 0.0, 1.0)).is_some());
    assert!(camera.project(&Vector3::new(-0.84, 0.0, 1.0)).is_none());
}

#[test]
fn beyond_a_fold_of_decentring_nothing_is_seen() {
    // The radial part nearly stops rising at r = 1.2 and goes on; decentring folds it there, and a point beyond
    // shares its pixel with one inside.
    let parameters = [1000.0, 1000.0, 500.0, 500.0, 0.858, 0.816, 7.35e-3, 0.0, 0.778, -0.703, 0.526, 0.671];
    let camera = Camera::new(Lens::BrownConrady8, &parameters).unwrap();
    assert!(camera.project(&Vector3::new(0.8, -0.3, 1.0)).is_some());
    assert!(camera.project(&Vector3::new(1.259, -0.439, 1.0)).is_none());
    let without =
        Camera::new(Lens::BrownConrady8, &parameters.map(|p| if p == 7.35e-3 { 0.0 } else { p })).unwrap();
    assert!(without.project(&Vector3::new(1.259, -0.439, 1.0)).is_some());
}

#[test]
fn the_fisheye_is_smooth_at_its_centre() {
    let camera = camera(Lens::KannalaBrandt, 1.0);
    for x in [0.0, 1e-9, 0.99e-4, 1.01e-4] {
        let p = camera.project_with_derivatives(&Vector3::new(x, 0.0, 1.0)).unwrap();
        assert!((p.d_point.m11 - 1400.0).abs() < 1e-4, "{}", p.d_point);
        let back = camera.unproject(&p.pixel).unwrap();
        assert!((back.x / back.z - x).abs() < 1e-15);
    }
}
