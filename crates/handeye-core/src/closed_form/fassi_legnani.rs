//! Fassi and Legnani: two screw axes and their common normal as a frame, in hand and eye.

use nalgebra::{Matrix3, Vector3};

use super::motion::Motion;
use super::rotation_fit::rotation_from_correlation;
use super::screw::{Axis, ScrewPair, screw_pairs};
use crate::error::Error;
use crate::se3::Se3;

pub(super) const PAPER: &str = "I. Fassi and G. Legnani, \"Hand to sensor calibration: a geometrical \
    interpretation of the matrix equation AX = XB\", Journal of Robotic Systems 22(9), 2005";

/// Motions that each motion is paired with, at most; more add equations that say the same.
const PARTNERS: usize = 64;

/// Sine of the angle between two axes below which they count as parallel and have no common normal.
const PARALLEL: f64 = 1e-6;

/// `Z` of `hand Z = Z eye`.
///
/// The paper reads `AX = XB` as lines: one motion leaves a turn about and a slide along its screw axis free,
/// two motions with axes that are not parallel leave nothing. The axes and their common normal are a frame,
/// once in the hand and once in the eye, and `Z` carries one to the other. Over all pairs of motions the
/// answers are averaged (rotation: chordal mean; translation: arithmetic), each weighted by how well its frame
/// is known: `w_i w_j sin(axis i, axis j)` squared, `w = 2 sin(angle / 2)`. The paper treats the two motions
/// and what is left free; the mean over more of them is ours.
pub(super) fn solve(motions: &[Motion]) -> Result<Se3, Error> {
    let pairs = screw_pairs(motions);
    let step = pairs.len().div_ceil(PARTNERS).max(1);
    let (mut rotation, mut frames) = (Matrix3::zeros(), Vec::new());
    for (i, first) in pairs.iter().enumerate() {
        for second in pairs.iter().skip((i + 1).next_multiple_of(step)).step_by(step) {
            let (Some(hand), Some(eye)) =
                (Frame::of(first, second, |p| &p.hand), Frame::of(first, second, |p| &p.eye))
            else {
                continue;
            };
            let weight = (first.weight * second.weight * hand.sine.min(eye.sine)).powi(2);
            rotation += hand.axes * eye.axes.transpose() * weight;
            frames.push((weight, hand.origin, eye.origin));
        }
    }
    let rotation = rotation_from_correlation(&rotation)?;
    let (mut translation, mut total) = (Vector3::zeros(), 0.0);
    for (weight, hand, eye) in frames {
        translation += (hand - rotation * eye) * weight;
        total += weight;
    }
    Ok(Se3::new(rotation, translation / total))
}

/// The frame of two lines: first direction, common normal, and where the normal meets the first line.
struct Frame {
    axes: Matrix3<f64>,
    origin: Vector3<f64>,
    sine: f64,
}

impl Frame {
    /// `None` if the lines are parallel.
    fn of(first: &ScrewPair, second: &ScrewPair, side: fn(&ScrewPair) -> &Axis) -> Option<Self> {
        let (a, b) = (side(first), side(second));
        let normal = a.direction.cross(&b.direction);
        let sine = normal.norm();
        if sine < PARALLEL {
            return None;
        }
        let normal = normal / sine;
        let from = a.weighted_point / first.weight;
        let between = b.weighted_point / second.weight - from;
        let along = between.cross(&b.direction).dot(&normal) / sine;
        let axes = Matrix3::from_columns(&[a.direction, normal, a.direction.cross(&normal)]);
        Some(Self { axes, origin: from + a.direction * along, sine })
    }
}
