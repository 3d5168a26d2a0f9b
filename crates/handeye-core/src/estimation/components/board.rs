//! Boards that are larger or smaller than stated: printers and rulers.

use nalgebra::{DMatrix, DVector};

use super::Component;
use crate::estimation::cell::Cell;
use crate::estimation::component::{Effect, Term};
use crate::estimation::levels::{Level, LevelPrior};
use crate::estimation::linearisation::Linearisation;

/// The scale of every board, relative to one.
pub(in crate::estimation) struct BoardScale {
    /// Whether boards were touched. A board of another size and an arm of another size look much alike; where touches
    /// speak of the board, its size is what is suspected first.
    pub touched: bool,
}

impl Component for BoardScale {
    fn name(&self) -> &'static str {
        "board_scale"
    }

    fn levels(&self) -> Vec<Level> {
        vec![Level {
            name: "board_scale",
            start: if self.touched { 3e-3 } else { 1e-4 },
            prior: LevelPrior::Deviation { size: 5e-4, exponent: 0.1, tail: 1.0, nothing: 1e-6 },
        }]
    }

    fn terms(&self, cell: &Cell, _: &Linearisation) -> Vec<Term> {
        let count = cell.targets.len();
        let effect = Effect::Prior {
            first: cell.columns().boards,
            information: DMatrix::identity(count, count),
            mean: DVector::zeros(count),
        };
        vec![Term { levels: vec![0], effect }]
    }
}
