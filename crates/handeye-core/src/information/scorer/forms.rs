//! The covariances that an entropy gain compares, as the algebra wants them.
//!
//! With `C = Ad(X A)` the camera-frame twist of a candidate is `eta = xi_x + C xi_y`. With information `M` of the view
//! and covariance `S_r` of the robot's error in the camera frame, the view tells `M_eff = (M^-1 + S_r)^-1`, and
//!
//! ```text
//! |I + M_eff S| = |I + M (S + S_r)| / |I + M S_r|
//! ```
//!
//! so that an entropy gain is half the logarithm of a quotient of two determinants. `S` is written as
//! `S_0 + (K + C G)(K + C G)'` with `G G'` the covariance of `xi_y`: where `xi_x` and `C xi_y` cancel, as they do in a
//! good calibration, they cancel before they are squared.

use nalgebra::{DMatrix, Matrix6};

use super::algebra::{Form, Moved};
use super::block::{UPPER, upper};
use crate::error::Error;
use crate::information::belief::{Belief, CHAIN, invert};
use crate::information::candidate::semidefinite_root;
use crate::information::criteria::EntropyOf;
use crate::least_squares::Side;
use crate::se3::Se3;

/// `1/2 ln (|I + M with| / |I + M without|)`.
pub(super) struct Forms {
    pub with: Form,
    pub without: Option<Form>,
}

impl Forms {
    /// The gain in the entropy of everything or of the hand-eye alone, for a belief of `X` and `Y` only.
    pub fn new(
        belief: &Belief,
        of: EntropyOf,
        x: &Se3,
        robot: Option<&(Side, Matrix6<f64>)>,
    ) -> Result<Self, Error> {
        debug_assert_eq!(belief.len(), CHAIN);
        let left = match robot {
            Some((Side::Left, root)) => square(&(x.adjoint() * root)),
            _ => Matrix6::zeros(),
        };
        let right = match robot {
            Some((Side::Right, root)) => Some(root),
            _ => None,
        };
        let with = total(belief, &left, right)?;
        let right = right.map_or_else(Matrix6::zeros, square);
        let without = match (of, robot) {
            (EntropyOf::Everything, None) => None,
            (EntropyOf::Everything, Some(_)) => Some(part(&left, &right)),
            (EntropyOf::HandEye, _) => {
                let target = conditional(belief, 6)?;
                Some(part(&left, &(target + right)))
            }
        };
        Ok(Self { with, without })
    }
}

fn square(root: &Matrix6<f64>) -> Matrix6<f64> {
    root * root.transpose()
}

/// Covariance of six parameters, from `at` on, if all others were known.
fn conditional(belief: &Belief, at: usize) -> Result<Matrix6<f64>, Error> {
    let block = belief.information().view((at, at), (6, 6)).into_owned();
    let (inverse, _) =
        invert(&block).ok_or_else(|| Error::degenerate("a block of the information is singular"))?;
    Ok(Matrix6::from_column_slice(inverse.as_slice()))
}

/// `S + S_r`.
fn total(belief: &Belief, left: &Matrix6<f64>, right: Option<&Matrix6<f64>>) -> Result<Form, Error> {
    let singular = || Error::degenerate("the covariance of the target's pose is singular");
    let covariance = belief.covariance();
    let cross: Matrix6<f64> = covariance.fixed_view::<6, 6>(0, 6).into_owned();
    let mut of_y: Matrix6<f64> = covariance.fixed_view::<6, 6>(6, 6).into_owned();
    let mut constant = conditional(belief, 0)? + left;
    if let Some(root) = right {
        // What robot noise on the right leaves of the correlation: S_xy (S_yy^-1 - (S_yy + R R')^-1) S_yx.
        let weighted = of_y.cholesky().ok_or_else(singular)?.solve(root);
        let inner = (Matrix6::identity() + root.transpose() * weighted).cholesky().ok_or_else(singular)?;
        let lost = inner.l().solve_lower_triangular(&(cross * weighted).transpose()).ok_or_else(singular)?;
        constant += lost.transpose() * lost;
        of_y += square(root);
    }
    let root = of_y.cholesky().ok_or_else(singular)?.l();
    let offset = root.solve_lower_triangular(&cross.transpose()).ok_or_else(singular)?.transpose();
    Ok(form(&constant, Some((&offset, &root))))
}

/// `constant + C of_y C'`.
fn part(constant: &Matrix6<f64>, of_y: &Matrix6<f64>) -> Form {
    if *of_y == Matrix6::zeros() {
        return form(constant, None);
    }
    let root = semidefinite_root(DMatrix::from_column_slice(6, 6, of_y.as_slice()));
    form(constant, Some((&Matrix6::zeros(), &Matrix6::from_column_slice(root.as_slice()))))
}

fn form(constant: &Matrix6<f64>, moved: Option<(&Matrix6<f64>, &Matrix6<f64>)>) -> Form {
    let rows = |m: &Matrix6<f64>| std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]));
    let mut packed = [0.0; UPPER];
    for i in 0..6 {
        for j in i..6 {
            packed[upper(i, j)] = 0.5 * (constant[(i, j)] + constant[(j, i)]);
        }
    }
    Form {
        constant: packed,
        moved: moved.map(|(offset, root)| Moved { offset: rows(offset), root: rows(root) }),
    }
}
