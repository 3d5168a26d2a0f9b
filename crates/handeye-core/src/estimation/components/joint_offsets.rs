//! Joints that stand beyond where they are read, always by the same.

use nalgebra::DMatrix;

use super::{Arm, Component, per_station};
use crate::estimation::cell::Cell;
use crate::estimation::component::{Effect, Term};
use crate::estimation::levels::{Level, LevelPrior};
use crate::estimation::linearisation::Linearisation;

/// Offsets of the joints between the first and the last, which only say where base and flange are.
pub(in crate::estimation) struct JointOffsets {
    offsets: Vec<DMatrix<f64>>,
    roughness: f64,
}

impl JointOffsets {
    pub(in crate::estimation) fn new(arm: &Arm, roughness: f64) -> Self {
        Self { offsets: arm.offsets.clone(), roughness }
    }
}

impl Component for JointOffsets {
    fn name(&self) -> &'static str {
        "joint_offsets"
    }

    fn levels(&self) -> Vec<Level> {
        let degree = 1_f64.to_radians();
        let of_usual =
            LevelPrior::Deviation { size: 0.07 * degree, exponent: 0.35, tail: 1.0, nothing: 1e-6 * degree };
        vec![Level::of_arm("offset_rad", self.roughness, (0.01 * degree, of_usual), 0.03 * degree)]
    }

    fn terms(&self, _: &Cell, linearisation: &Linearisation) -> Vec<Term> {
        let columns = per_station(linearisation, |rows| &rows.flange * &self.offsets[rows.station]);
        vec![Term { levels: vec![0], effect: Effect::Constant(columns) }]
    }
}
