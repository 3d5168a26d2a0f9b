//! Relative motions between pairs of views, the input of the `AX = XB` family.

use nalgebra::{Vector3, Vector4};

use super::quaternion::{positive_from_rotation, vector_part};
use crate::se3::Se3;

/// Relative rotations closer than this to half a turn are left out, radians (2.9 degrees).
///
/// At half a turn the axis is known only up to its sign, and noise decides which one is measured. Two such
/// motions leave two solutions half a turn apart, so they cannot count as evidence of two axes either.
pub const HALF_TURN_MARGIN_RAD: f64 = 0.05;

/// Most pairs that are used; up to 100 views every pair is.
pub const MAX_PAIRS: usize = 5_000;

/// Most pairs whose rotation is looked at; up to 2,000 views every pair is.
const MAX_CANDIDATES: usize = 2_000_000;

/// The motion from view i to view j: `hand Z = Z eye` with `Z = X^-1`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// `A_j A_i^-1`, in the flange frame (eye-in-hand) or the base frame (eye-to-hand).
    pub hand: Se3,
    /// `C_j C_i^-1`, in the camera frame.
    pub eye: Se3,
    /// Unit quaternion of the hand's rotation, `w >= 0`.
    pub hand_quaternion: Vector4<f64>,
    /// Unit quaternion of the eye's rotation, `w >= 0`.
    pub eye_quaternion: Vector4<f64>,
}

impl Motion {
    fn between(a: &[Se3], c: &[Se3], (i, j): (usize, usize)) -> Self {
        let hand = a[j] * a[i].inverse();
        let eye = c[j] * c[i].inverse();
        Self {
            hand,
            eye,
            hand_quaternion: positive_from_rotation(&hand.rotation),
            eye_quaternion: positive_from_rotation(&eye.rotation),
        }
    }

    /// `2 sin(angle / 2) axis` of the hand: Tsai and Lenz's modified Rodrigues vector (1989).
    pub fn hand_axis(&self) -> Vector3<f64> {
        vector_part(&self.hand_quaternion) * 2.0
    }

    /// `2 sin(angle / 2) axis` of the eye.
    pub fn eye_axis(&self) -> Vector3<f64> {
        vector_part(&self.eye_quaternion) * 2.0
    }

    /// Rotation angle of the hand, in `[0, pi]`.
    pub fn hand_angle(&self) -> f64 {
        angle(&self.hand_quaternion)
    }

    /// Rotation angle of the eye, in `[0, pi]`.
    pub fn eye_angle(&self) -> f64 {
        angle(&self.eye_quaternion)
    }
}

fn quaternions(transforms: &[Se3]) -> Vec<Vector4<f64>> {
    transforms.iter().map(|t| positive_from_rotation(&t.rotation)).collect()
}

fn angle(q: &Vector4<f64>) -> f64 {
    2.0 * vector_part(q).norm().atan2(q[0])
}

/// The pairs that the methods work on, and what was found on the way.
pub(super) struct Motions {
    /// Motions that are not half a turn.
    pub usable: Vec<Motion>,
    /// Pairs left out because they are half a turn.
    pub half_turns: usize,
}

impl Motions {
    /// Pairs the views.
    ///
    /// All pairs up to [`MAX_PAIRS`]. Beyond that the pairs with the largest rotation, no view in more than
    /// its equal share of them: without the share a few extreme views would be in every pair, and their noise
    /// in every equation. Small rotations need not be left out: every method weights a motion by its
    /// rotation.
    pub fn between(a: &[Se3], c: &[Se3]) -> Self {
        let views = a.len();
        let (hands, eyes) = (quaternions(a), quaternions(c));
        let smallest_cos_half = (HALF_TURN_MARGIN_RAD / 2.0).sin();

        let step = (views * (views - 1) / 2).div_ceil(MAX_CANDIDATES).max(1);
        let mut pairs = Vec::new();
        let mut half_turns = 0;
        for i in 0..views {
            for j in (i + step..views).step_by(step) {
                // Cosine of half the relative angle: cheap enough for every pair.
                let cos_half = hands[i].dot(&hands[j]).abs().min(eyes[i].dot(&eyes[j]).abs());
                if cos_half < smallest_cos_half {
                    half_turns += 1;
                } else {
                    pairs.push((cos_half, i, j));
                }
            }
        }
        if pairs.len() > MAX_PAIRS {
            pairs.sort_unstable_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)).then(p.2.cmp(&q.2)));
            let share = (2 * MAX_PAIRS).div_ceil(views);
            let mut uses = vec![0; views];
            pairs.retain(|&(_, i, j)| {
                let free = uses[i] < share && uses[j] < share;
                if free {
                    uses[i] += 1;
                    uses[j] += 1;
                }
                free
            });
        }
        let usable = pairs.into_iter().map(|(_, i, j)| Motion::between(a, c, (i, j))).collect();
        Self { usable, half_turns }
    }
}

/// Quaternions of hand and eye, one of each per view.
pub(super) type SignedQuaternions = (Vec<Vector4<f64>>, Vec<Vector4<f64>>);

/// Quaternions of the views, the eye's with signs such that `eye[k] x = y hand[k]` holds with one `x` and `y`
/// for all.
///
/// A rotation is two quaternions, `q` and `-q`. Relative motions of hand and eye have the same angle, so the
/// dot products between two views must have the same sign in both lists; signs are carried along a tree of
/// the smallest relative rotations, where the dot products are farthest from zero.
///
/// Returns `None` if some view is half a turn away from all others: its sign is then anyone's guess.
pub(super) fn consistent_signs(hand: &[Se3], eye: &[Se3]) -> Option<SignedQuaternions> {
    let (hands, mut eyes) = (quaternions(hand), quaternions(eye));
    let products =
        |eyes: &[Vector4<f64>], i: usize, j: usize| (hands[i].dot(&hands[j]), eyes[i].dot(&eyes[j]));
    // Prim's algorithm; `best[k]` is how surely and from whom view k gets its sign.
    let mut best = vec![(0.0_f64, 0_usize); hands.len()];
    let mut open: Vec<usize> = (1..hands.len()).collect();
    let mut last = 0;
    while !open.is_empty() {
        for &k in &open {
            let (h, e) = products(&eyes, last, k);
            let sure = h.abs().min(e.abs());
            if sure > best[k].0 {
                best[k] = (sure, last);
            }
        }
        let position = (0..open.len()).max_by(|&p, &q| best[open[p]].0.total_cmp(&best[open[q]].0))?;
        let k = open.swap_remove(position);
        let (sure, parent) = best[k];
        if sure < (HALF_TURN_MARGIN_RAD / 2.0).sin() {
            return None;
        }
        let (h, e) = products(&eyes, parent, k);
        if h * e < 0.0 {
            eyes[k] = -eyes[k];
        }
        last = k;
    }
    Some((hands, eyes))
}
