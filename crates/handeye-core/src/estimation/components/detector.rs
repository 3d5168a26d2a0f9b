//! Poses that a detector of somebody else has measured, and says nothing or too little about.

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::{Component, per_station};
use crate::estimation::cell::Cell;
use crate::estimation::component::{Effect, Term};
use crate::estimation::levels::{Level, LevelPrior};
use crate::estimation::linearisation::{Linearisation, Rows};

/// White noise of the target's position across and along the line of sight, and of its rotation.
pub(in crate::estimation) struct Detector;

impl Detector {
    /// The component, if a measurement is of such a detector.
    pub fn of(cell: &Cell) -> Option<Self> {
        cell.measurements.iter().any(|m| m.pose.is_foreign).then_some(Self)
    }
}

impl Component for Detector {
    fn name(&self) -> &'static str {
        "detector"
    }

    fn levels(&self) -> Vec<Level> {
        let degree = 1_f64.to_radians();
        // No detector is exact: a part that the residuals do not show is believed small before it is believed nothing.
        let deviation =
            |size: f64, nothing: f64| LevelPrior::Deviation { size, exponent: 0.3, tail: 1.0, nothing };
        vec![
            Level { name: "detector_across_m", start: 2e-4, prior: deviation(2e-3, 1e-6) },
            // Depth is what pictures know least.
            Level { name: "detector_along_m", start: 5e-4, prior: deviation(5e-3, 1e-6) },
            Level {
                name: "detector_rad",
                start: 0.05 * degree,
                prior: deviation(0.5 * degree, 1e-4 * degree),
            },
        ]
    }

    fn terms(&self, cell: &Cell, linearisation: &Linearisation) -> Vec<Term> {
        let noise = |root: fn(&Vector3<f64>) -> DMatrix<f64>| {
            Effect::Noise(per_station(linearisation, |rows| at_targets(cell, rows, root)))
        };
        vec![
            Term { levels: vec![0], effect: noise(|p| along(p, false)) },
            Term { levels: vec![1], effect: noise(|p| along(p, true)) },
            Term { levels: vec![2], effect: noise(turned) },
        ]
    }
}

/// Roots of all foreign measurements of a station, each with columns of its own, by the target's place in the camera.
fn at_targets(cell: &Cell, rows: &Rows, root: fn(&Vector3<f64>) -> DMatrix<f64>) -> DMatrix<f64> {
    let here = cell.measurements.iter().filter(|m| m.station == rows.station);
    let blocks: Vec<_> = here
        .enumerate()
        .filter(|(_, m)| m.pose.is_foreign)
        .map(|(i, m)| (6 * i, root(&m.pose.pose.translation)))
        .collect();
    let width = blocks.iter().map(|(_, block)| block.ncols()).sum();
    let mut all = DMatrix::zeros(rows.e.len(), width);
    let mut column = 0;
    for (at, block) in blocks {
        all.view_mut((at, column), (6, block.ncols())).copy_from(&block);
        column += block.ncols();
    }
    all
}

/// A displacement along the line of sight, or the two across it, as twists in the camera.
fn along(place: &Vector3<f64>, depth: bool) -> DMatrix<f64> {
    let sight = place.try_normalize(1e-9).unwrap_or_else(Vector3::z);
    let other = if sight.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    let first = sight.cross(&other).normalize();
    let ways = if depth { vec![sight] } else { vec![first, sight.cross(&first)] };
    DMatrix::from_fn(6, ways.len(), |i, j| if i < 3 { ways[j][i] } else { 0.0 })
}

/// A turn about the target's own place, as a twist in the camera.
fn turned(place: &Vector3<f64>) -> DMatrix<f64> {
    let mut root = DMatrix::zeros(6, 3);
    root.view_mut((0, 0), (3, 3)).copy_from(&place.cross_matrix());
    root.view_mut((3, 0), (3, 3)).copy_from(&Matrix3::identity());
    root
}
