//! The points of a target, arranged so that neighbours share work.

use crate::camera::Feature;
use crate::simd::{Simd, Vector};

/// Places that differ by less, in sizes of the target, are one: what rounding makes of a regular grid.
const ROUNDING: f64 = 1e-14;

/// Evenly spaced points of a line along x, and such lines evenly spaced along y.
pub(super) struct Patch {
    /// Its first point.
    pub first: [f64; 3],
    /// From a point to the next along x, and from a line to the next along y.
    pub step: [f64; 2],
    /// Points of a line, and lines.
    pub counts: [usize; 2],
}

impl Patch {
    /// Line by line, y and z and the x of its points.
    pub fn lines(&self) -> impl Iterator<Item = (f64, f64, impl Iterator<Item = f64>)> {
        let [x, y, z] = self.first;
        (0..self.counts[1]).map(move |j| {
            let along = (0..self.counts[0]).map(move |i| self.step[0].mul_add(i as f64, x));
            (self.step[1].mul_add(j as f64, y), z, along)
        })
    }
}

/// A way over a patch, in the camera frame: from each point to the next, and from each line to the next.
pub(super) struct Way<V> {
    pub first: [V; 3],
    pub next: [V; 3],
    pub next_line: [V; 3],
}

impl<V: Vector> Way<V> {
    /// For a patch at a pose.
    #[inline(always)]
    pub fn new<S: Simd<Vector = V>>(simd: S, patch: &Patch, pose: &[V; 12]) -> Self {
        let zero = [simd.splat(0.0); 3];
        let mut way = Self { first: zero, next: zero, next_line: zero };
        for row in 0..3 {
            let [x, y, z] = [pose[3 * row], pose[3 * row + 1], pose[3 * row + 2]];
            let start = z.mul_add(simd.splat(patch.first[2]), pose[9 + row]);
            let start = y.mul_add(simd.splat(patch.first[1]), start);
            way.first[row] = x.mul_add(simd.splat(patch.first[0]), start);
            way.next[row] = x * simd.splat(patch.step[0]);
            way.next_line[row] = y * simd.splat(patch.step[1]);
        }
        way
    }
}

/// Goes a step.
#[inline(always)]
pub(super) fn advance<V: Vector>(point: &mut [V; 3], step: &[V; 3]) {
    for row in 0..3 {
        point[row] = point[row] + step[row];
    }
}

/// The points of a target by patches, and the box around them.
pub(super) struct Target {
    pub patches: Vec<Patch>,
    pub count: f64,
    /// The z of all points, if they have one.
    pub plane_z: Option<f64>,
    pub centre: [f64; 3],
    pub half_size: [f64; 3],
}

impl Target {
    /// None if a feature is a circle.
    pub fn new(features: &[Feature]) -> Option<Self> {
        if features.iter().any(|f| f.radius != 0.0) {
            return None;
        }
        let points: Vec<[f64; 3]> = features.iter().map(|f| f.position.into()).collect();
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in &points {
            for axis in 0..3 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        let mut centre = [0.0; 3];
        let mut half_size = [0.0; 3];
        for axis in 0..3 {
            centre[axis] = 0.5 * (low[axis] + high[axis]);
            half_size[axis] = 0.5 * (high[axis] - low[axis]);
        }
        let plane_z = (low[2] == high[2]).then_some(low[2]);
        let count = points.len() as f64;
        Some(Self { patches: patches(points), count, plane_z, centre, half_size })
    }
}

/// Points to lines of even spacing, and these to patches.
fn patches(mut points: Vec<[f64; 3]>) -> Vec<Patch> {
    points.sort_by(|a, b| a[2].total_cmp(&b[2]).then(a[1].total_cmp(&b[1])).then(a[0].total_cmp(&b[0])));
    // (z, first x, step, points) of a line, and its y.
    let mut lines: Vec<([f64; 3], usize, f64)> = Vec::new();
    for row in points.chunk_by(|a, b| a[1..] == b[1..]) {
        let along: Vec<f64> = row.iter().map(|point| point[0]).collect();
        for (first, step, count) in progressions(&along) {
            lines.push(([row[0][2], first, step], count, row[0][1]));
        }
    }
    let order = |a: &[f64; 3], b: &[f64; 3]| {
        a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
    };
    lines.sort_by(|a, b| order(&a.0, &b.0).then(a.1.cmp(&b.1)).then(a.2.total_cmp(&b.2)));
    let mut patches = Vec::new();
    for alike in lines.chunk_by(|a, b| a.0 == b.0 && a.1 == b.1) {
        let ([z, x, step], count, _) = alike[0];
        let across: Vec<f64> = alike.iter().map(|line| line.2).collect();
        for (y, next, lines) in progressions(&across) {
            patches.push(Patch { first: [x, y, z], step: [step, next], counts: [count, lines] });
        }
    }
    patches
}

/// Sorted places as evenly spaced sets, `(first, step, count)`: all of them as one, every other one (a board of tags,
/// whose sides and gaps differ), or as pairs.
fn progressions(places: &[f64]) -> Vec<(f64, f64, usize)> {
    let size = places.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    for stride in [1, 2] {
        let sets: Option<Vec<_>> = (0..stride.min(places.len()))
            .map(|start| even(places[start..].iter().step_by(stride).copied(), ROUNDING * size))
            .collect();
        if let Some(sets) = sets {
            return sets;
        }
    }
    places.chunks(2).map(|pair| (pair[0], pair[pair.len() - 1] - pair[0], pair.len())).collect()
}

/// `(first, step, count)` of places if they are evenly spaced.
fn even(places: impl Iterator<Item = f64> + Clone, tolerance: f64) -> Option<(f64, f64, usize)> {
    let (first, last) = (places.clone().next()?, places.clone().last()?);
    let count = places.clone().count();
    let step = if count > 1 { (last - first) / (count - 1) as f64 } else { 0.0 };
    let fits = places.enumerate().all(|(i, x)| (x - step.mul_add(i as f64, first)).abs() <= tolerance);
    fits.then_some((first, step, count))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn target(points: &[[f64; 3]]) -> Target {
        let features: Vec<_> = points.iter().map(|p| Feature::new(Vector3::from(*p), 0.0).unwrap()).collect();
        Target::new(&features).unwrap()
    }

    fn points(target: &Target) -> Vec<[f64; 3]> {
        let mut all = Vec::new();
        for patch in &target.patches {
            for (y, z, along) in patch.lines() {
                all.extend(along.map(|x| [x, y, z]));
            }
        }
        all
    }

    fn same(given: &[[f64; 3]], found: &[[f64; 3]]) {
        assert_eq!(given.len(), found.len());
        let near = |a: &[f64; 3], b: &[f64; 3]| (0..3).all(|axis| (a[axis] - b[axis]).abs() < 1e-14);
        for point in given {
            assert_eq!(found.iter().filter(|other| near(point, other)).count(), 1, "{point:?}");
        }
    }

    #[test]
    fn a_grid_is_one_patch() {
        let grid: Vec<_> =
            (0..88).map(|i| [f64::from(i % 11) * 0.03 - 0.1, f64::from(i / 11) * 0.03, 0.0]).collect();
        let found = target(&grid);
        assert_eq!(found.patches.len(), 1);
        assert_eq!(found.patches[0].counts, [11, 8]);
        same(&grid, &points(&found));
    }

    #[test]
    fn corners_of_tags_are_four_patches() {
        let side = [0.0, 0.024, 0.0312, 0.0552, 0.0624, 0.0864];
        let tags: Vec<_> = side.iter().flat_map(|y| side.iter().map(|x| [*x, *y, 0.0])).collect();
        let found = target(&tags);
        assert_eq!(found.patches.len(), 4);
        same(&tags, &points(&found));
    }

    #[test]
    fn scattered_points_are_all_there() {
        let mut random = crate::testing::Random::new(3);
        let mut scattered: Vec<_> =
            (0..31).map(|_| [0.0; 3].map(|_: f64| random.uniform(-0.1, 0.1))).collect();
        scattered.extend((0..5).map(|i| [f64::from(i * i) * 0.01, 0.5, 0.25]));
        let found = target(&scattered);
        assert_eq!(found.plane_z, None);
        same(&scattered, &points(&found));
    }
}
