//! Components of the error: one file each, listed in [`all`].

mod arm;
mod assumptions;
mod backlash;
mod board;
mod camera;
mod detector;
mod joint_noise;
mod joint_offsets;
mod links;
mod posture;
mod robot_pose;
mod time_lag;

pub(super) use self::arm::Arm;
pub use self::assumptions::Assumptions;
use super::cell::Cell;
use super::component::{Component, per_station};
use crate::error::Error;

/// Components of a cell whose robot errs in a new way at every station.
pub(super) fn independent(cell: &Cell) -> Vec<Box<dyn Component>> {
    let mut all = of_pictures(cell);
    all.push(Box::new(robot_pose::RobotPose::flange()));
    all.push(Box::new(robot_pose::RobotPose::base()));
    all
}

/// Cameras and boards.
fn of_pictures(cell: &Cell) -> Vec<Box<dyn Component>> {
    let mut all: Vec<Box<dyn Component>> = Vec::new();
    for (c, camera) in cell.cameras.iter().enumerate() {
        if let Some(prior) = &camera.prior {
            all.push(Box::new(camera::CameraCovariance::new(c, prior.clone())));
        }
    }
    if cell.board_scale {
        all.push(Box::new(board::BoardScale { touched: !cell.touches.is_empty() }));
    }
    if let Some(detector) = detector::Detector::of(cell) {
        all.push(Box::new(detector));
    }
    all
}

/// The components of a cell.
///
/// # Errors
/// [`Error::InvalidInput`] where the stations' arms do not fit the assumptions.
pub(super) fn all(cell: &Cell, assumptions: &Assumptions) -> Result<Vec<Box<dyn Component>>, Error> {
    if assumptions.exact_robot {
        return Ok(of_pictures(cell));
    }
    let mut all = independent(cell);
    if let Some(lag) = time_lag::TimeLag::of(cell) {
        all.push(Box::new(lag));
    }
    if let Some(arm) = Arm::of(cell, assumptions)? {
        all.push(Box::new(joint_noise::JointNoise::new(&arm)));
        all.push(Box::new(joint_offsets::JointOffsets::new(&arm, assumptions.roughness)));
        all.push(Box::new(links::Links::new(&arm, assumptions.roughness)));
        all.extend(backlash::Backlash::of(cell).map(|one| Box::new(one) as Box<dyn Component>));
    } else {
        all.push(Box::new(posture::Posture::flange(cell, assumptions.roughness)));
        all.push(Box::new(posture::Posture::base(cell, assumptions.roughness)));
    }
    Ok(all)
}

/// Whether a component is an error of the robot.
pub(super) fn is_of_robot(name: &str) -> bool {
    !matches!(name, "camera" | "board_scale" | "detector" | "time_lag")
}
