//! Chen: the screw axes of the motions as lines, carried into each other.

use nalgebra::{DMatrix, DVector};

use super::linear::least_squares;
use super::motion::Motion;
use super::rotation_fit::rotation_from_correlation;
use super::screw::{direction_correlation, screw_pairs};
use crate::error::Error;
use crate::se3::{Se3, hat};

pub(super) const PAPER: &str = "H. H. Chen, \"A screw motion approach to uniqueness analysis of head-eye \
    geometry\", IEEE Conference on Computer Vision and Pattern Recognition (CVPR), 1991";

/// `Z` of `hand Z = Z eye`.
///
/// A rigid motion keeps the angle and the pitch of a screw (screw congruence theorem), so only the axes, as
/// lines, say something about `Z`. Rotation: the one that carries the directions, `l_hand = R l_eye`.
/// Translation: from the moments, `m_hand = R m_eye + t x l_hand`, linear least squares. An axis is known as
/// well as its motion turns, so each line is weighted by `2 sin(angle / 2)`; the paper, about uniqueness,
/// weights all alike. What the pitch says about the noise is not used.
pub(super) fn solve(motions: &[Motion]) -> Result<Se3, Error> {
    let pairs = screw_pairs(motions);
    let rotation = rotation_from_correlation(&direction_correlation(&pairs))?;
    let mut matrix = DMatrix::zeros(3 * pairs.len(), 3);
    let mut rhs = DVector::zeros(3 * pairs.len());
    for (k, pair) in pairs.iter().enumerate() {
        let carried = rotation * pair.eye.direction;
        matrix.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(&(-hat(&carried) * pair.weight));
        rhs.fixed_rows_mut::<3>(3 * k)
            .copy_from(&(pair.hand.weighted_moment() - rotation * pair.eye.weighted_moment()));
    }
    let t = least_squares(matrix, rhs, "the translation between hand and eye")?;
    Ok(Se3::new(rotation, t.fixed_rows::<3>(0).into_owned()))
}
