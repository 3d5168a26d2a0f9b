//! From the quadratics of views to the normal equations of `[xi_x; xi_y]`, lanes = views.

use super::step::Equations;
use crate::batched_algebra::{UPPER, load, upper};
use crate::pose::{LinearisedGroup, Row};
use crate::simd::{Kernel, MAX_LANES, Simd, Vector, VectorUnit};

/// Sums the normal equations.
pub(super) struct Normal<'a> {
    pub linearised: &'a [LinearisedGroup],
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
    fn run<S: Simd>(self, simd: S) {
        for (g, seen) in self.linearised.iter().enumerate() {
            for at in (0..MAX_LANES).step_by(S::LANES) {
                let information = load(simd, &seen.information, at);
                let gradient = load(simd, &seen.gradient, at);
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
