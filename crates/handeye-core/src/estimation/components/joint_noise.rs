//! Each joint off by an error of its own at every station: encoders, play.

use nalgebra::DMatrix;

use super::{Arm, Component, per_station};
use crate::estimation::cell::Cell;
use crate::estimation::component::{Effect, Term};
use crate::estimation::levels::{Level, LevelPrior};
use crate::estimation::linearisation::Linearisation;

/// White noise of the joints.
pub(in crate::estimation) struct JointNoise {
    joints: Vec<DMatrix<f64>>,
}

impl JointNoise {
    pub(in crate::estimation) fn new(arm: &Arm) -> Self {
        Self { joints: arm.joints.clone() }
    }
}

impl Component for JointNoise {
    fn name(&self) -> &'static str {
        "joint_noise"
    }

    fn levels(&self) -> Vec<Level> {
        let degree = 1_f64.to_radians();
        vec![Level {
            name: "joint_rad",
            start: 0.004 * degree,
            prior: LevelPrior::Deviation {
                size: 0.02 * degree,
                exponent: 0.12,
                tail: 1.0,
                nothing: 1e-6 * degree,
            },
        }]
    }

    fn terms(&self, _: &Cell, linearisation: &Linearisation) -> Vec<Term> {
        let roots = per_station(linearisation, |rows| &rows.flange * &self.joints[rows.station]);
        vec![Term { levels: vec![0], effect: Effect::Noise(roots) }]
    }
}
