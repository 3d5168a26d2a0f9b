//! What is believed of `X` and `Y` before any view.

use nalgebra::{Matrix6, SMatrix, SVector, Vector3, Vector6};

use crate::se3::{Se3, hat};

type Matrix12 = SMatrix<f64, 12, 12>;
type Vector12 = SVector<f64, 12>;

/// What is believed of `X` and `Y` before any view: only enough to keep the information regular.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeakPrior {
    /// Mean of the translation of `X`, metres.
    pub x_translation_m: Vector3<f64>,
    /// Its standard deviation per axis.
    pub x_translation_sigma_m: f64,
    /// Standard deviation of rotations about the present estimate, radians.
    pub rotation_sigma_rad: f64,
    /// Standard deviation of the translation of `Y` about the present estimate, metres.
    pub y_translation_sigma_m: f64,
}

impl Default for WeakPrior {
    fn default() -> Self {
        Self {
            x_translation_m: Vector3::zeros(),
            x_translation_sigma_m: 1.0,
            rotation_sigma_rad: 3.0,
            y_translation_sigma_m: 10.0,
        }
    }
}

impl WeakPrior {
    /// Information and right-hand side of a twist of `X` at the present `X`.
    pub(super) fn of_x(&self, x: &Se3) -> (Matrix6<f64>, Vector6<f64>) {
        let (information, right) = self.normal(x);
        (information.fixed_view::<6, 6>(0, 0).into_owned(), right.fixed_rows::<6>(0).into_owned())
    }

    /// Information of a twist of `Y`.
    pub(super) fn of_y(&self) -> Matrix6<f64> {
        let (translation, rotation) = (self.y_translation_sigma_m.powi(-2), self.rotation_sigma_rad.powi(-2));
        Matrix6::from_diagonal(&Vector6::new(
            translation,
            translation,
            translation,
            rotation,
            rotation,
            rotation,
        ))
    }
    /// Information and right-hand side of a twist of `X` and `Y` at the present `X`.
    pub(crate) fn normal(&self, x: &Se3) -> (Matrix12, Vector12) {
        let mut jacobian = SMatrix::<f64, 3, 6>::zeros();
        jacobian.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&-hat(&x.translation));
        let weight = self.x_translation_sigma_m.powi(-2);
        let mut information = Matrix12::zeros();
        information.fixed_view_mut::<6, 6>(0, 0).copy_from(&(jacobian.transpose() * jacobian * weight));
        for i in 3..6 {
            information[(i, i)] += self.rotation_sigma_rad.powi(-2);
            information[(i + 6, i + 6)] += self.rotation_sigma_rad.powi(-2);
            information[(i + 3, i + 3)] += self.y_translation_sigma_m.powi(-2);
        }
        let mut right = Vector12::zeros();
        let pull = jacobian.transpose() * (self.x_translation_m - x.translation) * weight;
        right.fixed_rows_mut::<6>(0).copy_from(&pull);
        (information, right)
    }
}
