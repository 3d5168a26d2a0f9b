//! The points of a target, arranged so that neighbours share work.

use crate::camera::Feature;

/// Points with the same y and z.
pub(super) struct Line {
    pub y: f64,
    pub z: f64,
    /// Their x.
    pub x: Vec<f64>,
}

/// The points of a target by lines, and the box around them.
pub(super) struct Target {
    pub lines: Vec<Line>,
    pub count: f64,
    pub centre: [f64; 3],
    pub half_size: [f64; 3],
}

impl Target {
    /// None if a feature is a circle.
    pub fn new(features: &[Feature]) -> Option<Self> {
        if features.iter().any(|f| f.radius != 0.0) {
            return None;
        }
        let mut points: Vec<[f64; 3]> = features.iter().map(|f| f.position.into()).collect();
        points.sort_by(|a, b| a[2].total_cmp(&b[2]).then(a[1].total_cmp(&b[1])).then(a[0].total_cmp(&b[0])));
        let mut lines: Vec<Line> = Vec::new();
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in &points {
            for axis in 0..3 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
            match lines.last_mut() {
                Some(line) if line.y == point[1] && line.z == point[2] => line.x.push(point[0]),
                _ => lines.push(Line { y: point[1], z: point[2], x: vec![point[0]] }),
            }
        }
        let mut centre = [0.0; 3];
        let mut half_size = [0.0; 3];
        for axis in 0..3 {
            centre[axis] = 0.5 * (low[axis] + high[axis]);
            half_size[axis] = 0.5 * (high[axis] - low[axis]);
        }
        Some(Self { lines, count: points.len() as f64, centre, half_size })
    }
}
