//! Many configurations at once: forward kinematics with lanes = configurations, Jacobians one by one.

#![expect(clippy::inline_always, reason = "the kernel exists only inside the entry point of its unit")]

use nalgebra::{Vector3, Vector6};

use super::chain::{Chain, JointKind, MAX_JOINTS};
use crate::error::Error;
use crate::interrupt::checked;
use crate::se3::Se3;
use crate::simd::{Kernel, LARGEST_ANGLE, MAX_LANES, Simd, Vector, VectorUnit, dispatch, sin_cos};

/// In which frame a Jacobian's twists are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame {
    /// `T(q + dq) ~ exp(J dq) T(q)`.
    Base,
    /// `T(q + dq) ~ T(q) exp(J dq)`.
    Flange,
}

/// Entries of a homogeneous 4 x 4 matrix.
const MATRIX: usize = 16;

impl Chain {
    /// `T_base_flange` as row-major 4 x 4 matrices, one after another, of configurations one after another.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] if `q` is not a whole number of configurations, `poses` does not hold as many
    /// matrices, or a position is not finite.
    pub fn forward_all(&self, q: &[f64], poses: &mut [f64]) -> Result<(), Error> {
        self.forward_all_on(VectorUnit::widest(), q, poses)
    }

    /// As [`Chain::forward_all`] on a given vector unit.
    ///
    /// # Errors
    /// As [`Chain::forward_all`].
    pub fn forward_all_on(&self, unit: VectorUnit, q: &[f64], poses: &mut [f64]) -> Result<(), Error> {
        let count = self.check(q)?;
        if poses.len() != count * MATRIX {
            return Err(Error::invalid(format!("{} entries for {count} poses of 16", poses.len())));
        }
        let vectorised = self.joints().iter().all(|j| j.kind == JointKind::Revolute)
            && q.iter().all(|q| q.abs() <= LARGEST_ANGLE);
        if vectorised {
            dispatch(unit, Forward { chain: self, q, poses });
            return Ok(());
        }
        for (q, pose) in checked(q.chunks_exact(self.len()).zip(poses.chunks_exact_mut(MATRIX))) {
            write_pose(&self.forward(q), pose);
        }
        Ok(())
    }

    /// Jacobians as row-major 6 x n matrices, one after another.
    ///
    /// # Errors
    /// As [`Chain::forward_all`].
    pub fn jacobian_all(&self, frame: Frame, q: &[f64], jacobians: &mut [f64]) -> Result<(), Error> {
        let count = self.check(q)?;
        let n = self.len();
        if jacobians.len() != count * 6 * n {
            return Err(Error::invalid(format!(
                "{} entries for {count} Jacobians of 6 x {n}",
                jacobians.len()
            )));
        }
        for (q, out) in checked(q.chunks_exact(n).zip(jacobians.chunks_exact_mut(6 * n))) {
            let (_, columns) = match frame {
                Frame::Base => self.base_jacobian(q),
                Frame::Flange => self.flange_jacobian(q),
            };
            for (row, entries) in out.chunks_exact_mut(n).enumerate() {
                for (entry, column) in entries.iter_mut().zip(&columns) {
                    *entry = column[row];
                }
            }
        }
        Ok(())
    }

    /// Poses in the base as row-major 4 x 4 matrices, `n + 2` of each configuration: the base itself, each joint in its
    /// own frame where it has moved, the flange.
    ///
    /// # Errors
    /// As [`Chain::forward_all`].
    pub fn frames_all(&self, q: &[f64], frames: &mut [f64]) -> Result<(), Error> {
        let count = self.check(q)?;
        let each = MATRIX * (self.len() + 2);
        if frames.len() != count * each {
            return Err(Error::invalid(format!("{} entries for {count} times {each}", frames.len())));
        }
        for (q, out) in checked(q.chunks_exact(self.len()).zip(frames.chunks_exact_mut(each))) {
            let (flange, moved) = self.moved(q);
            let base = Se3::identity();
            let all = [&base].into_iter().chain(&moved[..self.len()]).chain([&flange]);
            all.zip(out.chunks_exact_mut(MATRIX)).for_each(|(frame, out)| write_pose(frame, out));
        }
        Ok(())
    }

    /// Twists of the flange where joints sit displaced on the link before them, as row-major 6 x m matrices, one after
    /// another: column `w` for `ways[w]`, a joint and its twist in its own frame before it moves.
    ///
    /// # Errors
    /// As [`Chain::forward_all`], and for a joint that the chain does not have.
    pub fn displacements_all(
        &self,
        frame: Frame,
        q: &[f64],
        ways: &[(usize, Vector6<f64>)],
        out: &mut [f64],
    ) -> Result<(), Error> {
        let count = self.check(q)?;
        let m = ways.len();
        if out.len() != count * 6 * m || ways.iter().any(|(joint, _)| *joint >= self.len()) {
            return Err(Error::invalid(format!("{count} matrices of 6 x {m} for joints of this chain")));
        }
        if m == 0 {
            return Ok(());
        }
        // Along the frames whose z is an axis, what shifts and what turns.
        let turned = |(joint, twist): &(usize, Vector6<f64>)| {
            // Its own frame to the one whose z is its axis.
            let turn = self.turns[*joint].rotation;
            let (rho, phi) = (twist.fixed_rows::<3>(0), twist.fixed_rows::<3>(3));
            (*joint, turn * rho, (phi != Vector3::zeros()).then(|| turn * phi))
        };
        let ways: Vec<_> = ways.iter().map(turned).collect();
        for (q, out) in checked(q.chunks_exact(self.len()).zip(out.chunks_exact_mut(6 * m))) {
            let (flange, mut places) = self.places(q);
            if frame == Frame::Flange {
                let back = flange.inverse();
                places[..self.len()].iter_mut().for_each(|place| *place = back * *place);
            }
            for (w, (joint, rho, phi)) in ways.iter().enumerate() {
                let place = &places[*joint];
                let (mut rho, mut phi) = (place.rotation * rho, *phi);
                if let Some(phi) = &mut phi {
                    *phi = place.rotation * *phi;
                    rho += place.translation.cross(phi);
                }
                let phi = phi.unwrap_or_default();
                for (row, entry) in rho.iter().chain(&phi).enumerate() {
                    out[row * m + w] = *entry;
                }
            }
        }
        Ok(())
    }

    /// Number of configurations in `q`, all finite.
    fn check(&self, q: &[f64]) -> Result<usize, Error> {
        let n = self.len();
        if !q.len().is_multiple_of(n) {
            return Err(Error::invalid(format!("{} joint positions are no multiple of {n} joints", q.len())));
        }
        if let Some(i) = q.iter().position(|q| !q.is_finite()) {
            return Err(Error::invalid(format!(
                "configuration {}, joint {}: the position is not finite",
                i / n,
                i % n
            )));
        }
        Ok(q.len() / n)
    }
}

fn write_pose(t: &Se3, out: &mut [f64]) {
    for row in 0..3 {
        for column in 0..3 {
            out[4 * row + column] = t.rotation[(row, column)];
        }
        out[4 * row + 3] = t.translation[row];
    }
    out[12..MATRIX].copy_from_slice(&[0.0, 0.0, 0.0, 1.0]);
}

/// Turning joints only; angles at most [`LARGEST_ANGLE`].
struct Forward<'a> {
    chain: &'a Chain,
    q: &'a [f64],
    poses: &'a mut [f64],
}

impl Kernel for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let n = self.chain.len();
        let lanes = S::LANES;
        let zero = simd.splat(0.0);
        let mut angles = [0.0; MAX_LANES];
        let mut cells = [[0.0; MAX_LANES]; 12];
        for (q, poses) in checked(self.q.chunks(n * lanes).zip(self.poses.chunks_mut(MATRIX * lanes))) {
            let here = q.len() / n;
            let mut turns = [(zero, zero); MAX_JOINTS];
            for (i, turn) in turns.iter_mut().take(n).enumerate() {
                for (lane, angle) in angles.iter_mut().take(here).enumerate() {
                    *angle = q[lane * n + i];
                }
                *turn = sin_cos(simd, simd.load(&angles));
            }
            // A row of the product needs nothing of the other rows: four vectors travel along the chain.
            for row in 0..3 {
                let first = &self.chain.links[0];
                let r = &first.rotation;
                let mut x = simd.splat(r[(row, 0)]);
                let mut y = simd.splat(r[(row, 1)]);
                let mut z = simd.splat(r[(row, 2)]);
                let mut t = simd.splat(first.translation[row]);
                for ((s, c), link) in turns.iter().take(n).zip(&self.chain.links[1..]) {
                    let (a, b) = (x.mul_add(*c, y * *s), x.neg_mul_add(*s, y * *c));
                    let (r, p) = (&link.rotation, &link.translation);
                    t = a.mul_add(simd.splat(p.x), b.mul_add(simd.splat(p.y), z.mul_add(simd.splat(p.z), t)));
                    x = a.mul_add(simd.splat(r.m11), b.mul_add(simd.splat(r.m21), z * simd.splat(r.m31)));
                    y = a.mul_add(simd.splat(r.m12), b.mul_add(simd.splat(r.m22), z * simd.splat(r.m32)));
                    z = a.mul_add(simd.splat(r.m13), b.mul_add(simd.splat(r.m23), z * simd.splat(r.m33)));
                }
                x.store(&mut cells[4 * row]);
                y.store(&mut cells[4 * row + 1]);
                z.store(&mut cells[4 * row + 2]);
                t.store(&mut cells[4 * row + 3]);
            }
            for (lane, pose) in poses.chunks_exact_mut(MATRIX).enumerate() {
                for (entry, cell) in pose.iter_mut().zip(&cells) {
                    *entry = cell[lane];
                }
                pose[12..].copy_from_slice(&[0.0, 0.0, 0.0, 1.0]);
            }
        }
    }
}
