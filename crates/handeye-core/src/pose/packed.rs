//! Measurements of views as structure of arrays: a view, or a part of one, per lane.

use nalgebra::Vector2;

use crate::batched_algebra::set_lane;
use crate::camera::{Camera, Feature};
use crate::se3::{Se3, entries};
use crate::simd::MAX_LANES;

/// A view as it was measured.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    /// As the robot reports it.
    pub motion: &'a Se3,
    /// As many as pixels, three at least.
    pub features: &'a [Feature],
    pub pixels: &'a [Vector2<f64>],
}

/// One value per view of a group.
pub(crate) type Row = [f64; MAX_LANES];

/// A point of each view of a group: where it is on the target and where it was seen.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Point {
    /// On the target, metres.
    pub position: [Row; 3],
    /// In the plane at unit depth, after the lens: `(u - c_x) / f_x`, `(v - c_y) / f_y`.
    pub seen: [Row; 2],
}

/// As many views, or parts of views, as the widest vector has lanes.
#[derive(Clone, Debug)]
pub(crate) struct Group {
    /// Points of each lane; of the first for a lane without a view.
    pub counts: Row,
    /// Up to here every lane has a point; the rest repeats a lane's first.
    pub full: usize,
    /// As the robot reports them.
    pub motions: [Row; 12],
    pub points: Vec<Point>,
}

/// The views of a solve in their order, by groups.
#[derive(Clone, Debug)]
pub(crate) struct Measurements {
    pub groups: Vec<Group>,
    /// Lanes that share the points of a view; they follow one another.
    pub parts: usize,
    /// Number of views.
    pub views: usize,
}

/// Fixed cost of a group, as a number of points.
const GROUP_COST: usize = 12;

impl Measurements {
    /// Views split into as many parts as run fastest; None for circles and fisheyes, which have no batched engine.
    pub fn new(camera: &Camera, views: &[View<'_>]) -> Option<Self> {
        if !Self::in_lanes(camera, views) {
            return None;
        }
        let longest = views.iter().map(|view| view.pixels.len()).max().unwrap_or(0);
        let cost =
            |parts: usize| (views.len() * parts).div_ceil(MAX_LANES) * (longest.div_ceil(parts) + GROUP_COST);
        Some(Self::in_parts(camera, views, if cost(2) < cost(1) { 2 } else { 1 }))
    }

    /// Whether kernels that take many points at once know lens and features.
    pub fn in_lanes(camera: &Camera, views: &[View<'_>]) -> bool {
        let is_corner = |feature: &Feature| feature.radius == 0.0;
        camera.lens.in_lanes() && views.iter().all(|view| view.features.iter().all(is_corner))
    }

    /// With every view in `parts` parts, of at least a point each.
    pub fn in_parts(camera: &Camera, views: &[View<'_>], parts: usize) -> Self {
        let lanes: Vec<View<'_>> = views.iter().flat_map(|view| split(view, parts)).collect();
        let groups = lanes.chunks(MAX_LANES).map(|lanes| group(camera, lanes)).collect();
        Self { groups, parts, views: views.len() }
    }
}

/// A view in parts of about the same size.
fn split<'a>(view: &View<'a>, parts: usize) -> impl Iterator<Item = View<'a>> {
    let View { motion, features, pixels } = *view;
    let bound = move |i: usize| pixels.len() * i / parts;
    (0..parts).map(move |i| {
        let range = bound(i)..bound(i + 1);
        View { motion, features: &features[range.clone()], pixels: &pixels[range] }
    })
}

/// A lane for each of some views.
fn group(camera: &Camera, lanes: &[View<'_>]) -> Group {
    const ZERO: Row = [0.0; MAX_LANES];
    // A lane without a view repeats the first.
    let lanes: [&View<'_>; MAX_LANES] = std::array::from_fn(|i| lanes.get(i).unwrap_or(&lanes[0]));
    let counts = lanes.map(|view| view.pixels.len());
    let longest = counts.iter().copied().max().unwrap_or(0);
    let mut motions = [ZERO; 12];
    for (i, view) in lanes.iter().enumerate() {
        set_lane(&mut motions, i, &entries(view.motion));
    }
    let [fx, fy, cx, cy] = [0, 1, 2, 3].map(|i| camera.parameters[i]);
    let inverse_focal = [1.0 / fx, 1.0 / fy];
    let mut points = vec![Point { position: [ZERO; 3], seen: [ZERO; 2] }; longest];
    for (n, point) in points.iter_mut().enumerate() {
        for (i, view) in lanes.iter().enumerate() {
            let own = if n < counts[i] { n } else { 0 };
            let (feature, pixel) = (&view.features[own], &view.pixels[own]);
            for axis in 0..3 {
                point.position[axis][i] = feature.position[axis];
            }
            point.seen[0][i] = (pixel.x - cx) * inverse_focal[0];
            point.seen[1][i] = (pixel.y - cy) * inverse_focal[1];
        }
    }
    let full = counts.into_iter().min().unwrap_or(0);
    Group { counts: counts.map(|count| count as f64), full, motions, points }
}
