//! Information of all parameters: coefficients of what recurs first, then those of the answer.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::mixed::Mixed;
use super::products::{Accumulate, TOGETHER};
use super::recurring::{EachStation, FUNCTIONS, OverStations};
use crate::positive::Block;
use crate::simd::{MAX_LANES, dispatch};

/// Rows of sums, `width` apart, and in which of their columns those begin that are summed as they are.
pub(super) struct Sums<'a> {
    pub rows: &'a mut [f64],
    pub width: usize,
    pub to: usize,
}

impl Mixed {
    /// Values of the functions at the stations, for each column of what recurs.
    pub(super) fn functions(&self) -> Vec<&[Block]> {
        let of = self.priors.iter().filter(|p| p.recurring);
        of.flat_map(|p| std::iter::repeat_n(&p.functions[..], p.count)).collect()
    }

    /// Products of the columns of what recurs with others from one on, of rows `across` wide, station by station;
    /// where `upper`, of each other only with later ones.
    pub(super) fn each_station(
        &self,
        rows: &[f64],
        (right, across): (&[f64], usize),
        from: usize,
        upper: bool,
    ) -> Vec<f64> {
        let mut products = vec![0.0; self.stations() * self.twists * across];
        let (sizes, width, count) = (&self.covariances.sizes[..], self.width, self.twists);
        dispatch(
            self.unit,
            EachStation { sizes, left: rows, width, count, right, across, from, upper, out: &mut products },
        );
        products
    }

    /// Sums of such products over the stations for all coefficients of what recurs; where `pairs`, with each other before
    /// those with others.
    pub(super) fn over_stations(
        &self,
        products: &[f64],
        across: usize,
        plain: Range<usize>,
        pairs: bool,
        Sums { rows: out, width, to }: Sums<'_>,
    ) {
        let functions = &self.functions()[..];
        dispatch(self.unit, OverStations { functions, products, across, plain, to, pairs, out, width });
    }

    /// What whitened rows add to the information of the answer and, behind it with the sign changed, to the right side:
    /// rows as wide as those, from [`Mixed::lead`] on; last the sum of squares.
    pub(super) fn sum_told(&self, rows: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; (self.told + 1).next_multiple_of(TOGETHER) * self.width];
        dispatch(self.unit, Accumulate::pairs(rows, self.width, self.lead, self.told + 1, &mut sum));
        sum
    }

    /// Upper triangle of the information of all parameters, each row with its right side behind it, with the sign changed;
    /// and the sum of squares of the whitened rows. Given are information and right side of the answer without them, and
    /// the deviations of all priors.
    pub(super) fn system(
        &self,
        rows: &[f64],
        (information, right): (&DMatrix<f64>, &DVector<f64>),
        prior: &[f64],
    ) -> (Vec<Block>, f64) {
        let (told, first) = (self.told, FUNCTIONS * self.twists);
        let width = (first + (told + 1).next_multiple_of(MAX_LANES)).next_multiple_of(MAX_LANES);
        let mut system = vec![[0.0; MAX_LANES]; self.size * width / MAX_LANES];
        let (recurring, answer) = system.as_flattened_mut().split_at_mut(first * width);
        let plain = self.lead..self.lead + told + 1;
        if self.twists > 0 {
            let products = self.each_station(rows, (rows, self.width), 0, true);
            let sums = Sums { rows: &mut *recurring, width, to: first };
            self.over_stations(&products, self.width, plain.clone(), true, sums);
        }
        for (p, s) in self.priors.iter().zip(prior).filter(|(p, _)| p.recurring) {
            for i in FUNCTIONS * p.first..FUNCTIONS * (p.first + p.count) {
                recurring[i * width + i] += s.powi(-2);
            }
        }
        let sum = self.sum_told(rows);
        for (i, (line, row)) in answer.chunks_exact_mut(width).zip(sum.chunks_exact(self.width)).enumerate() {
            let (line, row) = (&mut line[first..=first + told], &row[plain.clone()]);
            line.copy_from_slice(row);
            // Columns of a symmetric matrix are its rows.
            for (entry, given) in line[i..].iter_mut().zip(&information.column(i).as_slice()[i..]) {
                *entry += given;
            }
            line[told] -= right[i];
        }
        (system, sum[told * self.width + self.lead + told])
    }
}
