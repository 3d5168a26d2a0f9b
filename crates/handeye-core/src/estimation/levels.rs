//! How large the components of the error are, and what is believed of that beforehand.

/// What is believed of the size of a component before any data, as a density of its logarithm.
///
/// In the spirit of penalised complexity priors (Simpson et al. 2017): nothing is the base case, and what a healthy cell
/// never shows costs more and more. No level is kept away from zero, and none has an end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LevelPrior {
    /// A deviation `s` of density `(1 + s / (LEAST size))^exponent / (1 + s / size)^tail` in its logarithm, down to where it
    /// is nothing: rare beyond its size, nowhere impossible, and of any scale where it hardly matters.
    Deviation {
        /// Where sizes become rare, in the unit of the level.
        size: f64,
        /// How much likelier larger levels are between [`LEAST`] of it and it; nearly nothing for what residuals show.
        exponent: f64,
        /// Power by which larger ones become rare; the higher where residuals do not show them.
        tail: f64,
        /// Below this it is as good as nothing.
        nothing: f64,
    },
    /// A ratio, log-normal about its start.
    Ratio {
        /// Deviation of its logarithm.
        spread: f64,
    },
    /// A deviation that is roughly known: log-normal about its start.
    Known {
        /// Deviation of its logarithm.
        spread: f64,
        /// Below this it would be as good as nothing.
        nothing: f64,
    },
}

/// A level of the error.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Stable name.
    pub name: &'static str,
    /// Where to begin, and the median of a ratio.
    pub start: f64,
    /// What is believed.
    pub prior: LevelPrior,
}

/// Share of its size below which a level of any scale is as likely: an arm that errs by so little may be exact.
const LEAST: f64 = 0.05;
/// How sharply a level ends where it is nothing, in its logarithm.
const WALL: f64 = 0.5;

/// How surely the constants of a rough arm that is described are about as large as its noise.
const ROUGH_SPREAD: f64 = 0.7;
/// Metres or radians that are as good as none in an arm that misses by a tenth of a degree.
const NOTHING: f64 = 1e-7;

impl Level {
    /// Of a constant of an arm: where to begin and what is believed if the arm is like others, and how large it is in one
    /// that is rough, per roughness. How rough that is its noise shows, and constants are in proportion.
    pub(super) fn of_arm(name: &'static str, roughness: f64, usual: (f64, LevelPrior), rough: f64) -> Self {
        if roughness > 1.0 {
            return Self {
                name,
                start: rough * roughness,
                prior: LevelPrior::Known { spread: ROUGH_SPREAD, nothing: NOTHING },
            };
        }
        Self { name, start: usual.0, prior: usual.1 }
    }

    /// The level at which its component is as good as absent.
    pub(super) fn nothing(&self) -> f64 {
        match self.prior {
            LevelPrior::Deviation { nothing, .. } | LevelPrior::Known { nothing, .. } => nothing,
            LevelPrior::Ratio { .. } => self.start,
        }
    }

    /// Minus the logarithm of the prior density of the logarithm `t`, its slope and its curvature.
    pub(super) fn penalty(&self, t: f64) -> (f64, f64, f64) {
        match self.prior {
            LevelPrior::Ratio { spread } | LevelPrior::Known { spread, .. } => {
                let z = (t - self.start.ln()) / spread;
                (0.5 * z * z, z / spread, spread.powi(-2))
            }
            LevelPrior::Deviation { size, exponent, tail, nothing } => {
                let relative = t.exp() / size;
                let share = relative / (1.0 + relative);
                let drawn = relative / (LEAST + relative);
                let below = (nothing.ln() - t).max(0.0) / WALL;
                (
                    tail * relative.ln_1p() - exponent * (relative / LEAST).ln_1p() + 0.5 * below * below,
                    tail * share - exponent * drawn - below / WALL,
                    tail * share * (1.0 - share) - exponent * drawn * (1.0 - drawn)
                        + if below > 0.0 { WALL.powi(-2) } else { 0.0 },
                )
            }
        }
    }
}
