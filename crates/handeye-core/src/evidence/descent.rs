//! Levenberg-Marquardt on twists between chain and poses from many starts at once, lanes = starts.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]
#![expect(clippy::needless_range_loop, reason = "indices of matrices: several are read at the same place")]

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::chain::WeakPrior;
use super::systems::{eliminate, entries_of, start_of, substitute};
use crate::lanes::{UPPER, entries, load, right_product, store, upper};
use crate::least_squares::through_chain;
use crate::se3::Se3;
use crate::simd::{Kernel, MAX_LANES, Mask, Simd, Vector, VectorUnit, dispatch, sin_cos};

type Row = [f64; MAX_LANES];

const UNKNOWNS: usize = 12;
/// A step that lowers the cost by less, relatively, is the last of its start.
const TOLERANCE: f64 = 1e-9;
/// Damping to begin with, and its limits.
const FIRST_DAMPING: f64 = 1e-3;
const SMALLEST_DAMPING: f64 = 1e-12;
const LARGEST_DAMPING: f64 = 1e6;

/// What all starts share.
pub(super) struct Poses<'a> {
    views: Vec<View>,
    prior: &'a WeakPrior,
}

struct View {
    motion: [f64; 12],
    /// Inverse of the pose.
    back: [f64; 12],
    /// Information of the pose's twist.
    weight: [f64; UPPER],
}

impl<'a> Poses<'a> {
    pub fn new(motions: &[Se3], poses: &[Se3], weights: &[Matrix6<f64>], prior: &'a WeakPrior) -> Self {
        let view = |((motion, pose), weight): ((&Se3, &Se3), &Matrix6<f64>)| {
            let mut triangle = [0.0; UPPER];
            for i in 0..6 {
                for j in i..6 {
                    triangle[upper(i, j)] = weight[(i, j)];
                }
            }
            View { motion: entries(motion), back: entries(&pose.inverse()), weight: triangle }
        };
        Self { views: motions.iter().zip(poses).zip(weights).map(view).collect(), prior }
    }

    /// Takes steps from each start, fewer where it has converged.
    pub fn descend(&self, runs: &mut [Run], steps: usize) {
        for chunk in runs.chunks_mut(MAX_LANES) {
            let mut lanes = Lanes::of(chunk);
            dispatch(VectorUnit::widest(), Descend { poses: self, lanes: &mut lanes, steps });
            for (i, run) in chunk.iter_mut().enumerate() {
                run.x = transform(&lanes.x, i);
                run.y = transform(&lanes.y, i);
                run.cost = lanes.cost[i];
                run.damping = lanes.damping[i];
            }
        }
    }
}

/// Where a start has come to.
pub(super) struct Run {
    pub x: Se3,
    pub y: Se3,
    pub cost: f64,
    damping: f64,
    pub origin: &'static str,
}

impl Run {
    pub fn new(x: Se3, y: Se3, origin: &'static str) -> Self {
        Self { x, y, cost: f64::INFINITY, damping: FIRST_DAMPING, origin }
    }
}

/// Runs side by side.
#[repr(C, align(64))]
struct Lanes {
    x: [Row; 12],
    y: [Row; 12],
    cost: Row,
    damping: Row,
}

impl Lanes {
    /// Lanes without a run repeat the first.
    fn of(runs: &[Run]) -> Self {
        const ZERO: Row = [0.0; MAX_LANES];
        let mut lanes = Self { x: [ZERO; 12], y: [ZERO; 12], cost: ZERO, damping: ZERO };
        for i in 0..MAX_LANES {
            let run = &runs[if i < runs.len() { i } else { 0 }];
            let both = entries(&run.x).into_iter().zip(entries(&run.y));
            for ((x, y), (row_x, row_y)) in both.zip(lanes.x.iter_mut().zip(&mut lanes.y)) {
                (row_x[i], row_y[i]) = (x, y);
            }
            lanes.damping[i] = run.damping;
        }
        lanes
    }
}

fn transform(rows: &[Row; 12], lane: usize) -> Se3 {
    let e: [f64; 12] = std::array::from_fn(|i| rows[i][lane]);
    Se3::new(Matrix3::from_row_slice(&e[..9]), Vector3::from_column_slice(&e[9..]))
}

struct Descend<'a> {
    poses: &'a Poses<'a>,
    lanes: &'a mut Lanes,
    steps: usize,
}

impl Kernel for Descend<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { poses, lanes, steps } = self;
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        let mut here = vec![[zero; 6]; poses.views.len()];
        let mut there = here.clone();
        let mut system = vec![zero; entries_of(UNKNOWNS)];
        for at in (0..MAX_LANES).step_by(S::LANES) {
            let (mut x, mut y) = (load(simd, &lanes.x, at), load(simd, &lanes.y, at));
            let mut damping = simd.load(&lanes.damping[at..]);
            let mut cost = errors(simd, poses, &x, &y, &mut here);
            let mut going = one;
            for _ in 0..steps {
                let delta = step(simd, poses, &x, &here, damping, &mut system);
                let tried_x = product(&exponential(simd, &delta.0), &x);
                let tried_y = product(&exponential(simd, &delta.1), &y);
                let tried = errors(simd, poses, &tried_x, &tried_y, &mut there);
                let active = going.greater(zero);
                let better = cost.at_least(tried) & active;
                let lowered = cost - tried;
                let enough = lowered.at_least(simd.splat(TOLERANCE) * cost);
                for (value, other) in x.iter_mut().zip(tried_x).chain(y.iter_mut().zip(tried_y)) {
                    *value = other.keep_or(better, *value);
                }
                for (error, other) in here.iter_mut().zip(&there) {
                    for i in 0..6 {
                        error[i] = other[i].keep_or(better, error[i]);
                    }
                }
                cost = tried.keep_or(better, cost);
                let relaxed = (damping * simd.splat(0.1)).max(simd.splat(SMALLEST_DAMPING));
                let tightened = -(-(damping * simd.splat(10.0))).max(simd.splat(-LARGEST_DAMPING));
                damping = relaxed.keep_or(better, tightened).keep_or(active, damping);
                // A start that no longer gains by its steps is done; one whose step was refused goes on.
                let gained = lowered.greater(zero) & better;
                going = one.keep(enough).keep_or(gained, one).keep(active);
                if zero.at_least(going).all() {
                    break;
                }
            }
            store(&x, &mut lanes.x, at);
            store(&y, &mut lanes.y, at);
            cost.store(&mut lanes.cost[at..]);
            damping.store(&mut lanes.damping[at..]);
        }
    }
}

/// Twists between chain and poses at `X` and `Y`; the cost there, belief included.
#[inline(always)]
fn errors<S: Simd>(
    simd: S,
    poses: &Poses<'_>,
    x: &[S::Vector; 12],
    y: &[S::Vector; 12],
    out: &mut [[S::Vector; 6]],
) -> S::Vector {
    let mut cost = simd.splat(0.0);
    for i in 0..3 {
        let away = x[9 + i] - simd.splat(poses.prior.x_translation_m[i]);
        cost = away.mul_add(away, cost);
    }
    cost = cost * simd.splat(poses.prior.x_translation_sigma_m.powi(-2));
    for (view, out) in poses.views.iter().zip(out) {
        let chain = product(&right_product(simd, x, &view.motion), y);
        *out = logarithm(simd, &right_product(simd, &chain, &view.back));
        let weighted = weighted(simd, view, out);
        for i in 0..6 {
            cost = out[i].mul_add(weighted[i], cost);
        }
    }
    cost
}

#[inline(always)]
fn weighted<S: Simd>(simd: S, view: &View, error: &[S::Vector; 6]) -> [S::Vector; 6] {
    let mut out = *error;
    for i in 0..6 {
        out[i] = simd.splat(view.weight[upper(i, 0)]) * error[0];
        for j in 1..6 {
            out[i] = simd.splat(view.weight[upper(i, j)]).mul_add(error[j], out[i]);
        }
    }
    out
}

/// Twists of `X` and `Y` of the damped normal equations.
#[inline(always)]
fn step<S: Simd>(
    simd: S,
    poses: &Poses<'_>,
    x: &[S::Vector; 12],
    errors: &[[S::Vector; 6]],
    damping: S::Vector,
    system: &mut [S::Vector],
) -> ([S::Vector; 6], [S::Vector; 6]) {
    let zero = simd.splat(0.0);
    believe(simd, poses.prior, x, system);
    for (view, error) in poses.views.iter().zip(errors) {
        let forward = right_product(simd, x, &view.motion);
        let mut weight = [zero; UPPER];
        for (to, from) in weight.iter_mut().zip(view.weight) {
            *to = simd.splat(from);
        }
        let gradient = weighted(simd, view, error);
        let through = through_chain(&weight, &gradient, &forward);
        for i in 0..6 {
            let (upper_row, lower_row) = (start_of(UNKNOWNS, i), start_of(UNKNOWNS, 6 + i));
            for j in i..6 {
                let entry = &mut system[upper_row + j - i];
                *entry = *entry + weight[upper(i, j)];
                let entry = &mut system[lower_row + j - i];
                *entry = *entry + through.yy[upper(i, j)];
            }
            for j in 0..6 {
                let entry = &mut system[upper_row + 6 + j - i];
                *entry = *entry + through.xy[i][j];
            }
            let entry = &mut system[upper_row + UNKNOWNS - i];
            *entry = *entry + gradient[i];
            let entry = &mut system[lower_row + 6 - i];
            *entry = *entry + through.y[i];
        }
    }
    let factor = simd.splat(1.0) + damping;
    for i in 0..UNKNOWNS {
        let entry = &mut system[start_of(UNKNOWNS, i)];
        *entry = *entry * factor;
    }
    let (mut inverses, mut solution) = ([zero; UNKNOWNS], [zero; UNKNOWNS]);
    eliminate(simd, UNKNOWNS, f64::MIN_POSITIVE, system, &mut inverses);
    substitute(simd, UNKNOWNS, system, &inverses, &mut solution);
    let [a, b, c, d, e, f, g, h, i, j, k, l] = solution;
    ([a, b, c, d, e, f], [g, h, i, j, k, l])
}

/// Normal equations of the prior at the present `X`: as [`WeakPrior::normal`].
#[inline(always)]
fn believe<S: Simd>(simd: S, prior: &WeakPrior, x: &[S::Vector; 12], system: &mut [S::Vector]) {
    let zero = simd.splat(0.0);
    for entry in system.iter_mut() {
        *entry = zero;
    }
    let weight = simd.splat(prior.x_translation_sigma_m.powi(-2));
    let turn = prior.rotation_sigma_rad.powi(-2);
    let t = [x[9], x[10], x[11]];
    let squared = t[0].mul_add(t[0], t[1].mul_add(t[1], t[2] * t[2]));
    let mut away = t;
    for i in 0..3 {
        away[i] = (t[i] - simd.splat(prior.x_translation_m[i])) * weight;
    }
    for i in 0..3 {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        // J = [I, -[t]].
        let row = start_of(UNKNOWNS, i);
        system[row] = weight;
        system[row + 3 + a - i] = t[b] * weight;
        system[row + 3 + b - i] = -(t[a] * weight);
        system[row + UNKNOWNS - i] = away[i];
        let row = start_of(UNKNOWNS, 3 + i);
        for j in i..3 {
            let own = if i == j { squared } else { zero };
            system[row + j - i] = (own - t[i] * t[j]) * weight;
        }
        system[row] = system[row] + simd.splat(turn);
        system[row + UNKNOWNS - 3 - i] = t[a] * away[b] - t[b] * away[a];
        system[start_of(UNKNOWNS, 6 + i)] = simd.splat(prior.y_translation_sigma_m.powi(-2));
        system[start_of(UNKNOWNS, 9 + i)] = simd.splat(turn);
    }
}

/// `A B`.
#[inline(always)]
fn product<V: Vector>(a: &[V; 12], b: &[V; 12]) -> [V; 12] {
    let mut out = *a;
    for i in 0..3 {
        let (p, q, r) = (a[3 * i], a[3 * i + 1], a[3 * i + 2]);
        for j in 0..3 {
            out[3 * i + j] = p.mul_add(b[j], q.mul_add(b[3 + j], r * b[6 + j]));
        }
        out[9 + i] = p.mul_add(b[9], q.mul_add(b[10], r.mul_add(b[11], a[9 + i])));
    }
    out
}

/// As [`Se3::exp`].
#[inline(always)]
fn exponential<S: Simd>(simd: S, xi: &[S::Vector; 6]) -> [S::Vector; 12] {
    let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
    let phi = [xi[3], xi[4], xi[5]];
    let squared = phi[0].mul_add(phi[0], phi[1].mul_add(phi[1], phi[2] * phi[2]));
    let angle = squared.sqrt();
    let (sine, cosine) = sin_cos(simd, angle);
    let small = simd.splat(1e-6).greater(squared);
    let series = |a: f64, b: f64, c: f64| {
        squared.mul_add(squared.mul_add(simd.splat(c), simd.splat(b)), simd.splat(a))
    };
    let a = series(1.0, -1.0 / 6.0, 1.0 / 120.0).keep_or(small, sine / angle);
    let b = series(0.5, -1.0 / 24.0, 1.0 / 720.0).keep_or(small, (one - cosine) / squared);
    let c = series(1.0 / 6.0, -1.0 / 120.0, 1.0 / 5040.0).keep_or(small, (angle - sine) / (squared * angle));
    let mut out = [zero; 12];
    for i in 0..3 {
        let mut translation = zero;
        for j in 0..3 {
            // [phi]^2 = phi phi' - |phi|^2 I
            let outer = phi[i] * phi[j];
            let (same, twice) = if i == j { (one, outer - squared) } else { (zero, outer) };
            let k = (6 - i - j) % 3;
            let skew = if i == j {
                zero
            } else if (i + 1) % 3 == j {
                -phi[k]
            } else {
                phi[k]
            };
            out[3 * i + j] = twice.mul_add(b, skew.mul_add(a, same));
            let entry = twice.mul_add(c, skew.mul_add(b, same));
            translation = entry.mul_add(xi[j], translation);
        }
        out[9 + i] = translation;
    }
    out
}

/// As [`Se3::log`].
#[inline(always)]
fn logarithm<S: Simd>(simd: S, t: &[S::Vector; 12]) -> [S::Vector; 6] {
    let (zero, half, one) = (simd.splat(0.0), simd.splat(0.5), simd.splat(1.0));
    let axis = [(t[7] - t[5]) * half, (t[2] - t[6]) * half, (t[3] - t[1]) * half];
    let sine = axis[0].mul_add(axis[0], axis[1].mul_add(axis[1], axis[2] * axis[2])).sqrt();
    let cosine = (t[0] + t[4] + t[8] - one) * half;
    let angle = arc(simd, sine, cosine);
    let tiny = simd.splat(1e-7).greater(sine);
    let scale = one.keep_or(tiny, angle / sine);
    let mut phi = [axis[0] * scale, axis[1] * scale, axis[2] * scale];
    // Near a half turn the antisymmetric part vanishes: read the axis off the symmetric part.
    let plain = cosine.max(sine - simd.splat(1e-3)).greater(zero);
    if !plain.all() {
        let share = one / (one - cosine);
        let outer = |i: usize, j: usize| {
            let symmetric = (t[3 * i + j] + t[3 * j + i]) * half;
            (if i == j { symmetric - cosine } else { symmetric }) * share
        };
        let mut column = [outer(0, 0), outer(1, 0), outer(2, 0)];
        for j in 1..3 {
            let larger = outer(j, j).greater(if j == 1 { outer(0, 0) } else { outer(0, 0).max(outer(1, 1)) });
            for (i, entry) in column.iter_mut().enumerate() {
                *entry = outer(i, j).keep_or(larger, *entry);
            }
        }
        let [p, q, r] = column;
        let along = p.mul_add(axis[0], q.mul_add(axis[1], r * axis[2]));
        let norm = p.mul_add(p, q.mul_add(q, r * r)).sqrt();
        let signed = angle.keep_or(along.at_least(zero), -angle) / norm;
        for (value, entry) in phi.iter_mut().zip(column) {
            *value = value.keep_or(plain, entry * signed);
        }
    }
    // J^-1 = I - [phi]/2 + (1 - a/2 cot(a/2)) / a^2 [phi]^2
    let squared = phi[0].mul_add(phi[0], phi[1].mul_add(phi[1], phi[2] * phi[2]));
    let cotangent = ((one + cosine) / sine).keep_or(cosine.greater(zero), sine / (one - cosine));
    let exact = (one - half * angle * cotangent) / squared;
    let series = squared.mul_add(simd.splat(1.0 / 720.0), simd.splat(1.0 / 12.0));
    let coefficient = series.keep_or(simd.splat(1e-6).greater(squared), exact);
    let v = [t[9], t[10], t[11]];
    let cross = |a: &[S::Vector; 3], b: &[S::Vector; 3], i: usize| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    };
    let once = [cross(&phi, &v, 0), cross(&phi, &v, 1), cross(&phi, &v, 2)];
    let mut out = [zero; 6];
    for i in 0..3 {
        out[i] = coefficient.mul_add(cross(&phi, &once, i), half.neg_mul_add(once[i], v[i]));
        out[3 + i] = phi[i];
    }
    out
}

/// Terms of the series of the arcus tangent below; the first that is left out is below rounding.
const TERMS: u8 = 11;
/// Tangents that the series is developed from, their angles, and from where on each is the nearest; and zero.
const ANCHORS: [(f64, f64, f64); 3] = [
    (0.28, 0.273_008_703_086_710_6, 0.1374),
    (0.6, 0.540_419_500_270_584_2, 0.4307),
    (1.0, std::f64::consts::FRAC_PI_4, 0.7808),
];

/// `atan2(sine, cosine)` for `sine >= 0`, up to a common factor of both, to about two units in the last place.
///
/// The smaller of both over the larger is in `[0, 1]`; with `c = tan a` of the nearest anchor,
/// `atan r = a + atan((r - c) / (1 + r c))`, a series in at most 0.14 (Abramowitz and Stegun, 4.4.34 and 4.4.42).
#[inline(always)]
fn arc<S: Simd>(simd: S, sine: S::Vector, cosine: S::Vector) -> S::Vector {
    let zero = simd.splat(0.0);
    let one = simd.splat(1.0);
    let size = cosine.abs();
    let steep = sine.greater(size);
    let ratio = size.keep_or(steep, sine) / sine.max(size);
    let (mut anchor, mut tangent) = (zero, zero);
    for (tangent_of, angle, limit) in ANCHORS {
        let beyond = ratio.greater(simd.splat(limit));
        anchor = simd.splat(angle).keep_or(beyond, anchor);
        tangent = simd.splat(tangent_of).keep_or(beyond, tangent);
    }
    let z = (ratio - tangent) / ratio.mul_add(tangent, one);
    let square = z * z;
    let mut series = simd.splat(0.0);
    for i in (1..TERMS).rev() {
        let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
        series = series.mul_add(square, simd.splat(sign / (2.0 * f64::from(i) + 1.0)));
    }
    let angle = anchor + (series * square).mul_add(z, z);
    let angle = (simd.splat(std::f64::consts::FRAC_PI_2) - angle).keep_or(steep, angle);
    angle.keep_or(cosine.at_least(zero), simd.splat(std::f64::consts::PI) - angle)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector6;

    use super::*;
    use crate::testing::Random;

    /// Logarithms of transforms, and exponentials of these.
    struct Both<'a> {
        transforms: &'a [Row; 12],
        twists: &'a mut [Row; 6],
        back: &'a mut [Row; 12],
    }

    impl Kernel for Both<'_> {
        type Output = ();

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) {
            for at in (0..MAX_LANES).step_by(S::LANES) {
                let twist = logarithm(simd, &load(simd, self.transforms, at));
                store(&twist, self.twists, at);
                store(&exponential(simd, &twist), self.back, at);
            }
        }
    }

    #[test]
    fn lanes_have_the_logarithms_and_exponentials_of_single_transforms() {
        let random = &mut Random::new(5);
        for round in 0..400 {
            // From nothing to a half turn, and very near to both.
            let angle = match round % 4 {
                0 => 10_f64.powf(random.uniform(-12.0, -2.0)),
                1 => std::f64::consts::PI - 10_f64.powf(random.uniform(-12.0, -2.0)),
                2 if round < 8 => std::f64::consts::PI,
                3 if round < 8 => 0.0,
                _ => random.uniform(0.0, std::f64::consts::PI),
            };
            let all: [Se3; MAX_LANES] = std::array::from_fn(|lane| {
                let mut axis = Vector3::from_fn(|_, _| random.normal());
                if lane < 3 && round < 8 {
                    axis = Vector3::zeros();
                    axis[lane] = 1.0;
                }
                let phi = axis.normalize() * angle;
                let rho = Vector3::from_fn(|_, _| random.normal());
                Se3::exp(&Vector6::new(rho.x, rho.y, rho.z, phi.x, phi.y, phi.z))
            });
            let mut rows = [[0.0; MAX_LANES]; 12];
            for (lane, one) in all.iter().enumerate() {
                for (row, entry) in rows.iter_mut().zip(entries(one)) {
                    row[lane] = entry;
                }
            }
            for unit in VectorUnit::ALL {
                let (mut twists, mut back) = ([[0.0; MAX_LANES]; 6], rows);
                dispatch(unit, Both { transforms: &rows, twists: &mut twists, back: &mut back });
                for (lane, one) in all.iter().enumerate() {
                    let found = Vector6::from_fn(|i, _| twists[i][lane]);
                    let expected = one.log();
                    // A half turn has two logarithms.
                    let near = (found - expected).amax() < 1e-8 || angle > std::f64::consts::PI - 1e-7;
                    assert!(near, "{angle} {} {}", found.transpose(), expected.transpose());
                    let again = transform(&back, lane);
                    assert!((again.to_matrix() - one.to_matrix()).amax() < 1e-8, "{angle}");
                }
            }
        }
    }

    #[test]
    fn a_start_goes_where_single_steps_lead() {
        let random = &mut Random::new(8);
        let (x, y) = (random.transform(0.3, 1.0), random.transform(1.0, 1.0));
        let motions: Vec<Se3> = (0..6).map(|_| random.transform(0.4, 0.8)).collect();
        let poses: Vec<Se3> = motions.iter().map(|a| random.transform(1e-3, 1e-3) * x * *a * y).collect();
        let weights = vec![Matrix6::identity() * 1e6; 6];
        let prior = WeakPrior::default();
        let cost = |x: &Se3, y: &Se3| {
            let off = x.translation - prior.x_translation_m;
            motions.iter().zip(&poses).fold(off.norm_squared(), |sum, (a, c)| {
                sum + 1e6 * (*x * *a * *y * c.inverse()).log().norm_squared()
            })
        };
        let mut runs: Vec<Run> = (0..11)
            .map(|_| Run::new(random.transform(0.2, 0.5) * x, random.transform(0.2, 0.5) * y, "given"))
            .collect();
        let before: Vec<f64> = runs.iter().map(|run| cost(&run.x, &run.y)).collect();
        Poses::new(&motions, &poses, &weights, &prior).descend(&mut runs, 40);
        let least = runs.iter().map(|run| run.cost).fold(f64::INFINITY, f64::min);
        for (run, before) in runs.iter().zip(before) {
            assert!(run.cost < before);
            assert!((run.cost - cost(&run.x, &run.y)).abs() < 1e-6 * run.cost);
            assert!(run.cost - least < 1e-6 * least, "{} {least}", run.cost);
        }
        // No small twist of X or Y lowers the cost.
        let best = &runs[0];
        for i in 0..12 {
            for step in [-1e-4, 1e-4] {
                let mut twist = Vector6::zeros();
                twist[i % 6] = step;
                let moved = Se3::exp(&twist);
                let (x, y) = if i < 6 { (moved * best.x, best.y) } else { (best.x, moved * best.y) };
                assert!(cost(&x, &y) > best.cost);
            }
        }
    }
}
