//! Screw axes of motions: what the geometric methods match.

use nalgebra::{Matrix3, Vector3};

use super::motion::Motion;
use super::quaternion::vector_part;
use crate::se3::Se3;

/// Rotation below which a motion has no axis to speak of, as `2 sin(angle / 2)`.
const NO_AXIS: f64 = 1e-9;

/// The line that a motion turns about and slides along.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    /// Unit direction.
    pub direction: Vector3<f64>,
    /// The point of the line nearest to the origin times the weight of the motion: finite however small the
    /// rotation is.
    pub weighted_point: Vector3<f64>,
}

/// One motion as hand and eye saw it: two axes that `Z` carries into each other (screw congruence).
#[derive(Clone, Copy, Debug)]
pub(super) struct ScrewPair {
    /// Axis in the frame of the hand.
    pub hand: Axis,
    /// Axis in the frame of the eye.
    pub eye: Axis,
    /// `2 sin(angle / 2)` of the smaller of the two rotations: how well the axis is known.
    pub weight: f64,
}

impl Axis {
    /// `weighted_point = w c` with `c = (t_p + cot(angle / 2) l x t) / 2`, where `t_p` is the part of `t`
    /// across the axis (Chen 1991; Murray, Li and Sastry 1994, section 2.3).
    fn of(motion: &Se3, half_axis: &Vector3<f64>, weight: f64) -> Self {
        let sin = half_axis.norm();
        let direction = half_axis / sin;
        let t = motion.translation;
        let cos = (1.0 - sin * sin).max(0.0).sqrt();
        let across = t - direction * direction.dot(&t);
        let weighted_point = (across * sin + direction.cross(&t) * cos) * (0.5 * weight / sin);
        Self { direction, weighted_point }
    }

    /// The moment of the line times the weight, `w c x l`.
    pub fn weighted_moment(&self) -> Vector3<f64> {
        self.weighted_point.cross(&self.direction)
    }
}

/// Axes of the motions that have one, with their weights.
pub(super) fn screw_pairs(motions: &[Motion]) -> Vec<ScrewPair> {
    motions
        .iter()
        .filter_map(|m| {
            let (hand, eye) = (vector_part(&m.hand_quaternion), vector_part(&m.eye_quaternion));
            let weight = 2.0 * hand.norm().min(eye.norm());
            (weight > NO_AXIS).then(|| ScrewPair {
                hand: Axis::of(&m.hand, &hand, weight),
                eye: Axis::of(&m.eye, &eye, weight),
                weight,
            })
        })
        .collect()
}

/// `sum w^2 l_hand l_eye'`, from which the rotation that carries one list of directions to the other follows.
pub(super) fn direction_correlation(pairs: &[ScrewPair]) -> Matrix3<f64> {
    pairs.iter().map(|pair| pair.hand.direction * pair.eye.direction.transpose() * pair.weight.powi(2)).sum()
}
