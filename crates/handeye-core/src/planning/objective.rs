//! What a set of views is worth: concave functions of the information, with their gradients.

use nalgebra::{DMatrix, Matrix3x6, Vector3};

use crate::error::Error;
use crate::positive::Factor;
use crate::se3::hat;

/// A concave function `phi` of the information; larger is better.
#[derive(Clone, Debug)]
pub enum Objective {
    /// `ln |Lambda|`: entropy of all parameters, doubled and negated.
    Entropy,
    /// `ln |Lambda| - ln |Lambda_nn|`: entropy of the hand-eye alone, doubled and negated.
    EntropyHandEye,
    /// `-tr(Q Sigma)`: mean variance of tool points, negated; `Q` acts on the hand-eye's twist.
    ToolPoint(DMatrix<f64>),
}

impl Objective {
    /// Mean variance of points in the camera frame (metres) mapped through `X`.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] without points.
    pub fn tool_points(points: &[Vector3<f64>]) -> Result<Self, Error> {
        if points.is_empty() {
            return Err(Error::invalid("tool points: at least one"));
        }
        let mut q = DMatrix::zeros(6, 6);
        for p in points {
            let mut j = Matrix3x6::zeros();
            j.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
            j.fixed_view_mut::<3, 3>(0, 3).copy_from(&-hat(p));
            q += j.transpose() * j / points.len() as f64;
        }
        Ok(Self::ToolPoint(q))
    }

    /// `phi` of an information; `None` if it is not positive definite.
    pub fn value(&self, information: &DMatrix<f64>) -> Option<f64> {
        match self {
            Self::Entropy => log_determinant(information),
            Self::EntropyHandEye => {
                Some(log_determinant(information)? - log_determinant(&nuisance(information))?)
            }
            Self::ToolPoint(q) => {
                let covariance = inverse(information)?;
                Some(-(q * covariance.view((0, 0), (6, 6))).trace())
            }
        }
    }

    /// `phi` and its derivatives; `None` if the information is not positive definite.
    pub(super) fn expand(&self, information: &DMatrix<f64>) -> Option<Expansion> {
        let n = information.nrows();
        let (covariance, whole) = inverse_and_log_determinant(information)?;
        match self {
            Self::Entropy => {
                Some(Expansion { value: whole, gradient: covariance.clone(), covariance, of_rest: None })
            }
            Self::EntropyHandEye => {
                let (of_rest, rest) = inverse_and_log_determinant(&nuisance(information))?;
                let mut gradient = covariance.clone();
                let mut block = gradient.view_mut((6, 6), (n - 6, n - 6));
                block -= &of_rest;
                Some(Expansion { value: whole - rest, gradient, covariance, of_rest: Some(of_rest) })
            }
            Self::ToolPoint(q) => {
                let columns = covariance.columns(0, 6).into_owned();
                let value = -(q * covariance.view((0, 0), (6, 6))).trace();
                let gradient = &columns * q * columns.transpose();
                Some(Expansion { value, gradient, covariance, of_rest: None })
            }
        }
    }

    /// How fast the gradient falls along `direction`: `C` with `d tr(G E) = -tr(C E)` for any symmetric `E`, up to the
    /// antisymmetric part of `C`.
    pub(super) fn curvature(&self, at: &Expansion, direction: &DMatrix<f64>) -> DMatrix<f64> {
        let n = direction.nrows();
        let spread = direction * &at.covariance;
        if let Self::ToolPoint(_) = self {
            return &at.gradient * spread * 2.0;
        }
        let mut curvature = &at.covariance * spread;
        if let Some(of_rest) = &at.of_rest {
            let along = direction.view((6, 6), (n - 6, n - 6));
            let mut block = curvature.view_mut((6, 6), (n - 6, n - 6));
            block -= of_rest * along * of_rest;
        }
        curvature
    }

    /// How good `chosen` is against `best`, both values of `phi`, as a share of the best: the D-efficiency for
    /// entropies (per parameter), the ratio of standard deviations for tool points.
    pub fn efficiency(&self, chosen: f64, best: f64, parameters: usize) -> f64 {
        match self {
            Self::Entropy => ((chosen - best) / parameters as f64).exp(),
            Self::EntropyHandEye => ((chosen - best) / 6.0).exp(),
            Self::ToolPoint(_) => (best / chosen).max(0.0).sqrt(),
        }
    }
}

/// `phi` at some information, and what its derivatives are made of.
pub(super) struct Expansion {
    pub value: f64,
    /// Positive semi-definite `G` with `d phi = tr(G d Lambda)`.
    pub gradient: DMatrix<f64>,
    covariance: DMatrix<f64>,
    /// Inverse of the information of everything but the hand-eye.
    of_rest: Option<DMatrix<f64>>,
}

fn nuisance(information: &DMatrix<f64>) -> DMatrix<f64> {
    let n = information.nrows() - 6;
    information.view((6, 6), (n, n)).into_owned()
}

fn log_determinant(m: &DMatrix<f64>) -> Option<f64> {
    Factor::new(m).map(|factor| factor.log_determinant())
}

fn inverse(m: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    Factor::new(m).map(|factor| factor.inverse())
}

fn inverse_and_log_determinant(m: &DMatrix<f64>) -> Option<(DMatrix<f64>, f64)> {
    Factor::new(m).map(|factor| (factor.inverse(), factor.log_determinant()))
}
