//! The robot's error in one view, marginalised out of the view's quadratic (a Schur complement).

use nalgebra::Matrix6;

use super::accumulate::{PixelColumns, ViewBlock};

/// A view's quadratic seen through a robot error `w` of unit covariance with `T = d eta / d w`: in `[eta; c]`,
/// `N - N_t T (I + T' M T)^-1 T' N_t'`.
pub(crate) fn marginalised(block: &ViewBlock, to_error: &Matrix6<f64>) -> ViewBlock {
    let mt = block.m * to_error;
    let h = Matrix6::identity() + to_error.transpose() * mt;
    // The identity plus a positive semi-definite matrix.
    let factor = h.cholesky().unwrap_or_else(|| Matrix6::identity().cholesky().expect("identity"));
    let offset = factor.solve(&(to_error.transpose() * block.g));
    let m = block.m - mt * factor.solve(&mt.transpose());
    let columns = block.columns.as_ref().map(|c| {
        let ct = c.mc.transpose() * to_error;
        let mut slope = ct.transpose();
        factor.solve_mut(&mut slope);
        PixelColumns { mc: &c.mc - mt * &slope, cc: &c.cc - &ct * &slope, gc: &c.gc - &ct * offset }
    });
    ViewBlock {
        m: (m + m.transpose()) * 0.5,
        g: block.g - mt * offset,
        columns,
        squared_px: block.squared_px,
    }
}
