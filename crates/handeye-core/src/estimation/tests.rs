//! Slopes against differences, cells of several cameras against their truth, and levels against what was put in.

use nalgebra::{DMatrix, DVector, Matrix6, Matrix6xX, Vector3, Vector6};

use super::components;
use super::linearisation::{Guess, linearise};
use super::mixed::{Mixed, Wanted};
use super::*;
use crate::se3::Se3;
use crate::testing::Random;

const PIXELS: f64 = 1e-4;

pub(super) struct Truth {
    pub cell: Cell,
    pub x: Vec<Se3>,
    pub y: Vec<Se3>,
}

fn assumptions(described: bool) -> Assumptions {
    Assumptions {
        exact_robot: false,
        roughness: 1.0,
        joint_scales: if described { vec![1.0; 4] } else { vec![] },
        free_joints: if described { vec![1, 2] } else { vec![] },
        link_lengths: if described { vec![true, false] } else { vec![] },
    }
}

/// A cell whose poses are exact but for noise of the pixels and, new at every station, twists of the flange.
pub(super) fn made(
    seed: u64,
    bodies: (&[Body], &[Body]),
    stations: usize,
    flange: f64,
    described: bool,
) -> Truth {
    let random = &mut Random::new(seed);
    let x: Vec<Se3> = bodies.0.iter().map(|_| random.transform(0.3, 1.5)).collect();
    let y: Vec<Se3> = bodies.1.iter().map(|_| random.transform(0.5, 1.5)).collect();
    let mut cell = Cell {
        stations: vec![],
        cameras: bodies
            .0
            .iter()
            .map(|body| SeenBy { body: *body, parameters: 1, from_these_pixels: false, prior: None })
            .collect(),
        targets: bodies.1.to_vec(),
        board_scale: false,
        measurements: vec![],
        tips: vec![],
        touches: vec![],
    };
    for k in 0..stations {
        let reported = random.transform(0.6, 1.2);
        let mut part = |n: usize| DMatrix::from_fn(6, n, |_, _| random.uniform(-1.0, 1.0));
        let (joints, links) = (described.then(|| part(4)), described.then(|| part(2)));
        let twist = Vector6::from_fn(|_, _| random.normal()) * flange;
        cell.stations.push(Station {
            pose: reported * Se3::exp(&twist),
            joints,
            velocity: None,
            links,
            approach: None,
        });
        for (c, of_camera) in x.iter().enumerate() {
            for (t, of_target) in y.iter().enumerate() {
                let measured = Measurement {
                    station: k,
                    camera: c,
                    target: t,
                    pose: PoseMeasurement {
                        is_foreign: false,
                        motion: reported,
                        pose: Se3::identity(),
                        covariance: Matrix6::identity() * (PIXELS * PIXELS),
                        sensitivity: Matrix6xX::zeros(1),
                        camera_information: DMatrix::identity(1, 1),
                        camera_gradient: DVector::zeros(1),
                        variance_px2: 1.0,
                        degrees_of_freedom: 50.0,
                        slow: SlowResiduals::default(),
                    },
                    variance_px2: 1.0,
                };
                cell.measurements.push(measured);
                let last = cell.measurements.len() - 1;
                let exact = *of_camera * cell.middle(&cell.measurements[last]) * *of_target;
                let noise = Vector6::from_fn(|_, _| random.normal()) * PIXELS;
                cell.measurements[last].pose.pose = Se3::exp(&noise) * exact;
            }
        }
        // The arm truly stands elsewhere than it says.
        cell.stations[k].pose = reported;
    }
    Truth { cell, x, y }
}

pub(super) fn options(described: bool) -> Options {
    Options {
        assumptions: assumptions(described),
        weak: WeakPrior::default(),
        pairs: 8,
        most_rounds: 8,
        levels: vec![],
    }
}

pub(super) fn mixed_of(truth: &Truth, described: bool) -> Mixed {
    let guess = Guess { x: truth.x.clone(), y: truth.y.clone(), away: vec![] };
    let all = components::all(&truth.cell, &assumptions(described)).unwrap();
    let end = truth.cell.columns().end;
    let weak = (DMatrix::identity(end, end), DVector::zeros(end));
    Mixed::new(&linearise(&truth.cell, &guess), &all, (&weak.0, &weak.1), &truth.cell)
}

#[test]
fn slopes_are_those_of_the_value() {
    for (seed, described) in [(1, true), (2, false)] {
        let truth = made(seed, (&[Body::Flange], &[Body::Base]), 8, 1e-3, described);
        let mixed = mixed_of(&truth, described);
        let random = &mut Random::new(seed);
        for _ in 0..4 {
            let t = mixed.start().map(|t| t + random.uniform(-1.0, 1.0));
            let found = mixed.evaluate(&t, Wanted::Slope).unwrap();
            for l in 0..t.len() {
                let at = |step: f64| {
                    let mut moved = t.clone();
                    moved[l] += step;
                    mixed.evaluate(&moved, Wanted::Value).unwrap().value
                };
                let expected = (at(1e-4) - at(-1e-4)) / 2e-4;
                let size = expected.abs().max(1.0);
                assert!(
                    (found.slope[l] - expected).abs() < 1e-5 * size,
                    "{l}: {} {expected}",
                    found.slope[l]
                );
            }
        }
    }
}

#[test]
fn stations_reduced_to_six_rows_say_the_same() {
    let bodies: (&[Body], &[Body]) = (&[Body::Flange, Body::Base], &[Body::Base, Body::Flange]);
    let close = |a: &[f64], b: &[f64]| {
        let size = a.iter().fold(0.0, |size: f64, a| size.max(a.abs()));
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-7 * size)
    };
    for (seed, described) in [(3, true), (4, false)] {
        let mut truth = made(seed, bodies, 8, 1e-3, described);
        let random = &mut Random::new(seed);
        for m in &mut truth.cell.measurements {
            m.pose.sensitivity = Matrix6xX::from_fn(1, |_, _| random.uniform(-1.0, 1.0));
        }
        let whole = mixed_of(&truth, described);
        let reduced = mixed_of(&truth, described).reduced().unwrap();
        assert!(whole.stations.iter().all(|station| station.size == 24));
        assert!(reduced.stations.iter().all(|station| station.size == 6));
        assert_eq!(whole.rows(), reduced.rows() + reduced.settled.rows);
        for _ in 0..4 {
            let t = whole.start().map(|t| t + random.uniform(-1.0, 1.0));
            for wanted in [Wanted::Slope, Wanted::Answer] {
                let (a, b) = (whole.evaluate(&t, wanted).unwrap(), reduced.evaluate(&t, wanted).unwrap());
                assert!((a.value - b.value).abs() < 1e-7 * a.value.abs(), "{} {}", a.value, b.value);
                assert!(close(a.slope.as_slice(), b.slope.as_slice()));
                assert!(close(a.curvature.as_slice(), b.curvature.as_slice()));
                assert!(close(a.theta.as_slice(), b.theta.as_slice()));
                assert!(close(a.covariance.as_slice(), b.covariance.as_slice()));
                assert!(close(a.information.as_slice(), b.information.as_slice()));
            }
            let theta = whole.evaluate(&t, Wanted::Slope).unwrap().theta;
            let both = whole.misfit(&t, &theta).unwrap().into_iter().zip(reduced.misfit(&t, &theta).unwrap());
            for ((name, a), (_, b)) in both {
                assert!((a - b).abs() < 1e-7 * a.abs(), "{name}: {a} {b}");
            }
        }
    }
}

#[test]
fn cells_of_any_cameras_and_targets_are_found() {
    let (flange, base) = (Body::Flange, Body::Base);
    let cases: [(&[Body], &[Body]); 5] = [
        (&[flange], &[base]),
        (&[base], &[flange]),
        (&[flange, flange], &[base]),
        (&[flange, base], &[base, flange]),
        (&[flange, flange, base, base], &[base, flange]),
    ];
    for (seed, bodies) in (10..).zip(cases) {
        let truth = made(seed, bodies, 12, 2e-4, false);
        let start = start_of_cell(&truth.cell, &WeakPrior::default(), None).unwrap();
        let found = estimate(&truth.cell, (start.x, start.y), &options(false)).unwrap();
        assert!(found.converged);
        for (c, (x, expected)) in found.x.iter().zip(&truth.x).enumerate() {
            let error = (*x * expected.inverse()).log();
            let covariance = found.covariance.fixed_view::<6, 6>(6 * c, 6 * c).into_owned();
            let squared = error.dot(&covariance.cholesky().unwrap().solve(&error));
            assert!(squared < 40.0, "{bodies:?} camera {c}: {squared}");
            assert!(error.norm() < 2e-3, "{bodies:?} camera {c}: {error}");
        }
    }
}

#[test]
fn what_one_station_shares_does_not_part_two_cameras() {
    // The arm errs by a milliradian; camera to camera is known as the pixels have it.
    let truth = made(20, (&[Body::Flange, Body::Flange], &[Body::Base]), 12, 1e-3, false);
    let start = start_of_cell(&truth.cell, &WeakPrior::default(), None).unwrap();
    let found = estimate(&truth.cell, (start.x, start.y), &options(false)).unwrap();
    let between = found.x[0] * found.x[1].inverse();
    let error = (between * (truth.x[0] * truth.x[1].inverse()).inverse()).log().norm();
    let alone = (found.x[0] * truth.x[0].inverse()).log().norm();
    assert!(error < 0.3 * alone, "{error} {alone}");
}

#[test]
fn levels_have_no_end() {
    for (seed, size) in [(31, 3e-4), (32, 3e-3), (33, 3e-2)] {
        let truth = made(seed, (&[Body::Flange], &[Body::Base]), 25, size, true);
        let start = start_of_cell(&truth.cell, &WeakPrior::default(), None).unwrap();
        let found = estimate(&truth.cell, (start.x, start.y), &options(true)).unwrap();
        let at = found.level_names.iter().position(|n| *n == "flange_rad").unwrap();
        let joint = found.level_names.iter().position(|n| *n == "joint_rad").unwrap();
        let levels = &found.nodes[0].levels;
        let total = levels[at].hypot(levels[joint]);
        assert!((0.4..2.5).contains(&(total / size)), "{size}: {total}");
        assert!(found.robot_loss > 5.0);
    }
}

#[test]
fn pixels_that_a_prior_holds_count_once() {
    let mut truth = made(40, (&[Body::Flange], &[Body::Base]), 10, 0.0, false);
    let views = truth.cell.measurements.len() as f64;
    truth.cell.cameras[0].prior = Some(CameraPrior {
        information: DMatrix::identity(1, 1) * views,
        mean: DVector::zeros(1),
        inflated: false,
    });
    let sigma = |cell: &Cell| {
        let found = estimate(cell, (truth.x.clone(), truth.y.clone()), &options(false)).unwrap();
        found.covariance[(12, 12)]
    };
    let twice = sigma(&truth.cell);
    let mut once = truth.cell.clone();
    once.cameras[0].from_these_pixels = true;
    assert!((sigma(&once) / twice - 2.0).abs() < 0.05, "{} {twice}", sigma(&once));
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let good = made(50, (&[Body::Flange], &[Body::Base]), 4, 0.0, false);
    let start = || (good.x.clone(), good.y.clone());
    let mut unknown = good.cell.clone();
    unknown.measurements[1].camera = 3;
    assert!(estimate(&unknown, start(), &options(false)).is_err());
    let mut negative = good.cell.clone();
    negative.measurements[0].variance_px2 = -1.0;
    assert!(estimate(&negative, start(), &options(false)).is_err());
    let mut untied = good.cell.clone();
    untied.targets[0] = Body::Flange;
    assert!(start_of_cell(&untied, &WeakPrior::default(), None).is_err());
}

#[test]
fn neighbours_that_err_alike_are_told_from_chance() {
    let white = (SlowResiduals { squared_px: 14.0, freedom: 14 }, 1.0);
    let alike = (SlowResiduals { squared_px: 70.0, freedom: 14 }, 1.0);
    assert_eq!(shared_error(&[white; 8]), 1.0);
    assert!((shared_error(&[alike; 8]) - 7.0).abs() < 1e-12);
    assert_eq!(shared_error(&[]), 1.0);
}

#[test]
fn pixels_twice_as_noisy_are_poses_twice_as_loose() {
    let found = [true, false].map(|noisy| {
        let Truth { mut cell, x, y } = made(6, (&[Body::Flange], &[Body::Base]), 8, 1e-3, false);
        for m in &mut cell.measurements {
            if noisy {
                m.variance_px2 = 4.0;
                m.pose.camera_information *= 4.0;
                m.pose.camera_gradient *= 4.0;
            } else {
                m.pose.covariance *= 4.0;
            }
        }
        estimate(&cell, (x, y), &options(false)).unwrap()
    });
    let [noisy, loose] = &found;
    assert!((&noisy.covariance - &loose.covariance).amax() < 1e-9 * loose.covariance.amax());
}

/// Corners of the board touched with a tip at poses of their own, and poses at which the tip turns about a fixed point.
fn touched(truth: &mut Truth, scale: f64, sigma: f64) {
    let random = &mut Random::new(71);
    let tip = Vector3::new(0.01, -0.02, 0.15);
    let fixed = Vector3::new(0.4, 0.1, 0.2);
    let cell = &mut truth.cell;
    cell.board_scale = true;
    for m in &mut cell.measurements {
        // Pictures that know nothing of the size of the board.
        m.pose.sensitivity = Matrix6xX::zeros(2);
        m.pose.camera_information = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 0.0]));
        m.pose.camera_gradient = DVector::zeros(2);
    }
    let loose = nalgebra::Matrix3::identity();
    cell.tips = vec![
        Tip { body: Body::Flange, at: tip + Vector3::new(1e-3, 0.0, 0.0), information: loose },
        Tip { body: Body::Base, at: fixed + Vector3::new(0.0, 2e-3, 0.0), information: loose },
    ];
    let corners = [(0.0, 0.0), (0.2, 0.0), (0.0, 0.15)].map(|(u, v)| Vector3::new(u, v, 0.0));
    for k in 0..9 {
        let turn = random.transform(0.0, 1.0);
        let (place, other) = match corners.get(k) {
            Some(corner) => {
                (truth.y[0].act(&(corner * (1.0 + scale))), TouchPoint::OfTarget { target: 0, at: *corner })
            }
            None => (fixed, TouchPoint::Tip(1)),
        };
        let noise = Vector3::from_fn(|_, _| random.normal()) * sigma;
        let pose = Se3::new(turn.rotation, place + noise - turn.rotation * tip);
        let (joints, links) = (None, None);
        cell.stations.push(Station { pose, joints, velocity: None, links, approach: None });
        cell.touches.push(Touch {
            station: cell.stations.len() - 1,
            points: [TouchPoint::Tip(0), other],
            covariance: nalgebra::Matrix3::identity() * sigma * sigma,
        });
    }
}

#[test]
fn rows_of_touches_are_their_derivatives() {
    let mut truth = made(70, (&[Body::Flange], &[Body::Base]), 4, 0.0, false);
    touched(&mut truth, 0.01, 1e-4);
    let guess = Guess { x: truth.x.clone(), y: truth.y.clone(), away: vec![] };
    let at = |cell: &Cell, guess: &Guess| linearise(cell, guess).stations[4].clone();
    let here = at(&truth.cell, &guess);
    let step = 1e-6;
    for j in 0..6 {
        let mut xi = Vector6::zeros();
        xi[j] = step;
        let mut moved = guess.clone();
        moved.y[0] = Se3::exp(&xi) * moved.y[0];
        let of_y = (at(&truth.cell, &moved).e - &here.e) / step;
        assert!((of_y - here.b.column(6 + j)).amax() < 1e-5);
        let mut stands = truth.cell.clone();
        stands.stations[4].pose = stands.stations[4].pose * Se3::exp(&xi);
        assert!(((at(&stands, &guess).e - &here.e) / step - here.flange.column(j)).amax() < 1e-5);
        stands.stations[4].pose = Se3::exp(&xi) * truth.cell.stations[4].pose;
        assert!(((at(&stands, &guess).e - &here.e) / step - here.base.column(j)).amax() < 1e-5);
    }
    let columns = truth.cell.columns();
    for j in 0..3 {
        let mut moved = truth.cell.clone();
        moved.tips[0].at[j] += step;
        let of_tip = (at(&moved, &guess).e - &here.e) / step;
        assert!((of_tip - here.b.column(columns.tips + j)).amax() < 1e-5);
    }
    let mut larger = truth.cell.clone();
    larger.touches[0].points[1] = TouchPoint::OfTarget { target: 0, at: Vector3::new(step, 0.0, 0.0) };
    let mut column = here.b.column(columns.boards).into_owned();
    assert!(column.amax() < 1e-12, "the origin does not move with the size");
    column.copy_from(&linearise(&truth.cell, &guess).stations[5].b.column(columns.boards));
    assert!((column - truth.y[0].rotation * Vector3::new(0.2, 0.0, 0.0)).amax() < 1e-12);
}

#[test]
fn touches_find_the_size_of_a_board_and_the_tip() {
    let mut truth = made(72, (&[Body::Flange], &[Body::Base]), 12, 2e-5, false);
    touched(&mut truth, 0.005, 2e-5);
    let found = estimate(&truth.cell, (truth.x.clone(), truth.y.clone()), &options(false)).unwrap();
    let columns = truth.cell.columns();
    let scale = (found.theta[columns.boards], found.covariance[(columns.boards, columns.boards)].sqrt());
    assert!((scale.0 - 0.005).abs() < 3.0 * scale.1 && scale.1 < 5e-4, "{scale:?}");
    // Where it was believed to be was 1 mm off.
    assert!((found.theta[columns.tips] + 1e-3).abs() < 2e-4, "{}", found.theta[columns.tips]);
    let mut seen_there = truth.cell.clone();
    seen_there.touches[0].station = 0;
    assert!(estimate(&seen_there, (truth.x.clone(), truth.y.clone()), &options(false)).is_err());
    let mut same_body = truth.cell.clone();
    same_body.tips[1].body = Body::Flange;
    assert!(estimate(&same_body, (truth.x, truth.y), &options(false)).is_err());
}
