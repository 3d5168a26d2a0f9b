//! What a view not yet taken would tell: its predicted information, seen through the noise of the robot.

use nalgebra::{DMatrix, Matrix4, Matrix6, Vector2};

use super::belief::CHAIN;
use crate::camera::{Camera, Feature};
use crate::error::Error;
use crate::interrupt;
use crate::least_squares::{Moments, PixelColumns, PixelParameters, ViewBlock, marginalised};
use crate::se3::Se3;
use crate::simd::VectorUnit;
use crate::threads;

/// Which features a candidate is expected to see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visibility {
    /// Image width and height, px; `None`: whatever the lens can project counts.
    pub image: Option<[f64; 2]>,
    /// Distance that a feature must keep from the image border, px.
    pub margin_px: f64,
    /// Fewest features in sight; a candidate with fewer has no gain.
    pub fewest: usize,
}

/// What predicts a candidate: the current estimate and the noise its view would have.
#[derive(Clone, Debug)]
pub struct CandidateModel<'a> {
    /// Current camera.
    pub camera: &'a Camera,
    /// Current `X`.
    pub x: Se3,
    /// Current `Y`.
    pub y: Se3,
    /// Features of the target.
    pub features: &'a [Feature],
    /// Expected pixel noise, px.
    pub pixel_sigma: f64,
    /// Error of the robot at the candidate's station.
    pub robot: RobotError,
    /// Which pixel parameters are free.
    pub pixel_parameters: Option<&'a PixelParameters>,
    /// Number of kinematic parameters (their Jacobian comes with each candidate).
    pub kinematic_count: usize,
    /// What must be seen.
    pub visibility: Visibility,
}

/// A candidate's information `F F'` in all global parameters.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// `F`, `n x (6 + n_c)`.
    pub factor: DMatrix<f64>,
    /// Features in sight.
    pub seen: usize,
}

/// Error of the robot that is new at every station: square roots of the covariances of twists on both sides of `A`.
///
/// Eye-in-hand: `A = T_flange_base`, so left is the flange and right the base; eye-to-hand the other way round.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RobotError {
    /// On the left, `X exp(eps) A Y`; `None` where there is none.
    pub left: Option<Matrix6<f64>>,
    /// On the right, `X A exp(eps) Y`.
    pub right: Option<Matrix6<f64>>,
}

impl RobotError {
    /// On the left alone.
    pub fn on_left(root: Matrix6<f64>) -> Self {
        Self { left: Some(root), right: None }
    }

    /// On the right alone.
    pub fn on_right(root: Matrix6<f64>) -> Self {
        Self { left: None, right: Some(root) }
    }

    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        self.left.is_none() && self.right.is_none()
    }
}

/// How errors of the arm move one candidate, where its kinematics are known: `A <- exp(D dq) A`.
#[derive(Clone, Debug)]
pub struct CandidateJoints {
    /// Columns of the arm's constant errors that are parameters, `6 x kinematic_count`.
    pub constants: DMatrix<f64>,
    /// Square root of the covariance that noise of the joints gives `A` on its left, `6 x n`; beside the model's robot
    /// error.
    pub noise_root: Option<DMatrix<f64>>,
}

/// [`CandidateJoints`] of many candidates.
#[derive(Clone, Copy, Debug)]
pub struct ArmColumns<'a> {
    /// Matrices of six rows, one after another, row by row: columns of the arm's constant errors, then those of a square
    /// root of the covariance of the noise of the joints.
    pub entries: &'a [f64],
    /// Columns of the constants, and of the noise.
    pub counts: (usize, usize),
}

impl ArmColumns<'_> {
    /// Of candidate `i`.
    pub fn of(&self, i: usize) -> CandidateJoints {
        let (constants, noise) = self.counts;
        let both = DMatrix::from_row_slice(6, constants + noise, self.part(i, 1).entries);
        CandidateJoints {
            constants: both.columns(0, constants).into_owned(),
            noise_root: (noise > 0).then(|| both.columns(constants, noise).into_owned()),
        }
    }

    /// Of `count` candidates from `first` on.
    pub(super) fn part(&self, first: usize, count: usize) -> Self {
        let each = 6 * (self.counts.0 + self.counts.1);
        Self { entries: &self.entries[each * first..each * (first + count)], counts: self.counts }
    }

    /// # Errors
    /// [`Error::InvalidInput`] if they are not.
    pub(super) fn check(&self, candidates: usize, constants: usize) -> Result<(), Error> {
        let (of_constants, of_noise) = self.counts;
        if of_constants == constants && self.entries.len() == 6 * (constants + of_noise) * candidates {
            return Ok(());
        }
        Err(Error::invalid(format!(
            "expected the arm of {candidates} candidates with {constants} constants each"
        )))
    }
}

/// Information of a view, being summed.
pub(super) struct Sums {
    pub moments: Moments,
    pub columns: Option<PixelColumns>,
}

impl Sums {
    fn clear(&mut self) {
        self.moments = Moments::new();
        if let Some(columns) = &mut self.columns {
            columns.mc.fill(0.0);
            columns.cc.fill(0.0);
            columns.gc.fill(0.0);
        }
    }
}

impl CandidateModel<'_> {
    /// Number of global parameters of the belief it goes with.
    pub fn parameter_count(&self) -> usize {
        CHAIN + self.pixel_parameters.map_or(0, PixelParameters::count) + self.kinematic_count
    }

    /// The quadratic at the predicted pose, robot error marginalised; `None` if too little is in sight.
    fn block(&self, motion: &Se3, joints: Option<&CandidateJoints>) -> Option<(ViewBlock, usize)> {
        let mut sums = self.sums();
        let seen = self.sum(&(self.x * *motion * self.y), &mut sums);
        if seen < self.visibility.fewest.max(1) {
            return None;
        }
        let (m, g) = sums.moments.finish();
        let block = ViewBlock { m, g, columns: sums.columns, squared_px: 0.0 };
        let joints = joints.and_then(|j| j.noise_root.as_ref());
        if self.robot.is_none() && joints.is_none() {
            return Some((block, seen));
        }
        let (left, right) = (self.x.adjoint(), (self.x * *motion).adjoint());
        let mut covariance = Matrix6::zeros();
        for (before, root) in [(left, self.robot.left), (right, self.robot.right)] {
            if let Some(root) = root {
                let moved = before * root;
                covariance += moved * moved.transpose();
            }
        }
        if let Some(root) = joints {
            let moved = left * root;
            covariance += &moved * moved.transpose();
        }
        let covariance = DMatrix::from_column_slice(6, 6, covariance.as_slice());
        let root = Matrix6::from_column_slice(semidefinite_root(covariance).as_slice());
        Some((marginalised(&block, &root), seen))
    }

    /// Empty sums for [`CandidateModel::sum`].
    pub(super) fn sums(&self) -> Sums {
        Sums {
            moments: Moments::new(),
            columns: self.pixel_parameters.map(|p| PixelColumns::zeros(p.count())),
        }
    }

    /// Sums the information of the features in sight at a pose, the robot taken as exact; their number.
    pub(super) fn sum(&self, pose: &Se3, sums: &mut Sums) -> usize {
        let weight = 1.0 / (self.pixel_sigma * self.pixel_sigma);
        let nothing = Vector2::zeros();
        sums.clear();
        let mut seen = 0;
        for feature in self.features {
            if let Some((parameters, columns)) = self.pixel_parameters.zip(sums.columns.as_mut()) {
                let Some(o) = self.camera.observe_with_derivatives(pose, feature) else { continue };
                if !self.in_image(&o.pixel) {
                    continue;
                }
                sums.moments.add(&o.d_twist, &nothing, weight);
                columns.add(parameters, &o, &(pose.rotation * feature.position), &nothing, weight);
            } else {
                let Some((pixel, d)) = self.camera.observe_with_twist_derivative(pose, feature) else {
                    continue;
                };
                if !self.in_image(&pixel) {
                    continue;
                }
                sums.moments.add(&d, &nothing, weight);
            }
            seen += 1;
        }
        seen
    }

    #[inline]
    fn in_image(&self, pixel: &Vector2<f64>) -> bool {
        let margin = self.visibility.margin_px;
        match self.visibility.image {
            None => true,
            Some([width, height]) => {
                pixel.x >= margin
                    && pixel.y >= margin
                    && pixel.x <= width - 1.0 - margin
                    && pixel.y <= height - 1.0 - margin
            }
        }
    }

    /// The candidate at robot motion `A`. Without `joints` its kinematic parameters, if there are any, move nothing.
    pub fn candidate(&self, motion: &Se3, joints: Option<&CandidateJoints>) -> Option<Candidate> {
        interrupt::check();
        let (block, seen) = self.block(motion, joints)?;
        let extra = block.columns.as_ref().map_or(0, |c| c.gc.len());
        let n = self.parameter_count();
        let mut map = DMatrix::zeros(6 + extra, n);
        map.view_mut((0, 0), (6, 6)).fill_with_identity();
        map.view_mut((0, 6), (6, 6)).copy_from(&(self.x * *motion).adjoint());
        map.view_mut((6, CHAIN), (extra, extra)).fill_with_identity();
        if let Some(joints) = joints {
            let columns = self.x.adjoint() * &joints.constants;
            map.view_mut((0, CHAIN + extra), columns.shape()).copy_from(&columns);
        }
        let factor = map.tr_mul(&semidefinite_root(block.matrix()));
        Some(Candidate { factor, seen })
    }
}

/// Robot motions `A` of candidates, as they come.
#[derive(Clone, Copy, Debug)]
pub enum Motions<'a> {
    /// Transforms.
    Transforms(&'a [Se3]),
    /// Homogeneous 4 x 4 matrices, row by row, one after the other: 16 numbers each.
    Matrices(&'a [f64]),
}

impl Motions<'_> {
    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Self::Transforms(transforms) => transforms.len(),
            Self::Matrices(matrices) => matrices.len() / 16,
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    pub(super) fn get(&self, i: usize) -> Result<Se3, Error> {
        match self {
            Self::Transforms(transforms) => Ok(transforms[i]),
            Self::Matrices(matrices) => {
                Se3::from_matrix(&Matrix4::from_row_slice(&matrices[16 * i..16 * (i + 1)]))
            }
        }
    }

    /// `count` motions from `first` on.
    pub(super) fn part(&self, first: usize, count: usize) -> Self {
        match self {
            Self::Transforms(transforms) => Self::Transforms(&transforms[first..first + count]),
            Self::Matrices(matrices) => Self::Matrices(&matrices[16 * first..16 * (first + count)]),
        }
    }

    /// Writes the matrices to the front of `to` and repeats the last one to its end.
    pub(super) fn fill(&self, to: &mut [f64]) {
        match self {
            Self::Transforms(transforms) => {
                for (to, from) in to.chunks_exact_mut(16).zip(*transforms) {
                    to.copy_from_slice(from.to_matrix().transpose().as_slice());
                }
            }
            Self::Matrices(matrices) => to[..matrices.len()].copy_from_slice(matrices),
        }
        let filled = 16 * self.len();
        for at in (filled..to.len()).step_by(16) {
            to.copy_within(filled - 16..filled, at);
        }
    }
}

/// How the machine is used; results do not depend on it beyond rounding.
#[derive(Clone, Copy, Debug)]
pub struct Execution {
    /// Which vector unit.
    pub unit: VectorUnit,
    /// How many threads; zero for as many as the machine runs at once, if there is enough to do.
    pub threads: usize,
}

impl Default for Execution {
    fn default() -> Self {
        Self { unit: VectorUnit::widest(), threads: 0 }
    }
}

/// Candidates below which waking a second thread costs more than it brings.
const CANDIDATES_PER_THREAD: usize = 2_500;

impl Execution {
    pub(super) fn threads_for(&self, candidates: usize) -> usize {
        let most = (candidates / CANDIDATES_PER_THREAD).max(1);
        match self.threads {
            0 => threads::available().min(most),
            threads => threads.min(candidates.max(1)),
        }
    }
}

/// `F` with `F F' = m` for a positive semi-definite `m`: Cholesky with diagonal pivoting, which leaves the columns of
/// null directions zero (Higham, "Accuracy and Stability of Numerical Algorithms", 2nd ed., 2002, section 10.3).
pub(crate) fn semidefinite_root(mut m: DMatrix<f64>) -> DMatrix<f64> {
    let n = m.nrows();
    let scale: Vec<f64> = (0..n).map(|i| m[(i, i)].abs()).collect();
    let mut left: Vec<usize> = (0..n).collect();
    let mut root = DMatrix::zeros(n, n);
    for column in 0..n {
        // Sizes are compared in units of the diagonal: translations and rotations differ by orders.
        let relative = |i: usize| if scale[i] > 0.0 { m[(i, i)] / scale[i] } else { 0.0 };
        let Some(at) = (0..left.len()).max_by(|a, b| relative(left[*a]).total_cmp(&relative(left[*b])))
        else {
            break;
        };
        let k = left.swap_remove(at);
        if relative(k).is_nan() || relative(k) <= NULL_PIVOT {
            break;
        }
        let pivot = m[(k, k)].sqrt();
        root[(k, column)] = pivot;
        for i in &left {
            root[(*i, column)] = m[(*i, k)] / pivot;
        }
        for i in &left {
            for j in &left {
                m[(*i, *j)] -= root[(*i, column)] * root[(*j, column)];
            }
        }
    }
    root
}

/// Pivots below this fraction of their diagonal are rounding.
const NULL_PIVOT: f64 = 1e-14;
