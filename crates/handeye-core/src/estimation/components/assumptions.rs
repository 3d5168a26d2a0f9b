//! What is assumed of a cell.

/// What is assumed of the cell beside what was measured.
#[derive(Clone, Debug)]
pub struct Assumptions {
    /// Whether the robot's poses are exact.
    pub exact_robot: bool,
    /// What a deviation of one means for each joint: radians, metres.
    pub joint_scales: Vec<f64>,
    /// How many times rougher the arm is than those that priors are about, at least one: an arm that is rough in what
    /// residuals show is believed to be as rough in constant errors that hide.
    pub roughness: f64,
    /// Joints whose offset is a parameter: all but those that only say where base and flange are.
    pub free_joints: Vec<usize>,
    /// Whether each way of displacing a joint on its link is in metres.
    pub link_lengths: Vec<bool>,
}
