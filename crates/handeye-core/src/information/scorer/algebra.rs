//! Determinants of six-dimensional measurements, lanes = candidates; everything unrolled.

use super::block::{BLOCK, Block, Row};
use super::forms::{Form, Moved, packed};
use crate::batched_algebra::{UPPER, load, upper};
use crate::simd::{Kernel, Simd, Twin, Vector, ln};

/// Pivots of a covariance below this fraction of their diagonal are rounding.
pub(super) const NULL_PIVOT: f64 = 1e-15;

/// Does the body for each of the indices, each a constant.
macro_rules! each {
    ($i:ident in [$($n:literal)*] $body:block) => {
        $({
            const $i: usize = $n;
            $body
        })*
    };
}

/// `|I + scale M S|` of a block, for `M` the information in it on the twist, the first of `size` rows.
pub(super) struct Determinant<'a> {
    pub scale: f64,
    pub size: usize,
    pub form: &'a Form,
    pub block: &'a Block,
    pub out: &'a mut Row,
}

impl Kernel for Determinant<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let twin = Twin(simd);
        for at in (0..BLOCK).step_by(2 * S::LANES) {
            let first = self.form.covariance(simd, self.block, at);
            let s = twin.pair(first, self.form.covariance(simd, self.block, at + S::LANES));
            let mut m = [twin.splat(0.0); UPPER];
            each!(I in [0 1 2 3 4 5] {
                let row = &self.block.information[packed(self.size, I, I)..][..6 - I];
                for j in I..6 {
                    m[upper(I, j)] = twin.load(&row[j - I][at..]);
                }
            });
            determinant(twin, s, twin.splat(self.scale), m).store(&mut self.out[at..]);
        }
    }
}

impl Form {
    /// The covariance of the twist.
    #[inline(always)]
    fn covariance<S: Simd>(&self, simd: S, block: &Block, at: usize) -> [S::Vector; UPPER] {
        let constant: &[f64; UPPER] = self.constant.first_chunk().expect("six rows");
        let mut s = [simd.splat(0.0); UPPER];
        for i in 0..UPPER {
            s[i] = simd.splat(constant[i]);
        }
        if let Some(moved) = &self.moved {
            let u = spread(simd, moved, &load(simd, &block.before_y, at));
            add_square(&u, &mut s);
        }
        s
    }
}

/// `U = offset + Ad(T) root`, with `Ad(T) = [R, [t]R; 0, R]` and a root that is an upper triangle, so that the lower
/// left of `U` is that of the offset.
#[inline(always)]
pub(super) fn spread<S: Simd>(simd: S, moved: &Moved, t: &[S::Vector; 12]) -> [[S::Vector; 6]; 6] {
    let zero = simd.splat(0.0);
    let mut u = [[zero; 6]; 6];
    macro_rules! rotated {
        // Entry `(i, j)` of `R` times rows `$from..$from + 3` of the root, of which only `$rows` count.
        ($i:expr, $j:expr, $from:literal, $rows:expr, $start:expr) => {{
            let mut sum = $start;
            for k in $rows {
                sum = t[3 * $i + k].mul_add(simd.splat(moved.root[$from + k][$j]), sum);
            }
            sum
        }};
    }
    // R G22, the lower right.
    let mut low = [[zero; 6]; 3];
    each!(I in [0 1 2] {
        each!(J in [3 4 5] { low[I][J] = rotated!(I, J, 3, 0..J - 2, zero); });
    });
    each!(I in [0 1 2] {
        const A: usize = (I + 1) % 3;
        const B: usize = (I + 2) % 3;
        each!(J in [0 1 2] {
            u[I][J] = rotated!(I, J, 0, 0..=J, simd.splat(moved.offset[I][J]));
            u[I + 3][J] = simd.splat(moved.offset[I + 3][J]);
        });
        each!(J in [3 4 5] {
            // t x (column of R G22)
            let sum = rotated!(I, J, 0, 0..3, simd.splat(moved.offset[I][J]));
            u[I][J] = t[9 + B].neg_mul_add(low[A][J], t[9 + A].mul_add(low[B][J], sum));
            u[I + 3][J] = low[I][J] + simd.splat(moved.offset[I + 3][J]);
        });
    });
    u
}

/// Adds `U U'` to a symmetric matrix, but for what is constant in its lower right: see [`Moved`].
#[inline(always)]
pub(super) fn add_square<V: Vector>(u: &[[V; 6]; 6], s: &mut [V; UPPER]) {
    each!(I in [0 1 2 3 4 5] {
        const FIRST: usize = if I < 3 { 0 } else { 3 };
        for j in I..6 {
            let mut sum = s[upper(I, j)];
            for (a, b) in u[I][FIRST..].iter().zip(&u[j][FIRST..]) {
                sum = a.mul_add(*b, sum);
            }
            s[upper(I, j)] = sum;
        }
    });
}

/// `|I + scale M S|`.
///
/// `S = L D L'` is taken as six scalar causes of the measurement with directions `l_k` and variances `d_k`; each in turn
/// multiplies the determinant by `p = 1 + d l' M l` and leaves the information `M - (d / p) M l l' M` for the others.
/// `M` may be singular, and every factor is at least one.
#[expect(clippy::reversed_empty_ranges, reason = "unrolled: the last steps have nothing left to do")]
#[inline(always)]
fn determinant<S: Simd>(
    simd: S,
    mut s: [S::Vector; UPPER],
    scale: S::Vector,
    mut m: [S::Vector; UPPER],
) -> S::Vector {
    let zero = simd.splat(0.0);
    let one = simd.splat(1.0);
    let mut floors = [zero; 6];
    each!(K in [0 1 2 3 4 5] { floors[K] = simd.splat(NULL_PIVOT) * s[upper(K, K)]; });
    let mut product = one;
    each!(K in [0 1 2 3 4 5] {
        // Pivot and column of the factorisation of S.
        let pivot = s[upper(K, K)];
        let counts = pivot.greater(floors[K]);
        let inverse = (one / pivot).keep(counts);
        let d = (pivot * scale).keep(counts);
        let mut l = [zero; 6];
        for i in K + 1..6 {
            l[i] = s[upper(K, i)] * inverse;
        }
        for i in K + 1..6 {
            for j in i..6 {
                s[upper(i, j)] = l[i].neg_mul_add(s[upper(K, j)], s[upper(i, j)]);
            }
        }
        // M l, and l' M l.
        let mut v = [zero; 6];
        for i in K..6 {
            let mut sum = m[upper(i, K)];
            for j in K + 1..6 {
                sum = m[upper(i, j)].mul_add(l[j], sum);
            }
            v[i] = sum;
        }
        let mut information = v[K];
        for i in K + 1..6 {
            information = l[i].mul_add(v[i], information);
        }
        let factor = d.mul_add(information, one);
        product = product * factor;
        let weight = d / factor;
        for i in K + 1..6 {
            let weighted = v[i] * weight;
            for j in i..6 {
                m[upper(i, j)] = weighted.neg_mul_add(v[j], m[upper(i, j)]);
            }
        }
    });
    product
}

/// `1/2 ln (with / without)`, NaN where fewer features are in sight than wanted (or the numbers overflow).
pub(super) struct Gains<'a> {
    pub block: &'a Block,
    pub fewest: f64,
    pub compared: bool,
    pub out: &'a mut Row,
}

impl Kernel for Gains<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        for at in (0..BLOCK).step_by(S::LANES) {
            let mut ratio = simd.load(&self.block.with[at..]);
            if self.compared {
                ratio = ratio / simd.load(&self.block.without[at..]);
            }
            let gain = ln(simd, ratio) * simd.splat(0.5);
            let enough = simd.load(&self.block.seen[at..]).at_least(simd.splat(self.fewest));
            let told = enough & simd.splat(f64::MAX).at_least(ratio);
            gain.keep_or(told, simd.splat(f64::NAN)).store(&mut self.out[at..]);
        }
    }
}
