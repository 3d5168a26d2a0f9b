//! An arm whose kinematics are known, at the stations of a cell.

use nalgebra::DMatrix;

use super::Assumptions;
use crate::error::Error;
use crate::estimation::cell::Cell;

/// Jacobians of the flange by joints and links, per station of the cell.
#[derive(Clone, Debug)]
pub(in crate::estimation) struct Arm {
    /// `6 x n`, each joint at a deviation of one.
    pub joints: Vec<DMatrix<f64>>,
    /// `6 x f`, offsets that are parameters, each at a deviation of one.
    pub offsets: Vec<DMatrix<f64>>,
    /// `6 x l`, ways in metres.
    pub lengths: Vec<DMatrix<f64>>,
    /// `6 x a`, ways in radians.
    pub angles: Vec<DMatrix<f64>>,
}

impl Arm {
    /// The arm, if every station has it.
    pub fn of(cell: &Cell, assumptions: &Assumptions) -> Result<Option<Self>, Error> {
        if cell.stations.iter().all(|s| s.joints.is_none()) {
            return Ok(None);
        }
        let n = assumptions.joint_scales.len();
        let ways = assumptions.link_lengths.len();
        let chosen = |lengths: bool| -> Vec<usize> {
            (0..ways).filter(|i| assumptions.link_lengths[*i] == lengths).collect()
        };
        let (in_metres, in_radians) = (chosen(true), chosen(false));
        let mut arm = Self { joints: vec![], offsets: vec![], lengths: vec![], angles: vec![] };
        for (k, station) in cell.stations.iter().enumerate() {
            let (Some(joints), Some(links)) = (&station.joints, &station.links) else {
                return Err(Error::invalid(format!("station {k} has no joints, others have")));
            };
            if joints.ncols() != n || links.ncols() != ways || assumptions.free_joints.iter().any(|j| *j >= n)
            {
                return Err(Error::invalid(format!(
                    "station {k}: {} joints and {} ways of displacing them, expected {n} and {ways}",
                    joints.ncols(),
                    links.ncols()
                )));
            }
            let mut scaled = joints.clone();
            for (mut column, scale) in scaled.column_iter_mut().zip(&assumptions.joint_scales) {
                column *= *scale;
            }
            arm.offsets.push(scaled.select_columns(&assumptions.free_joints));
            arm.joints.push(scaled);
            arm.lengths.push(links.select_columns(&in_metres));
            arm.angles.push(links.select_columns(&in_radians));
        }
        Ok(Some(arm))
    }
}
