//! Choices against the exhaustive optimum, and bounds that hold.

use nalgebra::{DMatrix, Vector3};

use super::*;
use crate::information::{CandidateModel, Sight};
use crate::least_squares::tests::Cell;

/// Information of three views as a base and of a pool of others.
fn pool(seed: u64, size: usize) -> (DMatrix<f64>, Vec<DMatrix<f64>>) {
    let cell = Cell::new(seed, size + 3);
    let model = CandidateModel {
        camera: &cell.camera,
        x: cell.x,
        y: cell.y,
        features: &cell.features,
        pixel_sigma: 0.2,
        robot: None,
        pixel_parameters: None,
        kinematic_count: 0,
        sight: Sight { image: None, margin_px: 0.0, fewest: 1 },
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
        let (_, gradient) = objective.gradient(&base).unwrap();
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
fn impossible_questions_are_refused() {
    let (base, pool) = pool(8, 3);
    assert!(select(&base, &pool, 4, &Objective::Entropy).is_err());
    assert!(select(&base, &pool, 0, &Objective::Entropy).is_err());
    let nothing = DMatrix::zeros(12, 12);
    assert!(select(&nothing, std::slice::from_ref(&nothing), 1, &Objective::Entropy).is_err());
}
