//! What stands in a cell, and what was measured there.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3, Vector6};

use super::pose_measurement::PoseMeasurement;
use crate::error::Error;
use crate::se3::Se3;

/// What a camera or a target is fixed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Body {
    /// The flange of the arm.
    Flange,
    /// Its base, or anything that does not move against it.
    Base,
}

/// What is believed of a camera's free parameters beforehand: a Gaussian around `mean`, relative to the values at which
/// the measurements were made.
#[derive(Clone, Debug)]
pub struct CameraPrior {
    /// Information, square.
    pub information: DMatrix<f64>,
    /// Mean, relative to the present values.
    pub mean: DVector<f64>,
    /// Whether the covariance may be larger than stated, by a level that is found.
    pub inflated: bool,
}

/// A camera: what it is fixed to, and its free parameters.
#[derive(Clone, Debug)]
pub struct SeenBy {
    /// What it is fixed to.
    pub body: Body,
    /// Free parameters, without the scale of a board.
    pub parameters: usize,
    /// Whether the prior comes from the very pixels of the measurements, which then say nothing new of the camera.
    pub from_these_pixels: bool,
    /// `None`: nothing but what the pictures say.
    pub prior: Option<CameraPrior>,
}

/// One stop of the arm.
#[derive(Clone, Debug)]
pub struct Station {
    /// `T_base_flange` as reported.
    pub pose: Se3,
    /// Twist of the flange in its own frame per joint, `6 x n`: truly `T exp(J dq)`; `None` where the arm is not known.
    pub joints: Option<DMatrix<f64>>,
    /// Twist of the flange in its own frame per second while the picture was taken; `None` where that is not known.
    pub velocity: Option<Vector6<f64>>,
    /// Twist per way of displacing a joint on its link, `6 x m`.
    pub links: Option<DMatrix<f64>>,
    /// Twist per joint and its play, `6 x n`: half of it towards the side that the joint came from. `None` where that
    /// is not known, or the joints have no play.
    pub approach: Option<DMatrix<f64>>,
}

/// One detection of a target in a picture.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// Where the arm stood.
    pub station: usize,
    /// Which camera.
    pub camera: usize,
    /// Which target.
    pub target: usize,
    /// The pose of the target in the camera; its sensitivity has a column per free parameter of the camera and, last,
    /// one for the scale of the board where [`Cell::board_scale`] says so.
    pub pose: PoseMeasurement,
    /// Variance of the pixels, px^2.
    pub variance_px2: f64,
}

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

/// A cell and what was measured in it.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Stops of the arm.
    pub stations: Vec<Station>,
    /// Cameras.
    pub cameras: Vec<SeenBy>,
    /// What each target is fixed to.
    pub targets: Vec<Body>,
    /// Whether the scale of every board is a parameter.
    pub board_scale: bool,
    /// Detections, by station.
    pub measurements: Vec<Measurement>,
    /// Points that touches are about beside those of the targets.
    pub tips: Vec<Tip>,
    /// Points that met, by station.
    pub touches: Vec<Touch>,
}

impl Cell {
    /// Columns of the parameters: first those of `X` and `Y`, then of the cameras, then scales of the boards,
    /// then tips.
    pub(super) fn columns(&self) -> Columns {
        let poses = 6 * (self.cameras.len() + self.targets.len());
        let mut camera = Vec::with_capacity(self.cameras.len());
        let mut next = poses;
        for one in &self.cameras {
            camera.push(next);
            next += one.parameters;
        }
        let boards = next;
        let tips = boards + if self.board_scale { self.targets.len() } else { 0 };
        Columns { targets: 6 * self.cameras.len(), camera, boards, tips, end: tips + 3 * self.tips.len() }
    }

    /// The middle `M` of the chain `X M Y` at a station, by the pose that it reports.
    pub(super) fn middle(&self, m: &Measurement) -> Se3 {
        self.middle_at(m, &self.stations[m.station].pose)
    }

    /// The same where the arm stands elsewhere.
    pub(super) fn middle_at(&self, m: &Measurement, pose: &Se3) -> Se3 {
        match (self.cameras[m.camera].body, self.targets[m.target]) {
            (Body::Flange, Body::Base) => pose.inverse(),
            (Body::Base, Body::Flange) => *pose,
            _ => Se3::identity(),
        }
    }

    /// Whether all poses were measured by detectors of somebody else, without pictures.
    pub(super) fn is_unseen(&self) -> bool {
        self.measurements.iter().all(|m| m.pose.is_foreign)
    }

    /// # Errors
    /// [`Error::InvalidInput`] naming what does not fit.
    pub(super) fn check(&self) -> Result<(), Error> {
        if self.cameras.is_empty() || self.targets.is_empty() || self.measurements.is_empty() {
            return Err(Error::invalid("a cell needs a camera, a target and a measurement"));
        }
        if !self.measurements.is_sorted_by_key(|m| m.station) {
            return Err(Error::invalid("measurements must come station by station"));
        }
        for (k, m) in self.measurements.iter().enumerate() {
            let known = m.station < self.stations.len()
                && m.camera < self.cameras.len()
                && m.target < self.targets.len();
            if !known {
                return Err(Error::invalid(format!(
                    "measurement {k}: no such station, camera or target ({}, {}, {})",
                    m.station, m.camera, m.target
                )));
            }
            let columns = self.cameras[m.camera].parameters + usize::from(self.board_scale);
            if m.pose.sensitivity.ncols() != columns {
                return Err(Error::invalid(format!(
                    "measurement {k}: {} columns of sensitivity, expected {columns}",
                    m.pose.sensitivity.ncols()
                )));
            }
            if !(m.variance_px2 > 0.0 && m.variance_px2.is_finite()) {
                return Err(Error::invalid(format!("measurement {k}: pixel variance {}", m.variance_px2)));
            }
        }
        for (c, camera) in self.cameras.iter().enumerate() {
            let fits = |p: &CameraPrior| {
                p.information.shape() == (camera.parameters, camera.parameters)
                    && p.mean.len() == camera.parameters
            };
            if camera.prior.as_ref().is_some_and(|p| !fits(p)) {
                return Err(Error::invalid(format!("camera {c}: its prior is not of its parameters")));
            }
        }
        self.check_touches()
    }

    /// What a point is fixed to; `None` where there is no such target or tip.
    pub(super) fn body_of(&self, point: TouchPoint) -> Option<Body> {
        match point {
            TouchPoint::OfTarget { target, .. } => self.targets.get(target).copied(),
            TouchPoint::Tip(tip) => self.tips.get(tip).map(|t| t.body),
        }
    }

    /// # Errors
    /// [`Error::InvalidInput`] naming what does not fit.
    fn check_touches(&self) -> Result<(), Error> {
        let seen = self.measurements.iter().map(|m| m.station).max();
        for (k, touch) in self.touches.iter().enumerate() {
            let bodies = touch.points.map(|point| self.body_of(point));
            let mut both = bodies.iter().flatten();
            if both.next() == both.next() || bodies.contains(&None) {
                return Err(Error::invalid(format!(
                    "touch {k}: a point of the flange and one of the base are needed"
                )));
            }
            if touch.station >= self.stations.len() || seen.is_some_and(|last| touch.station <= last) {
                return Err(Error::invalid(format!(
                    "touch {k}: its station must come after those of the pictures"
                )));
            }
            if touch.covariance.cholesky().is_none() {
                return Err(Error::invalid(format!("touch {k}: its covariance is not positive")));
            }
        }
        if !self.touches.is_sorted_by(|a, b| a.station < b.station) {
            return Err(Error::invalid("touches must come one to a station, in order"));
        }
        Ok(())
    }
}

/// Where parameters stand.
#[derive(Clone, Debug)]
pub(super) struct Columns {
    /// First of the targets' twists; the cameras' begin at zero.
    pub targets: usize,
    /// First of each camera's parameters.
    pub camera: Vec<usize>,
    /// First of the scales of the boards.
    pub boards: usize,
    /// First of the tips.
    pub tips: usize,
    /// One beyond the last.
    pub end: usize,
}
