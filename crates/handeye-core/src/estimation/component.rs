//! What every component of the error answers, and in which terms.

use nalgebra::{DMatrix, DVector};

use super::cell::Cell;
use super::levels::Level;
use super::linearisation::{Linearisation, Rows};
use crate::positive::Block;

/// One thing that can be wrong.
pub(super) trait Component {
    /// Stable name.
    fn name(&self) -> &'static str;

    /// Its levels.
    fn levels(&self) -> Vec<Level>;

    /// What it does to a linearised cell, by numbers of its levels.
    fn terms(&self, cell: &Cell, linearisation: &Linearisation) -> Vec<Term>;
}

/// What a component does, and the levels whose product is its deviation.
#[derive(Clone, Debug)]
pub(super) struct Term {
    /// Its component's levels that are multiplied.
    pub levels: Vec<usize>,
    /// What it does.
    pub effect: Effect,
}

/// What a component does at a deviation of one.
#[derive(Clone, Debug)]
pub(super) enum Effect {
    /// New at every station: roots of its covariance, one per station.
    Noise(Vec<DMatrix<f64>>),
    /// The same at all stations: columns of new parameters, one matrix per station.
    Constant(Vec<DMatrix<f64>>),
    /// As `Constant`, but what all stations share of it cannot be told from the poses and comes again whenever the arm
    /// works: the answer is given as if it were new at every station, and its covariance is as it is. A parameter is the
    /// coefficient of one of a few functions in one column.
    Recurring {
        /// One matrix per station.
        columns: Vec<DMatrix<f64>>,
        /// Values of the [`FUNCTIONS`](super::recurring::FUNCTIONS) at each station, zero behind them.
        functions: Vec<Block>,
    },
    /// A prior on parameters that are there already.
    Prior {
        /// First of them.
        first: usize,
        /// Information at a deviation of one.
        information: DMatrix<f64>,
        /// Mean.
        mean: DVector<f64>,
    },
}

/// A matrix per station: rows of a twist at the flange or base times columns of such twists.
pub(super) fn per_station(
    linearisation: &Linearisation,
    of: impl Fn(&Rows) -> DMatrix<f64>,
) -> Vec<DMatrix<f64>> {
    linearisation.stations.iter().map(of).collect()
}
