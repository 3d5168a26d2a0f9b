//! Components of the error: one file each, listed in [`all`].

mod arm;
mod board;
mod camera;
mod joint_noise;
mod joint_offsets;
mod links;
mod posture;
mod robot_pose;
mod time_lag;

use nalgebra::DMatrix;

pub(super) use self::arm::Arm;
use super::cell::Cell;
use super::levels::Level;
use super::linearisation::Linearisation;
use super::mixed::Term;
use crate::error::Error;

/// One thing that can be wrong.
pub(in crate::estimation) trait Component {
    /// Stable name.
    fn name(&self) -> &'static str;

    /// Its levels.
    fn levels(&self) -> Vec<Level>;

    /// What it does to a linearised cell, by numbers of its levels.
    fn terms(&self, cell: &Cell, linearisation: &Linearisation) -> Vec<Term>;
}

/// What is assumed of the cell beside what was measured.
#[derive(Clone, Debug)]
pub struct Assumptions {
    /// Whether the robot's poses are exact.
    pub exact_robot: bool,
    /// What a deviation of one means for each joint: radians, metres.
    pub joint_scales: Vec<f64>,
    /// Joints whose offset is a parameter: all but those that only say where base and flange are.
    pub free_joints: Vec<usize>,
    /// Whether each way of displacing a joint on its link is in metres.
    pub link_lengths: Vec<bool>,
}

/// The components of a cell.
///
/// # Errors
/// [`Error::InvalidInput`] where the stations' arms do not fit the assumptions.
pub(super) fn all(cell: &Cell, assumptions: &Assumptions) -> Result<Vec<Box<dyn Component>>, Error> {
    let mut all: Vec<Box<dyn Component>> = Vec::new();
    for (c, camera) in cell.cameras.iter().enumerate() {
        if let Some(prior) = &camera.prior {
            all.push(Box::new(camera::CameraCovariance::new(c, prior.clone())));
        }
    }
    if cell.board_scale {
        all.push(Box::new(board::BoardScale));
    }
    if assumptions.exact_robot {
        return Ok(all);
    }
    all.push(Box::new(robot_pose::RobotPose::flange()));
    all.push(Box::new(robot_pose::RobotPose::base()));
    if let Some(lag) = time_lag::TimeLag::of(cell) {
        all.push(Box::new(lag));
    }
    if let Some(arm) = Arm::of(cell, assumptions)? {
        all.push(Box::new(joint_noise::JointNoise::new(&arm)));
        all.push(Box::new(joint_offsets::JointOffsets::new(&arm)));
        all.push(Box::new(links::Links::new(&arm)));
    } else {
        all.push(Box::new(posture::Posture::flange(cell)));
        all.push(Box::new(posture::Posture::base(cell)));
    }
    Ok(all)
}

/// Whether a component is an error of the robot.
pub(super) fn is_of_robot(name: &str) -> bool {
    !matches!(name, "camera" | "board_scale" | "time_lag")
}

/// A matrix per station: rows of a twist at the flange or base times columns of such twists.
fn per_station(
    linearisation: &Linearisation,
    of: impl Fn(&super::linearisation::Rows) -> DMatrix<f64>,
) -> Vec<DMatrix<f64>> {
    linearisation.stations.iter().map(of).collect()
}
