//! Errors of an arm that is not described: alike where postures are alike.
//!
//! Links and joints that are not as the controller believes them err the same way in the same posture. Such an error is
//! a Gaussian process over postures; with correlation `C ~ F F'` between stations it is a sum of a few functions of the
//! posture whose coefficients are twists (Rasmussen and Williams, "Gaussian Processes for Machine Learning", 2006,
//! section 2.2).

use nalgebra::{DMatrix, SymmetricEigen};

use super::{Component, per_station};
use crate::estimation::cell::Cell;
use crate::estimation::component::{Effect, Term};
use crate::estimation::levels::{Level, LevelPrior};
use crate::estimation::linearisation::{Linearisation, Rows};
use crate::estimation::recurring::{FUNCTIONS, squared};
use crate::positive::Block;
use crate::simd::MAX_LANES;

/// Flange poses further apart than this have little of an error in common; a chord of 2 is half a turn.
const LIKENESS_M: f64 = 1.0;
const LIKENESS_CHORD: f64 = 2.0;
/// What is believed of an error on one side: it hides in X and Y, where no residual shows it, so more is believed of it
/// than of what residuals show.
struct Beliefs {
    /// Share of the variance that no posture changes: a base or flange that is turned in itself.
    same_everywhere: f64,
    /// See [`LevelPrior::Deviation`], degrees.
    size_deg: f64,
    /// About which it is log-normal in a rough arm, per roughness, by `handeye study cheap-arms`.
    rough_deg: f64,
    exponent: f64,
    /// Lever that turns the rotation into a translation, metres, and by which factor (natural logarithm) it may differ.
    lever_m: f64,
    lever_spread: f64,
}

/// Wrists are short, and what they hide is small.
const AT_FLANGE: Beliefs = Beliefs {
    same_everywhere: 0.5,
    size_deg: 0.011,
    rough_deg: 0.02,
    exponent: 0.26,
    lever_m: 0.4,
    lever_spread: 0.7,
};
/// Shoulders and mountings carry the whole reach.
const AT_BASE: Beliefs = Beliefs {
    same_everywhere: 0.9,
    size_deg: 0.025,
    rough_deg: 0.025,
    exponent: 0.6,
    lever_m: 1.0,
    lever_spread: 0.7,
};
/// Of an arm that is known by a list of poses alone nobody has said that it was ever calibrated, and its pictures, which
/// would tell what is the detector's, are not there.
const AT_FLANGE_UNSEEN: Beliefs = Beliefs { size_deg: 0.16, rough_deg: 0.16, lever_spread: 1.5, ..AT_FLANGE };
const AT_BASE_UNSEEN: Beliefs = Beliefs { size_deg: 0.08, rough_deg: 0.08, lever_spread: 1.5, ..AT_BASE };
/// How surely a rough arm hides errors in proportion to its noise, and the lever of arms as rough: they are small.
const ROUGH_SPREAD: f64 = 0.4;
const ROUGH_LEVER_M: f64 = 0.6;
/// Functions that carry less of the variance than this count as each station's own. So do all but the largest: where
/// stations have little in common there are as many functions as stations, and each says as little as noise of its own.
const SMALLEST_FUNCTION: f64 = 1e-4;
/// Share of the variance that is always each station's own.
const OWN_SHARE: f64 = 1e-3;

/// A smooth error at the flange or at the base.
pub(in crate::estimation) struct Posture {
    name: &'static str,
    beliefs: &'static Beliefs,
    levels: [&'static str; 2],
    rows: fn(&Rows) -> &DMatrix<f64>,
    /// Value of each function at each station of the cell.
    functions: Vec<Block>,
    /// Root of the share of the variance that is each station's own.
    own: Vec<f64>,
    roughness: f64,
}

impl Posture {
    /// At the flange.
    pub fn flange(cell: &Cell, roughness: f64) -> Self {
        Self::new(
            cell,
            "posture_flange",
            ["posture_flange_rad", "posture_flange_lever_m"],
            if cell.is_unseen() { &AT_FLANGE_UNSEEN } else { &AT_FLANGE },
            |rows| &rows.flange,
            roughness,
        )
    }

    /// At the base.
    pub fn base(cell: &Cell, roughness: f64) -> Self {
        Self::new(
            cell,
            "posture_base",
            ["posture_base_rad", "posture_base_lever_m"],
            if cell.is_unseen() { &AT_BASE_UNSEEN } else { &AT_BASE },
            |rows| &rows.base,
            roughness,
        )
    }

    fn new(
        cell: &Cell,
        name: &'static str,
        levels: [&'static str; 2],
        beliefs: &'static Beliefs,
        rows: fn(&Rows) -> &DMatrix<f64>,
        roughness: f64,
    ) -> Self {
        let eigen = SymmetricEigen::new(likeness(cell, beliefs.same_everywhere));
        let count = cell.stations.len();
        let least = SMALLEST_FUNCTION * count as f64;
        let mut kept: Vec<usize> = (0..count).filter(|i| eigen.eigenvalues[*i] > least.min(0.5)).collect();
        kept.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        kept.truncate(FUNCTIONS);
        let mut functions = vec![[0.0; MAX_LANES]; count];
        for (j, of) in kept.into_iter().enumerate() {
            let size = (eigen.eigenvalues[of] * (1.0 - OWN_SHARE)).sqrt();
            for (values, entry) in functions.iter_mut().zip(eigen.eigenvectors.column(of).iter()) {
                values[j] = entry * size;
            }
        }
        let own = functions.iter().map(|values| (1.0 - squared(values)).max(OWN_SHARE).sqrt()).collect();
        Self { name, beliefs, levels, rows, functions, own, roughness }
    }
}

/// How far a smooth error is the same at two stations.
fn likeness(cell: &Cell, same: f64) -> DMatrix<f64> {
    let count = cell.stations.len();
    DMatrix::from_fn(count, count, |i, j| {
        let (a, b) = (&cell.stations[i].pose, &cell.stations[j].pose);
        let metres = (a.translation - b.translation).norm() / LIKENESS_M;
        // 2 sin(angle / 2); of the angle itself it would be no correlation.
        let chord = (3.0 - a.rotation.dot(&b.rotation)).max(0.0).sqrt() / LIKENESS_CHORD;
        let alike = if i == j { 1.0 } else { (-0.5 * (metres * metres + chord * chord)).exp() };
        same + (1.0 - same) * alike
    })
}

impl Component for Posture {
    fn name(&self) -> &'static str {
        self.name
    }

    fn levels(&self) -> Vec<Level> {
        let degree = 1_f64.to_radians();
        let (size, rough_size) = (self.beliefs.size_deg * degree, self.beliefs.rough_deg * degree);
        let nothing = 1e-6 * degree;
        let rough = self.roughness > 1.0;
        let level = if rough {
            Level {
                name: self.levels[0],
                start: rough_size * self.roughness,
                prior: LevelPrior::Known { spread: ROUGH_SPREAD, nothing },
            }
        } else {
            let prior = LevelPrior::Deviation { size, exponent: self.beliefs.exponent, tail: 2.0, nothing };
            Level { name: self.levels[0], start: 0.006 * degree, prior }
        };
        let lever_m = if rough { self.beliefs.lever_m.min(ROUGH_LEVER_M) } else { self.beliefs.lever_m };
        vec![
            level,
            Level {
                name: self.levels[1],
                start: lever_m,
                prior: LevelPrior::Ratio { spread: self.beliefs.lever_spread },
            },
        ]
    }

    fn terms(&self, _: &Cell, linearisation: &Linearisation) -> Vec<Term> {
        let mut terms = Vec::new();
        for (first, levels) in [(0, vec![0, 1]), (3, vec![0])] {
            let part = |rows: &Rows| (self.rows)(rows).columns(first, 3).into_owned();
            let functions = linearisation.stations.iter().map(|rows| self.functions[rows.station]).collect();
            let shared = Effect::Recurring { columns: per_station(linearisation, part), functions };
            let own = per_station(linearisation, |rows| part(rows) * self.own[rows.station]);
            terms.push(Term { levels: levels.clone(), effect: shared });
            terms.push(Term { levels, effect: Effect::Noise(own) });
        }
        terms
    }
}
