//! Choices against the exhaustive optimum, and bounds that hold.

use nalgebra::{DMatrix, Vector3};

use super::pool::Pool;
use super::*;
use crate::information::{CandidateModel, Visibility};
use crate::least_squares::tests::Cell;
use crate::simd::VectorUnit;

/// Information of three views as a base and of a pool of others.
fn pool(seed: u64, size: usize) -> (DMatrix<f64>, Vec<DMatrix<f64>>) {
    let cell = Cell::new(seed, size + 3);
    let model = CandidateModel {
        camera: &cell.camera,
        x: cell.x,
        y: cell.y,
        features: &cell.features,
        pixel_sigma: 0.2,
        robot: crate::information::RobotError::default(),
        pixel_parameters: None,
        kinematic_count: 0,
        visibility: Visibility { image: None, margin_px: 0.0, fewest: 1 },
    };
    let all: Vec<DMatrix<f64>> = cell
        .motions
        .iter()
        .map(|a| {
            let factor = model.candidate(a, None).unwrap().factor;
            &factor * factor.transpose()
        })
        .collect();
    let base = all[..3].iter().fold(DMatrix::zeros(12, 12), |sum, i| sum + i);
    (base, all[3..].to_vec())
}

fn objectives() -> [Objective; 3] {
    let box_corner = Vector3::new(0.1, 0.1, 0.6);
    [
        Objective::Entropy,
        Objective::EntropyHandEye,
        Objective::tool_points(&[box_corner, -box_corner, Vector3::new(0.0, 0.0, 0.5)]).unwrap(),
    ]
}

/// The best of all choices of `k`.
fn exhaustive(base: &DMatrix<f64>, pool: &[DMatrix<f64>], k: usize, objective: &Objective) -> f64 {
    fn descend(
        total: &DMatrix<f64>,
        pool: &[DMatrix<f64>],
        from: usize,
        k: usize,
        objective: &Objective,
        best: &mut f64,
    ) {
        if k == 0 {
            *best = best.max(objective.value(total).unwrap());
            return;
        }
        for j in from..=pool.len() - k {
            descend(&(total + &pool[j]), pool, j + 1, k - 1, objective, best);
        }
    }
    let mut best = f64::NEG_INFINITY;
    descend(base, pool, 0, k, objective, &mut best);
    best
}

#[test]
fn choices_are_near_the_exhaustive_optimum_and_bounds_hold() {
    for seed in 0..6 {
        let (base, pool) = pool(seed, 14);
        for objective in objectives() {
            let best = exhaustive(&base, &pool, 4, &objective);
            let chosen = select(&base, &pool, 4, &objective).unwrap();
            assert!(chosen.value <= best + 1e-9);
            let efficiency = objective.efficiency(chosen.value, best, 12);
            assert!(efficiency > 0.995, "seed {seed}: {objective:?}: {efficiency}");
            let certificate = certify(&base, &pool, 4, &objective, &chosen.indices, 200, 1e-4).unwrap();
            assert!(certificate.bound >= best - 1e-9 * best.abs(), "seed {seed}: {objective:?}");
            let proven = objective.efficiency(chosen.value, certificate.bound, 12);
            assert!(proven > 0.75, "seed {seed}: {objective:?}: {proven}");
        }
    }
}

#[test]
fn five_of_twenty_seven() {
    let (base, pool) = pool(100, 27);
    let objective = Objective::Entropy;
    let best = exhaustive(&base, &pool, 5, &objective);
    let chosen = select(&base, &pool, 5, &objective).unwrap();
    assert!(objective.efficiency(chosen.value, best, 12) >= 0.995);
    let certificate = certify(&base, &pool, 5, &objective, &chosen.indices, 300, 1e-4).unwrap();
    assert!(certificate.bound >= best);
}

#[test]
fn gradients_are_slopes() {
    let (base, pool) = pool(7, 5);
    for objective in objectives() {
        let gradient = objective.expand(&base).unwrap().gradient;
        for information in &pool {
            let h = 1e-6;
            let ahead = objective.value(&(&base + information * h)).unwrap();
            let behind = objective.value(&(&base - information * h)).unwrap();
            let slope = (ahead - behind) / (2.0 * h);
            assert!((slope - gradient.dot(information)).abs() < 1e-4 * slope.abs(), "{objective:?}");
        }
    }
}

#[test]
fn curvatures_are_slopes_of_slopes() {
    let (base, pool) = pool(9, 4);
    for objective in objectives() {
        let here = objective.expand(&base).unwrap();
        for along in &pool {
            let h = 1e-6;
            let ahead = objective.expand(&(&base + along * h)).unwrap().gradient;
            let behind = objective.expand(&(&base - along * h)).unwrap().gradient;
            let curvature = objective.curvature(&here, along);
            for other in &pool {
                let slope = (ahead.dot(other) - behind.dot(other)) / (2.0 * h);
                assert!((slope + curvature.dot(other)).abs() < 1e-3 * slope.abs(), "{objective:?}");
            }
        }
    }
}

/// On every vector unit, what a pool says of its views is what they say one by one.
#[test]
fn views_side_by_side_are_worth_what_each_is() {
    let (base, informations) = pool(10, 13);
    for unit in VectorUnit::ALL.into_iter().filter(|unit| unit.is_available()) {
        let pool = Pool::new(&informations, unit);
        let mut out = Vec::new();
        for objective in objectives() {
            pool.worth(&base, &objective, &mut out);
            assert_eq!(out.len(), informations.len());
            for (found, information) in out.iter().zip(&informations) {
                let expected = objective.value(&(&base + information)).unwrap();
                assert!((found - expected).abs() < 1e-10 * expected.abs(), "{}: {objective:?}", unit.name());
            }
            let gradient = objective.expand(&base).unwrap().gradient;
            pool.lean(&gradient, &mut out);
            for (found, information) in out.iter().zip(&informations) {
                assert!((found / gradient.dot(information) - 1.0).abs() < 1e-10, "{}", unit.name());
            }
            pool.worth(&(&base * -1e6), &objective, &mut out);
            assert!(out.iter().all(|value| *value == f64::NEG_INFINITY));
        }
    }
}

/// The best fractional choice is found: bound and value meet, from any start and with nothing known before.
#[test]
fn bounds_meet_the_best_fractional_choice() {
    for seed in 20..28 {
        let (base, pool) = pool(seed, 60);
        let nothing = DMatrix::zeros(12, 12);
        for objective in objectives() {
            for (base, k) in [(&base, 1), (&base, 7), (&nothing, 8)] {
                let scale = objective.value(&pool.iter().sum()).unwrap().abs();
                let tolerance = 1e-7 * scale;
                let known: Vec<usize> = (0..k).collect();
                let [a, b] = [&known[..], &[]].map(|start| {
                    let found = certify(base, &pool, k, &objective, start, 300, tolerance).unwrap();
                    assert!(
                        found.bound - found.relaxed <= tolerance,
                        "seed {seed}: {objective:?}: {found:?}"
                    );
                    assert!(found.iterations < 100, "seed {seed}: {objective:?}: {found:?}");
                    found
                });
                assert!((a.relaxed - b.relaxed).abs() <= tolerance);
            }
        }
    }
}

#[test]
fn impossible_questions_are_refused() {
    let (base, pool) = pool(8, 3);
    assert!(select(&base, &pool, 4, &Objective::Entropy).is_err());
    assert!(select(&base, &pool, 0, &Objective::Entropy).is_err());
    let nothing = DMatrix::zeros(12, 12);
    assert!(select(&nothing, std::slice::from_ref(&nothing), 1, &Objective::Entropy).is_err());
}
