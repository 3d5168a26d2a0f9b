//! Each reported pose off by a twist of its own, at the flange or at the base.

use nalgebra::DMatrix;

use super::{Component, per_station};
use crate::estimation::cell::Cell;
use crate::estimation::component::{Effect, Term};
use crate::estimation::levels::{Level, LevelPrior};
use crate::estimation::linearisation::{Linearisation, Rows};

/// White noise of the robot's poses: rotation, and translation as rotation times a lever.
pub(in crate::estimation) struct RobotPose {
    name: &'static str,
    levels: [&'static str; 2],
    rows: fn(&Rows) -> &DMatrix<f64>,
}

impl RobotPose {
    /// At the flange.
    pub fn flange() -> Self {
        Self { name: "robot_flange", levels: ["flange_rad", "flange_lever_m"], rows: |rows| &rows.flange }
    }

    /// At the base.
    pub fn base() -> Self {
        Self { name: "robot_base", levels: ["base_rad", "base_lever_m"], rows: |rows| &rows.base }
    }
}

impl Component for RobotPose {
    fn name(&self) -> &'static str {
        self.name
    }

    fn levels(&self) -> Vec<Level> {
        let degree = 1_f64.to_radians();
        vec![
            Level {
                name: self.levels[0],
                start: 0.004 * degree,
                prior: LevelPrior::Deviation {
                    size: 0.02 * degree,
                    exponent: 0.0,
                    tail: 1.0,
                    nothing: 1e-6 * degree,
                },
            },
            Level { name: self.levels[1], start: 1.0, prior: LevelPrior::Ratio { spread: 0.7 } },
        ]
    }

    fn terms(&self, _: &Cell, linearisation: &Linearisation) -> Vec<Term> {
        let part = |first: usize| {
            Effect::Noise(per_station(linearisation, |rows| (self.rows)(rows).columns(first, 3).into_owned()))
        };
        vec![Term { levels: vec![0, 1], effect: part(0) }, Term { levels: vec![0], effect: part(3) }]
    }
}
