//! The linear mixed model: its restricted likelihood with slope and curvature, and the answer, at given levels.
//!
//! With `e = -B theta + noise`, noise of covariance `V = blockdiag(V_k)` that is new at every station and a Gaussian
//! prior on `theta`, minus the logarithm of the marginal likelihood is, up to a constant,
//!
//! ```text
//! 1/2 ( ln|V| + ln|prior^-1| + ln|H| + e' V^-1 e + mean' prior mean - b' H^-1 b ),   H = prior + B' V^-1 B
//! ```
//!
//! (Harville 1977). Its slope in a level with `dV` is `1/2 (tr(P dV) - y' P dV P y)`; its curvature is taken as that of
//! the average of observed and expected information (Gilmour, Thompson and Cullis 1995).

use nalgebra::{DMatrix, DVector};

use super::component::Component;
pub(super) use super::component::{Effect, Term};
use super::levels::Level;
use super::linearisation::Linearisation;
use super::products::{Accumulate, TOGETHER, Whiten, product_with};
use crate::positive::Factor;
use crate::simd::{MAX_LANES, VectorUnit, dispatch};

/// A prior on parameters.
#[derive(Clone)]
struct Prior {
    of: &'static str,
    levels: Vec<usize>,
    first: usize,
    count: usize,
    /// `None`: the identity.
    information: Option<DMatrix<f64>>,
    mean: Option<DVector<f64>>,
    recurring: bool,
    /// Of recurring ones: covariances of the stations at a deviation of one.
    squares: Vec<DMatrix<f64>>,
}

impl Prior {
    /// Of new parameters with columns of their own, whose place is not known yet.
    fn of_columns(of: &'static str, levels: Vec<usize>, columns: &[DMatrix<f64>], recurring: bool) -> Self {
        let count = columns.first().map_or(0, DMatrix::ncols);
        let squares = if recurring { columns.iter().map(square).collect() } else { vec![] };
        Self { of, levels, first: 0, count, information: None, mean: None, recurring, squares }
    }

    fn range(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.count
    }

    /// Information times a vector.
    fn times(&self, v: &[f64]) -> Vec<f64> {
        match &self.information {
            None => v.to_vec(),
            Some(m) => (m * DVector::from_column_slice(v)).as_slice().to_vec(),
        }
    }
}

/// `m m'`.
fn square(m: &DMatrix<f64>) -> DMatrix<f64> {
    m * m.transpose()
}

/// Adds a multiple of a matrix of the same shape.
fn add(to: &mut DMatrix<f64>, factor: f64, m: &DMatrix<f64>) {
    for (to, m) in to.as_mut_slice().iter_mut().zip(m.as_slice()) {
        *to += factor * m;
    }
}

#[derive(Clone)]
struct Noise {
    of: &'static str,
    levels: Vec<usize>,
    roots: Vec<DMatrix<f64>>,
    /// Their squares: covariances at a deviation of one.
    squares: Vec<DMatrix<f64>>,
}

/// Rows of all stations in units of their noise.
struct Whitened {
    /// Cholesky factor of the covariance of each.
    factors: Vec<DMatrix<f64>>,
    /// Their rows, one after the other.
    rows: Vec<f64>,
}

/// Rows of a station, as the kernels want them.
#[derive(Clone)]
struct Station {
    size: usize,
    /// `[B e]` row by row, padded to whole vectors.
    rows: Vec<f64>,
    pixels: DMatrix<f64>,
}

/// A cell linearised, with its components.
pub(super) struct Mixed {
    pub levels: Vec<Level>,
    /// Parameters of the answer: poses, cameras, boards, and constants of the arm.
    pub size: usize,
    /// Those of them before the recurring ones.
    pub told: usize,
    /// Names of the components, with the range of their levels.
    pub components: Vec<(&'static str, std::ops::Range<usize>)>,
    /// Names of the components, with the range of their constants.
    pub constants: Vec<(&'static str, std::ops::Range<usize>)>,
    width: usize,
    stations: Vec<Station>,
    noises: Vec<Noise>,
    priors: Vec<Prior>,
    given: DMatrix<f64>,
    given_right: DVector<f64>,
    unit: VectorUnit,
}

/// How much of [`Mixed::evaluate`] is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// The penalised likelihood alone.
    Value,
    /// Its slope and curvature too.
    Slope,
    /// The answer instead of slopes.
    Answer,
}

/// The model at given levels.
pub(super) struct Evaluation {
    /// Minus the logarithm of the posterior density of the levels.
    pub value: f64,
    /// Its slope in the logarithms of the levels.
    pub slope: DVector<f64>,
    /// Its curvature.
    pub curvature: DMatrix<f64>,
    /// The parameters.
    pub theta: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Their information under the working model, where an answer was wanted.
    pub information: DMatrix<f64>,
}

impl Mixed {
    /// A linearised cell with its components; `weak` is information and right side of what is believed of the poses.
    pub fn new(
        linearisation: &Linearisation,
        components: &[Box<dyn Component + '_>],
        weak: (&DMatrix<f64>, &DVector<f64>),
        cell: &super::cell::Cell,
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
                        noises.push(Noise { of: component.name(), levels: of, roots, squares });
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
        let stations = linearisation
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
                Station { size: rows_of, rows, pixels: from.pixels.clone() }
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
            stations,
            noises,
            priors,
            given,
            given_right,
            unit: VectorUnit::widest(),
        }
    }

    /// The same model of some of the stations only; what all pixels say of camera and board stays.
    pub fn among(&self, chosen: &[usize]) -> Self {
        let of = |all: &[DMatrix<f64>]| -> Vec<DMatrix<f64>> {
            chosen.iter().filter_map(|k| all.get(*k)).cloned().collect()
        };
        let noise = |x: &Noise| Noise { roots: of(&x.roots), squares: of(&x.squares), ..x.clone() };
        Self {
            levels: self.levels.clone(),
            components: self.components.clone(),
            constants: self.constants.clone(),
            stations: chosen.iter().map(|k| self.stations[*k].clone()).collect(),
            noises: self.noises.iter().map(noise).collect(),
            priors: self.priors.iter().map(|p| Prior { squares: of(&p.squares), ..p.clone() }).collect(),
            given: self.given.clone(),
            given_right: self.given_right.clone(),
            ..*self
        }
    }

    /// Number of stations.
    pub fn stations(&self) -> usize {
        self.stations.len()
    }

    /// Number of rows of all stations.
    pub fn rows(&self) -> usize {
        self.stations.iter().map(|station| station.size).sum()
    }

    /// Noise of a station's twists at levels `exp(t)`, and what parameters theta with their covariance leave of the
    /// twists: their mean, and the covariance that comes from the parameters alone. Nothing may recur.
    pub fn residual(
        &self,
        k: usize,
        t: &DVector<f64>,
        (theta, covariance): (&DVector<f64>, &DMatrix<f64>),
    ) -> (DMatrix<f64>, DVector<f64>, DMatrix<f64>) {
        let station = &self.stations[k];
        let mut noise = station.pixels.clone();
        for x in &self.noises {
            add(&mut noise, Self::deviation(&x.levels, t).powi(2), &x.squares[k]);
        }
        let rows = DMatrix::from_fn(station.size, self.size, |i, j| station.rows[i * self.width + j]);
        let e = DVector::from_fn(station.size, |i, _| station.rows[i * self.width + self.size]);
        (noise, e + &rows * theta, &rows * covariance * rows.transpose())
    }

    /// Logarithms of the levels to begin with.
    pub fn start(&self) -> DVector<f64> {
        DVector::from_iterator(self.levels.len(), self.levels.iter().map(|l| l.start.ln()))
    }

    fn deviation(levels: &[usize], t: &DVector<f64>) -> f64 {
        levels.iter().map(|l| t[*l]).sum::<f64>().exp()
    }

    /// The model at levels `exp(t)`; `None` where it is singular or not finite.
    pub fn evaluate(&self, t: &DVector<f64>, wanted: Wanted) -> Option<Evaluation> {
        let n = self.size;
        let noise: Vec<f64> = self.noises.iter().map(|x| Self::deviation(&x.levels, t)).collect();
        let prior: Vec<f64> = self.priors.iter().map(|x| Self::deviation(&x.levels, t)).collect();
        let mut sum = vec![0.0; (n + 1).next_multiple_of(TOGETHER) * self.width];
        let mut constant = 0.0;
        let (whitened, log_determinant) = self.whitened(&noise, None)?;
        constant += log_determinant;
        dispatch(
            self.unit,
            Accumulate { rows: &whitened.rows, width: self.width, size: n + 1, sum: &mut sum },
        );
        let entry = |i: usize, j: usize| sum[i.min(j) * self.width + i.max(j)];
        constant += entry(n, n);
        let mut information = self.given.clone();
        let mut right = self.given_right.clone();
        for i in 0..n {
            right[i] -= entry(i, n);
            for j in i..n {
                let value = entry(i, j);
                information[(i, j)] += value;
                if i != j {
                    information[(j, i)] += value;
                }
            }
        }
        for (p, s) in self.priors.iter().zip(&prior) {
            constant += Self::add_prior(p, *s, &mut information, &mut right);
        }
        let factor = Factor::new(&information)?;
        let theta = DVector::from_vec(factor.solve(right.as_slice()));
        constant += factor.log_determinant() - right.dot(&theta);
        let mut value = 0.5 * constant;
        let count = self.levels.len();
        let mut slope = DVector::zeros(count);
        let mut curvature = DMatrix::zeros(count, count);
        for (i, (level, t)) in self.levels.iter().zip(t.iter()).enumerate() {
            let (penalty, first, second) = level.penalty(*t);
            value += penalty;
            slope[i] = first;
            curvature[(i, i)] = second;
        }
        if !value.is_finite() {
            return None;
        }
        let apart = wanted == Wanted::Answer && self.told < n;
        let covariance = match wanted {
            Wanted::Slope => factor.inverse(),
            Wanted::Answer if !apart => factor.inverse(),
            _ => DMatrix::zeros(0, 0),
        };
        let mut evaluation =
            Evaluation { value, slope, curvature, theta, covariance, information: DMatrix::zeros(0, 0) };
        match wanted {
            Wanted::Value => {}
            Wanted::Slope => self.differentiate(&whitened, &noise, &prior, &mut evaluation),
            Wanted::Answer if apart => self.answer_apart(&noise, &prior, &mut evaluation)?,
            Wanted::Answer => evaluation.information = information,
        }
        Some(evaluation)
    }

    /// Adds a prior at deviation `s`; what it adds to twice the value.
    fn add_prior(p: &Prior, s: f64, information: &mut DMatrix<f64>, right: &mut DVector<f64>) -> f64 {
        let weight = s.powi(-2);
        let mut constant = 2.0 * p.count as f64 * s.ln();
        match &p.information {
            None => {
                for i in p.range() {
                    information[(i, i)] += weight;
                }
            }
            Some(m) => {
                let mut view = information.view_mut((p.first, p.first), (p.count, p.count));
                view += m * weight;
            }
        }
        if let Some(mean) = &p.mean {
            let pull = DVector::from_vec(p.times(mean.as_slice())) * weight;
            constant += pull.dot(mean);
            let mut view = right.rows_mut(p.first, p.count);
            view += pull;
        }
        constant
    }

    /// All stations' rows, whitened, and the logarithm of the determinant of their covariances; `prior` as in `factor`.
    fn whitened(&self, noise: &[f64], prior: Option<&[f64]>) -> Option<(Whitened, f64)> {
        let mut all = Whitened { factors: Vec::with_capacity(self.stations.len()), rows: Vec::new() };
        let mut constant = 0.0;
        for (k, station) in self.stations.iter().enumerate() {
            let (factor, log_determinant) = self.factor(station, k, noise, prior)?;
            constant += log_determinant;
            let first = all.rows.len();
            all.rows.extend_from_slice(&station.rows);
            let rows = &mut all.rows[first..];
            dispatch(self.unit, Whiten { factor: &factor, rows, width: self.width });
            all.factors.push(factor);
        }
        Some((all, constant))
    }

    /// Cholesky factor of a station's covariance, and the logarithm of its determinant. With `prior`, recurring errors
    /// count as new at the station.
    fn factor(
        &self,
        station: &Station,
        k: usize,
        noise: &[f64],
        prior: Option<&[f64]>,
    ) -> Option<(DMatrix<f64>, f64)> {
        let mut covariance = station.pixels.clone();
        for (x, s) in self.noises.iter().zip(noise) {
            add(&mut covariance, s * s, &x.squares[k]);
        }
        if let Some(prior) = prior {
            for (p, s) in self.priors.iter().zip(prior).filter(|(p, _)| p.recurring) {
                add(&mut covariance, s * s, &p.squares[k]);
            }
        }
        let factor = covariance.cholesky()?.unpack();
        let log_determinant = 2.0 * factor.diagonal().iter().map(|x| x.ln()).sum::<f64>();
        Some((factor, log_determinant))
    }

    /// Slope and curvature.
    fn differentiate(&self, whitened: &Whitened, noise: &[f64], prior: &[f64], evaluation: &mut Evaluation) {
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

    /// The answer as if recurring errors were new at every station, with its covariance under the model as it is: the
    /// sandwich of a working model (Huber 1967, White 1980).
    fn answer_apart(&self, noise: &[f64], prior: &[f64], evaluation: &mut Evaluation) -> Option<()> {
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
        dispatch(self.unit, Accumulate { rows, width: self.width, size: p, sum: &mut sum });
        // What the recurring errors of each station do to the answer, a row for each of them.
        let mut by_station = vec![0.0; self.stations.len() * recurring * narrow];
        let mut here = vec![0.0; tall * self.width];
        let mut first = 0;
        for (station, by_station) in self.stations.iter().zip(by_station.chunks_exact_mut(recurring * narrow))
        {
            let end = first + station.size * self.width;
            here.fill(0.0);
            let rows = &whitened.rows[first..end];
            dispatch(self.unit, Accumulate { rows, width: self.width, size: p, sum: &mut here });
            first = end;
            for ((j, scale), row) in scales.iter().enumerate().zip(by_station.chunks_exact_mut(narrow)) {
                for (i, entry) in row[..p].iter_mut().enumerate() {
                    *entry = here[i * self.width + p + j] * scale;
                    shared[(i, j)] += *entry;
                }
            }
        }
        dispatch(self.unit, Accumulate { rows: &by_station, width: narrow, size: p, sum: &mut own });
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

    /// Information under the working model.
    pub fn information(&self, t: &DVector<f64>) -> Option<DMatrix<f64>> {
        Some(self.evaluate(t, Wanted::Answer)?.information)
    }
}

impl Mixed {
    /// The penalised likelihood without a component: its deviations at nothing, its ratios at their start.
    pub fn value_without(&self, names: &[&str], t: &DVector<f64>) -> Option<f64> {
        let mut without = t.clone();
        for (_, range) in self.components.iter().filter(|(name, _)| names.contains(name)) {
            for l in range.clone() {
                without[l] = self.levels[l].nothing().ln();
            }
        }
        let penalty = |t: &DVector<f64>| -> f64 {
            self.levels.iter().zip(t.iter()).map(|(level, t)| level.penalty(*t).0).sum()
        };
        // Likelihoods are compared: what is believed of the levels has no say.
        Some(self.evaluate(&without, Wanted::Value)?.value - penalty(&without) + penalty(t))
    }

    /// How much each component moves the measurements: mean square of their displacement in standard deviations of the
    /// pixels, per degree of freedom, at levels `exp(t)` and parameters theta.
    pub fn misfit(&self, t: &DVector<f64>, theta: &DVector<f64>) -> Option<Vec<(&'static str, f64)>> {
        let mut sums: Vec<(&'static str, f64)> =
            self.components.iter().map(|(name, _)| (*name, 0.0)).collect();
        let mut add = |of: &str, value: f64| {
            for (name, sum) in &mut sums {
                if *name == of {
                    *sum += value;
                }
            }
        };
        let mut rows = 0;
        for (k, station) in self.stations.iter().enumerate() {
            rows += station.size;
            let factor = station.pixels.clone().cholesky()?;
            for x in &self.noises {
                let mut root = x.roots[k].clone();
                factor.l_dirty().solve_lower_triangular_mut(&mut root);
                add(x.of, Self::deviation(&x.levels, t).powi(2) * root.norm_squared());
            }
            for p in &self.priors {
                let mut moved = if p.recurring {
                    // What it is here is not told; what it may be is.
                    station.columns(p, self.width) * Self::deviation(&p.levels, t)
                } else {
                    let mut values = theta.rows(p.first, p.count).into_owned();
                    if let Some(mean) = &p.mean {
                        values -= mean;
                    }
                    DMatrix::from_column_slice(
                        station.size,
                        1,
                        (station.columns(p, self.width) * values).as_slice(),
                    )
                };
                factor.l_dirty().solve_lower_triangular_mut(&mut moved);
                add(p.of, moved.norm_squared());
            }
        }
        for (_, sum) in &mut sums {
            *sum /= rows as f64;
        }
        Some(sums)
    }
}

impl Station {
    /// Columns of a prior's parameters.
    fn columns(&self, p: &Prior, width: usize) -> DMatrix<f64> {
        DMatrix::from_fn(self.size, p.count, |i, j| self.rows[i * width + p.first + j])
    }
}
