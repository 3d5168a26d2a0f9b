//! A block of candidates as structure of arrays: the desk that the stages of the scorer hand on.

use std::ops::{Deref, DerefMut};

use crate::batched_algebra::UPPER;
use crate::simd::MAX_LANES;

/// Candidates in a block: a multiple of every unit's lanes, few enough that a block stays in the nearest cache.
pub(super) const BLOCK: usize = 6 * MAX_LANES;

/// One value per candidate of a block.
pub(super) type Row = [f64; BLOCK];

/// Rotation row by row, then translation.
pub(super) type Transforms = [Row; 12];

/// Rows as many as wanted, none of whose vectors lies across two cache lines.
pub(super) struct Rows {
    values: Vec<f64>,
    start: usize,
}

impl Rows {
    fn new(count: usize) -> Self {
        let values = vec![0.0; count * BLOCK + MAX_LANES];
        let start = values.as_ptr().align_offset(size_of::<f64>() * MAX_LANES);
        Self { values, start }
    }
}

impl Deref for Rows {
    type Target = [Row];

    #[inline(always)]
    fn deref(&self) -> &[Row] {
        self.values[self.start..].as_chunks().0
    }
}

impl DerefMut for Rows {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [Row] {
        self.values[self.start..].as_chunks_mut().0
    }
}

#[repr(C, align(64))]
pub(super) struct Block {
    /// `X A`, which carries twists of `Y` into the camera frame.
    pub before_y: Transforms,
    /// `T_camera_target = X A Y`.
    pub pose: Transforms,
    /// Information of `[eta; c]`, upper triangle row by row, up to a factor common to all candidates.
    pub information: Rows,
    /// What constants of the arm move in the camera frame, 6 rows for each, and beside them its noise.
    pub arm: Rows,
    /// How many of either.
    pub arm_counts: (usize, usize),
    /// Features in sight.
    pub seen: Row,
    /// `|I + M S|`.
    pub with: Row,
    /// What it is compared with.
    pub without: Row,
}

impl Block {
    /// For informations of `size` rows, and so many constants of the arm and columns of its noise.
    pub fn new(size: usize, arm_counts: (usize, usize)) -> Self {
        const ZERO: Row = [0.0; BLOCK];
        Self {
            before_y: [ZERO; 12],
            pose: [ZERO; 12],
            information: Rows::new(size * (size + 1) / 2),
            arm: Rows::new(6 * (arm_counts.0 + arm_counts.1)),
            arm_counts,
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
