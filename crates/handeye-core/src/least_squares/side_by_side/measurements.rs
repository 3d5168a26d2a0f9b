//! Measurements of views as structure of arrays: one view per lane.

use crate::camera::Feature;
use crate::least_squares::Problem;
use crate::simd::MAX_LANES;

/// One value per view of a group.
pub(super) type Row = [f64; MAX_LANES];

/// A point of each view of a group: where it is on the target and where it was seen.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(in crate::least_squares) struct Point {
    /// On the target, metres.
    pub position: [Row; 3],
    /// In the plane at unit depth, after the lens: `(u - c_x) / f_x`, `(v - c_y) / f_y`.
    pub seen: [Row; 2],
}

/// Square roots of the information of a point of each view, `[w11, w21, w22]` of a lower triangle.
pub(super) type Whitening = [Row; 3];

/// As many views as the widest vector has lanes.
#[derive(Clone, Debug)]
pub(in crate::least_squares) struct Group {
    /// Points of each view; zero for a lane without a view.
    pub counts: Row,
    /// Up to here every lane has a point; the rest repeats a lane's first.
    pub full: usize,
    pub points: Vec<Point>,
    /// As many as points, or none where every point counts alike.
    pub whitening: Vec<Whitening>,
}

/// The views of a solve in their order, by groups. Circles have no place here.
#[derive(Clone, Debug)]
pub(in crate::least_squares) struct Measurements {
    pub groups: Vec<Group>,
}

impl Measurements {
    /// None if a view sees a circle.
    pub fn new(problem: &Problem, views: &[usize]) -> Option<Self> {
        let is_point = |f: &Feature| f.radius == 0.0;
        if !views.iter().all(|k| problem.features()[problem.samples(*k)].iter().all(is_point)) {
            return None;
        }
        Some(Self { groups: views.chunks(MAX_LANES).map(|views| group(problem, views)).collect() })
    }
}

fn group(problem: &Problem, views: &[usize]) -> Group {
    const ZERO: Row = [0.0; MAX_LANES];
    let counts = |lane: usize| views.get(lane).map_or(0, |k| problem.point_count(*k));
    let longest = (0..MAX_LANES).map(counts).max().unwrap_or(0);
    let [fx, fy, cx, cy] = [0, 1, 2, 3].map(|i| problem.camera().parameters[i]);
    let whitened = problem.whitening(0).is_some();
    let mut points = vec![Point { position: [ZERO; 3], seen: [ZERO; 2] }; longest];
    let mut whitening = vec![[ZERO; 3]; if whitened { longest } else { 0 }];
    for lane in 0..MAX_LANES {
        // A lane without a view repeats the first, and counts for nothing.
        let samples = problem.samples(views[if lane < views.len() { lane } else { 0 }]);
        let features = &problem.features()[samples.clone()];
        let pixels = &problem.pixels()[samples.clone()];
        let repeated = std::iter::repeat((&features[0], &pixels[0]));
        let all = features.iter().zip(pixels).chain(repeated);
        for (point, (feature, pixel)) in points.iter_mut().zip(all) {
            for axis in 0..3 {
                point.position[axis][lane] = feature.position[axis];
            }
            point.seen[0][lane] = (pixel.x - cx) / fx;
            point.seen[1][lane] = (pixel.y - cy) / fy;
        }
        for (i, rows) in whitening.iter_mut().enumerate() {
            let sample = if i < samples.len() { samples.start + i } else { samples.start };
            if let Some(w) = problem.whitening(sample) {
                for (row, value) in rows.iter_mut().zip([w.m11, w.m21, w.m22]) {
                    row[lane] = value;
                }
            }
        }
    }
    let full = (0..MAX_LANES).map(counts).min().unwrap_or(0);
    Group { counts: std::array::from_fn(|lane| counts(lane) as f64), full, points, whitening }
}
