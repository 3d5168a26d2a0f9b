//! The robot's error in one view, marginalised out of the view's quadratic (a Schur complement).

use nalgebra::{DMatrix, Matrix6, Vector6};

use super::accumulate::{PixelColumns, ViewBlock};

/// Elimination of one view's correction: `dw = -(offset + slope [eta; c])`.
pub(super) struct Eliminated {
    pub(super) offset: Vector6<f64>,
    pub(super) slope: DMatrix<f64>,
}

/// Marginalises the whitened correction `w` (prior `|w|^2`) out of a view's quadratic.
///
/// With `T = d eta / d w`, the quadratic in `[eta; c]` becomes `N - N_t T (I + T' M T)^-1 T' N_t'`.
pub(super) fn eliminate(
    block: &ViewBlock,
    to_correction: &Matrix6<f64>,
    w: &Vector6<f64>,
    damping: f64,
) -> (ViewBlock, Eliminated, f64) {
    let mt = block.m * to_correction;
    let mut h = Matrix6::identity() + to_correction.transpose() * mt;
    for i in 0..6 {
        h[(i, i)] += damping * h[(i, i)];
    }
    let gradient = to_correction.transpose() * block.g + w;
    // `h` is the identity plus a positive semi-definite matrix.
    let factor = h.cholesky().unwrap_or_else(|| Matrix6::identity().cholesky().expect("identity"));
    let offset = factor.solve(&gradient);
    let slope_m = factor.solve(&mt.transpose());
    let log_determinant = 2.0 * (0..6).map(|i| factor.l_dirty()[(i, i)].ln()).sum::<f64>();
    let m = block.m - mt * slope_m;
    let extra = block.columns.as_ref().map_or(0, |c| c.gc.len());
    let mut slope = DMatrix::zeros(6, 6 + extra);
    slope.view_mut((0, 0), (6, 6)).copy_from(&slope_m);
    let columns = block.columns.as_ref().map(|c| {
        let ct = c.mc.transpose() * to_correction;
        let mut slope_c = ct.transpose();
        factor.solve_mut(&mut slope_c);
        slope.view_mut((0, 6), (6, extra)).copy_from(&slope_c);
        PixelColumns { mc: &c.mc - mt * &slope_c, cc: &c.cc - &ct * &slope_c, gc: &c.gc - &ct * offset }
    });
    let reduced = ViewBlock {
        m: (m + m.transpose()) * 0.5,
        g: block.g - mt * offset,
        columns,
        cost: block.cost,
        squared_px: block.squared_px,
    };
    (reduced, Eliminated { offset, slope }, log_determinant)
}

/// A view's quadratic seen through a robot error with `T = d eta / d w`: `M (I + S M)^-1` with `S = T T'`.
pub(crate) fn marginalised(block: &ViewBlock, to_correction: &Matrix6<f64>) -> ViewBlock {
    eliminate(block, to_correction, &Vector6::zeros(), 0.0).0
}
