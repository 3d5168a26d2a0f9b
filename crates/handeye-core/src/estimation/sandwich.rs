//! The answer where errors come again that no residual shows.

use nalgebra::DMatrix;

use super::mixed::{Evaluation, Mixed, add};
use super::products::{Accumulate, Product, TOGETHER};
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
        let n = self.size;
        let (whitened, _) = self.whitened(noise, Some(prior))?;
        let rows = &whitened.rows[..];
        let mut sum = vec![0.0; p.next_multiple_of(TOGETHER) * self.width];
        dispatch(self.unit, Accumulate::pairs(rows, self.width, p, &mut sum));
        let shared = DMatrix::from_fn(p, recurring, |i, j| sum[i * self.width + p + j] * scales[j]);
        // What the recurring errors of each station do to the answer, of their covariance there.
        let narrow = p.next_multiple_of(MAX_LANES);
        let mut told = vec![0.0; rows.len() / self.width * narrow];
        for (to, row) in told.chunks_exact_mut(narrow).zip(rows.chunks_exact(self.width)) {
            to.copy_from_slice(&row[..narrow]);
        }
        let mut moved = vec![0.0; told.len()];
        let mut first = 0;
        for (k, (station, factor)) in self.stations.iter().zip(&whitened.factors).enumerate() {
            let end = first + station.size * narrow;
            let covariance = self.recurring_at(k, prior, factor);
            let product = Product {
                rows: covariance.as_slice(),
                width: station.size,
                matrix: &told[first..end],
                across: narrow,
                out: &mut moved[first..end],
            };
            if station.size > 0 {
                dispatch(self.unit, product);
            }
            first = end;
        }
        let mut own = vec![0.0; p.next_multiple_of(TOGETHER) * narrow];
        let both = Accumulate {
            left: &told,
            width: narrow,
            size: p,
            right: &moved,
            across: narrow,
            upper: true,
            sum: &mut own,
        };
        dispatch(self.unit, both);
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

    /// Covariance of the recurring errors of a station in units of its noise, whose Cholesky factor is given.
    fn recurring_at(&self, k: usize, prior: &[f64], factor: &DMatrix<f64>) -> DMatrix<f64> {
        let mut covariance = DMatrix::zeros(factor.nrows(), factor.nrows());
        for (q, s) in self.priors.iter().zip(prior).filter(|(q, _)| q.recurring) {
            add(&mut covariance, s * s, &q.squares[k]);
        }
        factor.solve_lower_triangular_unchecked_mut(&mut covariance);
        covariance.transpose_mut();
        factor.solve_lower_triangular_unchecked_mut(&mut covariance);
        covariance
    }
}
