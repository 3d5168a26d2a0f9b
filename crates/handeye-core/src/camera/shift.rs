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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Lens;

    #[test]
    fn the_farthest_ray_counts() {
        let camera = |fx, cx, k1| {
            Camera::new(Lens::BrownConrady4, &[fx, 1000.0, cx, 500.0, k1, 0.0, 0.0, 0.0]).unwrap()
        };
        let (before, size) = (camera(1000.0, 500.0, 0.0), [1001.0, 1001.0]);
        let shift = |other: &Camera| before.largest_shift_px(other, size);
        assert!((shift(&camera(1000.0, 503.0, 0.0)) - 3.0).abs() < 1e-9);
        // At the border, half the image from the middle.
        assert!((shift(&camera(1010.0, 500.0, 0.0)) - 5.0).abs() < 1e-9);
        let corner = 0.5_f64.sqrt();
        assert!((shift(&camera(1000.0, 500.0, 0.01)) - 10.0 * corner.powi(3)).abs() < 1e-9);
        // A lens that folds over so close to its axis sees only the middle of it.
        assert!(before.largest_shift_px(&camera(1000.0, 500.0, -1e9), [1e6, 1e6]).is_infinite());
    }
}
