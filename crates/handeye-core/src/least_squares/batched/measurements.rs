//! Measurements of views as structure of arrays: a view, or a part of one, per lane.

use std::ops::Range;

use super::normal::set_lane;
use crate::batched_algebra::entries;
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

/// As many views, or parts of views, as the widest vector has lanes.
#[derive(Clone, Debug)]
pub(in crate::least_squares) struct Group {
    /// Points of each lane; of the first for a lane without a view.
    pub counts: Row,
    /// Up to here every lane has a point; the rest repeats a lane's first.
    pub full: usize,
    /// As the robot reports them.
    pub motions: [Row; 12],
    pub points: Vec<Point>,
    /// As many as points, or none where every point counts alike.
    pub whitening: Vec<Whitening>,
}

/// The views of a solve in their order, by groups. Circles have no place here.
#[derive(Clone, Debug)]
pub(in crate::least_squares) struct Measurements {
    pub groups: Vec<Group>,
    /// Lanes that share the points of a view; they follow one another.
    pub parts: usize,
}

/// What a group costs beside its points, in points.
const GROUP_COST: usize = 12;

impl Measurements {
    /// With views in as many parts as go fastest, or `whole`; None if a view sees a circle.
    pub fn new(problem: &Problem, views: &[usize], whole: bool) -> Option<Self> {
        if problem.features().iter().any(|f| f.radius != 0.0) && sees_circle(problem, views) {
            return None;
        }
        let longest = views.iter().map(|k| problem.point_count(*k)).max().unwrap_or(0);
        let cost =
            |parts: usize| (views.len() * parts).div_ceil(MAX_LANES) * (longest.div_ceil(parts) + GROUP_COST);
        let parts = if !whole && cost(2) < cost(1) { 2 } else { 1 };
        let split = |k: &usize| {
            let k = *k;
            split(problem.samples(k), parts).map(move |samples| (k, samples))
        };
        let lanes: Vec<(usize, Range<usize>)> = views.iter().flat_map(split).collect();
        Some(Self { groups: lanes.chunks(MAX_LANES).map(|lanes| group(problem, lanes)).collect(), parts })
    }
}

fn sees_circle(problem: &Problem, views: &[usize]) -> bool {
    views.iter().any(|k| problem.features()[problem.samples(*k)].iter().any(|f| f.radius != 0.0))
}

/// The samples of a view in parts of about the same size; a view has three at least.
fn split(samples: Range<usize>, parts: usize) -> impl Iterator<Item = Range<usize>> {
    let bound = move |i: usize| samples.start + samples.len() * i / parts;
    (0..parts).map(move |i| bound(i)..bound(i + 1))
}

/// Of views and the samples in each lane.
fn group(problem: &Problem, lanes: &[(usize, Range<usize>)]) -> Group {
    const ZERO: Row = [0.0; MAX_LANES];
    // A lane without a view repeats the first.
    let lane = |i: usize| &lanes[if i < lanes.len() { i } else { 0 }];
    let counts: [usize; MAX_LANES] = std::array::from_fn(|i| lane(i).1.len());
    let longest = counts.iter().copied().max().unwrap_or(0);
    let mut motions = [ZERO; 12];
    for i in 0..MAX_LANES {
        set_lane(&mut motions, i, &entries(problem.motion(lane(i).0)));
    }
    let [fx, fy, cx, cy] = [0, 1, 2, 3].map(|i| problem.camera().parameters[i]);
    let inverse_focal = [1.0 / fx, 1.0 / fy];
    let features: [_; MAX_LANES] = std::array::from_fn(|i| &problem.features()[lane(i).1.clone()]);
    let pixels: [_; MAX_LANES] = std::array::from_fn(|i| &problem.pixels()[lane(i).1.clone()]);
    let mut points = vec![Point { position: [ZERO; 3], seen: [ZERO; 2] }; longest];
    for (n, point) in points.iter_mut().enumerate() {
        for i in 0..MAX_LANES {
            let own = if n < counts[i] { n } else { 0 };
            let (feature, pixel) = (&features[i][own], &pixels[i][own]);
            for axis in 0..3 {
                point.position[axis][i] = feature.position[axis];
            }
            point.seen[0][i] = (pixel.x - cx) * inverse_focal[0];
            point.seen[1][i] = (pixel.y - cy) * inverse_focal[1];
        }
    }
    let whitened = problem.whitening(0).is_some();
    let mut whitening = vec![[ZERO; 3]; if whitened { longest } else { 0 }];
    for (n, rows) in whitening.iter_mut().enumerate() {
        for i in 0..MAX_LANES {
            let samples = &lane(i).1;
            let own = if n < samples.len() { samples.start + n } else { samples.start };
            if let Some(w) = problem.whitening(own) {
                set_lane(rows, i, &[w.m11, w.m21, w.m22]);
            }
        }
    }
    let full = counts.into_iter().min().unwrap_or(0);
    Group { counts: counts.map(|count| count as f64), full, motions, points, whitening }
}
