//! Pictures taken a little later than the poses that they are filed with.

use nalgebra::DMatrix;

use super::{Component, per_station};
use crate::estimation::cell::Cell;
use crate::estimation::component::{Effect, Term};
use crate::estimation::levels::{Level, LevelPrior};
use crate::estimation::linearisation::Linearisation;

/// One lag for all pictures, seconds.
pub(in crate::estimation) struct TimeLag;

impl TimeLag {
    /// Where the velocity of the flange is known at every station.
    pub fn of(cell: &Cell) -> Option<Self> {
        cell.stations.iter().all(|s| s.velocity.is_some()).then_some(Self)
    }
}

impl Component for TimeLag {
    fn name(&self) -> &'static str {
        "time_lag"
    }

    fn levels(&self) -> Vec<Level> {
        vec![Level {
            name: "lag_s",
            start: 1e-3,
            prior: LevelPrior::Deviation { size: 0.05, exponent: 0.02, tail: 1.0, nothing: 1e-6 },
        }]
    }

    fn terms(&self, cell: &Cell, linearisation: &Linearisation) -> Vec<Term> {
        let columns = per_station(linearisation, |rows| {
            cell.stations[rows.station].velocity.map_or_else(
                || DMatrix::zeros(rows.flange.nrows(), 1),
                |v| DMatrix::from_column_slice(rows.flange.nrows(), 1, (&rows.flange * v).as_slice()),
            )
        });
        vec![Term { levels: vec![0], effect: Effect::Constant(columns) }]
    }
}
