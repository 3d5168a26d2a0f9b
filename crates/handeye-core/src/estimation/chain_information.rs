//! What views say of `X` and `Y` without any prior belief: their information, seen through the noise of the robot.

use nalgebra::{Matrix6, SMatrix};

use crate::batched_algebra::{UPPER, upper};
use crate::error::Error;
use crate::least_squares::{Side, through_chain};
use crate::se3::{Se3, entries};

/// Information of the twists of `X` and `Y`, `sum B' (sigma^2 M^-1 + S)^-1 B` with `B = [I, Ad(X A)]` of each view.
///
/// `forward` is `X A` of each view, `pixels` the information `M` of its pose at 1 px and the deviation of its pixels,
/// `robot` on which side of `A` the robot errs and the square root of the covariance of that twist.
///
/// # Errors
/// [`Error::Degenerate`] where the pixels or the noise leave a direction of a pose open.
pub fn chain_information(
    x: &Se3,
    forward: &[Se3],
    pixels: &[(Matrix6<f64>, f64)],
    robot: Option<(Side, Matrix6<f64>)>,
) -> Result<SMatrix<f64, 12, 12>, Error> {
    let mut sum = SMatrix::<f64, 12, 12>::zeros();
    let left = x.adjoint();
    for (k, (forward, (information, sigma_px))) in forward.iter().zip(pixels).enumerate() {
        let inverse = |m: Matrix6<f64>| {
            let factor = m.cholesky().ok_or_else(|| {
                Error::degenerate(format!("view {k}: its points do not determine the target's pose"))
            })?;
            Ok::<_, Error>(factor.inverse())
        };
        let mut covariance = inverse(*information)? * sigma_px.powi(2);
        if let Some((side, root)) = robot {
            let moved = if side == Side::Left { left } else { forward.adjoint() } * root;
            covariance += moved * moved.transpose();
        }
        let weight = inverse(covariance)?;
        let mut triangle = [0.0; UPPER];
        for i in 0..6 {
            for j in i..6 {
                triangle[upper(i, j)] = weight[(i, j)];
            }
        }
        let through = through_chain(&triangle, &[0.0; 6], &entries(forward));
        for i in 0..6 {
            for j in 0..6 {
                sum[(i, 6 + j)] += through.xy[i][j];
                if j >= i {
                    sum[(i, j)] += weight[(i, j)];
                    sum[(6 + i, 6 + j)] += through.yy[upper(i, j)];
                }
            }
        }
    }
    sum.fill_lower_triangle_with_upper_triangle();
    Ok(sum)
}
