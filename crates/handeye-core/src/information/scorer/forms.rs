//! The covariances that a gain is made of, as the algebra wants them.
//!
//! With `C = Ad(X A)` the camera-frame twist of a candidate is `eta = xi_x + C xi_y`; beside it stand the pixel
//! parameters c. With information `N` of the view in `[eta; c]` and covariance `S_r` of the robot's error in the
//! camera frame, the view tells `N_eff = (N^-1 + S_r)^-1`, and with `S` the covariance of `[eta; c]` before it
//!
//! ```text
//! |I + N_eff S| = |I + N (S + S_r)| / |I + N S_r|
//! Z (N_eff^-1 + S)^-1 Z' = Z (N^-1 + S + S_r)^-1 Z'
//! ```
//!
//! so that an entropy gain is half the logarithm of a quotient of two determinants, and what a view takes off a
//! covariance needs no `N_eff`. `S` is written as `constant + U U'` with `U = [K + C G; K_c]` and `G G'` the covariance
//! of `xi_y`: where `xi_x` and `C xi_y` cancel, as they do in a good calibration, they cancel before they are squared.
//!
//! Where constants of the arm are parameters q, `eta = xi_x + C xi_y + E q` with `E` of each candidate. Then `S` is the
//! covariance for known q, and beside it `U U'` with `U = [K_x + C K_y + E L; K_c]`, `L L'` the covariance of q and
//! `K L'` its covariance with the others: again what cancels does so before it is squared.

use nalgebra::{DMatrix, Matrix6};

use crate::error::Error;
use crate::information::belief::{Belief, CHAIN, invert};
use crate::information::candidate::RobotError;
use crate::information::criteria::EntropyOf;
use crate::se3::Se3;

/// Where entry `(i, j)`, `i <= j`, of a symmetric matrix of `size` rows lies in its upper triangle, row by row.
pub(super) const fn packed(size: usize, i: usize, j: usize) -> usize {
    i * size - i * (i + 1) / 2 + j
}

/// A covariance of `[eta; c]`: `constant + U U'`.
pub(super) struct Form {
    /// Six and the number of pixel parameters.
    pub size: usize,
    /// Symmetric, upper triangle row by row.
    pub constant: Vec<f64>,
    /// The part that the motion moves; none if it moves nothing.
    pub moved: Option<Box<Moved>>,
    /// The part of the arm; none where its errors are no part of the model.
    pub arm: Option<OfArm>,
}

/// `U = [of_x + C of_y + E root; pixel]` of the arm's constants, one entry per column; what no candidate changes in
/// `U U'` is among the constants. The noise of the joints comes beside it, as it is.
#[derive(Clone, Default)]
pub(super) struct OfArm {
    pub columns: Vec<ArmColumn>,
    /// Lower triangle, row by row.
    pub root: Vec<Vec<f64>>,
}

/// What goes with a column of the root.
#[derive(Clone)]
pub(super) struct ArmColumn {
    pub of_x: [f64; 6],
    pub of_y: [f64; 6],
    pub pixel: Vec<f64>,
}

/// `U = [offset + C root; pixel]`. What no motion moves in `U U'` is among the constants: `pixel pixel'`, and the square
/// of the offset's lower left, where `C root` is zero.
pub(super) struct Moved {
    /// 6 x 6, row by row.
    pub offset: [[f64; 6]; 6],
    /// Upper triangle, 6 x 6, row by row.
    pub root: [[f64; 6]; 6],
    /// One row per pixel parameter.
    pub pixel: Vec<[f64; 6]>,
}

/// How parameters of interest go with `[eta; c]`, one row each: `Z = constant + [of_y C', 0]`.
pub(super) struct Observed {
    /// `[eta; c]` columns.
    pub constant: Vec<Vec<f64>>,
    pub of_y: Vec<[f64; 6]>,
    /// Beside it `[of_arm E', 0]`.
    pub of_arm: Vec<Vec<f64>>,
}

/// `1/2 ln (|I + N with| / |I + N without|)`.
pub(super) struct Entropies {
    pub with: Form,
    pub without: Option<Form>,
}

/// The robot's error in the camera frame, `left + C right right' C'`.
struct RobotNoise {
    left: Matrix6<f64>,
    right: Option<Matrix6<f64>>,
}

impl RobotNoise {
    fn new(x: &Se3, robot: &RobotError) -> Self {
        Self {
            left: robot.left.map_or_else(Matrix6::zeros, |root| square(&(x.adjoint() * root))),
            right: robot.right,
        }
    }

    /// `S_r`, padded with zeros for the pixel parameters.
    fn form(&self, size: usize) -> Form {
        let mut covariance = DMatrix::zeros(size, size);
        if let Some(root) = &self.right {
            covariance.view_mut((0, 0), (6, 6)).copy_from(&square(root));
        }
        without_chain(&covariance, &self.left)
    }
}

impl Entropies {
    /// The gain in the entropy of everything or of the hand-eye alone.
    pub fn new(
        belief: &Belief,
        of: EntropyOf,
        pixel_parameters: usize,
        x: &Se3,
        robot: &RobotError,
        arm: Arm,
    ) -> Result<Self, Error> {
        let size = 6 + pixel_parameters;
        let noise = RobotNoise::new(x, robot);
        let without = match (of, robot.is_none() && !arm.noisy) {
            (EntropyOf::Everything, true) => None,
            // The robot's error moves the twist alone.
            (EntropyOf::Everything, false) => Some(robot_only(0, x, robot, arm)),
            (EntropyOf::HandEye, _) => {
                let n = belief.len() - 6;
                let nuisance = belief.information().view((6, 6), (n, n)).into_owned();
                let (mut of_rest, of_arm) = apart(&nuisance, size, 0, arm)?;
                if let Some(root) = &noise.right {
                    let mut of_y = of_rest.view_mut((0, 0), (6, 6));
                    of_y += square(root);
                }
                Some(with_arm(without_chain(&of_rest, &noise.left), of_arm))
            }
        };
        Ok(Self { with: predicted(belief, pixel_parameters, x, robot, arm)?, without })
    }
}

/// What of the arm's errors is part of a call.
#[derive(Clone, Copy)]
pub(super) struct Arm {
    /// Whether candidates come with what its constants move.
    pub known: bool,
    /// Whether they come with noise of the joints.
    pub noisy: bool,
}

fn singular() -> Error {
    Error::degenerate("the information of the target's pose is singular")
}

/// Of the information of `[(xi_x), xi_y, c, q]`, `xi_x` of `chain` rows: the covariance of the first `told` parameters,
/// q known where the arm is, and what q adds to it.
fn apart(
    information: &DMatrix<f64>,
    told: usize,
    chain: usize,
    arm: Arm,
) -> Result<(DMatrix<f64>, Option<OfArm>), Error> {
    let (whole, _) = invert(information).ok_or_else(singular)?;
    if !arm.known {
        let of_noise = arm.noisy.then(OfArm::default);
        return Ok((whole.view((0, 0), (told, told)).into_owned(), of_noise));
    }
    let (given, _) = invert(&information.view((0, 0), (told, told)).into_owned()).ok_or_else(singular)?;
    let count = information.nrows() - told;
    let root =
        whole.view((told, told), (count, count)).into_owned().cholesky().ok_or_else(singular)?.unpack();
    // K' = L^-1 of the covariance of q with the others.
    let mut with = whole.view((told, 0), (count, told)).into_owned();
    root.solve_lower_triangular_mut(&mut with);
    let columns = (0..count)
        .map(|j| ArmColumn {
            of_x: std::array::from_fn(|i| if chain == 0 { 0.0 } else { with[(j, i)] }),
            of_y: std::array::from_fn(|i| with[(j, chain + i)]),
            pixel: (chain + 6..told).map(|i| with[(j, i)]).collect(),
        })
        .collect();
    let root = (0..count).map(|i| (0..=i).map(|j| root[(i, j)]).collect()).collect();
    Ok((given, Some(OfArm { columns, root })))
}

/// A form with the arm beside it.
fn with_arm(mut form: Form, arm: Option<OfArm>) -> Form {
    if let Some(arm) = &arm {
        for i in 6..form.size {
            for j in i..form.size {
                form.constant[packed(form.size, i, j)] +=
                    arm.columns.iter().map(|c| c.pixel[i - 6] * c.pixel[j - 6]).sum::<f64>();
            }
        }
    }
    form.arm = arm;
    form
}

/// `S + S_r`: the covariance of what a view measures.
pub(super) fn predicted(
    belief: &Belief,
    pixel_parameters: usize,
    x: &Se3,
    robot: &RobotError,
    arm: Arm,
) -> Result<Form, Error> {
    let noise = RobotNoise::new(x, robot);
    let (covariance, of_arm) = apart(belief.information(), CHAIN + pixel_parameters, 6, arm)?;
    let chain = covariance.view((0, 0), (CHAIN, CHAIN)).into_owned();
    let (information, _) = invert(&chain).ok_or_else(singular)?;
    let (conditional, _) = invert(&information.view((0, 0), (6, 6)).into_owned()).ok_or_else(singular)?;
    let mut of_y: Matrix6<f64> = covariance.fixed_view::<6, 6>(6, 6).into_owned();
    let cross: Matrix6<f64> = covariance.fixed_view::<6, 6>(0, 6).into_owned();
    let mut of_eta = Matrix6::from_column_slice(conditional.as_slice()) + noise.left;
    if let Some(root) = &noise.right {
        // What noise on the right leaves of the correlation: S_xy (S_yy^-1 - (S_yy + R R')^-1) S_yx.
        let weighted = of_y.cholesky().ok_or_else(singular)?.solve(root);
        let inner = (Matrix6::identity() + root.transpose() * weighted).cholesky().ok_or_else(singular)?;
        let lost = inner.l().solve_lower_triangular(&(cross * weighted).transpose()).ok_or_else(singular)?;
        of_eta += lost.transpose() * lost;
        of_y += square(root);
    }
    let root = positive_upper_root(&of_y).ok_or_else(singular)?;
    let offset = root.solve_upper_triangular(&cross.transpose()).ok_or_else(singular)?.transpose();
    let with_y = covariance.view((6, CHAIN), (6, pixel_parameters)).into_owned();
    let pixel = root.solve_upper_triangular(&with_y).ok_or_else(singular)?.transpose();

    let size = 6 + pixel_parameters;
    let mut constant = DMatrix::zeros(size, size);
    constant.view_mut((0, 0), (6, 6)).copy_from(&of_eta);
    let with_x = covariance.view((0, CHAIN), (6, pixel_parameters));
    constant.view_mut((0, 6), (6, pixel_parameters)).copy_from(&(with_x - offset * pixel.transpose()));
    constant
        .view_mut((6, 6), (pixel_parameters, pixel_parameters))
        .copy_from(&covariance.view((CHAIN, CHAIN), (pixel_parameters, pixel_parameters)));
    Ok(with_arm(form(&constant, Some((&offset, &root, &pixel))), of_arm))
}

/// The same with `xi_x` known: `of_rest` is the covariance of `[xi_y; c]`, `left` that of the robot's error.
fn without_chain(of_rest: &DMatrix<f64>, left: &Matrix6<f64>) -> Form {
    let size = of_rest.nrows();
    let mut constant = of_rest.clone();
    constant.view_mut((0, 0), (6, size)).fill(0.0);
    constant.view_mut((0, 0), (6, 6)).copy_from(left);
    let of_y = of_rest.view((0, 0), (6, 6)).into_owned();
    if of_y.iter().all(|x| *x == 0.0) {
        return form(&constant, None);
    }
    // Null columns of the root go with nothing.
    let root = upper_root(of_y);
    let mut pixel = of_rest.view((6, 0), (size - 6, 6)).into_owned();
    for j in (0..6).rev() {
        for i in 0..size - 6 {
            let before: f64 = (j + 1..6).map(|k| pixel[(i, k)] * root[(j, k)]).sum();
            let pivot = root[(j, j)];
            pixel[(i, j)] = if pivot > 0.0 { (pixel[(i, j)] - before) / pivot } else { 0.0 };
        }
    }
    let root = Matrix6::from_column_slice(root.as_slice());
    form(&constant, Some((&Matrix6::zeros(), &root, &pixel)))
}

fn form(constant: &DMatrix<f64>, moved: Option<(&Matrix6<f64>, &Matrix6<f64>, &DMatrix<f64>)>) -> Form {
    let size = constant.nrows();
    let rows = |m: &Matrix6<f64>| std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]));
    let mut constant = constant.clone();
    if let Some((offset, _, _)) = moved {
        let still = offset.fixed_view::<3, 3>(3, 0);
        let mut of_rotation = constant.fixed_view_mut::<3, 3>(3, 3);
        of_rotation += still * still.transpose();
    }
    let constant = &constant;
    Form {
        size,
        constant: (0..size).flat_map(|i| (i..size).map(move |j| constant[(i, j)])).collect(),
        moved: moved.map(|(offset, root, pixel)| {
            Box::new(Moved {
                offset: rows(offset),
                root: rows(root),
                pixel: (0..size - 6).map(|i| std::array::from_fn(|j| pixel[(i, j)])).collect(),
            })
        }),
        arm: None,
    }
}

/// Upper triangle `G` with `G G' = m` for a positive semi-definite `m`: Cholesky from the last column on that leaves null
/// columns zero.
fn upper_root(mut m: DMatrix<f64>) -> DMatrix<f64> {
    let n = m.nrows();
    let floor: Vec<f64> = (0..n).map(|i| 1e-13 * m[(i, i)].abs()).collect();
    for j in (0..n).rev() {
        let pivot = m[(j, j)];
        let inverse = if pivot > floor[j] && pivot > 0.0 { 1.0 / pivot.sqrt() } else { 0.0 };
        for i in 0..=j {
            m[(i, j)] *= inverse;
        }
        for k in 0..j {
            let f = m[(k, j)];
            for i in 0..=k {
                m[(i, k)] -= m[(i, j)] * f;
            }
        }
        for i in j + 1..n {
            m[(i, j)] = 0.0;
        }
    }
    m
}

/// The same for a positive definite `m`.
fn positive_upper_root(m: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    let turned = |m: &Matrix6<f64>| Matrix6::from_fn(|i, j| m[(5 - i, 5 - j)]);
    Some(turned(&turned(m).cholesky()?.l()))
}

fn square(root: &Matrix6<f64>) -> Matrix6<f64> {
    root * root.transpose()
}

impl Observed {
    /// The covariance of the first parameters of the chain with `[eta; c]`, each row times its weight.
    pub fn covariance(belief: &Belief, pixel_parameters: usize, weights: &[f64], arm: Arm) -> Self {
        let covariance = belief.covariance();
        let entry = |i: usize, j: usize| covariance[(i, j)] * weights[i];
        let columns = || (0..6).chain(CHAIN..CHAIN + pixel_parameters);
        Self {
            constant: (0..weights.len()).map(|i| columns().map(|j| entry(i, j)).collect()).collect(),
            of_y: (0..weights.len()).map(|i| std::array::from_fn(|j| entry(i, 6 + j))).collect(),
            of_arm: (0..weights.len())
                .map(|i| {
                    let first = if arm.known { CHAIN + pixel_parameters } else { belief.len() };
                    (first..belief.len()).map(|j| entry(i, j)).collect()
                })
                .collect(),
        }
    }

    /// `B' = [I, C]'`, each row times its weight: with it and no belief, what a view tells of the chain itself.
    pub fn information(pixel_parameters: usize, weights: &[f64; CHAIN]) -> Self {
        let unit = |i: usize, j: usize| if i == j { weights[i] } else { 0.0 };
        Self {
            constant: (0..CHAIN)
                .map(|i| (0..6 + pixel_parameters).map(|j| if j < 6 { unit(i, j) } else { 0.0 }).collect())
                .collect(),
            of_y: (0..CHAIN).map(|i| std::array::from_fn(|j| unit(i, 6 + j))).collect(),
            of_arm: vec![vec![]; CHAIN],
        }
    }
}

/// What the robot's error alone makes of a view.
pub(super) fn robot_only(pixel_parameters: usize, x: &Se3, robot: &RobotError, arm: Arm) -> Form {
    let mut form = RobotNoise::new(x, robot).form(6 + pixel_parameters);
    form.arm = arm.noisy.then(OfArm::default);
    form
}
