//! The information of corners in twist and pixel parameters, lanes = candidates.

use super::block::{BLOCK, Block};
use super::forms::packed;
use super::target::{Patch, Target};
use super::window::Window;
use crate::batched_algebra::load;
use crate::camera::{
    DistortedPoint, MAX_PARAMETERS, MIN_DEPTH_M, coefficient_derivative, distort, projection_row,
};
use crate::simd::{Kernel, Simd, Vector};

/// Points whose rows of `d pi / d [eta; c]` are squared together: a sum is fetched once for all of them.
const TOGETHER: usize = 4;

/// Most columns: the twist, all parameters of a lens, and the board's scale.
const COLUMNS: usize = 6 + MAX_PARAMETERS + 1;

/// A pixel parameter.
#[derive(Clone, Copy, Debug)]
pub(super) enum Column {
    /// Camera parameter of this index.
    Camera(usize),
    /// Scale of the board about its origin.
    BoardScale,
}

impl Column {
    /// Whether it is a parameter of the camera.
    pub fn is_of_camera(&self) -> bool {
        matches!(self, Self::Camera(_))
    }

    /// Whether it moves points along u, and along v.
    fn moves(&self) -> [bool; 2] {
        match self {
            Self::Camera(0 | 2) => [true, false],
            Self::Camera(1 | 3) => [false, true],
            _ => [true, true],
        }
    }
}

/// Sums the information, divided by `f_x^2`, of the points in sight, and counts them.
pub(super) struct WidePoints<'a, const DISTORTED: bool, const RATIONAL: bool, const PRISM: bool> {
    pub parameters: &'a [f64; MAX_PARAMETERS],
    pub columns: &'a [Column],
    pub window: &'a Window,
    pub target: &'a Target,
    pub block: &'a mut Block,
}

impl<const DISTORTED: bool, const RATIONAL: bool, const PRISM: bool> Kernel
    for WidePoints<'_, DISTORTED, RATIONAL, PRISM>
{
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let zero = simd.splat(0.0);
        let size = 6 + self.columns.len();
        let mut moves = [[true; 2]; COLUMNS];
        for (moves, column) in moves[6..].iter_mut().zip(self.columns) {
            *moves = column.moves();
        }
        let mut rows: Rows<S::Vector> = [[[zero; TOGETHER]; 2]; COLUMNS];
        for at in (0..BLOCK).step_by(S::LANES) {
            for sum in self.block.information.iter_mut() {
                zero.store(&mut sum[at..]);
            }
            let pose = load(simd, &self.block.pose, at);
            let mut seen = zero;
            let mut filled = 0;
            for (y, z, along) in self.target.patches.iter().flat_map(Patch::lines) {
                for x in along {
                    seen = seen + self.point_rows::<S>(simd, &pose, [x, y, z], &mut rows, filled);
                    filled += 1;
                    if filled == TOGETHER {
                        add_squares(simd, &rows[..size], &moves, &mut self.block.information, at);
                        filled = 0;
                    }
                }
            }
            if filled > 0 {
                for column in &mut rows[..size] {
                    column[0][filled..].fill(zero);
                    column[1][filled..].fill(zero);
                }
                add_squares(simd, &rows[..size], &moves, &mut self.block.information, at);
            }
            seen.store(&mut self.block.seen[at..]);
        }
    }
}

/// Derivatives of points: column by column, of u and of v.
type Rows<V> = [[[V; TOGETHER]; 2]; COLUMNS];

impl<const DISTORTED: bool, const RATIONAL: bool, const PRISM: bool>
    WidePoints<'_, DISTORTED, RATIONAL, PRISM>
{
    /// Writes the two rows of a point, zero where it is not in sight; one where it is.
    #[inline(always)]
    fn point_rows<S: Simd>(
        &self,
        simd: S,
        pose: &[S::Vector; 12],
        point: [f64; 3],
        rows: &mut Rows<S::Vector>,
        at: usize,
    ) -> S::Vector {
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        let p = self.parameters;
        let place = [simd.splat(point[0]), simd.splat(point[1]), simd.splat(point[2])];
        let mut turned = [zero; 3];
        for i in 0..3 {
            let sum = pose[3 * i + 1].mul_add(place[1], pose[3 * i + 2] * place[2]);
            turned[i] = pose[3 * i].mul_add(place[0], sum);
        }
        let depth = turned[2] + pose[11];
        let w = one / depth;
        let x = (turned[0] + pose[9]) * w;
        let y = (turned[1] + pose[10]) * w;
        let distorted: DistortedPoint<S::Vector> = if DISTORTED {
            distort::<S, RATIONAL, PRISM>(simd, p, x, y)
        } else {
            DistortedPoint::unchanged(simd, x, y)
        };
        let in_sight = self.window.shows(simd, &distorted) & depth.greater(simd.splat(MIN_DEPTH_M));
        let (w, x, y) = (w.keep(in_sight), x.keep(in_sight), y.keep(in_sight));
        let aspect = simd.splat(p[1] / p[0]);
        let jacobian = [
            (distorted.along_x.keep(in_sight), distorted.cross_x.keep(in_sight)),
            ((distorted.cross_y * aspect).keep(in_sight), (distorted.along_y * aspect).keep(in_sight)),
        ];
        for (row, of_lens) in jacobian.into_iter().enumerate() {
            let entries = projection_row(of_lens, w, x, y);
            for (i, entry) in entries.into_iter().enumerate() {
                rows[i][row][at] = if i == 2 || i == 3 { -entry } else { entry };
            }
        }
        let inverse_focal = simd.splat(1.0 / p[0]);
        for (column, rows) in self.columns.iter().zip(&mut rows[6..]) {
            let (u, v) = match column {
                Column::BoardScale => {
                    let mut pair = [zero; 2];
                    for (row, (a, b)) in jacobian.into_iter().enumerate() {
                        let across = a.mul_add(turned[0], b * turned[1]);
                        pair[row] = w * a.mul_add(x, b * y).neg_mul_add(turned[2], across);
                    }
                    (pair[0], pair[1])
                }
                Column::Camera(0) => (distorted.x * inverse_focal, zero),
                Column::Camera(1) => (zero, distorted.y * inverse_focal),
                Column::Camera(2) => (inverse_focal, zero),
                Column::Camera(3) => (zero, inverse_focal),
                Column::Camera(i) => {
                    let (u, v) = coefficient_derivative(simd, *i, x, y, &distorted);
                    (u, v * aspect)
                }
            };
            rows[0][at] = u.keep(in_sight);
            rows[1][at] = v.keep(in_sight);
        }
        one.keep(in_sight)
    }
}

/// Adds the squares of the rows to the information; what moves no point along an axis has no product there.
#[inline(always)]
fn add_squares<S: Simd>(
    simd: S,
    columns: &[[[S::Vector; TOGETHER]; 2]],
    moves: &[[bool; 2]],
    information: &mut [[f64; BLOCK]],
    at: usize,
) {
    let size = columns.len();
    let mut i = 0;
    while i < size {
        // Two columns at a time, in registers: what is fetched of a third serves both.
        let next = (i + 1).min(size - 1);
        let two = next > i && moves[i] == moves[next];
        let (first, second) = (columns[i], columns[next]);
        for j in i..size {
            let moved = [moves[i][0] && moves[j][0], moves[i][1] && moves[j][1]];
            let right = columns[j];
            let sum = &mut information[packed(size, i, j)][at..];
            product(&first, &right, moved, simd.load(sum)).store(sum);
            if two && j > i {
                let sum = &mut information[packed(size, next, j)][at..];
                product(&second, &right, moved, simd.load(sum)).store(sum);
            }
        }
        i += if two { 2 } else { 1 };
    }
}

/// `sum + left' right` over the axes along which both move.
#[inline(always)]
fn product<V: Vector>(
    left: &[[V; TOGETHER]; 2],
    right: &[[V; TOGETHER]; 2],
    moved: [bool; 2],
    mut sum: V,
) -> V {
    if moved == [true, true] {
        let mut along_v = left[1][0] * right[1][0];
        sum = left[0][0].mul_add(right[0][0], sum);
        for k in 1..TOGETHER {
            sum = left[0][k].mul_add(right[0][k], sum);
            along_v = left[1][k].mul_add(right[1][k], along_v);
        }
        return sum + along_v;
    }
    for axis in 0..2 {
        if moved[axis] {
            for k in 0..TOGETHER {
                sum = left[axis][k].mul_add(right[axis][k], sum);
            }
        }
    }
    sum
}
