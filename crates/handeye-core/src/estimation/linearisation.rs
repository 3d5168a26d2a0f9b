//! Chains around a guess: twists between chain and measurement, and how everything moves them.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Vector3, Vector6};

use super::cell::{Body, Cell, Columns, Touch, TouchPoint};
use crate::se3::Se3;

/// The unknown poses.
#[derive(Clone, Debug)]
pub(super) struct Guess {
    /// `X` of each camera.
    pub x: Vec<Se3>,
    /// `Y` of each target.
    pub y: Vec<Se3>,
    /// Of stations with a measurement, the twist by which the flange stands elsewhere than reported, in its own
    /// frame; of those that are missing, none.
    pub away: Vec<Vector6<f64>>,
}

impl Guess {
    /// After the twists at the front of `theta`.
    pub fn moved(&self, theta: &[f64]) -> Self {
        let twist = |i: usize| Vector6::from_column_slice(&theta[6 * i..6 * i + 6]);
        let cameras = self.x.len();
        Self {
            x: self.x.iter().enumerate().map(|(c, x)| Se3::exp(&twist(c)) * *x).collect(),
            y: self.y.iter().enumerate().map(|(t, y)| Se3::exp(&twist(cameras + t)) * *y).collect(),
            away: self.away.clone(),
        }
    }
}

/// One station linearised: six rows per measurement, or three of a touch.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    /// Which station of the cell.
    pub station: usize,
    /// Twist between chain and measurement.
    pub e: DVector<f64>,
    /// Its derivative in the parameters of [`Cell::columns`].
    pub b: DMatrix<f64>,
    /// Covariance that the pixels give it.
    pub pixels: DMatrix<f64>,
    /// Its derivative in a twist of the flange in its own frame.
    pub flange: DMatrix<f64>,
    /// Its derivative in a twist of the base.
    pub base: DMatrix<f64>,
}

/// All stations.
#[derive(Clone, Debug)]
pub(super) struct Linearisation {
    /// Stations with a measurement or a touch.
    pub stations: Vec<Rows>,
    /// What the pixels say of the parameters beside the poses, and what is known of tips: information and gradient.
    pub information: DMatrix<f64>,
    /// See `information`.
    pub gradient: DVector<f64>,
}

/// Linearises a cell at a guess.
pub(super) fn linearise(cell: &Cell, guess: &Guess) -> Linearisation {
    let columns = cell.columns();
    let mut information = DMatrix::zeros(columns.end, columns.end);
    let mut gradient = DVector::zeros(columns.end);
    let mut stations = Vec::new();
    let groups = cell.measurements.chunk_by(|a, b| a.station == b.station);
    for (k, group) in groups.enumerate() {
        let away = guess.away.get(k).copied().unwrap_or_default();
        let pose = cell.stations[group[0].station].pose * Se3::exp(&away);
        let size = 6 * group.len();
        let mut rows = Rows {
            station: group[0].station,
            e: DVector::zeros(size),
            b: DMatrix::zeros(size, columns.end),
            pixels: DMatrix::zeros(size, size),
            flange: DMatrix::zeros(size, 6),
            base: DMatrix::zeros(size, 6),
        };
        for (i, m) in group.iter().enumerate() {
            let at = 6 * i;
            let (x, y) = (&guess.x[m.camera], &guess.y[m.target]);
            let before = *x * cell.middle_at(m, &pose);
            let (of_x, of_y) = (x.adjoint(), before.adjoint());
            let e = (before * *y * m.pose.pose.inverse()).log();
            rows.e.rows_mut(at, 6).copy_from(&e);
            rows.b.view_mut((at, 6 * m.camera), (6, 6)).copy_from(&Matrix6::identity());
            rows.b.view_mut((at, columns.targets + 6 * m.target), (6, 6)).copy_from(&of_y);
            let pixel = pixel_columns(cell, m.camera, m.target, &columns);
            for (j, column) in pixel.iter().enumerate() {
                rows.b.view_mut((at, *column), (6, 1)).copy_from(&m.pose.sensitivity.column(j));
            }
            let weight = 1.0 / m.variance_px2;
            // Pixels count once: where the camera's prior holds them already, they say nothing new of it.
            let known =
                if cell.cameras[m.camera].from_these_pixels { cell.cameras[m.camera].parameters } else { 0 };
            for (a, row) in pixel.iter().enumerate().skip(known) {
                gradient[*row] += weight * m.pose.camera_gradient[a];
                for (b, column) in pixel.iter().enumerate().skip(known) {
                    information[(*row, *column)] += weight * m.pose.camera_information[(a, b)];
                }
            }
            rows.pixels.view_mut((at, at), (6, 6)).copy_from(&(m.pose.covariance * m.variance_px2));
            // A = T_base_flange is truly exp(base) A exp(flange), and M is A or its inverse.
            match (cell.cameras[m.camera].body, cell.targets[m.target]) {
                (Body::Flange, Body::Base) => {
                    rows.flange.view_mut((at, 0), (6, 6)).copy_from(&-of_x);
                    rows.base.view_mut((at, 0), (6, 6)).copy_from(&-of_y);
                }
                (Body::Base, Body::Flange) => {
                    rows.base.view_mut((at, 0), (6, 6)).copy_from(&of_x);
                    rows.flange.view_mut((at, 0), (6, 6)).copy_from(&of_y);
                }
                _ => {}
            }
        }
        // As it would be where the arm says it stands, were it linear all the way.
        let back = &rows.flange * DVector::from_column_slice(away.as_slice());
        rows.e -= back;
        stations.push(rows);
    }
    stations.extend(cell.touches.iter().map(|touch| rows_of_touch(cell, guess, &columns, touch)));
    for (i, tip) in cell.tips.iter().enumerate() {
        let mut known = information.view_mut((columns.tips + 3 * i, columns.tips + 3 * i), (3, 3));
        known += &tip.information;
    }
    Linearisation { stations, information, gradient }
}

/// Columns of a measurement's pixel parameters: those of its camera, then the scale of its board.
fn pixel_columns(cell: &Cell, camera: usize, target: usize, columns: &Columns) -> Vec<usize> {
    let first = columns.camera[camera];
    let mut all: Vec<usize> = (first..first + cell.cameras[camera].parameters).collect();
    if cell.board_scale {
        all.push(columns.boards + target);
    }
    all
}

/// Where a point is in its body, and the derivative of that in the parameters.
fn place(point: TouchPoint, cell: &Cell, guess: &Guess, columns: &Columns) -> (Vector3<f64>, DMatrix<f64>) {
    let mut slope = DMatrix::zeros(3, columns.end);
    match point {
        TouchPoint::OfTarget { target, at } => {
            let y = &guess.y[target];
            let place = y.act(&at);
            slope.view_mut((0, columns.targets + 6 * target), (3, 6)).copy_from(&along_twist(&place));
            if cell.board_scale {
                slope.view_mut((0, columns.boards + target), (3, 1)).copy_from(&(y.rotation * at));
            }
            (place, slope)
        }
        TouchPoint::Tip(tip) => {
            slope.view_mut((0, columns.tips + 3 * tip), (3, 3)).copy_from(&Matrix3::<f64>::identity());
            (cell.tips[tip].at, slope)
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

/// Linearises one touch: three rows of a station of its own.
///
/// With `T` the pose of the arm, `f` the point in the flange and `b` the one in the base, `b - T f` vanishes but for how
/// well it was touched.
fn rows_of_touch(cell: &Cell, guess: &Guess, columns: &Columns, touch: &Touch) -> Rows {
    let pose: Se3 = cell.stations[touch.station].pose;
    let [one, other] = touch.points;
    let (on_flange, on_base) =
        if cell.body_of(one) == Some(Body::Flange) { (one, other) } else { (other, one) };
    let (f, of_f) = place(on_flange, cell, guess, columns);
    let (b, of_b) = place(on_base, cell, guess, columns);
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
