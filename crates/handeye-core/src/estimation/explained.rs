//! What each component of the error explains.

use nalgebra::{DMatrix, DVector};

use super::mixed::{Mixed, Prior, Wanted};

impl Mixed {
    /// The penalised likelihood without a component: its deviations at nothing, its ratios at their start.
    pub fn value_without(&self, names: &[&str], t: &DVector<f64>) -> Option<f64> {
        let mut without = t.clone();
        for (_, range) in self.components.iter().filter(|(name, _)| names.contains(name)) {
            for l in range.clone() {
                without[l] = self.levels[l].nothing().ln();
            }
        }
        let penalty = |t: &DVector<f64>| -> f64 {
            self.levels.iter().zip(t.iter()).map(|(level, t)| level.penalty(*t).0).sum()
        };
        // Likelihoods are compared: what is believed of the levels has no say.
        Some(self.evaluate(&without, Wanted::Value)?.value - penalty(&without) + penalty(t))
    }

    /// How much each component moves the measurements: mean square of their displacement in standard deviations of the
    /// pixels, per degree of freedom, at levels `exp(t)` and parameters theta.
    pub fn misfit(&self, t: &DVector<f64>, theta: &DVector<f64>) -> Option<Vec<(&'static str, f64)>> {
        let mut sums: Vec<(&'static str, f64)> =
            self.components.iter().map(|(name, _)| (*name, 0.0)).collect();
        let mut add = |of: &str, value: f64| {
            for (name, sum) in &mut sums {
                if *name == of {
                    *sum += value;
                }
            }
        };
        let mut rows = self.settled.rows;
        for (k, station) in self.stations.iter().enumerate() {
            rows += station.size;
            let factor = station.pixels.clone().cholesky()?;
            for x in &self.noises {
                let mut root = x.roots[k].clone();
                factor.l_dirty().solve_lower_triangular_mut(&mut root);
                add(x.of, Self::deviation(&x.levels, t).powi(2) * root.norm_squared());
            }
            for p in &self.priors {
                let mut moved = if p.recurring {
                    // What it is here is not told; what it may be is.
                    station.columns(p, self.width) * Self::deviation(&p.levels, t)
                } else {
                    let values = Self::deviation_from(p, theta);
                    DMatrix::from_column_slice(
                        station.size,
                        1,
                        (station.columns(p, self.width) * values).as_slice(),
                    )
                };
                factor.l_dirty().solve_lower_triangular_mut(&mut moved);
                add(p.of, moved.norm_squared());
            }
        }
        for p in self.priors.iter().filter(|p| !p.recurring) {
            let moved = Self::deviation_from(p, theta);
            let of = self.settled.information.view((p.first, p.first), (p.count, p.count));
            add(p.of, moved.dot(&(of * &moved)));
        }
        for (_, sum) in &mut sums {
            *sum /= rows as f64;
        }
        Some(sums)
    }

    /// By how much parameters are away from their prior's mean.
    fn deviation_from(p: &Prior, theta: &DVector<f64>) -> DVector<f64> {
        let values = theta.rows(p.first, p.count).into_owned();
        p.mean.as_ref().map_or_else(|| values.clone(), |mean| &values - mean)
    }
}
