//! A block of candidates as structure of arrays: the desk that the stages of the scorer hand on.

use crate::simd::{MAX_LANES, Simd, Vector};

/// Candidates in a block: a multiple of every unit's lanes, few enough that a block stays in the nearest cache.
pub(super) const BLOCK: usize = 4 * MAX_LANES;

/// One value per candidate of a block.
pub(super) type Row = [f64; BLOCK];

/// Entries of a symmetric 6 x 6 matrix, upper triangle row by row.
pub(super) const UPPER: usize = 21;

/// Where entry `(i, j)`, in either order, of a symmetric 6 x 6 matrix lies in its upper triangle.
pub(super) const fn upper(i: usize, j: usize) -> usize {
    let (i, j) = if i <= j { (i, j) } else { (j, i) };
    i * 6 - i * (i + 1) / 2 + j
}

/// Rotation row by row, then translation.
pub(super) type Transforms = [Row; 12];

#[repr(C, align(64))]
pub(super) struct Block {
    /// `X A`, which carries twists of `Y` into the camera frame.
    pub before_y: Transforms,
    /// `T_camera_target = X A Y`.
    pub pose: Transforms,
    /// Information of `[eta; c]`, upper triangle row by row, up to a factor common to all candidates.
    pub information: Vec<Row>,
    /// Features in sight.
    pub seen: Row,
    /// `|I + M S|`.
    pub with: Row,
    /// What it is compared with.
    pub without: Row,
}

impl Block {
    /// For informations of `size` rows.
    pub fn new(size: usize) -> Self {
        const ZERO: Row = [0.0; BLOCK];
        Self {
            before_y: [ZERO; 12],
            pose: [ZERO; 12],
            information: vec![ZERO; size * (size + 1) / 2],
            seen: ZERO,
            with: ZERO,
            without: ZERO,
        }
    }

    /// The information where the twist is all there is.
    #[inline(always)]
    pub fn of_twist(&mut self) -> &mut [Row; UPPER] {
        self.information.first_chunk_mut().expect("a block has room for six rows")
    }
}

/// Lanes `at..` of each row.
#[inline(always)]
pub(super) fn load<S: Simd, const N: usize>(simd: S, rows: &[Row; N], at: usize) -> [S::Vector; N] {
    let mut out = [simd.splat(0.0); N];
    for (vector, row) in out.iter_mut().zip(rows) {
        *vector = simd.load(&row[at..]);
    }
    out
}

/// Writes lanes `at..` of each row.
#[inline(always)]
pub(super) fn store<V: Vector, const N: usize>(vectors: &[V; N], rows: &mut [Row; N], at: usize) {
    for (vector, row) in vectors.iter().zip(rows) {
        vector.store(&mut row[at..]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_upper_triangle_is_numbered_row_by_row() {
        let mut next = 0;
        for i in 0..6 {
            for j in i..6 {
                assert_eq!((upper(i, j), upper(j, i)), (next, next));
                next += 1;
            }
        }
        assert_eq!(next, UPPER);
    }
}
