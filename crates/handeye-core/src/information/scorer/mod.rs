//! Entropy gains of many candidates at once, lanes = candidates.
//!
//! A block of candidates goes through four stages, each a kernel compiled for every vector unit: motions to poses
//! (`approach`), points to 6 x 6 information (`pinhole`, `distorted`, or feature by feature for circles and fisheyes),
//! information to determinants (`algebra`, over the covariances of `forms`), determinants to gains.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

mod algebra;
mod approach;
mod block;
mod distorted;
mod forms;
mod pinhole;
mod target;
#[cfg(test)]
mod tests;

use nalgebra::Matrix3;

use self::algebra::{Determinant, Gains};
use self::approach::{Approach, MATRIX, entries};
use self::block::{BLOCK, Block, upper};
use self::distorted::Distorted;
use self::forms::Forms;
use self::pinhole::{Pinhole, Window};
use self::target::Target;
use super::belief::Belief;
use super::candidate::{CandidateModel, Execution, Motions};
use super::criteria::EntropyOf;
use crate::camera::{Camera, Lens};
use crate::error::Error;
use crate::se3::Se3;
use crate::simd::{VectorUnit, dispatch};

/// Everything about a call that does not change from candidate to candidate.
pub(super) struct Scorer<'a> {
    model: &'a CandidateModel<'a>,
    x: [f64; 12],
    y: [f64; 12],
    forms: Forms,
    /// Present where lanes can do the points.
    lanes: Option<(Window, Target)>,
    fewest: f64,
    unit: VectorUnit,
}

impl<'a> Scorer<'a> {
    pub fn new(
        model: &'a CandidateModel<'a>,
        belief: &Belief,
        of: EntropyOf,
        unit: VectorUnit,
    ) -> Result<Self, Error> {
        let target =
            if model.camera.lens == Lens::KannalaBrandt { None } else { Target::new(model.features) };
        Ok(Self {
            model,
            x: entries(&model.x),
            y: entries(&model.y),
            forms: Forms::new(belief, of, &model.x, model.robot.as_ref())?,
            lanes: target.map(|target| (window(model), target)),
            fewest: model.sight.fewest.max(1) as f64,
            unit,
        })
    }

    /// Gains of motions; NaN where too little would be in sight.
    pub fn score(&self, motions: Motions<'_>, execution: &Execution, gains: &mut [f64]) -> Result<(), Error> {
        let threads = execution.threads_for(gains.len());
        if threads == 1 {
            return self.score_in_turn(motions, gains);
        }
        let share = gains.len().div_ceil(threads).next_multiple_of(BLOCK);
        std::thread::scope(|scope| {
            let workers: Vec<_> = gains
                .chunks_mut(share)
                .enumerate()
                .map(|(i, gains)| {
                    let motions = motions.part(i * share, gains.len());
                    scope.spawn(move || self.score_in_turn(motions, gains))
                })
                .collect();
            workers.into_iter().try_for_each(|worker| match worker.join() {
                Ok(outcome) => outcome,
                Err(panic) => std::panic::resume_unwind(panic),
            })
        })
    }

    fn score_in_turn(&self, motions: Motions<'_>, gains: &mut [f64]) -> Result<(), Error> {
        let mut block = Box::new(Block::new());
        let mut padded = [0.0; BLOCK * MATRIX];
        let mut out = [0.0; BLOCK];
        for (i, gains) in gains.chunks_mut(BLOCK).enumerate() {
            let part = motions.part(i * BLOCK, gains.len());
            let matrices = match part {
                Motions::Matrices(matrices) if gains.len() == BLOCK => matrices,
                _ => {
                    part.fill(&mut padded);
                    &padded
                }
            };
            self.approach(matrices, &mut block)?;
            self.inform(&mut block);
            self.weigh(&mut block, &mut out);
            gains.copy_from_slice(&out[..gains.len()]);
        }
        Ok(())
    }

    fn approach(&self, matrices: &[f64], block: &mut Block) -> Result<(), Error> {
        let (x, y) = (&self.x, &self.y);
        if dispatch(self.unit, Approach { x, y, motions: matrices, block }) {
            return Ok(());
        }
        // One by one: either says which is not rigid and why, or repairs what lanes were too strict about.
        let mut repaired = [0.0; BLOCK * MATRIX];
        for (to, from) in repaired.chunks_exact_mut(MATRIX).zip(matrices.chunks_exact(MATRIX)) {
            let motion = Se3::from_matrix(&nalgebra::Matrix4::from_row_slice(from))?;
            to.copy_from_slice(motion.to_matrix().transpose().as_slice());
        }
        if dispatch(self.unit, Approach { x, y, motions: &repaired, block }) {
            return Ok(());
        }
        Err(Error::NotRigid { deviation: f64::NAN })
    }

    /// Points to information.
    fn inform(&self, block: &mut Block) {
        let Some((window, target)) = &self.lanes else {
            return self.inform_one_by_one(block);
        };
        let parameters = &self.model.camera.parameters;
        match self.model.camera.lens {
            Lens::BrownConrady8 => {
                dispatch(self.unit, Distorted::<true, false> { parameters, window, target, block });
            }
            Lens::BrownConrady12 => {
                dispatch(self.unit, Distorted::<true, true> { parameters, window, target, block });
            }
            Lens::BrownConrady4 | Lens::BrownConrady5 => {
                dispatch(self.unit, Distorted::<false, false> { parameters, window, target, block });
            }
            Lens::Pinhole | Lens::KannalaBrandt => {
                dispatch(self.unit, Pinhole { window, target, block });
            }
        }
    }

    fn inform_one_by_one(&self, block: &mut Block) {
        for lane in 0..BLOCK {
            let pose = Se3::new(
                Matrix3::from_fn(|i, j| block.pose[3 * i + j][lane]),
                nalgebra::Vector3::from_fn(|i, _| block.pose[9 + i][lane]),
            );
            let (m, seen) = self.model.information(&pose);
            for i in 0..6 {
                for j in i..6 {
                    block.information[upper(i, j)][lane] = m[(i, j)];
                }
            }
            block.seen[lane] = seen as f64;
        }
    }

    /// Information to gains.
    fn weigh(&self, block: &mut Block, out: &mut [f64; BLOCK]) {
        let mut scale = 1.0;
        if self.lanes.is_some() {
            // Lanes leave out what is common to all points.
            scale = (self.model.camera.parameters[0] / self.model.pixel_sigma).powi(2);
        }
        let (mut with, mut without) = ([1.0; BLOCK], [1.0; BLOCK]);
        dispatch(self.unit, Determinant { scale, form: &self.forms.with, block, out: &mut with });
        if let Some(form) = &self.forms.without {
            dispatch(self.unit, Determinant { scale, form, block, out: &mut without });
        }
        (block.with, block.without) = (with, without);
        let compared = self.forms.without.is_some();
        dispatch(self.unit, Gains { block, fewest: self.fewest, compared, out });
    }
}

/// What of the plane at unit depth is in sight.
fn window(model: &CandidateModel<'_>) -> Window {
    let camera: &Camera = model.camera;
    let [fx, fy, cx, cy] = [0, 1, 2, 3].map(|i| camera.parameters[i]);
    let margin = model.sight.margin_px;
    let (x, y) = match model.sight.image {
        None => ([f64::NEG_INFINITY, f64::INFINITY], [f64::NEG_INFINITY, f64::INFINITY]),
        Some([width, height]) => (
            [(margin - cx) / fx, (width - 1.0 - margin - cx) / fx],
            [(margin - cy) / fy, (height - 1.0 - margin - cy) / fy],
        ),
    };
    Window { squared_aspect: (fy / fx).powi(2), x, y, max_squared_radius: camera.max_squared_radius() }
}
