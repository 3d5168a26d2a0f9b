//! Stations of several measurements as the six rows that the arm moves.
//!
//! All that the arm does wrong at a station is a twist of its flange. In units of the pixels' noise the rows of its
//! measurements are turned so that the first six carry that twist and the others do not: these have the same noise at
//! all levels, and are summed once. What cameras say of each other is in them, free of the arm.

use nalgebra::DMatrix;

use super::assembly::{in_one, square};
use super::mixed::{Mixed, Station};
use super::products::{Accumulate, Product, TOGETHER};
use crate::simd::dispatch;

/// Components of a twist.
const TWIST: usize = 6;

impl Mixed {
    /// The same likelihood of all levels, of six rows at most where measurements are of pictures; `None` where a
    /// covariance of pixels is singular.
    pub fn reduced(mut self) -> Option<Self> {
        let n = self.size;
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
            };
            for prior in self.priors.iter_mut().filter(|p| p.recurring) {
                prior.squares[k] = square(&station.columns(prior, self.width));
            }
            self.stations[k] = station;
        }
        let mut sum = vec![0.0; (n + 1).next_multiple_of(TOGETHER) * self.width];
        dispatch(self.unit, Accumulate::pairs(&free, self.width, n + 1, &mut sum));
        for (i, row) in sum.chunks_exact(self.width).enumerate().take(n) {
            self.given_right[i] -= row[n];
            for (j, value) in row[..n].iter().enumerate().skip(i) {
                self.settled.information[(i, j)] = *value;
                self.settled.information[(j, i)] = *value;
            }
        }
        self.given += &self.settled.information;
        self.settled.rows = free.len() / self.width;
        self.settled.constant += sum[n * self.width + n];
        Some(self)
    }
}
