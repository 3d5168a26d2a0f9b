//! From the quadratics of views to the normal equations of `[xi_x; xi_y]`, lanes = views.

use nalgebra::Vector6;

use super::linearise::LinearisedGroup;
use super::measurements::{Group, Row};
use super::step::{Equations, Vector12};
use crate::batched_algebra::{UPPER, left_product, load, store, upper};
use crate::least_squares::Side;
use crate::simd::{Kernel, MAX_LANES, Simd, Vector, VectorUnit, ln};

/// The robot's error in a group of views at one state, and what eliminating it gave.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Errors {
    /// Whitened corrections `w`.
    pub corrections: [Row; 6],
    /// `d eta' / d w` in the frame in which the error acts, 6 x 6 row by row.
    pub root: [Row; 36],
    /// Elimination: `dw = -(offset + slope eta)`.
    pub offset: [Row; 6],
    pub slope: [Row; 36],
    /// `ln |I + T' M T|`.
    pub log_determinant: Row,
}

impl Errors {
    pub fn new() -> Self {
        const ZERO: Row = [0.0; MAX_LANES];
        Self {
            corrections: [ZERO; 6],
            root: [ZERO; 36],
            offset: [ZERO; 6],
            slope: [ZERO; 36],
            log_determinant: ZERO,
        }
    }
}

/// The robot's noise, for kernels.
pub(super) struct Noise<'a> {
    pub side: Side,
    pub x: &'a [f64; 12],
    /// With the motions as the robot reports them.
    pub groups: &'a [Group],
    pub errors: &'a mut [Errors],
    pub damping: f64,
}

/// Sums the normal equations, the robot's errors eliminated.
pub(super) struct Normal<'a> {
    pub linearised: &'a [LinearisedGroup],
    pub noise: Option<Noise<'a>>,
    pub workspace: &'a mut Workspace,
    pub equations: &'a mut Equations,
}

/// A vector unit and room for its sums: blocks of the information and of the gradient, each entry by lanes.
#[repr(C, align(64))]
pub(in crate::least_squares) struct Workspace {
    xx: [Row; UPPER],
    yy: [Row; UPPER],
    xy: [Row; 36],
    x: [Row; 6],
    y: [Row; 6],
    pub unit: VectorUnit,
}

impl Workspace {
    pub fn new(unit: VectorUnit) -> Self {
        const ZERO: Row = [0.0; MAX_LANES];
        Self { xx: [ZERO; UPPER], yy: [ZERO; UPPER], xy: [ZERO; 36], x: [ZERO; 6], y: [ZERO; 6], unit }
    }
}

impl Kernel for Normal<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        for (g, seen) in self.linearised.iter().enumerate() {
            for at in (0..MAX_LANES).step_by(S::LANES) {
                let mut information = load(simd, &seen.information, at);
                let mut gradient = load(simd, &seen.gradient, at);
                if let Some(noise) = &mut self.noise {
                    eliminate(simd, noise, g, at, &mut information, &mut gradient);
                }
                let c = load(simd, &seen.before_y, at);
                add(simd, self.workspace, g == 0 && at == 0, &information, &gradient, &c);
            }
        }
        total(simd, self.workspace, self.equations);
    }
}

/// Blocks of `B' M B` and `B' g` with `B = [I, C]` beside `M` and `g` themselves.
pub(crate) struct ThroughChain<V> {
    /// `M C`.
    pub xy: [[V; 6]; 6],
    /// `C' M C`, upper triangle.
    pub yy: [V; UPPER],
    /// `C' g`.
    pub y: [V; 6],
}

/// With `C = [R, [t]R; 0, R]` of the entries `c`, by blocks of three:
/// with `M = [M1, M2; M2', M3]`, `M C = [M1 R, (M1 [t] + M2) R; M2' R, (M2' [t] + M3) R]`.
#[inline(always)]
pub(crate) fn through_chain<V: Vector>(m: &[V; UPPER], g: &[V; 6], c: &[V; 12]) -> ThroughChain<V> {
    // M [I, [t]; 0, I], then times the rotation.
    let mut xy = [[m[0]; 6]; 6];
    for i in 0..6 {
        let mut shifted = [m[0]; 6];
        for j in 0..3 {
            let (a, b) = ((j + 1) % 3, (j + 2) % 3);
            shifted[j] = m[upper(i, j)];
            let first = m[upper(i, a)].mul_add(c[9 + b], m[upper(i, 3 + j)]);
            shifted[3 + j] = m[upper(i, b)].neg_mul_add(c[9 + a], first);
        }
        for j in 0..3 {
            let (p, q, r) = (c[j], c[3 + j], c[6 + j]);
            xy[i][j] = shifted[0].mul_add(p, shifted[1].mul_add(q, shifted[2] * r));
            xy[i][3 + j] = shifted[3].mul_add(p, shifted[4].mul_add(q, shifted[5] * r));
        }
    }
    // [I, 0; [t]', I] M C: the lower rows and [t]' times the upper ones.
    let mut product = xy;
    for i in 0..3 {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        for j in 3..6 {
            let first = c[9 + b].mul_add(xy[a][j], xy[3 + i][j]);
            product[3 + i][j] = c[9 + a].neg_mul_add(xy[b][j], first);
        }
    }
    let turned = |column: &[V; 3], i: usize| {
        c[i].mul_add(column[0], c[3 + i].mul_add(column[1], c[6 + i] * column[2]))
    };
    let mut yy = *m;
    for i in 0..3 {
        for j in 0..6 {
            if j >= i {
                yy[upper(i, j)] = turned(&[product[0][j], product[1][j], product[2][j]], i);
            }
            if j >= 3 + i {
                yy[upper(3 + i, j)] = turned(&[product[3][j], product[4][j], product[5][j]], i);
            }
        }
    }
    let mut low = [g[3], g[4], g[5]];
    for i in 0..3 {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        low[i] = c[9 + a].neg_mul_add(g[b], c[9 + b].mul_add(g[a], low[i]));
    }
    let mut y = *g;
    for i in 0..3 {
        y[i] = turned(&[g[0], g[1], g[2]], i);
        y[3 + i] = turned(&low, i);
    }
    ThroughChain { xy, yy, y }
}

/// Adds the quadratic of a view to the sums.
#[inline(always)]
fn add<S: Simd>(
    simd: S,
    workspace: &mut Workspace,
    first: bool,
    m: &[S::Vector; UPPER],
    g: &[S::Vector; 6],
    c: &[S::Vector; 12],
) {
    let through = through_chain(m, g, c);
    put(simd, &mut workspace.xx, first, m);
    for (rows, product) in workspace.xy.chunks_exact_mut(6).zip(&through.xy) {
        put(simd, rows, first, product);
    }
    put(simd, &mut workspace.yy, first, &through.yy);
    put(simd, &mut workspace.x, first, g);
    put(simd, &mut workspace.y, first, &through.y);
}

/// Adds to sums; to nothing at the `first`.
#[inline(always)]
fn put<S: Simd>(simd: S, rows: &mut [Row], first: bool, values: &[S::Vector]) {
    for (row, value) in rows.iter_mut().zip(values) {
        let sum = if first { *value } else { simd.load(row) + *value };
        sum.store(row);
    }
}

/// The sums over the lanes.
#[inline(always)]
fn total<S: Simd>(simd: S, workspace: &Workspace, equations: &mut Equations) {
    for i in 0..6 {
        for j in i..6 {
            equations.set(i, j, simd.load(&workspace.xx[upper(i, j)]).sum());
            equations.set(6 + i, 6 + j, simd.load(&workspace.yy[upper(i, j)]).sum());
        }
        for j in 0..6 {
            equations.set(i, 6 + j, simd.load(&workspace.xy[6 * i + j]).sum());
        }
        equations.set_gradient(i, simd.load(&workspace.x[i]).sum());
        equations.set_gradient(6 + i, simd.load(&workspace.y[i]).sum());
    }
}

/// Eliminates the robot's errors of a group: as `marginal::eliminate`.
#[inline(always)]
fn eliminate<S: Simd>(
    simd: S,
    noise: &mut Noise<'_>,
    g: usize,
    at: usize,
    information: &mut [S::Vector; UPPER],
    gradient: &mut [S::Vector; 6],
) {
    let one = simd.splat(1.0);
    let errors = &mut noise.errors[g];
    let t = to_error(simd, noise.side, noise.x, &noise.groups[g].motions, &errors.root, at);
    let (m, grad) = (*information, *gradient);
    // M T, and H = I + T' M T with its damping.
    let mut mt = t;
    for i in 0..6 {
        for j in 0..6 {
            let mut sum = m[upper(i, 0)] * t[0][j];
            for k in 1..6 {
                sum = m[upper(i, k)].mul_add(t[k][j], sum);
            }
            mt[i][j] = sum;
        }
    }
    let mut h = [one; UPPER];
    let mut right = load(simd, &errors.corrections, at);
    for i in 0..6 {
        for j in i..6 {
            let mut sum = if i == j { one } else { simd.splat(0.0) };
            for k in 0..6 {
                sum = t[k][i].mul_add(mt[k][j], sum);
            }
            h[upper(i, j)] = sum;
        }
        h[upper(i, i)] = h[upper(i, i)] * simd.splat(1.0 + noise.damping);
        for k in 0..6 {
            right[i] = t[k][i].mul_add(grad[k], right[i]);
        }
    }
    // H = U' D U with unit U: the rows of `h` become those of `D U`, `inverse` that of D.
    let mut inverse = [one; 6];
    let mut product = one;
    for k in 0..6 {
        product = product * h[upper(k, k)];
        inverse[k] = one / h[upper(k, k)];
        for i in k + 1..6 {
            let factor = h[upper(k, i)] * inverse[k];
            for j in i..6 {
                h[upper(i, j)] = factor.neg_mul_add(h[upper(k, j)], h[upper(i, j)]);
            }
        }
    }
    ln(simd, product).store(&mut errors.log_determinant[at..]);
    let mut offset = right;
    substitute(&h, &inverse, &mut offset);
    store(&offset, &mut errors.offset, at);
    for i in 0..6 {
        // Column i of the slope, H^-1 (M T)'.
        let mut slope = mt[i];
        substitute(&h, &inverse, &mut slope);
        for k in 0..6 {
            slope[k].store(&mut errors.slope[6 * k + i][at..]);
        }
        for j in 0..=i {
            let mut sum = m[upper(j, i)];
            for k in 0..6 {
                sum = mt[j][k].neg_mul_add(slope[k], sum);
            }
            information[upper(j, i)] = sum;
        }
        let mut sum = grad[i];
        for k in 0..6 {
            sum = mt[i][k].neg_mul_add(offset[k], sum);
        }
        gradient[i] = sum;
    }
}

/// Solves `U' D U x = right` in place.
#[inline(always)]
fn substitute<V: Vector>(h: &[V; UPPER], inverse: &[V; 6], x: &mut [V; 6]) {
    for k in 0..6 {
        let scaled = x[k] * inverse[k];
        for i in k + 1..6 {
            x[i] = h[upper(k, i)].neg_mul_add(scaled, x[i]);
        }
    }
    for k in (0..6).rev() {
        let mut sum = x[k];
        for i in k + 1..6 {
            sum = h[upper(k, i)].neg_mul_add(x[i], sum);
        }
        x[k] = sum * inverse[k];
    }
}

/// `T = d eta / d w`: `Ad(X) root` or `Ad(X A) root`.
#[inline(always)]
fn to_error<S: Simd>(
    simd: S,
    side: Side,
    x: &[f64; 12],
    motions: &[Row; 12],
    root: &[Row; 36],
    at: usize,
) -> [[S::Vector; 6]; 6] {
    let zero = simd.splat(0.0);
    let before = match side {
        Side::Left => {
            let mut splat = [zero; 12];
            for (to, from) in splat.iter_mut().zip(x) {
                *to = simd.splat(*from);
            }
            splat
        }
        Side::Right => left_product(simd, x, &load(simd, motions, at)),
    };
    let root = load(simd, root, at);
    let mut t = [[zero; 6]; 6];
    for j in 0..6 {
        let mut low = [zero; 3];
        for i in 0..3 {
            let (p, q, r) = (before[3 * i], before[3 * i + 1], before[3 * i + 2]);
            t[i][j] = p.mul_add(root[j], q.mul_add(root[6 + j], r * root[12 + j]));
            low[i] = p.mul_add(root[18 + j], q.mul_add(root[24 + j], r * root[30 + j]));
        }
        for i in 0..3 {
            let (a, b) = ((i + 1) % 3, (i + 2) % 3);
            t[i][j] = before[9 + b].neg_mul_add(low[a], before[9 + a].mul_add(low[b], t[i][j]));
            t[3 + i][j] = low[i];
        }
    }
    t
}

/// The corrections after a step: `w - offset - slope (xi_x + C xi_y)`.
pub(super) struct Correct<'a> {
    pub step: &'a Vector12,
    pub linearised: &'a [LinearisedGroup],
    pub errors: &'a [Errors],
    pub out: &'a mut [Errors],
}

impl Kernel for Correct<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        for ((seen, errors), out) in self.linearised.iter().zip(self.errors).zip(self.out) {
            for at in (0..MAX_LANES).step_by(S::LANES) {
                let c = load(simd, &seen.before_y, at);
                let mut eta = [simd.splat(0.0); 6];
                for i in 0..3 {
                    for k in 0..3 {
                        eta[i] = c[3 * i + k].mul_add(simd.splat(self.step[6 + k]), eta[i]);
                        eta[3 + i] = c[3 * i + k].mul_add(simd.splat(self.step[9 + k]), eta[3 + i]);
                    }
                }
                let low = [eta[3], eta[4], eta[5]];
                for i in 0..3 {
                    let (a, b) = ((i + 1) % 3, (i + 2) % 3);
                    eta[i] = c[9 + b].neg_mul_add(low[a], c[9 + a].mul_add(low[b], eta[i]));
                    eta[i] = eta[i] + simd.splat(self.step[i]);
                    eta[3 + i] = eta[3 + i] + simd.splat(self.step[3 + i]);
                }
                let mut next = load(simd, &errors.corrections, at);
                let (offset, slope) = (load(simd, &errors.offset, at), load(simd, &errors.slope, at));
                for i in 0..6 {
                    next[i] = next[i] - offset[i];
                    for k in 0..6 {
                        next[i] = slope[6 * i + k].neg_mul_add(eta[k], next[i]);
                    }
                }
                store(&next, &mut out.corrections, at);
            }
        }
    }
}

/// Column of a view in rows.
pub(super) fn lane<const N: usize>(rows: &[Row; N], lane: usize) -> [f64; N] {
    std::array::from_fn(|i| rows[i][lane])
}

/// Writes the column of a view into rows.
pub(super) fn set_lane<const N: usize>(rows: &mut [Row; N], lane: usize, values: &[f64; N]) {
    for (row, value) in rows.iter_mut().zip(values) {
        row[lane] = *value;
    }
}

/// As a vector.
pub(super) fn correction(errors: &Errors, at: usize) -> Vector6<f64> {
    Vector6::from(lane(&errors.corrections, at))
}
