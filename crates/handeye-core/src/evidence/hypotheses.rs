//! What the robot's error may be: on which side, and how large.

use crate::least_squares::Side;

/// One point of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hypothesis {
    /// Where the error acts; `None`: the robot is exact.
    pub side: Option<Side>,
    /// Standard deviation per axis, metres.
    pub translation_m: f64,
    /// Standard deviation per axis, radians.
    pub rotation_rad: f64,
    /// Logarithm of its prior probability.
    pub log_prior: f64,
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
}

impl Default for LevelPrior {
    fn default() -> Self {
        Self {
            rotation_median_rad: 0.02_f64.to_radians(),
            rotation_spread: 2.0,
            lever_median_m: 3.0,
            lever_spread: 0.5,
            rotation_grid: (5e-4_f64.to_radians(), 0.3_f64.to_radians(), 12),
            lever_grid: (0.3, 10.0, 6),
            exact_probability: 1.0 / 3.0,
        }
    }
}

/// `n` values from `low` to `high` with equal ratios.
fn geometric(low: f64, high: f64, n: usize) -> Vec<f64> {
    let step = if n > 1 { (high / low).ln() / (n - 1) as f64 } else { 0.0 };
    (0..n).map(|i| low * (step * i as f64).exp()).collect()
}

impl LevelPrior {
    /// The grid over both sides; probabilities sum to one.
    pub fn grid(&self) -> Vec<Hypothesis> {
        self.grid_of(&[Side::Left, Side::Right])
    }

    /// The grid over the given sides, equally likely; probabilities sum to one.
    pub fn grid_of(&self, sides: &[Side]) -> Vec<Hypothesis> {
        let mut levels = Vec::new();
        let (low, high, n) = self.rotation_grid;
        for rotation in geometric(low, high, n) {
            let (low, high, n) = self.lever_grid;
            for lever in geometric(low, high, n) {
                let a = (rotation / self.rotation_median_rad).ln() / self.rotation_spread;
                let b = (lever / self.lever_median_m).ln() / self.lever_spread;
                levels.push((rotation, lever, -0.5 * (a * a + b * b)));
            }
        }
        let total: f64 = levels.iter().map(|l| l.2.exp()).sum();
        let mut grid = Vec::with_capacity(1 + levels.len() * sides.len());
        if self.exact_probability > 0.0 {
            grid.push(Hypothesis {
                side: None,
                translation_m: 0.0,
                rotation_rad: 0.0,
                log_prior: self.exact_probability.ln(),
            });
        }
        let share = ((1.0 - self.exact_probability) / sides.len() as f64).ln() - total.ln();
        for side in sides {
            grid.extend(levels.iter().map(|(rotation, lever, log_prior)| Hypothesis {
                side: Some(*side),
                translation_m: rotation * lever,
                rotation_rad: *rotation,
                log_prior: log_prior + share,
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
}
