//! From components of the error to the terms of the mixed model.

use nalgebra::{DMatrix, DVector};

use super::cell::Cell;
use super::component::{Component, Effect};
use super::linearisation::{Linearisation, Rows};
use super::mixed::{Mixed, Noise, Prior, Settled, Station, covariances};
use super::recurring::{FUNCTIONS, squared};
use crate::positive::Block;
use crate::simd::{MAX_LANES, VectorUnit};

impl Prior {
    /// Of new parameters with columns of their own, whose place is not known yet.
    fn of_columns(
        of: &'static str,
        levels: Vec<usize>,
        columns: &[DMatrix<f64>],
        functions: Vec<Block>,
    ) -> Self {
        let count = columns.first().map_or(0, DMatrix::ncols);
        let squares = columns.iter().zip(&functions).map(|(m, f)| square(m) * squared(f)).collect();
        let recurring = !functions.is_empty();
        Self { of, levels, first: 0, count, information: None, mean: None, recurring, functions, squares }
    }
}

/// `m m'`.
pub(super) fn square(m: &DMatrix<f64>) -> DMatrix<f64> {
    // Of few columns.
    let mut sum = DMatrix::zeros(m.nrows(), m.nrows());
    for column in m.column_iter() {
        sum.ger(1.0, &column, &column, 1.0);
    }
    sum
}

/// Matrices of as many rows, row by row, padded to whole vectors.
pub(super) fn in_one(rows: usize, all: &[&DMatrix<f64>]) -> Vec<f64> {
    let across = all.iter().map(|m| m.ncols()).sum::<usize>().next_multiple_of(MAX_LANES);
    let mut out = vec![0.0; rows * across];
    for (r, row) in out.chunks_exact_mut(across.max(1)).enumerate() {
        for (entry, from) in row.iter_mut().zip(all.iter().flat_map(|m| m.row(r).into_iter())) {
            *entry = *from;
        }
    }
    out
}

impl Mixed {
    /// A linearised cell with its components; `weak` is information and right side of what is believed of the poses.
    pub fn new(
        linearisation: &Linearisation,
        components: &[Box<dyn Component + '_>],
        weak: (&DMatrix<f64>, &DVector<f64>),
        cell: &Cell,
    ) -> Self {
        let mut levels = Vec::new();
        let mut owners = Vec::new();
        let (mut noises, mut priors, mut constants) = (Vec::new(), Vec::new(), Vec::new());
        let mut blocks: Vec<(Prior, Vec<DMatrix<f64>>)> = Vec::new();
        for component in components {
            let first = levels.len();
            levels.extend(component.levels());
            owners.push((component.name(), first..levels.len()));
            for term in component.terms(cell, linearisation) {
                let of: Vec<usize> = term.levels.iter().map(|l| first + l).collect();
                match term.effect {
                    Effect::Noise(roots) => {
                        let squares = roots.iter().map(square).collect();
                        let columns = roots.first().map_or(0, DMatrix::ncols);
                        noises.push(Noise { of: component.name(), levels: of, roots, columns, squares });
                    }
                    Effect::Constant(columns) => {
                        blocks.push((Prior::of_columns(component.name(), of, &columns, vec![]), columns));
                    }
                    Effect::Recurring { columns, functions } => {
                        blocks.push((Prior::of_columns(component.name(), of, &columns, functions), columns));
                    }
                    Effect::Prior { first, information, mean } => priors.push(Prior {
                        of: component.name(),
                        levels: of,
                        first,
                        count: mean.len(),
                        information: Some(information),
                        mean: Some(mean),
                        recurring: false,
                        functions: vec![],
                        squares: vec![],
                    }),
                }
            }
        }
        let poses = linearisation.information.nrows();
        let (mut told, mut twists) = (poses, 0);
        for (prior, _) in &mut blocks {
            let next = if prior.recurring { &mut twists } else { &mut told };
            prior.first = *next;
            *next += prior.count;
            if !prior.recurring {
                constants.push((prior.of, prior.range()));
            }
        }
        let lead = twists.next_multiple_of(MAX_LANES);
        let width = (lead + told + 1).next_multiple_of(MAX_LANES);
        let of_station = |(k, from): (usize, &Rows)| {
            let size = from.e.len();
            let mut rows = vec![0.0; size * width];
            for (r, row) in rows.chunks_exact_mut(width).enumerate() {
                for (prior, columns) in &blocks {
                    let first = if prior.recurring { 0 } else { lead } + prior.first;
                    for (entry, column) in row[first..].iter_mut().zip(columns[k].row(r).iter()) {
                        *entry = *column;
                    }
                }
                for (entry, column) in row[lead..].iter_mut().zip(from.b.row(r).iter()) {
                    *entry = *column;
                }
                row[lead + told] = from.e[r];
            }
            let of: Vec<&DMatrix<f64>> = noises.iter().map(|x: &Noise| &x.roots[k]).collect();
            Station {
                size,
                rows,
                roots: in_one(size, &of),
                pixels: from.pixels.clone(),
                arm: from.flange.clone(),
                reduced: false,
            }
        };
        let stations: Vec<Station> = linearisation.stations.iter().enumerate().map(of_station).collect();
        priors.extend(blocks.into_iter().map(|(prior, _)| prior));
        let mut given = DMatrix::zeros(told, told);
        let mut given_right = DVector::zeros(told);
        given.view_mut((0, 0), (poses, poses)).copy_from(&(&linearisation.information + weak.0));
        given_right.rows_mut(0, poses).copy_from(&(&linearisation.gradient + weak.1));
        Self {
            levels,
            size: FUNCTIONS * twists + told,
            told,
            twists,
            components: owners,
            constants,
            lead,
            width,
            covariances: covariances(&stations, &noises, &priors),
            stations,
            noises,
            priors,
            given,
            given_right,
            settled: Settled { rows: 0, information: DMatrix::zeros(told, told), constant: 0.0 },
            unit: VectorUnit::widest(),
        }
    }
}
