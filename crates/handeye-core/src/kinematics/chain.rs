//! The description of a chain, checked once.

use nalgebra::{Matrix3, Vector3};

use crate::error::Error;
use crate::se3::Se3;

/// Most joints of a chain: enough for an arm on a track and a turntable, few enough to keep on the stack.
pub const MAX_JOINTS: usize = 16;

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about its axis, radians.
    Revolute,
    /// Slides along its axis, metres.
    Prismatic,
}

/// A joint that moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// How it moves.
    pub kind: JointKind,
    /// Its frame at position zero in the frame of the joint before it, or in the base.
    pub placement: Se3,
    /// Its axis in its own frame; made a unit vector by [`Chain::new`].
    pub axis: Vector3<f64>,
    /// Least position, radians or metres; minus infinity for none.
    pub lower: f64,
    /// Greatest position; infinity for none.
    pub upper: f64,
}

/// A serial arm of at most [`MAX_JOINTS`] joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    joints: Vec<Joint>,
    tip: Se3,
    /// From the axis-aligned frame before joint `i` to that of joint `i`; one more for the flange.
    pub(super) links: Vec<Se3>,
    /// From each joint's own frame to the one whose z is its axis.
    pub(super) turns: Vec<Se3>,
}

impl Chain {
    /// A chain from its joints, base first, and the pose of the flange in the frame of the last joint.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for no or too many joints, a value that is not finite, an axis without direction, or
    /// limits in the wrong order.
    pub fn new(joints: Vec<Joint>, tip: Se3) -> Result<Self, Error> {
        if joints.is_empty() || joints.len() > MAX_JOINTS {
            return Err(Error::invalid(format!(
                "a chain has 1 to {MAX_JOINTS} joints that move, found {}",
                joints.len()
            )));
        }
        let mut joints = joints;
        for (i, joint) in joints.iter_mut().enumerate() {
            let norm = joint.axis.norm();
            if !(norm > 1e-9 && norm.is_finite() && is_finite(&joint.placement)) {
                return Err(Error::invalid(format!(
                    "joint {i}: no finite placement, or an axis of no length"
                )));
            }
            if joint.lower.is_nan() || joint.upper.is_nan() || joint.lower > joint.upper {
                return Err(Error::invalid(format!(
                    "joint {i}: limits {} to {} are not in order",
                    joint.lower, joint.upper
                )));
            }
            joint.axis /= norm;
        }
        if !is_finite(&tip) {
            return Err(Error::invalid("the pose of the flange is not finite"));
        }
        let mut links = Vec::with_capacity(joints.len() + 1);
        let mut turns = Vec::with_capacity(joints.len());
        let mut back = Se3::identity();
        for joint in &joints {
            let turn = Se3::new(turn_to(&joint.axis), Vector3::zeros());
            links.push(back * joint.placement * turn);
            back = turn.inverse();
            turns.push(back);
        }
        links.push(back * tip);
        Ok(Self { joints, tip, links, turns })
    }

    /// The joints, base first.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Pose of the flange in the frame of the last joint.
    pub fn tip(&self) -> &Se3 {
        &self.tip
    }

    /// Number of joints.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// Never: a chain has at least one joint.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Whether all positions lie within their limits.
    pub fn within_limits(&self, q: &[f64]) -> bool {
        q.len() == self.len() && self.joints.iter().zip(q).all(|(j, q)| (j.lower..=j.upper).contains(q))
    }
}

fn is_finite(t: &Se3) -> bool {
    t.rotation.iter().chain(t.translation.iter()).all(|x| x.is_finite())
}

/// A rotation that takes `z` to a unit axis: the identity for `z` itself, without rounding for the other axes.
fn turn_to(axis: &Vector3<f64>) -> Matrix3<f64> {
    // The cross product with the coordinate axis furthest from it spans the plane across.
    let aside = match axis.iamin() {
        0 => Vector3::x(),
        1 => Vector3::y(),
        _ => Vector3::z(),
    };
    let x = if *axis == Vector3::z() { Vector3::x() } else { aside.cross(axis).normalize() };
    Matrix3::from_columns(&[x, axis.cross(&x), *axis])
}
