//! Slope and curvature of the restricted likelihood in the levels.
//!
//! The slope in a level with `dV` is `1/2 (tr(P dV) - y' P dV P y)`; the curvature is taken as that of the average of
//! observed and expected information (Gilmour, Thompson and Cullis 1995).

use nalgebra::{DMatrix, DVector};

use super::mixed::{Evaluation, Mixed, Whitened};
use super::products::{Accumulate, Product, RowProducts, TOGETHER};
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
        let Evaluation { slope, curvature, theta, .. } = evaluation;
        let terms = self.noises.len() + self.priors.len();
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
        // A root of the covariance, theta and the deviations side by side: rows times them give what is needed of the
        // rows.
        let wide = (n + 1 + self.priors.len()).next_multiple_of(MAX_LANES);
        let mut matrix = factor.inverse_root(wide);
        for (line, theta) in matrix.chunks_exact_mut(wide).zip(theta.iter()) {
            line[n] = *theta;
        }
        for (j, (p, u)) in self.priors.iter().zip(&deviations).enumerate() {
            for (i, value) in p.range().zip(u) {
                matrix[i * wide + n + 1 + j] = *value;
            }
        }
        let (acts, mut slopes) = self.acts(whitened, noise, &matrix, wide);
        // B' V^-1 dV P y of each term, and the products of what they do.
        let across = terms.next_multiple_of(MAX_LANES);
        let mut pulled = vec![0.0; n.next_multiple_of(TOGETHER) * across];
        let (left, width) = (&whitened.rows[..], self.width);
        let onto = Accumulate { left, width, size: n, right: &acts, across, upper: false, sum: &mut pulled };
        dispatch(self.unit, onto);
        let mut products = vec![0.0; terms.next_multiple_of(TOGETHER) * across];
        dispatch(self.unit, Accumulate::pairs(&acts, across, terms, &mut products));
        for (i, (p, s)) in self.priors.iter().zip(prior).enumerate() {
            let weight = s.powi(-2);
            let u = DVector::from_column_slice(&deviations[i]);
            let mu = p.times(u.as_slice());
            let root = |i: usize| &matrix[i * wide + i..i * wide + n];
            let trace: f64 = match &p.information {
                None => p.range().map(|i| root(i).iter().map(|x| x * x).sum::<f64>()).sum(),
                Some(m) => {
                    let of = DMatrix::from_fn(p.count, n, |i, j| matrix[(p.first + i) * wide + j]);
                    m.dot(&(&of * of.transpose()))
                }
            };
            let squared: f64 = u.iter().zip(&mu).map(|(a, b)| a * b).sum();
            let at = self.noises.len() + i;
            slopes[at] += p.count as f64 - weight * (trace + squared);
            // What the pixels say of these parameters counts as observations too.
            for (j, other) in self.priors.iter().enumerate().take(i + 1) {
                let between = self.given.view((p.first, other.first), (p.count, other.count));
                let v = DVector::from_column_slice(&deviations[j]);
                products[(self.noises.len() + j) * across + at] += 4.0 * u.dot(&(between * v));
            }
            let given = self.given.columns(p.first, p.count) * u;
            for (line, given) in pulled.chunks_exact_mut(across).zip(given.iter()) {
                line[at] -= 2.0 * given;
            }
        }
        let mut solved = vec![0.0; n.next_multiple_of(TOGETHER) * across];
        let rows = &pulled[..n * across];
        let by_root = Accumulate {
            left: &matrix,
            width: wide,
            size: n,
            right: rows,
            across,
            upper: false,
            sum: &mut solved,
        };
        dispatch(self.unit, by_root);
        let mut absorbed = vec![0.0; products.len()];
        dispatch(self.unit, Accumulate::pairs(&solved[..n * across], across, terms, &mut absorbed));
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

    /// `dV P y` of each term, whitened, in the rows of the stations; of each noise, twice its slope. Side by side in the
    /// matrix, `wide` across: a root of the covariance of the parameters, theta, and deviations from each prior.
    fn acts(&self, whitened: &Whitened, noise: &[f64], matrix: &[f64], wide: usize) -> (Vec<f64>, Vec<f64>) {
        let n = self.size;
        let terms = self.noises.len() + self.priors.len();
        let across = terms.next_multiple_of(MAX_LANES);
        let mut slopes = vec![0.0; terms];
        let mut all = vec![0.0; whitened.rows.len() / self.width * across];
        let (mut rest, mut rest_acts) = (&whitened.rows[..], &mut all[..]);
        let columns = self.roots_across();
        let all_roots = self.whiten(&whitened.factors, |station| &station.roots, columns);
        let mut rest_roots = &all_roots[..];
        let (mut through, mut spread, mut turned) = (vec![], vec![], vec![]);
        for station in &self.stations {
            let size = station.size;
            if size == 0 {
                continue;
            }
            let (rows, after) = rest.split_at(size * self.width);
            let (acts, acts_after) = rest_acts.split_at_mut(size * across);
            let (roots, roots_after) = rest_roots.split_at(size * columns);
            (rest, rest_acts, rest_roots) = (after, acts_after, roots_after);
            through.clear();
            through.resize(size * wide, 0.0);
            spread.clear();
            spread.resize(size * size, 0.0);
            let product =
                Product { rows, width: self.width, matrix, across: wide, triangular: n, out: &mut through };
            dispatch(self.unit, product);
            // Whitened P y.
            let mut q = Vec::with_capacity(size);
            for ((row, through), acts) in rows
                .chunks_exact(self.width)
                .zip(through.chunks_exact_mut(wide))
                .zip(acts.chunks_exact_mut(across))
            {
                q.push(row[n] + through[n]);
                for (act, moved) in acts[self.noises.len()..terms].iter_mut().zip(&through[n + 1..]) {
                    *act = -2.0 * moved;
                }
                // Of the root alone the products are wanted.
                through[n..].fill(0.0);
            }
            let products =
                RowProducts { left: &through, across: wide, right: &through, width: wide, out: &mut spread };
            dispatch(self.unit, products);
            if columns == 0 {
                continue;
            }
            turned.clear();
            turned.resize(roots.len(), 0.0);
            let product = Product {
                rows: &spread,
                width: size,
                matrix: roots,
                across: columns,
                triangular: 0,
                out: &mut turned,
            };
            dispatch(self.unit, product);
            let mut along = vec![0.0; columns];
            let mut traces = vec![0.0; columns];
            for ((root, turned), q) in roots.chunks_exact(columns).zip(turned.chunks_exact(columns)).zip(&q) {
                for (c, (root, turned)) in root.iter().zip(turned).enumerate() {
                    along[c] += root * q;
                    traces[c] += root * (root - turned);
                }
            }
            for (root, acts) in roots.chunks_exact(columns).zip(acts.chunks_exact_mut(across)) {
                let mut first = 0;
                for ((x, s), act) in self.noises.iter().zip(noise).zip(acts) {
                    let range = first..first + x.columns;
                    first = range.end;
                    let moved: f64 = root[range.clone()].iter().zip(&along[range]).map(|(a, b)| a * b).sum();
                    *act = 2.0 * s * s * moved;
                }
            }
            let mut first = 0;
            for ((x, s), slope) in self.noises.iter().zip(noise).zip(&mut slopes) {
                let range = first..first + x.columns;
                first = range.end;
                let squared: f64 = along[range.clone()].iter().map(|a| a * a).sum();
                *slope += s * s * (traces[range].iter().sum::<f64>() - squared);
            }
        }
        (all, slopes)
    }
}
