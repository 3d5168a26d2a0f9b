//! Views in lanes against view by view, in every vector unit of this machine.

use nalgebra::{Vector2, Vector6};
use proptest::prelude::*;

use super::{BatchedEngine, Measurements, Workspace};
use crate::camera::{Camera, Feature, Lens};
use crate::least_squares::engine::smallest_pivot;
use crate::least_squares::solver::iterate;
use crate::least_squares::tests::Cell;
use crate::least_squares::view_by_view::ViewByView;
use crate::least_squares::{ChainPrior, Ending, Model, Options, Problem, Solution, Start, solve};
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
fn ragged(cell: &Cell, random: &mut Random, sigma_px: f64) -> Problem {
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
    Problem::new(cell.camera, features, pixels, offsets, cell.motions.clone()).unwrap()
}

fn by_lanes(
    problem: &Problem,
    model: &Model,
    start: &Start,
    options: &Options,
    unit: VectorUnit,
) -> Result<Solution, usize> {
    in_lanes(problem, problem.measurements().expect("corners"), model, start, options, unit)
}

fn in_lanes(
    problem: &Problem,
    measurements: &Measurements,
    model: &Model,
    start: &Start,
    options: &Options,
    unit: VectorUnit,
) -> Result<Solution, usize> {
    BatchedEngine::new(problem.camera(), model, measurements, start, &mut Workspace::new(unit))
        .map(|mut engine| iterate(&mut engine, options, problem.pixels().len()))
}

fn one_by_one(problem: &Problem, model: &Model, start: &Start, options: &Options) -> Result<Solution, usize> {
    ViewByView::new(problem, model, start)
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
    for (name, at, left, right) in [("X", 0, a.x, b.x), ("Y", 6, a.y, b.y)] {
        let difference = (left * right.inverse()).log();
        for i in 0..6 {
            let sigmas = difference[i].abs() * b.information[(at + i, at + i)].sqrt();
            prop_assert!(sigmas <= apart.sigmas, "{name} {i}: {sigmas} sigmas");
        }
    }
    prop_assert!((a.initial_cost - b.initial_cost).abs() <= 1e-11 * b.initial_cost);
    prop_assert!((a.cost - b.cost).abs() <= 1e-10 * b.cost, "cost {} {}", a.cost, b.cost);
    for i in 0..12 {
        for j in 0..12 {
            let scale = (b.information[(i, i)] * b.information[(j, j)]).sqrt();
            let difference = a.information[(i, j)] - b.information[(i, j)];
            prop_assert!(
                difference.abs() <= apart.relative * scale,
                "information {i} {j}: {}",
                difference / scale
            );
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]

    #[test]
    fn lanes_solve_as_one_by_one(
        seed in any::<u64>(),
        count in 3..20_usize,
        lens in prop::sample::select(Lens::ALL.into_iter().filter(|l| l.in_lanes()).collect::<Vec<_>>()),
        believed in any::<bool>(),
    ) {
        let random = &mut Random::new(seed);
        let mut cell = Cell::new(seed, count);
        cell.camera = camera(lens);
        let problem = ragged(&cell, random, 0.2);
        let mut model = Model::paper(count, 0.2);
        model.pixel_sigma = (0..count).map(|_| random.uniform(0.1, 0.4)).collect();
        if believed {
            model.chain_prior = Some(ChainPrior {
                x: cell.x * random.transform(0.01, 0.01),
                y: cell.y * random.transform(0.01, 0.01),
                sigma_x: Vector6::new(0.1, 0.1, 0.1, 0.2, 0.2, f64::INFINITY),
                sigma_y: Vector6::repeat(0.3),
            });
        }
        let start = cell.start(0.02, 0.01, seed);
        let options = Options { cost_tolerance: 1e-14, ..Options::default() };
        let untouched = Options { max_iterations: 0, ..options };
        let expected = one_by_one(&problem, &model, &start, &options);
        let at_start = one_by_one(&problem, &model, &start, &untouched);
        for unit in VectorUnit::ALL {
            let found = by_lanes(&problem, &model, &start, &untouched, unit);
            if let (Ok(found), Ok(expected)) = (&found, &at_start) {
                close(found, expected, &AT_ONE_POINT)?;
            }
            let found = by_lanes(&problem, &model, &start, &options, unit);
            match (&found, &expected) {
                // Whether views that hardly determine the answer do is decided by rounding.
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
    for lens in [Lens::Pinhole, Lens::BrownConrady5] {
        let cell = Cell { camera: camera(lens), ..Cell::new(4, 11) };
        let problem = ragged(&cell, &mut Random::new(1), 0.1);
        let model = Model::paper(11, 0.2);
        let mut named = 0;
        for seed in 0..60 {
            let start = cell.start(0.7, 0.3, seed);
            let options = Options { max_iterations: 0, ..Options::default() };
            let expected = one_by_one(&problem, &model, &start, &options).err();
            for unit in VectorUnit::ALL {
                let found = by_lanes(&problem, &model, &start, &options, unit).err();
                assert_eq!(found, expected, "{} seed {seed}", unit.name());
            }
            named += usize::from(expected.is_some());
        }
        assert!(named > 5 && named < 60, "{named} of 60 starts hide a view");
    }
}

#[test]
fn an_engine_is_found_for_every_problem() {
    let cell = Cell::new(6, 5);
    let problem = cell.problem(0.1, 3);
    let start = cell.start(0.05, 0.02, 1);
    let model = Model::paper(5, 0.1);
    let direct = solve(&problem, &model, &start, &Options::default()).unwrap();
    let lanes = by_lanes(&problem, &model, &start, &Options::default(), VectorUnit::widest()).unwrap();
    assert_eq!(direct.x, lanes.x);
    // Circles and fisheyes are not for lanes.
    let discs: Vec<Feature> = cell.features.iter().map(|f| Feature { radius: 0.004, ..*f }).collect();
    let round = Cell { features: discs, ..Cell::new(6, 5) };
    let fisheye =
        Camera::new(Lens::KannalaBrandt, &[700.0, 700.0, 640.0, 512.0, 0.01, 0.0, 0.0, 0.0]).unwrap();
    let wide = Cell { camera: fisheye, ..Cell::new(6, 5) };
    for other in [round, wide] {
        let problem = other.problem(0.0, 3);
        assert!(problem.measurements().is_none());
        let found = solve(&problem, &model, &start, &Options::default()).unwrap();
        assert!((found.x.to_matrix() - other.x.to_matrix()).amax() < 1e-8);
    }
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
    let start = Start { x: cell.x, y: cell.y };
    for unit in VectorUnit::ALL {
        let found = by_lanes(&problem, &Model::paper(9, 0.1), &start, &Options::default(), unit);
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
        let problem = ragged(&cell, random, 0.2);
        assert_eq!(problem.measurements().unwrap().parts, parts);
        let start = cell.start(0.02, 0.01, seed);
        let mut model = Model::paper(count, 0.2);
        model.pixel_sigma = (0..count).map(|_| random.uniform(0.1, 0.4)).collect();
        let options = Options { max_iterations: 0, ..Options::default() };
        let expected = one_by_one(&problem, &model, &start, &options).unwrap();
        for parts in [1, 2] {
            let measurements = Measurements::in_parts(problem.camera(), &problem.views(), parts);
            for unit in VectorUnit::ALL {
                let found = in_lanes(&problem, &measurements, &model, &start, &options, unit).unwrap();
                close(&found, &expected, &AT_ONE_POINT).unwrap();
            }
        }
    }
}
