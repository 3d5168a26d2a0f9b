//! Views in lanes against view by view, in every vector unit of this machine.

use nalgebra::{Matrix2, Matrix6, Vector2, Vector6};
use proptest::prelude::*;

use super::{BatchedEngine, Measurements, Workspace, fits};
use crate::camera::{Camera, Feature, Lens};
use crate::least_squares::engine::smallest_pivot;
use crate::least_squares::general::General;
use crate::least_squares::solver::iterate;
use crate::least_squares::tests::Cell;
use crate::least_squares::{
    ChainPrior, Ending, Loss, Model, Options, Problem, RobotNoise, Side, Solution, Start, solve,
};
use crate::se3::Se3;
use crate::simd::VectorUnit;
use crate::testing::Random;

fn camera(lens: Lens) -> Camera {
    let all = [
        1400.0, 1390.0, 640.0, 512.0, -0.1, 0.05, 1e-3, -5e-4, 0.01, 0.02, -0.01, 0.005, 1e-3, -5e-4, 5e-4,
        2e-4,
    ];
    Camera::new(lens, &all[..lens.parameter_count()]).unwrap()
}

/// Noisy pixels of a part of the board in each view, not the same part and not as many.
fn ragged(cell: &Cell, random: &mut Random, whitened: bool, sigma_px: f64) -> Problem {
    let (mut features, mut pixels, mut offsets) = (Vec::new(), Vec::new(), vec![0]);
    for motion in &cell.motions {
        let pose = cell.x * *motion * cell.y;
        let share = random.uniform(0.2, 1.3);
        for (i, feature) in cell.features.iter().enumerate() {
            if i < 6 || random.uniform(0.0, 1.0) < share {
                let noise = Vector2::new(random.normal(), random.normal()) * sigma_px;
                pixels.push(cell.camera.observe(&pose, feature).expect("in sight") + noise);
                features.push(*feature);
            }
        }
        offsets.push(pixels.len());
    }
    let covariances: Vec<Matrix2<f64>> = pixels
        .iter()
        .map(|_| {
            let (a, b, c) = (random.uniform(0.5, 2.0), random.uniform(-0.4, 0.4), random.uniform(0.5, 2.0));
            Matrix2::new(a, b, b, c)
        })
        .collect();
    let covariances = whitened.then_some(covariances.as_slice());
    Problem::new(cell.camera, features, pixels, covariances, offsets, cell.motions.clone()).unwrap()
}

fn by_lanes(
    problem: &Problem,
    model: &Model,
    start: &Start,
    views: &[usize],
    options: &Options,
    unit: VectorUnit,
) -> Result<Solution, usize> {
    assert!(fits(problem, model));
    let measurements = Measurements::new(problem, views, model.robot.is_some()).expect("no circles");
    BatchedEngine::new(problem, model, options, views, &measurements, start, &mut Workspace::new(unit))
        .map(|mut engine| iterate(&mut engine, options, problem.pixels().len()))
}

fn one_by_one(
    problem: &Problem,
    model: &Model,
    start: &Start,
    views: &[usize],
    options: &Options,
) -> Result<Solution, usize> {
    General::new(problem, model, options.loss, views, start)
        .map(|mut engine| iterate(&mut engine, options, problem.pixels().len()))
}

fn is_nearly_open(solution: &Solution) -> bool {
    let pivot = |factor| smallest_pivot(&solution.information, factor);
    solution.factor.as_ref().is_none_or(|factor| pivot(factor) < 1e-10)
}

/// How far two solutions of one problem may differ.
struct Apart {
    /// Of `X` and `Y`, in standard deviations of the answer.
    sigmas: f64,
    /// Of everything else, relative.
    relative: f64,
}

/// Evaluated at the same point: nothing but the order of the sums differs.
const AT_ONE_POINT: Apart = Apart { sigmas: 1e-9, relative: 1e-9 };

/// Iterated until converged: where exactly an iteration stops may differ within the criterion of convergence.
const AT_THE_OPTIMUM: Apart = Apart { sigmas: 1e-3, relative: 1e-4 };

fn close(a: &Solution, b: &Solution, apart: &Apart) -> Result<(), TestCaseError> {
    let apart_x = (a.x * b.x.inverse()).log();
    let apart_y = (a.y * b.y.inverse()).log();
    for i in 0..6 {
        let sigmas = apart_x[i].abs() * b.information[(i, i)].sqrt();
        prop_assert!(
            sigmas <= apart.sigmas,
            "X {i}: {sigmas} sigmas, {} {}",
            a.x.to_matrix(),
            b.x.to_matrix()
        );
        let sigmas = apart_y[i].abs() * b.information[(6 + i, 6 + i)].sqrt();
        prop_assert!(
            sigmas <= apart.sigmas,
            "Y {i}: {sigmas} sigmas, {} {}",
            a.y.to_matrix(),
            b.y.to_matrix()
        );
    }
    let relative = apart.relative;
    prop_assert!((a.initial_cost - b.initial_cost).abs() <= 1e-11 * b.initial_cost);
    prop_assert!((a.cost - b.cost).abs() <= 1e-10 * b.cost, "cost {} {}", a.cost, b.cost);
    for i in 0..12 {
        for j in 0..12 {
            let scale = (b.information[(i, i)] * b.information[(j, j)]).sqrt();
            let difference = a.information[(i, j)] - b.information[(i, j)];
            prop_assert!(difference.abs() <= relative * scale, "information {i} {j}: {}", difference / scale);
        }
    }
    prop_assert!(
        (&a.prior_information - &b.prior_information).amax() <= relative * b.prior_information.amax()
    );
    let of_determinant = (a.correction_log_determinant - b.correction_log_determinant).abs();
    prop_assert!(of_determinant <= relative * b.correction_log_determinant.abs());
    prop_assert_eq!(a.views.len(), b.views.len());
    for (a, b) in a.views.iter().zip(&b.views) {
        prop_assert_eq!(a.view, b.view);
        prop_assert!((a.rmse_px - b.rmse_px).abs() <= relative * b.rmse_px);
        prop_assert!((a.cost - b.cost).abs() <= relative * b.cost);
        prop_assert!((a.correction - b.correction).amax() <= 10.0 * relative * b.correction.amax());
        prop_assert!((a.correction_cost - b.correction_cost).abs() <= relative * (1.0 + b.correction_cost));
        prop_assert!((a.pose.to_matrix() - b.pose.to_matrix()).amax() <= relative);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]

    #[test]
    fn lanes_solve_as_one_by_one(
        seed in any::<u64>(),
        count in 3..20_usize,
        lens in prop::sample::select(Lens::ALL.into_iter().filter(|l| *l != Lens::KannalaBrandt).collect::<Vec<_>>()),
        loss in prop::sample::select(vec![
            Loss::Squared, Loss::Squared, Loss::Squared, Loss::Huber(1.5), Loss::Cauchy(2.0), Loss::Tukey(6.0),
        ]),
        whitened in prop::bool::weighted(0.25),
        noisy in 0..3_u8,
        believed in any::<bool>(),
    ) {
        let random = &mut Random::new(seed);
        let mut cell = Cell::new(seed, count);
        cell.camera = camera(lens);
        let problem = ragged(&cell, random, whitened, 0.2);
        let views: Vec<usize> = (0..count).rev().filter(|_| random.uniform(0.0, 1.0) < 0.8).collect();
        prop_assume!(views.len() >= 3);
        let mut model = Model::paper(count, 0.2);
        model.pixel_sigma = (0..count).map(|_| random.uniform(0.1, 0.4)).collect();
        if noisy > 0 {
            let roots = if noisy == 1 { 1 } else { count };
            let mut draw = |_| {
                let scale = random.uniform(2e-4, 2e-3);
                Matrix6::from_fn(|i, j| if i == j { 1.0 } else { random.uniform(-0.3, 0.3) }) * scale
            };
            let side = if noisy == 1 { Side::Left } else { Side::Right };
            model.robot = Some(RobotNoise { side, square_roots: (0..roots).map(&mut draw).collect() });
        }
        if believed {
            model.chain_prior = Some(ChainPrior {
                x: cell.x * random.transform(0.01, 0.01),
                y: cell.y * random.transform(0.01, 0.01),
                sigma_x: Vector6::new(0.1, 0.1, 0.1, 0.2, 0.2, f64::INFINITY),
                sigma_y: Vector6::repeat(0.3),
            });
        }
        let start = cell.start(0.02, 0.01, seed);
        let options = Options { loss, cost_tolerance: 1e-14, ..Options::default() };
        let untouched = Options { max_iterations: 0, ..options };
        let expected = one_by_one(&problem, &model, &start, &views, &options);
        let at_start = one_by_one(&problem, &model, &start, &views, &untouched);
        for unit in VectorUnit::ALL {
            let found = by_lanes(&problem, &model, &start, &views, &untouched, unit);
            if let (Ok(found), Ok(expected)) = (&found, &at_start) {
                close(found, expected, &AT_ONE_POINT)?;
            }
            let found = by_lanes(&problem, &model, &start, &views, &options, unit);
            match (&found, &expected) {
                // A robust loss may leave too few points: whether they determine the answer is decided by rounding.
                (Ok(_), Ok(expected)) if is_nearly_open(expected) => {}
                (Ok(found), Ok(expected)) if expected.ending.is_converged() => {
                    prop_assert!(found.ending.is_converged(), "{:?} {}", found.ending, unit.name());
                    close(found, expected, &AT_THE_OPTIMUM)?;
                }
                (Ok(found), Ok(expected)) => prop_assert_eq!(found.ending, expected.ending),
                _ => prop_assert_eq!(found.err(), expected.as_ref().err().copied()),
            }
        }
    }
}

#[test]
fn the_first_view_out_of_sight_is_named_in_either_way() {
    let cell = Cell::new(4, 11);
    for lens in [Lens::Pinhole, Lens::BrownConrady5] {
        let cell = Cell { camera: camera(lens), ..Cell::new(4, 11) };
        let problem = ragged(&cell, &mut Random::new(1), false, 0.1);
        let views: Vec<usize> = (0..11).collect();
        let model = Model::paper(11, 0.2);
        let mut named = 0;
        for seed in 0..60 {
            let start = cell.start(0.7, 0.3, seed);
            let options = Options { max_iterations: 0, ..Options::default() };
            let expected = one_by_one(&problem, &model, &start, &views, &options).err();
            for unit in VectorUnit::ALL {
                let found = by_lanes(&problem, &model, &start, &views, &options, unit).err();
                assert_eq!(found, expected, "{} seed {seed}", unit.name());
            }
            named += usize::from(expected.is_some());
        }
        assert!(named > 5 && named < 60, "{named} of 60 starts hide a view");
    }
    assert_eq!(cell.motions.len(), 11);
}

#[test]
fn an_engine_is_found_for_every_problem() {
    let cell = Cell::new(6, 5);
    let problem = cell.problem(0.1, 3);
    let views: Vec<usize> = (0..5).collect();
    let start = cell.start(0.05, 0.02, 1);
    let model = Model::paper(5, 0.1);
    let direct = solve(&problem, &model, &start, &views, &Options::default()).unwrap();
    let lanes =
        by_lanes(&problem, &model, &start, &views, &Options::default(), VectorUnit::widest()).unwrap();
    assert_eq!(direct.x, lanes.x);
    // Circles and fisheyes are not for lanes.
    let disc = |f: &Feature| Feature { radius: 0.004, ..*f };
    let discs: Vec<Feature> = cell.features.iter().map(disc).collect();
    let round = Cell { features: discs, ..Cell::new(6, 5) };
    let problem = round.problem(0.0, 3);
    assert!(Measurements::new(&problem, &views, false).is_none());
    let found = solve(&problem, &model, &start, &views, &Options::default()).unwrap();
    assert!((found.x.to_matrix() - round.x.to_matrix()).amax() < 1e-8);
    let fisheye =
        Camera::new(Lens::KannalaBrandt, &[700.0, 700.0, 640.0, 512.0, 0.01, 0.0, 0.0, 0.0]).unwrap();
    let wide = Cell { camera: fisheye, ..Cell::new(6, 5) };
    let problem = wide.problem(0.0, 3);
    assert!(!fits(&problem, &model));
    let found = solve(&problem, &model, &start, &views, &Options::default()).unwrap();
    assert!((found.x.to_matrix() - wide.x.to_matrix()).amax() < 1e-8);
}

#[test]
fn parallel_axes_end_as_degenerate_in_lanes() {
    let mut cell = Cell::new(2, 9);
    let mut random = Random::new(9);
    let first = cell.motions[0];
    for motion in &mut cell.motions {
        let turn = Vector6::new(random.uniform(-0.01, 0.01), 0.0, 0.0, 0.0, 0.0, random.uniform(-0.1, 0.1));
        *motion = Se3::exp(&turn) * first;
    }
    let problem = cell.problem(0.1, 0);
    let views: Vec<usize> = (0..9).collect();
    let start = Start { x: cell.x, y: cell.y };
    for unit in VectorUnit::ALL {
        let found = by_lanes(&problem, &Model::paper(9, 0.1), &start, &views, &Options::default(), unit);
        assert_eq!(found.unwrap().ending, Ending::Degenerate, "{}", unit.name());
    }
}

/// Few views leave lanes free: two share the points of a view.
#[test]
fn parts_of_views_add_up_to_views() {
    for (seed, count, parts) in [(0, 3, 2), (1, 4, 2), (2, 5, 1), (3, 3, 2), (4, 4, 2)] {
        let random = &mut Random::new(seed);
        let mut cell = Cell::new(seed, count);
        cell.camera = camera(if seed % 2 == 0 { Lens::Pinhole } else { Lens::BrownConrady5 });
        let problem = ragged(&cell, random, seed > 2, 0.2);
        let views: Vec<usize> = (0..count).collect();
        let start = cell.start(0.02, 0.01, seed);
        let mut model = Model::paper(count, 0.2);
        model.pixel_sigma = (0..count).map(|_| random.uniform(0.1, 0.4)).collect();
        for whole in [false, true] {
            let measurements = Measurements::new(&problem, &views, whole).unwrap();
            assert_eq!(measurements.parts, if whole { 1 } else { parts });
            let options = Options { loss: Loss::Cauchy(2.0), max_iterations: 0, ..Options::default() };
            let expected = one_by_one(&problem, &model, &start, &views, &options).unwrap();
            for unit in VectorUnit::ALL {
                let measured = &measurements;
                let mut workspace = Workspace::new(unit);
                let mut engine =
                    BatchedEngine::new(&problem, &model, &options, &views, measured, &start, &mut workspace)
                        .unwrap();
                let found = iterate(&mut engine, &options, problem.pixels().len());
                close(&found, &expected, &AT_ONE_POINT).unwrap();
            }
        }
    }
}
