//! The answer where errors come again that no residual shows.

use nalgebra::DMatrix;

use super::mixed::{Evaluation, Mixed};
use super::products::{Accumulate, TOGETHER};
use crate::positive::Factor;
use crate::simd::{MAX_LANES, dispatch};

impl Mixed {
    /// The answer as if recurring errors were new at every station, with its covariance under the model as it is: the
    /// sandwich of a working model (Huber 1967, White 1980).
    pub(super) fn answer_apart(
        &self,
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
        let mut shared = DMatrix::<f64>::zeros(p, recurring);
        let narrow = p.next_multiple_of(MAX_LANES);
        let tall = p.next_multiple_of(TOGETHER);
        let mut own = vec![0.0; tall * narrow];
        let mut sum = vec![0.0; tall * self.width];
        let n = self.size;
        let (whitened, _) = self.whitened(noise, Some(prior))?;
        let rows = &whitened.rows;
        dispatch(self.unit, Accumulate::pairs(rows, self.width, p, &mut sum));
        // What the recurring errors of each station do to the answer, a row for each of them.
        let mut by_station = vec![0.0; self.stations.len() * recurring * narrow];
        let mut here = vec![0.0; tall * self.width];
        let mut first = 0;
        for (station, by_station) in self.stations.iter().zip(by_station.chunks_exact_mut(recurring * narrow))
        {
            let end = first + station.size * self.width;
            here.fill(0.0);
            let rows = &whitened.rows[first..end];
            dispatch(self.unit, Accumulate::pairs(rows, self.width, p, &mut here));
            first = end;
            for ((j, scale), row) in scales.iter().enumerate().zip(by_station.chunks_exact_mut(narrow)) {
                for (i, entry) in row[..p].iter_mut().enumerate() {
                    *entry = here[i * self.width + p + j] * scale;
                    shared[(i, j)] += *entry;
                }
            }
        }
        dispatch(self.unit, Accumulate::pairs(&by_station, narrow, p, &mut own));
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
        let own = DMatrix::from_fn(p, p, |i, j| own[i.min(j) * narrow + i.max(j)]);
        let meat = &shared * shared.transpose() - own;
        evaluation.covariance = &bread + &bread * meat * &bread;
        evaluation.theta = theta;
        evaluation.information = information;
        Some(())
    }
}
