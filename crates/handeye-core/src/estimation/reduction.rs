//! Stations of several measurements as the six rows that the arm moves.
//!
//! All that the arm does wrong at a station is a twist of its flange. In units of the pixels' noise the rows of its
//! measurements are turned so that the first six carry that twist and the others do not: these have the same noise at
//! all levels, and are summed once. What cameras say of each other is in them, free of the arm: as far as the twists are
//! linear, so chains are linearised where the arm is found to have stood.

use nalgebra::{DMatrix, DVector, Vector6};

use super::assembly::{in_one, square};
use super::mixed::{Mixed, Station, add, covariances};
use super::products::{Accumulate, Product, TOGETHER};
use super::recurring::squared;
use crate::simd::dispatch;

/// Components of a twist.
const TWIST: usize = 6;

impl Mixed {
    /// The same likelihood of all levels, of six rows at most where measurements are of pictures; `None` where a
    /// covariance of pixels is singular.
    pub fn reduced(mut self) -> Option<Self> {
        let n = self.told;
        let mut free = Vec::new();
        for k in 0..self.stations.len() {
            let station = &self.stations[k];
            if station.size <= TWIST {
                continue;
            }
            let factor = station.pixels.clone().cholesky()?;
            self.settled.constant += 2.0 * factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>();
            let mut turn = DMatrix::identity(station.size, station.size);
            factor.l_dirty().solve_lower_triangular_unchecked_mut(&mut turn);
            let arm = (&turn * &station.arm).qr();
            arm.q_tr_mul(&mut turn);
            let mut rows = vec![0.0; station.rows.len()];
            let by_rows = turn.transpose();
            let product = Product {
                rows: by_rows.as_slice(),
                width: station.size,
                matrix: &station.rows,
                across: self.width,
                out: &mut rows,
            };
            dispatch(self.unit, product);
            free.extend(rows.drain(TWIST * self.width..));
            for noise in &mut self.noises {
                noise.roots[k] = turn.rows(0, TWIST) * &noise.roots[k];
                noise.squares[k] = square(&noise.roots[k]);
            }
            let of: Vec<&DMatrix<f64>> = self.noises.iter().map(|x| &x.roots[k]).collect();
            let station = Station {
                size: TWIST,
                rows,
                roots: in_one(TWIST, &of),
                pixels: DMatrix::identity(TWIST, TWIST),
                arm: arm.r(),
                reduced: true,
            };
            for prior in self.priors.iter_mut().filter(|p| p.recurring) {
                let columns = station.columns(prior, self.width);
                prior.squares[k] = square(&columns) * squared(&prior.functions[k]);
            }
            self.stations[k] = station;
        }
        if !free.is_empty() {
            self.covariances = covariances(&self.stations, &self.noises, &self.priors);
        }
        let mut sum = vec![0.0; (n + 1).next_multiple_of(TOGETHER) * self.width];
        // What recurs is of the arm and not in them.
        dispatch(self.unit, Accumulate::pairs(&free, self.width, self.lead, n + 1, &mut sum));
        for (i, row) in sum.chunks_exact(self.width).enumerate().take(n) {
            let row = &row[self.lead..];
            self.given_right[i] -= row[n];
            for (j, value) in row[..n].iter().enumerate().skip(i) {
                self.settled.information[(i, j)] = *value;
                self.settled.information[(j, i)] = *value;
            }
        }
        self.given += &self.settled.information;
        self.settled.rows = free.len() / self.width;
        self.settled.constant += sum[n * self.width + self.lead + n];
        Some(self)
    }

    /// By which twist the flange stood elsewhere than reported at each reduced station, elsewhere none: what its
    /// residuals show at levels `exp(t)` and parameters theta, or, where these are not known, all that they can show.
    pub fn flange_twists(&self, found: Option<(&DVector<f64>, &DVector<f64>)>) -> Vec<Vector6<f64>> {
        let twist = |(k, station): (usize, &Station)| -> Option<Vector6<f64>> {
            if !station.reduced {
                return None;
            }
            let rows = station.rows.chunks_exact(self.width).map(|row| &row[self.lead..]);
            let shown = match found {
                None => DVector::from_iterator(TWIST, rows.map(|row| row[self.told])),
                Some((t, theta)) => {
                    let arm = self.arm_covariance(k, t);
                    let left = |row: &[f64]| -> f64 {
                        row[self.told] + row.iter().zip(theta.iter()).map(|(b, x)| b * x).sum::<f64>()
                    };
                    let left = DVector::from_iterator(TWIST, rows.map(left));
                    &arm * (&arm + &station.pixels).cholesky()?.solve(&left)
                }
            };
            let twist = station.arm.solve_upper_triangular(&shown)?;
            Some(-Vector6::from_column_slice(twist.as_slice()))
        };
        self.stations.iter().enumerate().map(|of| twist(of).unwrap_or_default()).collect()
    }

    /// Covariance of what the arm does new at a station, what recurs included.
    fn arm_covariance(&self, k: usize, t: &DVector<f64>) -> DMatrix<f64> {
        let mut arm = DMatrix::zeros(TWIST, TWIST);
        for x in &self.noises {
            add(&mut arm, Self::deviation(&x.levels, t).powi(2), &x.squares[k]);
        }
        for p in self.priors.iter().filter(|p| p.recurring) {
            add(&mut arm, Self::deviation(&p.levels, t).powi(2), &p.squares[k]);
        }
        arm
    }
}
