//! Whether a set of views determines the answer at all.
//!
//! Rotations of hand and eye are related by `p = R q`, where `p` and `q` are `2 sin(angle / 2) axis` of the
//! two and `R` is the rotation of `Z = X^-1`. With `M = mean(p q')` and its singular values `s1 >= s2 >= s3`,
//! the rotation `R` is unique exactly if `u = s2 + sign(det M) s3` is positive (Kabsch 1978; Umeyama 1991),
//! and `sqrt(u)` is the root mean square rotation, in radians, about axes other than the dominant one: the
//! *spread*. The same number governs the translation, for `(R_a - I)' (R_a - I)` is `|p|^2 I - p p'`.
//!
//! Only rotation that hand *and* eye saw enters `M`: independent noise of the two averages out, and where the
//! hand is free of noise, parallel axes give a spread of exactly zero however noisy the camera is. Noise is
//! measured without knowing `X`: a rigid motion turns hand and eye by the same angle (screw congruence; Chen
//! 1991), so the differences of their angles are noise. Their median is not moved by a bad view.

use nalgebra::{Matrix3, Vector3};

use super::motion::{Motion, Motions};
use super::rotation_fit::Correlation;
use crate::error::Error;

/// Least spread, radians (0.11 degrees): about the noise of a camera pose, whatever the motions say about
/// theirs.
pub const MIN_SPREAD_RAD: f64 = 2e-3;

/// The spread must exceed the noise of the rotation angles by this factor.
///
/// What it does, by simulation (5,000 sets each). Parallel axes that noise of 1 mrad in the hand and 3 mrad
/// in the eye makes look different: 0.9 % of sets of three views pass, 0.2 % of four, 0.02 % of eight; a hand
/// without noise lets none pass. Legitimate sets of three views, noise 1 mrad in the eye, turned about random
/// axes: 7 % are refused at up to 3 degrees, 2 % at 5, 0.8 % at 10; of five views at 3 degrees 0.04 %.
pub const NOISE_FACTOR: f64 = 3.0;

/// Rotation of the robot below which its views count as not turned at all, radians (0.29 degrees): only for
/// the words.
const NO_ROTATION_RAD: f64 = 5e-3;

/// Extent below which positions count as equal, metres.
const SAME_PLACE_M: f64 = 1e-6;

/// The evidence: how much the views rotate, about how many axes, and how well hand and eye agree on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisSpread {
    /// Pairs of views looked at.
    pub pairs: usize,
    /// Pairs left out because they are half a turn to within [`super::HALF_TURN_MARGIN_RAD`].
    pub half_turns: usize,
    /// Largest relative rotation of the hand, radians.
    pub largest_rotation_rad: f64,
    /// Largest relative displacement of the hand, metres.
    pub largest_displacement_m: f64,
    /// Root mean square rotation of hand and eye about the dominant axis, radians (as `2 sin(angle / 2)`).
    pub dominant_rad: f64,
    /// The dominant axis of the hand, in the frame that X maps from: flange (eye-in-hand) or base
    /// (eye-to-hand).
    pub dominant_axis: Vector3<f64>,
    /// Root mean square rotation of hand and eye about all other axes: what must not vanish, radians.
    pub spread_rad: f64,
    /// As `dominant_rad`, of the hand alone, radians.
    pub hand_dominant_rad: f64,
    /// As `spread_rad`, of the hand alone, radians.
    pub hand_spread_rad: f64,
    /// Standard deviation of the difference of the rotation angles of hand and eye, by its median, radians.
    pub noise_rad: f64,
}

impl AxisSpread {
    pub(super) fn of(motions: &Motions) -> Result<Self, Error> {
        let pairs = motions.usable.len();
        let count = pairs.max(1) as f64;
        let mean_outer = |first: fn(&Motion) -> Vector3<f64>, second: fn(&Motion) -> Vector3<f64>| {
            motions.usable.iter().map(|m| first(m) * second(m).transpose()).sum::<Matrix3<f64>>() / count
        };
        let common = Correlation::of(&mean_outer(Motion::hand_axis, Motion::eye_axis))?;
        let hand = Correlation::of(&mean_outer(Motion::hand_axis, Motion::hand_axis))?;
        let largest = |value: fn(&Motion) -> f64| motions.usable.iter().map(value).fold(0.0_f64, f64::max);
        let rms = |mean_square: f64| mean_square.max(0.0).sqrt();
        // A sign that reads the same whichever way the decomposition came out.
        let axis = hand.left.column(0).into_owned();
        let axis = if axis[axis.iamax()] < 0.0 { -axis } else { axis };
        Ok(Self {
            pairs,
            half_turns: motions.half_turns,
            largest_rotation_rad: largest(Motion::hand_angle),
            largest_displacement_m: largest(|m| m.hand.translation.norm()),
            dominant_rad: rms(common.values[0]),
            dominant_axis: axis,
            spread_rad: rms(common.uniqueness()),
            hand_dominant_rad: rms(hand.values[0]),
            hand_spread_rad: rms(hand.uniqueness()),
            noise_rad: 1.4826 * median(motions.usable.iter().map(|m| (m.hand_angle() - m.eye_angle()).abs())),
        })
    }

    /// The spread that these views must reach, radians.
    pub fn needed_rad(&self) -> f64 {
        MIN_SPREAD_RAD.max(NOISE_FACTOR * self.noise_rad)
    }

    /// Refuses views that do not determine `X` and `Y`.
    ///
    /// # Errors
    /// [`Error::Degenerate`] saying what the views lack, with the numbers.
    pub fn require_two_axes(&self) -> Result<(), Error> {
        if self.spread_rad >= self.needed_rad() {
            return Ok(());
        }
        let half_turns = match self.half_turns {
            0 => String::new(),
            n => format!(
                "; {n} pairs of views half a turn apart were left out, for their axes have no known sign"
            ),
        };
        Err(Error::degenerate(self.reason() + &half_turns))
    }

    /// Why the spread is too small: the robot's own motion is looked at first, then whether the camera saw
    /// it.
    fn reason(&self) -> String {
        let deg = f64::to_degrees;
        let (spread, needed) = (deg(self.spread_rad), deg(self.needed_rad()));
        if self.pairs == 0 {
            return "every pair of views is half a turn apart: add views turned by less".to_owned();
        }
        if self.hand_dominant_rad < NO_ROTATION_RAD {
            let rotation = deg(self.largest_rotation_rad);
            return if self.largest_displacement_m < SAME_PLACE_M {
                format!(
                    "all views are alike: between two views the robot turned by {rotation:.4} deg and moved \
                     by {:.1e} m at most; move and turn it between views",
                    self.largest_displacement_m
                )
            } else {
                format!(
                    "the views differ by translation only: between two views the robot turned by \
                     {rotation:.4} deg at most; turn it about two axes between views"
                )
            };
        }
        let robot_turned = self.hand_spread_rad >= MIN_SPREAD_RAD;
        if robot_turned
            && (self.hand_spread_rad >= self.needed_rad() || self.dominant_rad < self.needed_rad())
        {
            return format!(
                "robot and camera do not report the same rotations: the angles between views differ by \
                 {:.3} deg, and the rotation about a second axis that both saw is {spread:.3} deg (needed: \
                 {needed:.3} deg, robot alone: {:.3} deg); poses and images may be paired wrongly, the \
                 target moved or taken for its symmetric twin, or the noise be too large for rotations this \
                 small",
                deg(self.noise_rad),
                deg(self.hand_spread_rad)
            );
        }
        // No minus before a zero.
        let axis = self.dominant_axis.map(|x| if x.abs() < 5e-4 { 0.0 } else { x });
        format!(
            "the rotation axes are parallel: all views turn about the axis ({:.3}, {:.3}, {:.3}) of the \
             flange frame (eye-in-hand) or base frame (eye-to-hand), by {:.3} deg rms, and about any other \
             by {spread:.4} deg rms (needed: {needed:.3} deg); turn the robot about another axis too",
            axis.x,
            axis.y,
            axis.z,
            deg(self.hand_dominant_rad)
        )
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    if values.is_empty() {
        return 0.0;
    }
    values.sort_unstable_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { f64::midpoint(values[middle - 1], values[middle]) }
}
