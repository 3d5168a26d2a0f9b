//! Slope and curvature of the restricted likelihood in the levels.
//!
//! The slope in a level with `dV` is `1/2 (tr(P dV) - y' P dV P y)`; the curvature is taken as that of the average of
//! observed and expected information (Gilmour, Thompson and Cullis 1995).

use nalgebra::{DMatrix, DVector};

use super::mixed::{Evaluation, Mixed, Whitened};
use super::products::product_with;

impl Mixed {
    /// Slope and curvature.
    pub(super) fn differentiate(
        &self,
        whitened: &Whitened,
        noise: &[f64],
        prior: &[f64],
        evaluation: &mut Evaluation,
    ) {
        let n = self.size;
        let Evaluation { slope, curvature, theta, covariance, .. } = evaluation;
        let terms = self.noises.len() + self.priors.len();
        // dV P y of each term, whitened, and B' V^-1 of it.
        let mut pulled = vec![vec![0.0; n]; terms];
        let mut products = DMatrix::<f64>::zeros(terms, terms);
        let mut slopes = vec![0.0; terms];
        // Deviations of the parameters from their priors.
        let deviations: Vec<Vec<f64>> = self
            .priors
            .iter()
            .map(|p| {
                let mut u = theta.as_slice()[p.range()].to_vec();
                if let Some(mean) = &p.mean {
                    u.iter_mut().zip(mean.iter()).for_each(|(u, m)| *u -= m);
                }
                u
            })
            .collect();
        let mut rest = &whitened.rows[..];
        for (k, factor) in whitened.factors.iter().enumerate() {
            let size = self.stations[k].size;
            let (rows, after) = rest.split_at(size * self.width);
            rest = after;
            let b = DMatrix::from_row_slice(size, self.width, rows);
            let bs = DMatrix::from_vec(size, n, product_with(self.unit, rows, self.width, size, covariance));
            let b_of = b.columns(0, n);
            let spread = &bs * b_of.transpose();
            // Whitened P y.
            let q = b.column(n) + b_of * &*theta;
            let mut acts: Vec<DVector<f64>> = Vec::with_capacity(terms);
            for (j, (x, s)) in self.noises.iter().zip(noise).enumerate() {
                let mut root = x.roots[k].clone();
                factor.solve_lower_triangular_mut(&mut root);
                let along = root.tr_mul(&q);
                let trace = root.norm_squared() - (&spread * &root).dot(&root);
                slopes[j] += s * s * (trace - along.norm_squared());
                acts.push(&root * along * (2.0 * s * s));
            }
            for (p, u) in self.priors.iter().zip(&deviations) {
                acts.push(b_of.columns(p.first, p.count) * DVector::from_column_slice(u) * -2.0);
            }
            for i in 0..terms {
                for j in 0..=i {
                    products[(i, j)] += acts[i].dot(&acts[j]);
                }
                let onto = b_of.tr_mul(&acts[i]);
                pulled[i].iter_mut().zip(onto.iter()).for_each(|(a, b)| *a += b);
            }
        }
        for (i, (p, s)) in self.priors.iter().zip(prior).enumerate() {
            let weight = s.powi(-2);
            let u = &deviations[i];
            let mu = p.times(u);
            let block = covariance.view((p.first, p.first), (p.count, p.count));
            let trace = match &p.information {
                None => block.trace(),
                Some(m) => m.dot(&block),
            };
            let squared: f64 = u.iter().zip(&mu).map(|(a, b)| a * b).sum();
            let at = self.noises.len() + i;
            slopes[at] += p.count as f64 - weight * (trace + squared);
            // What the pixels say of these parameters counts as observations too.
            for (j, other) in self.priors.iter().enumerate().take(i + 1) {
                let between = self.given.view((p.first, other.first), (p.count, other.count));
                let v = DVector::from_column_slice(&deviations[j]);
                let product = 4.0 * DVector::from_column_slice(u).dot(&(between * v));
                products[(at, self.noises.len() + j)] += product;
            }
            let onto = self.given.columns(p.first, p.count) * DVector::from_column_slice(u) * -2.0;
            pulled[at].iter_mut().zip(onto.iter()).for_each(|(a, b)| *a += b);
        }
        let pulled: Vec<DVector<f64>> = pulled.into_iter().map(DVector::from_vec).collect();
        let solved: Vec<DVector<f64>> = pulled.iter().map(|v| &*covariance * v).collect();
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
                let entry = 0.5 * (products[(i, j)] - pulled[i].dot(&solved[j]));
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
}
