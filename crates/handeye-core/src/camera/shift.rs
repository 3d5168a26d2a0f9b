//! How far pixels move between two cameras.

use nalgebra::Vector3;

use super::Camera;

/// Steps of the grid of rays along each side of the image.
const STEPS: usize = 6;

impl Camera {
    /// How far pixels move from this camera to another of the same lens, at most over a grid of rays in an image of this
    /// size; infinite where no ray is seen by both.
    pub fn largest_shift_px(&self, other: &Self, size_px: [f64; 2]) -> f64 {
        let [fx, fy, cx, cy] = [0, 1, 2, 3].map(|i| self.parameters[i]);
        let at = |step: usize, side: f64| step as f64 / STEPS as f64 * (side - 1.0);
        let rays = (0..=STEPS).flat_map(|i| (0..=STEPS).map(move |j| (i, j)));
        rays.filter_map(|(i, j)| {
            let ray = Vector3::new((at(j, size_px[0]) - cx) / fx, (at(i, size_px[1]) - cy) / fy, 1.0);
            Some((other.project(&ray)? - self.project(&ray)?).norm())
        })
        .reduce(f64::max)
        .unwrap_or(f64::INFINITY)
    }
}
