//! Rows of a view's least squares: how each pixel moves with the pose, the camera and a smooth field of errors.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use nalgebra::Vector2;

use crate::batched_algebra::load;
use crate::camera::{
    Camera, DistortedPoint, Feature, Lens, MIN_DEPTH_M, coefficient_derivative, distort, projection_row,
};
use crate::se3::{Se3, entries};
use crate::simd::{Kernel, MAX_LANES, Mask, Simd, Vector, VectorUnit, dispatch};

/// Polynomials of the second degree in two coordinates of the board.
pub(super) const POLYNOMIALS: usize = 6;

/// A view at a pose, and what is fitted to it.
pub(super) struct PixelRows<'a> {
    pub camera: &'a Camera,
    pub pose: &'a Se3,
    /// Free parameters of the camera.
    pub free: &'a [usize],
    pub features: &'a [Feature],
    pub pixels: &'a [Vector2<f64>],
    /// Of the points, where they are not equally good.
    pub weights: Option<&'a [f64]>,
}

impl PixelRows<'_> {
    /// Columns of pose and camera, which come first; then polynomials, the residual, and what the scale of the board
    /// does.
    pub fn fitted(&self) -> usize {
        6 + self.free.len()
    }

    /// Where the residual stands.
    pub fn residual(&self) -> usize {
        self.fitted() + POLYNOMIALS
    }

    /// Entries of a row: whole vectors.
    pub fn width(&self) -> usize {
        (self.residual() + 2).next_multiple_of(MAX_LANES)
    }

    /// The rows of one axis of the image, then of the other; `None` where a point cannot be seen.
    pub fn rows(&self) -> Option<[Vec<f64>; 2]> {
        let empty = || vec![0.0; self.features.len() * self.width()];
        let mut rows = [empty(), empty()];
        let (unit, corners) = (VectorUnit::widest(), self.features.iter().all(|f| f.radius == 0.0));
        let whole = match self.camera.lens {
            lens if !(corners && lens.in_lanes()) => self.one_by_one(&mut rows).is_some(),
            Lens::BrownConrady8 | Lens::BrownConrady12 => {
                dispatch(unit, InLanes::<true> { of: self, rows: &mut rows })
            }
            _ => dispatch(unit, InLanes::<false> { of: self, rows: &mut rows }),
        };
        if let Some(weights) = self.weights {
            for rows in &mut rows {
                for (row, weight) in rows.chunks_exact_mut(self.width()).zip(weights) {
                    let root = weight.sqrt();
                    for entry in row {
                        *entry *= root;
                    }
                }
            }
        }
        whole.then_some(rows)
    }

    fn one_by_one(&self, rows: &mut [Vec<f64>; 2]) -> Option<()> {
        let (fitted, residual, width) = (self.fitted(), self.residual(), self.width());
        let (centre, half) = extent(self.features);
        for (n, (feature, pixel)) in self.features.iter().zip(self.pixels).enumerate() {
            let seen = self.camera.observe_with_derivatives(self.pose, feature)?;
            let [x, y] = [0, 1].map(|i| (feature.position[i] - centre[i]) / half[i]);
            let turned = self.pose.rotation * feature.position;
            for (axis, rows) in rows.iter_mut().enumerate() {
                let row = &mut rows[n * width..(n + 1) * width];
                for (j, entry) in row[..6].iter_mut().enumerate() {
                    *entry = seen.d_twist[(axis, j)];
                }
                for (entry, j) in row[6..fitted].iter_mut().zip(self.free) {
                    *entry = seen.d_parameters[(axis, *j)];
                }
                row[fitted..residual].copy_from_slice(&[1.0, y, y * y, x, x * y, x * x]);
                row[residual] = pixel[axis] - seen.pixel[axis];
                // The first three columns of a twist are d pixel / d p, and d p / d scale = R P.
                row[residual + 1] = (0..3).map(|i| row[i] * turned[i]).sum();
            }
        }
        Some(())
    }
}

/// Middle and half size of points in both coordinates of the board; never nothing.
fn extent(features: &[Feature]) -> ([f64; 2], [f64; 2]) {
    let mut centre = [0.0; 2];
    let mut half = [1.0; 2];
    for axis in 0..2 {
        let low = features.iter().map(|f| f.position[axis]).fold(f64::INFINITY, f64::min);
        let high = features.iter().map(|f| f.position[axis]).fold(f64::NEG_INFINITY, f64::max);
        centre[axis] = 0.5 * (low + high);
        half[axis] = (0.5 * (high - low)).max(f64::MIN_POSITIVE);
    }
    (centre, half)
}

/// The same, lanes = points; `FULLY` says whether the lens has all of Brown's and Conrady's terms. Whether all are seen.
struct InLanes<'a, const FULLY: bool> {
    of: &'a PixelRows<'a>,
    rows: &'a mut [Vec<f64>; 2],
}

impl<const FULLY: bool> Kernel for InLanes<'_, FULLY> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> bool {
        let Self { of, rows } = self;
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        let p = &of.camera.parameters;
        let focal = [simd.splat(p[0]), simd.splat(p[1])];
        let pose = entries(of.pose);
        let (centre, half) = extent(of.features);
        let (fitted, residual, width) = (of.fitted(), of.residual(), of.width());
        let mut whole = true;
        let points = of.features.chunks(S::LANES).zip(of.pixels.chunks(S::LANES));
        for (n, (features, pixels)) in points.enumerate() {
            let count = features.len();
            let mut given = [[0.0; MAX_LANES]; 5];
            for lane in 0..S::LANES {
                // Lanes without a point repeat the first.
                let own = if lane < count { lane } else { 0 };
                let (at, pixel) = (&features[own].position, &pixels[own]);
                for (row, value) in given.iter_mut().zip([at.x, at.y, at.z, pixel.x, pixel.y]) {
                    row[lane] = value;
                }
            }
            let [bx, by, bz, u, v] = load(simd, &given, 0);
            let (mut turned, mut moved) = ([zero; 3], [zero; 3]);
            for i in 0..3 {
                let last = simd.splat(pose[3 * i + 2]) * bz;
                let sum = simd.splat(pose[3 * i + 1]).mul_add(by, last);
                turned[i] = simd.splat(pose[3 * i]).mul_add(bx, sum);
                moved[i] = turned[i] + simd.splat(pose[9 + i]);
            }
            let w = one / moved[2];
            let (x, y) = (moved[0] * w, moved[1] * w);
            let lens: DistortedPoint<S::Vector> = distort::<S, FULLY, FULLY>(simd, p, x, y);
            let front = moved[2].greater(simd.splat(MIN_DEPTH_M));
            whole &= (front & lens.is_valid(simd, of.camera.max_squared_radius())).all();
            let slopes = [(lens.along_x, lens.cross_x), (lens.cross_y, lens.along_y)];
            let after = [lens.x, lens.y];
            let board_x = (bx - simd.splat(centre[0])) / simd.splat(half[0]);
            let board_y = (by - simd.splat(centre[1])) / simd.splat(half[1]);
            let smooth = [one, board_y, board_y * board_y, board_x, board_x * board_y, board_x * board_x];
            for (axis, seen) in [u, v].into_iter().enumerate() {
                let out = &mut rows[axis][n * S::LANES * width..];
                let (a, b) = slopes[axis];
                let mut twist = projection_row((focal[axis] * a, focal[axis] * b), w, x, y);
                (twist[2], twist[3]) = (-twist[2], -twist[3]);
                let mut scale = zero;
                for i in 0..6 {
                    put(twist[i], out, width, i, count);
                    if i < 3 {
                        // The first three columns are d pixel / d p, and d p / d scale = R P.
                        scale = twist[i].mul_add(turned[i], scale);
                    }
                }
                for (column, parameter) in of.free.iter().enumerate() {
                    let moves = match *parameter {
                        i if i == axis => after[axis],
                        i if i == 2 + axis => one,
                        0..4 => zero,
                        i => {
                            let both = coefficient_derivative(simd, i, x, y, &lens);
                            focal[axis] * if axis == 0 { both.0 } else { both.1 }
                        }
                    };
                    put(moves, out, width, 6 + column, count);
                }
                for (i, polynomial) in smooth.iter().enumerate() {
                    put(*polynomial, out, width, fitted + i, count);
                }
                let predicted = focal[axis].mul_add(after[axis], simd.splat(p[2 + axis]));
                put(seen - predicted, out, width, residual, count);
                put(scale, out, width, residual + 1, count);
            }
        }
        whole
    }
}

/// Writes the first lanes of a vector into a column.
#[inline(always)]
fn put<V: Vector>(values: V, rows: &mut [f64], width: usize, column: usize, count: usize) {
    let mut lanes = [0.0; MAX_LANES];
    values.store(&mut lanes);
    for (lane, value) in lanes.iter().enumerate().take(count) {
        rows[lane * width + column] = *value;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::testing::Random;

    #[test]
    fn rows_in_lanes_are_those_one_by_one() {
        let all = [
            1400.0, 1390.0, 640.0, 512.0, -0.1, 0.05, 1e-3, -5e-4, 0.01, 0.02, -0.01, 0.005, 1e-3, -5e-4,
            5e-4, 2e-4,
        ];
        for lens in Lens::ALL.into_iter().filter(|lens| lens.in_lanes()) {
            let random = &mut Random::new(3);
            let camera = Camera::new(lens, &all[..lens.parameter_count()]).unwrap();
            let mut pose = random.transform(0.05, 0.3);
            pose.translation.z += 0.7;
            // Not a whole number of vectors of points.
            let place = |i: usize| Vector3::new((i % 6) as f64, (i / 6) as f64, 0.1) * 0.025;
            let features: Vec<_> = (0..21).map(|i| Feature { position: place(i), radius: 0.0 }).collect();
            let mut see =
                |f| camera.observe(&pose, f).expect("in sight") + Vector2::new(random.normal(), 0.3);
            let pixels: Vec<_> = features.iter().map(&mut see).collect();
            let free: Vec<usize> = (0..lens.parameter_count()).rev().collect();
            let view = PixelRows {
                camera: &camera,
                pose: &pose,
                free: &free,
                features: &features,
                pixels: &pixels,
                weights: None,
            };
            let found = view.rows().expect("in sight");
            let mut expected = found.each_ref().map(|rows| vec![0.0; rows.len()]);
            view.one_by_one(&mut expected).expect("in sight");
            for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
                assert!(
                    (found - expected).abs() < 1e-11 * expected.abs().max(1.0),
                    "{lens:?}: {found} {expected}"
                );
            }
            // A point counts as its weight says: its squares are summed.
            let weights: Vec<f64> = (0..21).map(|i| 0.5 + 0.1 * f64::from(i)).collect();
            let weighted = PixelRows { weights: Some(&weights), ..view }.rows().expect("in sight");
            for (rows, plain) in weighted.iter().zip(&found) {
                let width = rows.len() / weights.len();
                for ((row, plain), weight) in rows.chunks(width).zip(plain.chunks(width)).zip(&weights) {
                    let squares = |row: &[f64]| row.iter().map(|x| x * x).sum::<f64>();
                    assert!((squares(row) / squares(plain) - weight).abs() < 1e-12);
                }
            }
            let behind = Se3::new(pose.rotation, -pose.translation);
            assert!(PixelRows { pose: &behind, ..view }.rows().is_none());
        }
    }
}
