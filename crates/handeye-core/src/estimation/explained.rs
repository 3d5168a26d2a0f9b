//! What each component of the error explains.

use nalgebra::DVector;

use super::mixed::{Mixed, Prior, Wanted};
use super::recurring::squared;

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
        let (factors, _) = self.covariances.factorised(self.unit, &vec![0.0; self.noises.len()], None)?;
        let rows = self.whiten(&factors, |station| &station.rows, self.width);
        let across = self.roots_across();
        let roots = self.whiten(&factors, |station| &station.roots, across);
        let mut first = 0;
        for x in &self.noises {
            let range = first..first + x.columns;
            first = range.end;
            let squared: f64 =
                roots.chunks_exact(across).flat_map(|row| &row[range.clone()]).map(|v| v * v).sum();
            add(x.of, Self::deviation(&x.levels, t).powi(2) * squared);
        }
        for p in &self.priors {
            if p.recurring {
                // What it is here is not told; what it may be is.
                let sizes = self.stations.iter().zip(&p.functions);
                let sizes = sizes.flat_map(|(station, f)| std::iter::repeat_n(squared(f), station.size));
                let of = rows.chunks_exact(self.width).zip(sizes);
                let moved =
                    |(row, size): (&[f64], f64)| row[p.range()].iter().map(|v| v * v).sum::<f64>() * size;
                add(p.of, Self::deviation(&p.levels, t).powi(2) * of.map(moved).sum::<f64>());
            } else {
                let values = Self::deviation_from(p, theta);
                let moved = |row: &[f64]| row.iter().zip(values.iter()).map(|(b, x)| b * x).sum::<f64>();
                let of = rows.chunks_exact(self.width).map(|row| &row[self.lead..][p.range()]);
                add(p.of, of.map(|row| moved(row).powi(2)).sum());
            }
        }
        for p in self.priors.iter().filter(|p| !p.recurring) {
            let moved = Self::deviation_from(p, theta);
            let of = self.settled.information.view((p.first, p.first), (p.count, p.count));
            add(p.of, moved.dot(&(of * &moved)));
        }
        let count = (self.rows() + self.settled.rows) as f64;
        for (_, sum) in &mut sums {
            *sum /= count;
        }
        Some(sums)
    }

    /// By how much parameters are away from their prior's mean.
    fn deviation_from(p: &Prior, theta: &DVector<f64>) -> DVector<f64> {
        let values = theta.rows(p.first, p.count).into_owned();
        p.mean.as_ref().map_or_else(|| values.clone(), |mean| &values - mean)
    }
}
