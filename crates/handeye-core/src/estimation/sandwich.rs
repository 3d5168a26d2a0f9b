//! The answer where errors come again that no residual shows.

use nalgebra::DMatrix;

use super::mixed::{Evaluation, Mixed};
use super::products::{Accumulate, TOGETHER};
use super::station_covariances::{Between, StationFactors};
use crate::positive::Factor;
use crate::simd::{MAX_LANES, dispatch};

impl Mixed {
    /// The answer as if recurring errors were new at every station, with its covariance under the model as it is: the
    /// sandwich of a working model (Huber 1967, White 1980). Given are the factors of the stations' covariances without
    /// what recurs.
    pub(super) fn answer_apart(
        &self,
        alone: &StationFactors,
        noise: &[f64],
        prior: &[f64],
        evaluation: &mut Evaluation,
    ) -> Option<()> {
        let p = self.told;
        let mut information = self.given.view((0, 0), (p, p)).into_owned();
        let mut right = self.given_right.rows(0, p).into_owned();
        for (q, s) in self.priors.iter().zip(prior).filter(|(q, _)| !q.recurring) {
            Self::add_prior(q, *s, &mut information, &mut right);
        }
        let recurring = self.size - p;
        let mut scales = vec![0.0; recurring];
        for (q, s) in self.priors.iter().zip(prior).filter(|(q, _)| q.recurring) {
            scales[q.first - p..q.first - p + q.count].fill(*s);
        }
        let n = self.size;
        let (whitened, _) = self.whitened(noise, Some(prior))?;
        let rows = &whitened.rows[..];
        let mut sum = vec![0.0; p.next_multiple_of(TOGETHER) * self.width];
        dispatch(self.unit, Accumulate::pairs(rows, self.width, p, &mut sum));
        let shared = DMatrix::from_fn(p, recurring, |i, j| sum[i * self.width + p + j] * scales[j]);
        // Without what recurs the rows are less than of unit noise: what is between them then.
        let narrow = p.next_multiple_of(MAX_LANES);
        let mut left = vec![0.0; self.rows() * narrow];
        let between = Between {
            factors: &whitened.factors,
            others: alone,
            sizes: &self.covariances.sizes,
            rows,
            width: self.width,
            narrow,
            out: &mut left,
        };
        dispatch(self.unit, between);
        let mut own = vec![0.0; p.next_multiple_of(TOGETHER) * narrow];
        dispatch(self.unit, Accumulate::pairs(&left, narrow, p, &mut own));
        for i in 0..p {
            right[i] -= sum[i * self.width + n];
            for j in i..p {
                let value = sum[i * self.width + j];
                information[(i, j)] += value;
                if i != j {
                    information[(j, i)] += value;
                }
            }
        }
        let bread = Factor::new(&information)?.inverse();
        let theta = &bread * right;
        let recurs = |i: usize, j: usize| own[i * narrow + j] - sum[i * self.width + j];
        let meat = &shared * shared.transpose() + DMatrix::from_fn(p, p, |i, j| recurs(i.min(j), i.max(j)));
        evaluation.covariance = &bread + &bread * meat * &bread;
        evaluation.theta = theta;
        evaluation.information = information;
        Some(())
    }
}
