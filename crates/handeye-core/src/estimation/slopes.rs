//! Slope and curvature of the restricted likelihood in the levels.
//!
//! The slope in a level with `dV` is `1/2 (tr(P dV) - y' P dV P y)`; the curvature is taken as that of the average of
//! observed and expected information (Gilmour, Thompson and Cullis 1995).

use nalgebra::{DMatrix, DVector};

use super::acts::Acts;
use super::mixed::{Evaluation, Mixed, Prior, Whitened};
use super::normal_equations::Sums;
use super::products::{Accumulate, TOGETHER};
use super::recurring::FUNCTIONS;
use crate::positive::Factor;
use crate::simd::{MAX_LANES, dispatch};

impl Mixed {
    /// Slope and curvature.
    pub(super) fn differentiate(
        &self,
        whitened: &Whitened,
        factor: &Factor,
        (noise, prior): (&[f64], &[f64]),
        evaluation: &mut Evaluation,
    ) {
        let n = self.size;
        let Evaluation { slope, curvature, .. } = evaluation;
        let terms = self.noises.len() + self.priors.len();
        let theta = -DVector::from_vec(factor.solution());
        // Deviations of the parameters from their priors.
        let of_prior = |p: &Prior| {
            let mut u = theta.rows_range(self.place(p)).into_owned();
            if let Some(mean) = &p.mean {
                u -= mean;
            }
            u
        };
        let deviations: Vec<DVector<f64>> = self.priors.iter().map(of_prior).collect();
        // A root of the covariance, theta and the deviations side by side: rows times them give what is needed of the
        // rows.
        let wide = (n + 1 + self.priors.len()).next_multiple_of(MAX_LANES);
        let mut matrix = factor.inverse_root(wide);
        for (line, theta) in matrix.chunks_exact_mut(wide).zip(theta.iter()) {
            line[n] = *theta;
        }
        for (j, (p, u)) in self.priors.iter().zip(&deviations).enumerate() {
            for (i, value) in self.place(p).zip(u.iter()) {
                matrix[i * wide + n + 1 + j] = *value;
            }
        }
        let columns = self.roots_across();
        let roots = &self.whiten(&whitened.factors, |station| &station.roots, columns)[..];
        let acts = Acts { mixed: self, rows: &whitened.rows, roots, columns, noise, matrix: &matrix, wide };
        let (acts, mut slopes) = dispatch(self.unit, acts);
        // B' V^-1 dV P y of each term, and the products of what they do.
        let across = terms.next_multiple_of(MAX_LANES);
        let mut pulled = vec![0.0; n.next_multiple_of(TOGETHER) * across];
        let (of_recurring, of_told) = pulled.split_at_mut(FUNCTIONS * self.twists * across);
        let rows = &whitened.rows[..];
        let sums = Sums { rows: of_recurring, width: across, to: 0 };
        if self.twists > 0 {
            let of_twists = self.each_station(rows, (&acts, across), 0, false);
            self.over_stations(&of_twists, across, 0..across, false, sums);
        }
        let onto = Accumulate {
            left: rows,
            width: self.width,
            first: self.lead,
            size: self.told,
            right: &acts,
            across,
            from: 0,
            upper: false,
            sum: &mut *of_told,
        };
        dispatch(self.unit, onto);
        let mut products = vec![0.0; terms.next_multiple_of(TOGETHER) * across];
        dispatch(self.unit, Accumulate::pairs(&acts, across, 0, terms, &mut products));
        for (i, (p, s)) in self.priors.iter().zip(prior).enumerate() {
            let weight = s.powi(-2);
            let place = self.place(p);
            let root = |i: usize| &matrix[i * wide..i * wide + n];
            let trace: f64 = match &p.information {
                None => place.clone().map(|i| dot(&root(i)[i..], &root(i)[i..])).sum(),
                Some(m) => {
                    let row = |i: usize| root(place.start + i);
                    let of = DMatrix::from_fn(p.count, p.count, |i, j| {
                        let from = place.start + i.max(j);
                        m[(i, j)] * dot(&row(i)[from..], &row(j)[from..])
                    });
                    of.sum()
                }
            };
            let u = &deviations[i];
            let squared = u.dot(&p.times(u));
            let at = self.noises.len() + i;
            slopes[at] += place.len() as f64 - weight * (trace + squared);
            if p.recurring {
                continue;
            }
            // What the pixels say of these parameters counts as observations too.
            for (j, other) in self.priors.iter().enumerate().take(i + 1).filter(|(_, p)| !p.recurring) {
                let between = self.given.view((p.first, other.first), (p.count, other.count));
                products[(self.noises.len() + j) * across + at] += 4.0 * u.dot(&(between * &deviations[j]));
            }
            let given = self.given.columns(p.first, p.count) * u;
            for (line, given) in of_told.chunks_exact_mut(across).zip(given.iter()) {
                line[at] -= 2.0 * given;
            }
        }
        let mut solved = vec![0.0; n.next_multiple_of(TOGETHER) * across];
        let by_root = Accumulate {
            left: &matrix,
            width: wide,
            first: 0,
            size: n,
            right: &pulled[..n * across],
            across,
            from: 0,
            upper: false,
            sum: &mut solved,
        };
        dispatch(self.unit, by_root);
        let mut absorbed = vec![0.0; products.len()];
        dispatch(self.unit, Accumulate::pairs(&solved[..n * across], across, 0, terms, &mut absorbed));
        evaluation.theta = theta.rows_range(n - self.told..).into_owned();
        let of = |i: usize| -> &[usize] {
            if i < self.noises.len() {
                &self.noises[i].levels
            } else {
                &self.priors[i - self.noises.len()].levels
            }
        };
        for i in 0..terms {
            for l in of(i) {
                slope[*l] += slopes[i];
                // d2V = 2 dV, of which the average information knows nothing.
                for m in of(i) {
                    curvature[(*l, *m)] += 2.0 * slopes[i];
                }
            }
            for j in 0..=i {
                let entry = 0.5 * (products[j * across + i] - absorbed[j * across + i]);
                for l in of(i) {
                    for m in of(j) {
                        curvature[(*l, *m)] += entry;
                        if i != j {
                            curvature[(*m, *l)] += entry;
                        }
                    }
                }
            }
        }
    }

    /// Where the parameters of a prior stand among all.
    fn place(&self, p: &Prior) -> std::ops::Range<usize> {
        if p.recurring {
            return FUNCTIONS * p.first..FUNCTIONS * (p.first + p.count);
        }
        let first = FUNCTIONS * self.twists + p.first;
        first..first + p.count
    }
}

/// Sum of products.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; MAX_LANES];
    let (mut a, mut b) = (a.chunks_exact(MAX_LANES), b.chunks_exact(MAX_LANES));
    for (a, b) in a.by_ref().zip(b.by_ref()) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    let rest = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b);
    sums.into_iter().chain(rest).sum()
}
