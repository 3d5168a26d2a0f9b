//! Forward kinematics and Jacobians of one configuration; nothing is allocated.

use nalgebra::{Vector3, Vector6};

use super::chain::{Chain, JointKind, MAX_JOINTS};
use crate::se3::Se3;

/// Columns of a Jacobian, one twist `[rho; phi]` per joint; those beyond the number of joints are zero.
pub type Columns = [Vector6<f64>; MAX_JOINTS];

impl Chain {
    /// `T_base_flange` at joint positions `q`, radians and metres.
    ///
    /// # Panics
    /// If `q` has fewer entries than the chain has joints.
    pub fn forward(&self, q: &[f64]) -> Se3 {
        let mut t = self.links[0];
        for (i, joint) in self.joints().iter().enumerate() {
            move_joint(&mut t, joint.kind, q[i]);
            t = t * self.links[i + 1];
        }
        t
    }

    /// `T_base_flange`, and the twists by which a small motion of each joint moves it on the base side:
    /// `T(q + dq) ~ exp(J dq) T(q)`.
    pub fn base_jacobian(&self, q: &[f64]) -> (Se3, Columns) {
        let (flange, places, axes) = self.axes(q);
        let mut columns = [Vector6::zeros(); MAX_JOINTS];
        for (i, joint) in self.joints().iter().enumerate() {
            columns[i] = match joint.kind {
                JointKind::Revolute => twist(&places[i].cross(&axes[i]), &axes[i]),
                JointKind::Prismatic => twist(&axes[i], &Vector3::zeros()),
            };
        }
        (flange, columns)
    }

    /// `T_base_flange`, and the twists on the flange side: `T(q + dq) ~ T(q) exp(J dq)`.
    ///
    /// `J_flange = Ad(T^-1) J_base`, formed without the large numbers of a base far away.
    pub fn flange_jacobian(&self, q: &[f64]) -> (Se3, Columns) {
        let (flange, places, axes) = self.axes(q);
        let mut columns = [Vector6::zeros(); MAX_JOINTS];
        for (i, joint) in self.joints().iter().enumerate() {
            let axis = flange.rotation.tr_mul(&axes[i]);
            columns[i] = match joint.kind {
                JointKind::Revolute => {
                    let sweep = axes[i].cross(&(flange.translation - places[i]));
                    twist(&flange.rotation.tr_mul(&sweep), &axis)
                }
                JointKind::Prismatic => twist(&axis, &Vector3::zeros()),
            };
        }
        (flange, columns)
    }

    /// `T_base_flange`, and each joint before it moves, in the frame whose z is its axis.
    pub(super) fn places(&self, q: &[f64]) -> (Se3, [Se3; MAX_JOINTS]) {
        let mut places = [Se3::identity(); MAX_JOINTS];
        let mut t = self.links[0];
        for (i, joint) in self.joints().iter().enumerate() {
            places[i] = t;
            move_joint(&mut t, joint.kind, q[i]);
            t = t * self.links[i + 1];
        }
        (t, places)
    }

    /// `T_base_flange`, and each joint in its own frame where it has moved.
    pub(super) fn moved(&self, q: &[f64]) -> (Se3, [Se3; MAX_JOINTS]) {
        let mut moved = [Se3::identity(); MAX_JOINTS];
        let mut t = self.links[0];
        for (i, joint) in self.joints().iter().enumerate() {
            move_joint(&mut t, joint.kind, q[i]);
            moved[i] = t * self.turns[i];
            t = t * self.links[i + 1];
        }
        (t, moved)
    }

    /// The flange, and in base coordinates a point on and the direction of every joint's axis.
    pub(super) fn axes(&self, q: &[f64]) -> (Se3, [Vector3<f64>; MAX_JOINTS], [Vector3<f64>; MAX_JOINTS]) {
        let mut places = [Vector3::zeros(); MAX_JOINTS];
        let mut axes = [Vector3::zeros(); MAX_JOINTS];
        let mut t = self.links[0];
        for (i, joint) in self.joints().iter().enumerate() {
            places[i] = t.translation;
            axes[i] = t.rotation.column(2).into_owned();
            move_joint(&mut t, joint.kind, q[i]);
            t = t * self.links[i + 1];
        }
        (t, places, axes)
    }
}

/// Multiplies by a turn about or a shift along the frame's own `z`.
#[inline]
fn move_joint(t: &mut Se3, kind: JointKind, q: f64) {
    match kind {
        JointKind::Revolute => {
            let (s, c) = q.sin_cos();
            let r = &mut t.rotation;
            for row in 0..3 {
                let (x, y) = (r[(row, 0)], r[(row, 1)]);
                r[(row, 0)] = x * c + y * s;
                r[(row, 1)] = y * c - x * s;
            }
        }
        JointKind::Prismatic => t.translation += t.rotation.column(2) * q,
    }
}

#[inline]
fn twist(rho: &Vector3<f64>, phi: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(rho.x, rho.y, rho.z, phi.x, phi.y, phi.z)
}
