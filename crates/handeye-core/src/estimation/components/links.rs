//! Joints that sit a little beside where the description has them on the link before: displaced, or tilted.

use nalgebra::DMatrix;

use super::{Arm, Component, per_station};
use crate::estimation::cell::Cell;
use crate::estimation::component::{Effect, Term};
use crate::estimation::levels::{Level, LevelPrior};
use crate::estimation::linearisation::Linearisation;

/// Displacements in metres and tilts in radians, each with a level of its own.
pub(in crate::estimation) struct Links {
    lengths: Vec<DMatrix<f64>>,
    angles: Vec<DMatrix<f64>>,
    roughness: f64,
}

impl Links {
    pub(in crate::estimation) fn new(arm: &Arm, roughness: f64) -> Self {
        Self { lengths: arm.lengths.clone(), angles: arm.angles.clone(), roughness }
    }
}

impl Component for Links {
    fn name(&self) -> &'static str {
        "links"
    }

    fn levels(&self) -> Vec<Level> {
        let degree = 1_f64.to_radians();
        let usual = |size, nothing| LevelPrior::Deviation { size, exponent: 0.6, tail: 1.0, nothing };
        vec![
            Level::of_arm("link_m", self.roughness, (1e-4, usual(7e-4, 1e-8)), 5e-5),
            Level::of_arm(
                "link_rad",
                self.roughness,
                (0.005 * degree, usual(0.04 * degree, 1e-6 * degree)),
                0.03 * degree,
            ),
        ]
    }

    fn terms(&self, _: &Cell, linearisation: &Linearisation) -> Vec<Term> {
        let of = |ways: &[DMatrix<f64>]| {
            Effect::Constant(per_station(linearisation, |rows| &rows.flange * &ways[rows.station]))
        };
        vec![
            Term { levels: vec![0], effect: of(&self.lengths) },
            Term { levels: vec![1], effect: of(&self.angles) },
        ]
    }
}
