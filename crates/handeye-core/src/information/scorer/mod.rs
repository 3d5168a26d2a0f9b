//! Gains of many candidates at once, lanes = candidates.
//!
//! A block of candidates goes through stages, each a kernel compiled for every vector unit: motions to poses
//! (`approach`), points to information (`pinhole`, `distorted`, `wide_points`, or feature by feature for circles and
//! fisheyes), information to determinants or decreases of a covariance (`algebra`, `wide_algebra`, over the covariances
//! of `forms`), and these to gains.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

mod algebra;
mod approach;
mod block;
mod distorted;
mod forms;
mod pinhole;
mod sight;
mod target;
#[cfg(test)]
mod test_scene;
#[cfg(test)]
mod tests;
mod wide_algebra;
mod wide_points;
mod window;

use nalgebra::{Matrix3, Matrix4, Matrix6, Vector3};

use self::algebra::{Determinant, Gains};
use self::approach::{Approach, MATRIX};
use self::block::{BLOCK, Block, Row};
use self::distorted::Distorted;
use self::forms::{Arm, Entropies, Form, Observed, packed, predicted, robot_only};
use self::pinhole::Pinhole;
pub(super) use self::sight::in_sight;
use self::target::Target;
use self::wide_algebra::{Outcome, Wide};
use self::wide_points::{Column, WidePoints};
use self::window::Window;
use super::belief::Belief;
use super::candidate::{ArmColumns, CandidateModel, Execution, Motions, Sums};
use super::criteria::{Gain, Quantity};
use crate::batched_algebra::{UPPER, upper};
use crate::camera::{Camera, Lens};
use crate::error::Error;
use crate::interrupt;
use crate::least_squares::PixelParameters;
use crate::se3::Se3;
use crate::se3::entries;
use crate::simd::{VectorUnit, dispatch};

/// Everything about a call that does not change from candidate to candidate.
pub(super) struct Scorer<'a> {
    model: &'a CandidateModel<'a>,
    x: [f64; 12],
    y: [f64; 12],
    goal: Goal<'a>,
    /// Columns of the arm's constants and of its noise.
    arm_counts: (usize, usize),
    /// Present where lanes can do the points.
    lanes: Option<(Window, Target)>,
    columns: Vec<Column>,
    unit: VectorUnit,
}

/// What makes a gain.
enum Goal<'a> {
    /// None is wanted, only what is in sight.
    Sight,
    Entropy(Entropies),
    Trace(Form, Observed),
    HandEye(Form, Observed, Box<dyn Gain + 'a>),
}

impl<'a> Scorer<'a> {
    /// For the gains that a criterion makes of a quantity over a belief.
    pub fn new(
        model: &'a CandidateModel<'a>,
        unit: VectorUnit,
        (belief, quantity, gain): (&'a Belief, &Quantity, Box<dyn Gain + 'a>),
        arm: Option<&ArmColumns<'_>>,
    ) -> Result<Self, Error> {
        let mut scorer = Self::without_goal(model, unit);
        let (count, x, robot) = (scorer.columns.len(), &model.x, &model.robot);
        scorer.arm_counts = arm.map_or((0, 0), |arm| arm.counts);
        let (constants, noise) = scorer.arm_counts;
        let arm = Arm { known: constants > 0, noisy: noise > 0 };
        scorer.goal = match quantity {
            Quantity::Entropy(of) => Goal::Entropy(Entropies::new(belief, *of, count, x, robot, arm)?),
            Quantity::CovarianceTrace(weights) => Goal::Trace(
                predicted(belief, count, x, robot, arm)?,
                Observed::covariance(belief, count, weights, arm),
            ),
            Quantity::InformationTrace(weights) => {
                Goal::Trace(robot_only(count, x, robot, arm), Observed::information(count, weights))
            }
            Quantity::HandEyeCovariance => Goal::HandEye(
                predicted(belief, count, x, robot, arm)?,
                Observed::covariance(belief, count, &[1.0; 6], arm),
                gain,
            ),
        };
        Ok(scorer)
    }

    fn without_goal(model: &'a CandidateModel<'a>, unit: VectorUnit) -> Self {
        let target = if model.camera.lens.in_lanes() { Target::new(model.features) } else { None };
        Self {
            model,
            x: entries(&model.x),
            y: entries(&model.y),
            goal: Goal::Sight,
            arm_counts: (0, 0),
            lanes: target.map(|target| (window(model), target)),
            columns: model.pixel_parameters.map_or_else(Vec::new, columns),
            unit,
        }
    }

    /// Gains of motions; NaN where too little would be in sight.
    pub fn score(
        &self,
        motions: Motions<'_>,
        arm: Option<ArmColumns<'_>>,
        execution: &Execution,
        gains: &mut [f64],
    ) -> Result<(), Error> {
        let threads = execution.threads_for(gains.len());
        if threads == 1 {
            return self.score_in_turn(motions, arm, gains);
        }
        let share = gains.len().div_ceil(threads).next_multiple_of(BLOCK);
        std::thread::scope(|scope| {
            let workers: Vec<_> = gains
                .chunks_mut(share)
                .enumerate()
                .map(|(i, gains)| {
                    let motions = motions.part(i * share, gains.len());
                    let arm = arm.map(|arm| arm.part(i * share, gains.len()));
                    scope.spawn(move || self.score_in_turn(motions, arm, gains))
                })
                .collect();
            workers.into_iter().try_for_each(|worker| match worker.join() {
                Ok(outcome) => outcome,
                Err(panic) => std::panic::resume_unwind(panic),
            })
        })
    }

    fn score_in_turn(
        &self,
        motions: Motions<'_>,
        arm: Option<ArmColumns<'_>>,
        gains: &mut [f64],
    ) -> Result<(), Error> {
        let mut block = Box::new(Block::new(self.size(), self.arm_counts));
        let mut sums = self.model.sums();
        let mut padded = [0.0; BLOCK * MATRIX];
        let mut out = [0.0; BLOCK];
        for (i, gains) in gains.chunks_mut(BLOCK).enumerate() {
            interrupt::check();
            let part = motions.part(i * BLOCK, gains.len());
            let matrices = match part {
                Motions::Matrices(matrices) if gains.len() == BLOCK => matrices,
                _ => {
                    part.fill(&mut padded);
                    &padded
                }
            };
            self.approach(matrices, &mut block)?;
            self.inform(&mut block, &mut sums);
            if let Some(arm) = &arm {
                self.attach(&arm.part(i * BLOCK, gains.len()), &mut block);
            }
            self.weigh(&mut block, &mut out);
            gains.copy_from_slice(&out[..gains.len()]);
        }
        Ok(())
    }

    /// Puts what the arm's errors move into the camera frame.
    fn attach(&self, arm: &ArmColumns<'_>, block: &mut Block) {
        let to_camera = self.model.x.adjoint();
        let fewest = self.model.visibility.fewest.max(1) as f64;
        let count = arm.counts.0 + arm.counts.1;
        let mut moved = vec![0.0; count];
        for (lane, entries) in arm.entries.chunks_exact((6 * count).max(1)).enumerate() {
            if block.seen[lane] < fewest {
                continue;
            }
            for i in 0..6 {
                moved.fill(0.0);
                // Of a turn nothing comes of a shift.
                for (k, row) in entries.chunks_exact(count).enumerate().skip(i / 3 * 3) {
                    let factor = to_camera[(i, k)];
                    for (to, from) in moved.iter_mut().zip(row) {
                        *to += factor * from;
                    }
                }
                for (row, moved) in block.arm.iter_mut().skip(i).step_by(6).zip(&moved) {
                    row[lane] = *moved;
                }
            }
        }
    }

    /// Rows of a candidate's information.
    fn size(&self) -> usize {
        6 + self.columns.len()
    }

    fn approach(&self, matrices: &[f64], block: &mut Block) -> Result<(), Error> {
        let (x, y) = (&self.x, &self.y);
        if dispatch(self.unit, Approach { x, y, motions: matrices, block }) {
            return Ok(());
        }
        // One by one: either says which is not rigid and why, or repairs what lanes were too strict about.
        let mut repaired = [0.0; BLOCK * MATRIX];
        for (to, from) in repaired.chunks_exact_mut(MATRIX).zip(matrices.chunks_exact(MATRIX)) {
            let motion = Se3::from_matrix(&Matrix4::from_row_slice(from))?;
            to.copy_from_slice(motion.to_matrix().transpose().as_slice());
        }
        if dispatch(self.unit, Approach { x, y, motions: &repaired, block }) {
            return Ok(());
        }
        Err(Error::NotRigid { deviation: f64::NAN })
    }

    /// Points to information.
    fn inform(&self, block: &mut Block, sums: &mut Sums) {
        let Some((window, target)) = &self.lanes else {
            return self.inform_one_by_one(block, sums);
        };
        let parameters = &self.model.camera.parameters;
        macro_rules! see {
            ($kernel:ident $(, $flag:literal)*) => {
                dispatch(self.unit, $kernel::<$($flag),*> { parameters, window, target, block })
            };
        }
        macro_rules! see_wide {
            ($($flag:literal),*) => {{
                let columns = &self.columns;
                dispatch(self.unit, WidePoints::<$($flag),*> { parameters, columns, window, target, block })
            }};
        }
        let distorts = self.model.camera.lens != Lens::Pinhole;
        if !distorts && self.inform_of_plane(window, target, block) {
            return;
        }
        match (self.model.camera.lens, self.columns.is_empty()) {
            (Lens::Pinhole, false) => see_wide!(false, false, false),
            (Lens::Pinhole | Lens::BrownConrady4 | Lens::BrownConrady5, true) => {
                see!(Distorted, false, false);
            }
            (Lens::BrownConrady4 | Lens::BrownConrady5, false) => see_wide!(true, false, false),
            (Lens::BrownConrady8, true) => see!(Distorted, true, false),
            (Lens::BrownConrady12, true) => see!(Distorted, true, true),
            (Lens::BrownConrady8 | Lens::BrownConrady12, false) => see_wide!(true, true, true),
            _ => unreachable!("other lenses go feature by feature"),
        }
    }

    /// The same for a lens that leaves points where they are; false where it takes other means.
    fn inform_of_plane(&self, window: &Window, target: &Target, block: &mut Block) -> bool {
        let Some(plane_z) = target.plane_z else { return false };
        let columns = &self.columns;
        let focal = [0, 1].map(|i| self.model.camera.parameters[i]);
        if columns.is_empty() {
            return dispatch(self.unit, Pinhole::<false> { focal, columns, window, target, plane_z, block });
        }
        columns.iter().all(Column::is_of_camera)
            && dispatch(self.unit, Pinhole::<true> { focal, columns, window, target, plane_z, block })
    }

    fn inform_one_by_one(&self, block: &mut Block, sums: &mut Sums) {
        let size = self.size();
        for lane in 0..BLOCK {
            let pose = Se3::new(
                Matrix3::from_fn(|i, j| block.pose[3 * i + j][lane]),
                Vector3::from_fn(|i, _| block.pose[9 + i][lane]),
            );
            block.seen[lane] = self.model.sum(&pose, sums) as f64;
            let (twist, _) = sums.moments.finish();
            for i in 0..size {
                for j in i..size {
                    block.information[packed(size, i, j)][lane] = match &sums.columns {
                        Some(columns) if i >= 6 => columns.cc[(i - 6, j - 6)],
                        Some(columns) if j >= 6 => columns.mc[(i, j - 6)],
                        _ => twist[(i, j)],
                    };
                }
            }
        }
    }

    /// Information to gains.
    fn weigh(&self, block: &mut Block, out: &mut Row) {
        let mut scale = 1.0;
        if self.lanes.is_some() {
            // Lanes leave out what is common to all points.
            scale = (self.model.camera.parameters[0] / self.model.pixel_sigma).powi(2);
        }
        let fewest = self.model.visibility.fewest.max(1) as f64;
        match &self.goal {
            Goal::Sight => {
                for (out, seen) in out.iter_mut().zip(&block.seen) {
                    *out = if *seen >= fewest { 1.0 } else { f64::NAN };
                }
            }
            Goal::Entropy(Entropies { with, without }) => {
                let mut determinants = [1.0; BLOCK];
                self.determinant(scale, with, block, &mut determinants);
                block.with = determinants;
                if let Some(without) = without {
                    self.determinant(scale, without, block, &mut determinants);
                    block.without = determinants;
                }
                dispatch(self.unit, Gains { block, fewest, compared: without.is_some(), out });
            }
            Goal::Trace(form, observed) => {
                self.take(scale, form, block, Outcome::Trace(observed, out));
                for (gain, seen) in out.iter_mut().zip(&block.seen) {
                    *gain = if *seen >= fewest { *gain } else { f64::NAN };
                }
            }
            Goal::HandEye(form, observed, gain) => {
                let mut decrease = [[0.0; BLOCK]; UPPER];
                self.take(scale, form, block, Outcome::Decrease(observed, &mut decrease));
                for lane in 0..BLOCK {
                    let here = Matrix6::from_fn(|i, j| decrease[upper(i, j)][lane]);
                    let enough = block.seen[lane] >= fewest;
                    out[lane] = if enough { gain.gain_of_decrease(&here) } else { f64::NAN };
                }
            }
        }
    }

    fn determinant(&self, scale: f64, form: &Form, block: &Block, out: &mut Row) {
        if form.size == 6 && form.arm.is_none() {
            dispatch(self.unit, Determinant { scale, size: self.size(), form, block, out });
        } else {
            self.take(scale, form, block, Outcome::Determinant(out));
        }
    }

    fn take(&self, scale: f64, form: &Form, block: &Block, outcome: Outcome<'_>) {
        let rows = self.size();
        if form.size <= 12 {
            dispatch(self.unit, Wide::<12, 78> { scale, form, rows, block, outcome });
        } else {
            dispatch(self.unit, Wide::<23, 276> { scale, form, rows, block, outcome });
        }
    }
}

/// The pixel parameters in the order of their columns.
fn columns(parameters: &PixelParameters) -> Vec<Column> {
    let scale = parameters.board_scale.then_some(Column::BoardScale);
    parameters.camera.iter().map(|i| Column::Camera(*i)).chain(scale).collect()
}

/// What of the plane at unit depth is in sight.
fn window(model: &CandidateModel<'_>) -> Window {
    let camera: &Camera = model.camera;
    let [fx, fy, cx, cy] = [0, 1, 2, 3].map(|i| camera.parameters[i]);
    let margin = model.visibility.margin_px;
    let (x, y) = match model.visibility.image {
        None => ([f64::NEG_INFINITY, f64::INFINITY], [f64::NEG_INFINITY, f64::INFINITY]),
        Some([width, height]) => (
            [(margin - cx) / fx, (width - 1.0 - margin - cx) / fx],
            [(margin - cy) / fy, (height - 1.0 - margin - cy) / fy],
        ),
    };
    Window { squared_aspect: (fy / fx).powi(2), x, y, max_squared_radius: camera.max_squared_radius() }
}
