//! The answer where errors come again that no residual shows.

use nalgebra::{DMatrix, DVector};

use super::mixed::{Evaluation, Mixed};
use super::normal_equations::Sums;
use super::products::{Accumulate, TOGETHER};
use super::recurring::{FUNCTIONS, squared};
use crate::positive::Factor;
use crate::simd::{MAX_LANES, dispatch};

impl Mixed {
    /// The answer as if recurring errors were new at every station, with its covariance under the model as it is: the
    /// sandwich of a working model (Huber 1967, White 1980). Given are deviations of noises and priors, and information and
    /// right side without the stations.
    pub(super) fn answer_apart(
        &self,
        (noise, prior): (&[f64], &[f64]),
        (mut information, mut right): (DMatrix<f64>, DVector<f64>),
        evaluation: &mut Evaluation,
    ) -> Option<()> {
        let (p, width) = (self.told, self.width);
        let (whitened, _) = self.whitened(noise, Some(prior))?;
        let rows = &whitened.rows[..];
        let narrow = p.next_multiple_of(MAX_LANES);
        let mut products = self.each_station(rows, (rows, width), self.lead, false);
        let mut shared = vec![0.0; FUNCTIONS * self.twists * narrow];
        let sums = Sums { rows: &mut shared, width: narrow, to: 0 };
        self.over_stations(&products, width, self.lead..self.lead + p, false, sums);
        for (q, s) in self.priors.iter().zip(prior).filter(|(q, _)| q.recurring) {
            let lines = FUNCTIONS * q.first * narrow..FUNCTIONS * (q.first + q.count) * narrow;
            for entry in &mut shared[lines] {
                *entry *= s;
            }
            for (of_station, f) in products.chunks_exact_mut(self.twists * width).zip(&q.functions) {
                let size = s * squared(f).sqrt();
                let lines = &mut of_station[q.first * width..(q.first + q.count) * width];
                for entry in lines {
                    *entry *= size;
                }
            }
        }
        // What recurs is the same at all stations, and not new at each.
        let mut once = vec![0.0; p.next_multiple_of(TOGETHER) * narrow];
        dispatch(self.unit, Accumulate::pairs(&shared, narrow, 0, p, &mut once));
        let mut again = vec![0.0; p.next_multiple_of(TOGETHER) * width];
        dispatch(self.unit, Accumulate::pairs(&products, width, self.lead, p, &mut again));
        let sum = self.sum_told(rows);
        for i in 0..p {
            let row = &sum[i * width + self.lead..];
            right[i] -= row[p];
            for j in i..p {
                information[(i, j)] += row[j];
                information[(j, i)] = information[(i, j)];
            }
        }
        let meat = DMatrix::from_fn(p, p, |i, j| {
            let (first, last) = (i.min(j), i.max(j));
            information[(i, j)] + once[first * narrow + last] - again[first * width + self.lead + last]
        });
        let bread = Factor::new(&information)?.inverse();
        evaluation.covariance = &bread * meat * &bread;
        evaluation.theta = bread * right;
        evaluation.information = information;
        Some(())
    }
}
