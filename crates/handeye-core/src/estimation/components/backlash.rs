//! Play of the joints: a joint that came from one side stands half its play to that side of where it is read.

use nalgebra::DMatrix;

use super::{Component, per_station};
use crate::estimation::cell::Cell;
use crate::estimation::component::{Effect, Term};
use crate::estimation::levels::{Level, LevelPrior};
use crate::estimation::linearisation::Linearisation;

/// The play of each joint, where it is known from which side the joints came.
pub(in crate::estimation) struct Backlash;

impl Backlash {
    /// The component, if every station knows.
    pub fn of(cell: &Cell) -> Option<Self> {
        cell.stations.iter().all(|s| s.approach.is_some()).then_some(Self)
    }
}

impl Component for Backlash {
    fn name(&self) -> &'static str {
        "backlash"
    }

    fn levels(&self) -> Vec<Level> {
        let degree = 1_f64.to_radians();
        vec![Level {
            name: "play_rad",
            start: 0.05 * degree,
            prior: LevelPrior::Deviation {
                size: 0.5 * degree,
                exponent: 0.1,
                tail: 1.0,
                nothing: 1e-4 * degree,
            },
        }]
    }

    fn terms(&self, cell: &Cell, linearisation: &Linearisation) -> Vec<Term> {
        let columns = per_station(linearisation, |rows| {
            // `of` has seen that all have it.
            cell.stations[rows.station]
                .approach
                .as_ref()
                .map_or_else(|| DMatrix::zeros(rows.flange.nrows(), 0), |approach| &rows.flange * approach)
        });
        vec![Term { levels: vec![0], effect: Effect::Constant(columns) }]
    }
}
