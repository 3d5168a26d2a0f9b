//! What the robot's error may be: on which side, and how large.

use crate::least_squares::Side;

/// How errors of different views hang together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nature {
    /// Another error in each view.
    White,
    /// An error that changes smoothly with the posture. Needs [`super::SmoothError`].
    Smooth,
    /// Joints displaced on their links, by these levels each. Needs [`super::LinkErrors`].
    Links,
}

/// One point of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hypothesis {
    /// Where the error acts; `None`: the robot is exact.
    pub side: Option<Side>,
    /// Standard deviation per axis, metres.
    pub translation_m: f64,
    /// Standard deviation per axis, radians.
    pub rotation_rad: f64,
    /// How the errors of different views hang together.
    pub nature: Nature,
    /// Share of the variance of displaced joints that is another in each view: encoders, play, bending.
    pub own_share: f64,
    /// Standard deviation of the noise of the joints, radians; zero for none. Needs [`super::JointErrors`].
    pub joint_rad: f64,
    /// Standard deviation of the offsets of the joints, radians; meaningless without [`super::JointErrors`].
    pub offset_rad: f64,
    /// Logarithm of its prior probability.
    pub log_prior: f64,
}

impl Hypothesis {
    /// An exact robot.
    pub fn exact(log_prior: f64) -> Self {
        Self {
            side: None,
            translation_m: 0.0,
            rotation_rad: 0.0,
            nature: Nature::White,
            own_share: 0.0,
            joint_rad: 0.0,
            offset_rad: EXACT_OFFSET_RAD,
            log_prior,
        }
    }

    /// Twists of these standard deviations on a side of the motion.
    pub fn twists(side: Side, translation_m: f64, rotation_rad: f64, log_prior: f64) -> Self {
        Self { side: Some(side), translation_m, rotation_rad, ..Self::exact(log_prior) }
    }

    /// Noise of the joints.
    pub fn joints(joint_rad: f64, log_prior: f64) -> Self {
        Self { joint_rad, ..Self::exact(log_prior) }
    }

    /// Joints displaced on their links by these standard deviations per axis.
    pub fn links(translation_m: f64, rotation_rad: f64, own_share: f64, log_prior: f64) -> Self {
        let nature = Nature::Links;
        Self { translation_m, rotation_rad, nature, own_share, ..Self::exact(log_prior) }
    }

    /// Whether the noise is the same, whatever the offsets.
    pub(super) fn same_noise(&self, other: &Self) -> bool {
        (self.side, self.translation_m, self.rotation_rad, self.nature, self.own_share, self.joint_rad)
            == (
                other.side,
                other.translation_m,
                other.rotation_rad,
                other.nature,
                other.own_share,
                other.joint_rad,
            )
    }
}

/// Offsets so small that there are none, but that keep the information finite.
pub const EXACT_OFFSET_RAD: f64 = 1e-7;

/// Log-normal priors of the levels of joint errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointPrior {
    /// Noise of the joints.
    pub noise: LogNormal,
    /// Offsets of the joints.
    pub offset: LogNormal,
    /// Prior probability that there are no offsets.
    pub no_offset_probability: f64,
}

/// A log-normal prior on a grid of equal ratios.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogNormal {
    /// Median.
    pub median: f64,
    /// Standard deviation of the logarithm.
    pub spread: f64,
    /// Smallest and largest value of the grid, and how many.
    pub grid: (f64, f64, usize),
}

impl LogNormal {
    /// Values with the logarithms of their probabilities, which sum to one.
    fn values(&self) -> Vec<(f64, f64)> {
        let (low, high, n) = self.grid;
        let values = geometric(low, high, n);
        let log = |value: f64| -0.5 * ((value / self.median).ln() / self.spread).powi(2);
        let total: f64 = values.iter().map(|v| log(*v).exp()).sum();
        values.into_iter().map(|v| (v, log(v) - total.ln())).collect()
    }
}

impl Default for JointPrior {
    fn default() -> Self {
        let degrees = f64::to_radians;
        let noise =
            LogNormal { median: degrees(0.01), spread: 1.5, grid: (degrees(2.5e-4), degrees(0.25), 13) };
        let offset = LogNormal { median: degrees(0.03), spread: 1.0, grid: (degrees(4e-3), degrees(0.5), 7) };
        Self { noise, offset, no_offset_probability: 1.0 / 3.0 }
    }
}

impl JointPrior {
    /// Every hypothesis about the noise with every level of the offsets; one noise after another.
    ///
    /// Displaced joints may be turned about their axes too, which is an offset: they stand for themselves.
    pub fn with_offsets(&self, noise: &[Hypothesis]) -> Vec<Hypothesis> {
        let mut offsets = vec![(EXACT_OFFSET_RAD, self.no_offset_probability.ln())];
        let share = (1.0 - self.no_offset_probability).ln();
        offsets.extend(self.offset.values().into_iter().map(|(value, log)| (value, log + share)));
        offsets.retain(|(_, log)| log.is_finite());
        noise
            .iter()
            .flat_map(|h| {
                let (levels, share) = if h.nature == Nature::Links {
                    (&offsets[..1], -offsets[0].1)
                } else {
                    (&offsets[..], 0.0)
                };
                levels.iter().map(move |(offset_rad, log)| Hypothesis {
                    offset_rad: *offset_rad,
                    log_prior: h.log_prior + log + share,
                    ..*h
                })
            })
            .collect()
    }
}

/// Log-normal prior of the levels: of the rotation, and of the length by which it turns into translation.
///
/// An arm's pose error is mostly joint error times reach, so translation and rotation are tied by a length of the
/// order of the arm; the level itself is nearly free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelPrior {
    /// Median of the rotation level, radians.
    pub rotation_median_rad: f64,
    /// Standard deviation of its logarithm.
    pub rotation_spread: f64,
    /// Median of translation over rotation, metres.
    pub lever_median_m: f64,
    /// Standard deviation of its logarithm.
    pub lever_spread: f64,
    /// Smallest and largest rotation level of the grid, radians, and how many.
    pub rotation_grid: (f64, f64, usize),
    /// Smallest and largest lever of the grid, metres, and how many.
    pub lever_grid: (f64, f64, usize),
    /// Prior probability that the robot is exact.
    pub exact_probability: f64,
    /// How much likelier an error on one side is smooth than another in each view; zero leaves smooth ones out.
    pub smooth_odds: f64,
    /// As `rotation_grid`, of smooth errors: they need more work, and less resolution.
    pub smooth_rotation_grid: (f64, f64, usize),
    /// As `lever_grid`, of smooth errors.
    pub smooth_lever_grid: (f64, f64, usize),
}

/// Prior odds of smooth errors where the postures are known. What is smooth shows itself within a few views; before,
/// the odds keep white errors from looking less certain than they are.
pub const SMOOTH_ODDS: f64 = 0.03;

impl Default for LevelPrior {
    fn default() -> Self {
        Self {
            rotation_median_rad: 0.02_f64.to_radians(),
            rotation_spread: 2.0,
            lever_median_m: 1.0,
            lever_spread: 0.5,
            rotation_grid: (5e-4_f64.to_radians(), 0.3_f64.to_radians(), 12),
            lever_grid: (0.3, 10.0, 6),
            exact_probability: 1.0 / 3.0,
            smooth_odds: 0.0,
            smooth_rotation_grid: (1e-3_f64.to_radians(), 0.3_f64.to_radians(), 9),
            smooth_lever_grid: (0.4, 2.5, 3),
        }
    }
}

/// What of the error of displaced joints may be another in each view, equally likely.
const OWN_SHARES: [f64; 3] = [0.003, 0.04, 0.5];

impl LevelPrior {
    /// Of the joints of an arm, displaced on their links: a lever is metres of displacement per radian of tilt.
    pub fn of_links() -> Self {
        Self {
            rotation_median_rad: 0.03_f64.to_radians(),
            rotation_spread: 1.5,
            lever_median_m: 0.5,
            lever_spread: 1.0,
            rotation_grid: (3e-3_f64.to_radians(), 0.4_f64.to_radians(), 8),
            lever_grid: (0.15, 2.0, 3),
            ..Self::default()
        }
    }
}

/// `n` values from `low` to `high` with equal ratios.
fn geometric(low: f64, high: f64, n: usize) -> Vec<f64> {
    let step = if n > 1 { (high / low).ln() / (n - 1) as f64 } else { 0.0 };
    (0..n).map(|i| low * (step * i as f64).exp()).collect()
}

impl LevelPrior {
    /// Rotation levels and levers with the logarithms of their probabilities, which sum to one.
    fn levels(&self, rotations: (f64, f64, usize), levers: (f64, f64, usize)) -> Vec<(f64, f64, f64)> {
        let mut levels = Vec::new();
        for rotation in geometric(rotations.0, rotations.1, rotations.2) {
            for lever in geometric(levers.0, levers.1, levers.2) {
                let a = (rotation / self.rotation_median_rad).ln() / self.rotation_spread;
                let b = (lever / self.lever_median_m).ln() / self.lever_spread;
                levels.push((rotation, lever, -0.5 * (a * a + b * b)));
            }
        }
        let total = levels.iter().map(|l| l.2.exp()).sum::<f64>().ln();
        for level in &mut levels {
            level.2 -= total;
        }
        levels
    }

    /// The grid over both sides; probabilities sum to one.
    pub fn grid(&self) -> Vec<Hypothesis> {
        self.grid_of(&[Side::Left, Side::Right])
    }

    /// The grid over the given sides, equally likely; probabilities sum to one.
    pub fn grid_of(&self, sides: &[Side]) -> Vec<Hypothesis> {
        self.grid_with(sides, None, None)
    }

    /// As [`LevelPrior::grid_of`]; noise of the joints and displaced joints, where known how they act, are each as
    /// likely as either side.
    pub fn grid_with(
        &self,
        sides: &[Side],
        joints: Option<&LogNormal>,
        links: Option<&LevelPrior>,
    ) -> Vec<Hypothesis> {
        let white = self.levels(self.rotation_grid, self.lever_grid);
        let smooth = self.levels(self.smooth_rotation_grid, self.smooth_lever_grid);
        let mut grid = Vec::with_capacity(1 + (white.len() + smooth.len()) * sides.len());
        if self.exact_probability > 0.0 {
            grid.push(Hypothesis::exact(self.exact_probability.ln()));
        }
        let kinds = sides.len() + usize::from(joints.is_some()) + usize::from(links.is_some());
        let each = ((1.0 - self.exact_probability) / kinds as f64).ln();
        let smooth_share = self.smooth_odds / (1.0 + self.smooth_odds);
        for side in sides {
            grid.extend(white.iter().map(|(rotation, lever, log)| {
                Hypothesis::twists(*side, rotation * lever, *rotation, log + each + (1.0 - smooth_share).ln())
            }));
        }
        if self.smooth_odds > 0.0 {
            for side in sides {
                grid.extend(smooth.iter().map(|(rotation, lever, log)| Hypothesis {
                    nature: Nature::Smooth,
                    ..Hypothesis::twists(*side, rotation * lever, *rotation, log + each + smooth_share.ln())
                }));
            }
        }
        if let Some(joints) = joints {
            let values = joints.values();
            grid.extend(values.into_iter().map(|(rad, log)| Hypothesis::joints(rad, log + each)));
        }
        if let Some(links) = links {
            let levels = links.levels(links.rotation_grid, links.lever_grid);
            let log_count = (OWN_SHARES.len() as f64).ln();
            grid.extend(levels.into_iter().flat_map(|(rotation, lever, log)| {
                let log = log + each - log_count;
                OWN_SHARES.map(|own| Hypothesis::links(rotation * lever, rotation, own, log))
            }));
        }
        grid
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_sum_to_one() {
        let grid = LevelPrior::default().grid();
        let total: f64 = grid.iter().map(|h| h.log_prior.exp()).sum();
        assert!((total - 1.0).abs() < 1e-12);
        assert_eq!(grid.len(), 1 + 2 * 72);
    }

    #[test]
    fn probabilities_with_joints_sum_to_one() {
        let prior = JointPrior::default();
        let links = LevelPrior::of_links();
        let sides = [Side::Left, Side::Right];
        let noise = LevelPrior::default().grid_with(&sides, Some(&prior.noise), Some(&links));
        let by_kind = |wanted: fn(&Hypothesis) -> bool| -> f64 {
            noise.iter().filter(|h| wanted(h)).map(|h| h.log_prior.exp()).sum()
        };
        assert!((by_kind(|h| h.joint_rad > 0.0) - 1.0 / 6.0).abs() < 1e-12);
        assert!((by_kind(|h| h.nature == Nature::Links) - 1.0 / 6.0).abs() < 1e-12);
        assert!((by_kind(|h| h.side == Some(Side::Right)) - 1.0 / 6.0).abs() < 1e-12);
        let grid = prior.with_offsets(&noise);
        assert_eq!(grid.len(), (1 + 2 * 72 + 13) * 8 + 3 * 24);
        let total: f64 = grid.iter().map(|h| h.log_prior.exp()).sum();
        assert!((total - 1.0).abs() < 1e-12);
        let exact: f64 =
            grid.iter().filter(|h| h.offset_rad == EXACT_OFFSET_RAD).map(|h| h.log_prior.exp()).sum();
        assert!((exact - (1.0 / 6.0 + 5.0 / 6.0 / 3.0)).abs() < 1e-12);
    }
}
