//! What was measured: robot motions, features and the pixels they were seen at.

use std::ops::Range;
use std::sync::OnceLock;

use nalgebra::Vector2;

use crate::camera::{Camera, Feature};
use crate::error::Error;
use crate::pose::{Measurements, PoseFit, View, refine_pose};
use crate::se3::Se3;

/// Fewest views that can determine `X` and `Y`: two relative motions with distinct rotation axes.
pub const MIN_VIEWS: usize = 3;

/// The measurements of a calibration; a value that exists is consistent.
#[derive(Clone, Debug)]
pub struct Problem {
    camera: Camera,
    features: Vec<Feature>,
    pixels: Vec<Vector2<f64>>,
    offsets: Vec<usize>,
    motions: Vec<Se3>,
    /// Packed for vector lanes once they are solved; none for circles and fisheyes.
    measurements: OnceLock<Option<Measurements>>,
}

impl Problem {
    /// Views `k = 0..K` hold the samples `offsets[k]..offsets[k + 1]`; `motions[k]` is `A_k` of the chain.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] if lengths disagree, a pixel is not finite, or a view has fewer than
    /// three samples.
    pub fn new(
        camera: Camera,
        features: Vec<Feature>,
        pixels: Vec<Vector2<f64>>,
        offsets: Vec<usize>,
        motions: Vec<Se3>,
    ) -> Result<Self, Error> {
        if features.len() != pixels.len() {
            return Err(Error::invalid(format!("{} features but {} pixels", features.len(), pixels.len())));
        }
        if offsets.len() != motions.len() + 1 || offsets[0] != 0 || offsets[motions.len()] != pixels.len() {
            return Err(Error::invalid(format!(
                "{} robot poses and {} view boundaries do not share {} samples out",
                motions.len(),
                offsets.len(),
                pixels.len()
            )));
        }
        // Without a way out in the middle these go many at a time.
        let finite = pixels.iter().fold(true, |fine, p| fine & p.x.is_finite() & p.y.is_finite());
        for (k, pair) in offsets.windows(2).enumerate() {
            if pair[1] < pair[0] + 3 {
                return Err(Error::invalid(format!("view {k} has fewer than 3 points")));
            }
            if finite {
                continue;
            }
            for (i, pixel) in pixels[pair[0]..pair[1]].iter().enumerate() {
                if !(pixel.x.is_finite() && pixel.y.is_finite()) {
                    return Err(Error::invalid(format!("view {k}, point {i}: the pixel is not finite")));
                }
            }
        }
        Ok(Self { camera, features, pixels, offsets, motions, measurements: OnceLock::new() })
    }

    /// The same pixels as of another camera.
    pub fn through(&self, camera: Camera) -> Self {
        Self { camera, measurements: OnceLock::new(), ..self.clone() }
    }

    /// The poses `T_camera_target` that fit some views best, each near its start.
    ///
    /// # Errors
    /// As [`refine_pose`].
    pub fn refined(&self, starts: &[(usize, Se3)]) -> Result<Vec<PoseFit>, Error> {
        let one = |(k, start): &(usize, Se3)| {
            let samples = self.samples(*k);
            refine_pose(&self.camera, &self.features[samples.clone()], &self.pixels[samples], start)
        };
        starts.iter().map(one).collect()
    }

    /// All views in order.
    pub(super) fn views(&self) -> Vec<View<'_>> {
        (0..self.view_count())
            .map(|k| View {
                motion: self.motion(k),
                features: &self.features[self.samples(k)],
                pixels: &self.pixels[self.samples(k)],
            })
            .collect()
    }

    /// Packed for vector lanes; None for circles and fisheyes.
    pub(super) fn measurements(&self) -> Option<&Measurements> {
        self.measurements.get_or_init(|| Measurements::new(&self.camera, &self.views())).as_ref()
    }

    /// The camera the pixels were taken with.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Number of views.
    pub fn view_count(&self) -> usize {
        self.motions.len()
    }

    /// `A_k`.
    pub fn motion(&self, k: usize) -> &Se3 {
        &self.motions[k]
    }

    /// Samples of view `k`.
    pub fn samples(&self, k: usize) -> Range<usize> {
        self.offsets[k]..self.offsets[k + 1]
    }

    /// Number of points in view `k`.
    pub fn point_count(&self, k: usize) -> usize {
        self.offsets[k + 1] - self.offsets[k]
    }

    /// Features, one per sample.
    pub fn features(&self) -> &[Feature] {
        &self.features
    }

    /// Pixels, one per sample.
    pub fn pixels(&self) -> &[Vector2<f64>] {
        &self.pixels
    }
}
