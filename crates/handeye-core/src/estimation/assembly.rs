//! From components of the error to the terms of the mixed model.

use nalgebra::{DMatrix, DVector};

use super::cell::Cell;
use super::component::{Component, Effect};
use super::linearisation::Linearisation;
use super::mixed::{Mixed, Noise, Prior, Settled, Station, covariances};
use crate::simd::{MAX_LANES, VectorUnit};

impl Prior {
    /// Of new parameters with columns of their own, whose place is not known yet.
    fn of_columns(of: &'static str, levels: Vec<usize>, columns: &[DMatrix<f64>], recurring: bool) -> Self {
        let count = columns.first().map_or(0, DMatrix::ncols);
        let squares = if recurring { columns.iter().map(square).collect() } else { vec![] };
        Self { of, levels, first: 0, count, information: None, mean: None, recurring, squares }
    }
}

/// `m m'`.
pub(super) fn square(m: &DMatrix<f64>) -> DMatrix<f64> {
    m * m.transpose()
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
                        blocks.push((Prior::of_columns(component.name(), of, &columns, false), columns));
                    }
                    Effect::Recurring(columns) => {
                        blocks.push((Prior::of_columns(component.name(), of, &columns, true), columns));
                    }
                    Effect::Prior { first, information, mean } => priors.push(Prior {
                        of: component.name(),
                        levels: of,
                        first,
                        count: mean.len(),
                        information: Some(information),
                        mean: Some(mean),
                        recurring: false,
                        squares: vec![],
                    }),
                }
            }
        }
        // Recurring parameters come last: the answer does not name them.
        blocks.sort_by_key(|(prior, _)| prior.recurring);
        let poses = linearisation.information.nrows();
        let mut size = poses;
        let mut told = poses;
        for (prior, _) in &mut blocks {
            prior.first = size;
            constants.push((prior.of, prior.range()));
            size += prior.count;
            if !prior.recurring {
                told = size;
            }
        }
        let width = (size + 1).next_multiple_of(MAX_LANES);
        let stations: Vec<Station> = linearisation
            .stations
            .iter()
            .enumerate()
            .map(|(k, from)| {
                let rows_of = from.e.len();
                let mut rows = vec![0.0; rows_of * width];
                for (r, row) in rows.chunks_exact_mut(width).enumerate() {
                    for (j, entry) in row[..poses].iter_mut().enumerate() {
                        *entry = from.b[(r, j)];
                    }
                    let mut at = poses;
                    for (_, columns) in &blocks {
                        for j in 0..columns[k].ncols() {
                            row[at] = columns[k][(r, j)];
                            at += 1;
                        }
                    }
                    row[size] = from.e[r];
                }
                let of: Vec<&DMatrix<f64>> = noises.iter().map(|x: &Noise| &x.roots[k]).collect();
                Station {
                    size: rows_of,
                    rows,
                    roots: in_one(rows_of, &of),
                    pixels: from.pixels.clone(),
                    arm: from.flange.clone(),
                    reduced: false,
                }
            })
            .collect();
        priors.extend(blocks.into_iter().map(|(prior, _)| prior));
        let mut given = DMatrix::zeros(size, size);
        let mut given_right = DVector::zeros(size);
        given.view_mut((0, 0), (poses, poses)).copy_from(&(&linearisation.information + weak.0));
        given_right.rows_mut(0, poses).copy_from(&(&linearisation.gradient + weak.1));
        Self {
            levels,
            size,
            told,
            components: owners,
            constants,
            width,
            covariances: covariances(&stations, &noises, &priors),
            stations,
            noises,
            priors,
            given,
            given_right,
            settled: Settled { rows: 0, information: DMatrix::zeros(size, size), constant: 0.0 },
            unit: VectorUnit::widest(),
        }
    }
}
