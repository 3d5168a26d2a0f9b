//! Points touched with a tip: rows of the same model as the pictures, through no camera.
//!
//! The arm stops where a point that it carries meets one that stands still. With `T` its pose, `f` the point in the
//! flange and `b` the one in the base, `r = b - T f` vanishes but for how well it was touched. Derivatives are those of
//! a truth `exp(base) T exp(flange)`, `Y = exp(xi) Y`, a board `1 + s` times as large and tips moved by `dt`.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::cell::{Body, Cell, Columns};
use super::linearisation::{Guess, Rows};
use crate::error::Error;
use crate::se3::Se3;

/// A point that is not on a board: the tip of a tool in the flange, or a fixed point in the base.
#[derive(Clone, Debug)]
pub struct Tip {
    /// What it is fixed to.
    pub body: Body,
    /// Where it is believed to be in its body.
    pub at: Vector3<f64>,
    /// How well that is known.
    pub information: Matrix3<f64>,
}

/// A point that touches or is touched.
#[derive(Clone, Copy, Debug)]
pub enum TouchPoint {
    /// A point of a target, in its own frame.
    OfTarget {
        /// Which target.
        target: usize,
        /// Where.
        at: Vector3<f64>,
    },
    /// One of the cell's tips.
    Tip(usize),
}

/// Two points that met.
#[derive(Clone, Debug)]
pub struct Touch {
    /// Where the arm stood.
    pub station: usize,
    /// The two points, one on the flange and one on the base.
    pub points: [TouchPoint; 2],
    /// Covariance of how well they met, in the base.
    pub covariance: Matrix3<f64>,
}

impl TouchPoint {
    /// What it is fixed to; `None` where there is no such target or tip.
    fn body(self, cell: &Cell) -> Option<Body> {
        match self {
            Self::OfTarget { target, .. } => cell.targets.get(target).copied(),
            Self::Tip(tip) => cell.tips.get(tip).map(|t| t.body),
        }
    }

    /// Where it is in its body, and the derivative of that in the parameters.
    fn place(self, cell: &Cell, guess: &Guess, columns: &Columns) -> (Vector3<f64>, DMatrix<f64>) {
        let mut slope = DMatrix::zeros(3, columns.end);
        match self {
            Self::OfTarget { target, at } => {
                let y = &guess.y[target];
                let place = y.act(&at);
                slope.view_mut((0, columns.targets + 6 * target), (3, 6)).copy_from(&along_twist(&place));
                if cell.board_scale {
                    slope.view_mut((0, columns.boards + target), (3, 1)).copy_from(&(y.rotation * at));
                }
                (place, slope)
            }
            Self::Tip(tip) => {
                slope.view_mut((0, columns.tips + 3 * tip), (3, 3)).copy_from(&Matrix3::<f64>::identity());
                (cell.tips[tip].at, slope)
            }
        }
    }
}

/// Derivative of a point `p` in a twist from the left: `[I, -[p]x]`.
fn along_twist(p: &Vector3<f64>) -> DMatrix<f64> {
    let mut slope = DMatrix::zeros(3, 6);
    slope.view_mut((0, 0), (3, 3)).copy_from(&Matrix3::<f64>::identity());
    slope.view_mut((0, 3), (3, 3)).copy_from(&-p.cross_matrix());
    slope
}

/// # Errors
/// [`Error::InvalidInput`] naming what does not fit.
pub(super) fn check(cell: &Cell) -> Result<(), Error> {
    let seen = cell.measurements.iter().map(|m| m.station).max();
    for (k, touch) in cell.touches.iter().enumerate() {
        let bodies = touch.points.map(|point| point.body(cell));
        let mut both = bodies.iter().flatten();
        if both.next() == both.next() || bodies.contains(&None) {
            return Err(Error::invalid(format!(
                "touch {k}: a point of the flange and one of the base are needed"
            )));
        }
        if touch.station >= cell.stations.len() || seen.is_some_and(|last| touch.station <= last) {
            return Err(Error::invalid(format!(
                "touch {k}: its station must come after those of the pictures"
            )));
        }
        if touch.covariance.cholesky().is_none() {
            return Err(Error::invalid(format!("touch {k}: its covariance is not positive")));
        }
    }
    if !cell.touches.is_sorted_by(|a, b| a.station < b.station) {
        return Err(Error::invalid("touches must come one to a station, in order"));
    }
    Ok(())
}

/// Linearises one touch: three rows of a station of its own.
pub(super) fn rows(cell: &Cell, guess: &Guess, columns: &Columns, touch: &Touch) -> Rows {
    let pose: Se3 = cell.stations[touch.station].pose;
    let [one, other] = touch.points;
    let (on_flange, on_base) = if one.body(cell) == Some(Body::Flange) { (one, other) } else { (other, one) };
    let (f, of_f) = on_flange.place(cell, guess, columns);
    let (b, of_b) = on_base.place(cell, guess, columns);
    let carried = pose.act(&f);
    let rotation = DMatrix::from_column_slice(3, 3, pose.rotation.as_slice());
    Rows {
        station: touch.station,
        e: DVector::from_column_slice((b - carried).as_slice()),
        b: of_b - &rotation * of_f,
        pixels: DMatrix::from_column_slice(3, 3, touch.covariance.as_slice()),
        flange: -(&rotation * along_twist(&f)),
        base: -along_twist(&carried),
    }
}
