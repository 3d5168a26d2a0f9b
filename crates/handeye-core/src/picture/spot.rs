//! The area centroid of a spot, from grey values.
//!
//! The first moment of the grey values of a spot is the centroid of its area, exactly, as long as every pixel holds
//! the mean over its square: no edge has to be located. Only pixels near the edge can be partly covered; the others
//! are taken as inside or outside, so that their noise does not count.

use nalgebra::{Matrix2, Vector2};

use super::{Picture, nearest};

/// Half the width of the band around the edge in which pixels are partly covered: the pixel itself, and blur.
const BAND_PX: f64 = 2.5;
const SMALLEST_BAND_PX: f64 = 1.0;
const PASSES: usize = 3;
/// Grey values between a spot and what is around it.
const LEAST_CONTRAST: f64 = 3.0;
/// No spot is larger: half axes in pixels.
const LARGEST_AXIS_PX: f64 = 5000.0;

/// Centre of a spot, and its shape `S`: `x' S^-1 x = 1` for `x` from the centre to the edge.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// In pixels.
    pub centre: Vector2<f64>,
    /// In squared pixels.
    pub shape: Matrix2<f64>,
}

/// Centroid and shape of the spot near a first guess; `None` where the picture's edge cuts it, or without contrast.
///
/// `gap` is the narrowest free distance in pixels from its edge to that of the next spot.
pub fn area_centroid<T: Copy + Into<f64>>(picture: &Picture<'_, T>, guess: &Spot, gap: f64) -> Option<Spot> {
    (0..PASSES).try_fold(*guess, |spot, _| measured(picture, &spot, gap))
}

/// A pixel near the spot: offset from its centre, distance outwards from its edge, grey value.
struct Sample {
    offset: Vector2<f64>,
    distance: f64,
    grey: f64,
}

fn measured<T: Copy + Into<f64>>(picture: &Picture<'_, T>, spot: &Spot, gap: f64) -> Option<Spot> {
    let axes = half_axes(&spot.shape)?;
    if !(spot.centre.iter().all(|x| x.is_finite()) && axes[1] < LARGEST_AXIS_PX) || gap.is_nan() {
        return None;
    }
    // Up to half way to the next spot: an inner part for the transition, the rest for the level outside.
    let reach = (0.5 * gap).clamp(2.0 * SMALLEST_BAND_PX, 2.0 * BAND_PX);
    let band = (0.6 * reach).clamp(SMALLEST_BAND_PX, BAND_PX);
    let extent = spot.shape.diagonal().map(f64::sqrt);
    let last = [picture.width as f64 - 1.0, picture.height as f64 - 1.0];
    for i in 0..2 {
        let own = extent[i] + SMALLEST_BAND_PX;
        if spot.centre[i] - own < 0.0 || spot.centre[i] + own > last[i] {
            return None;
        }
    }
    let samples = samples(picture, spot, &extent, axes[0], reach, band)?;
    let is_inside = |s: &Sample| s.distance < -band.min(0.5 * axes[0]);
    let is_outside = |s: &Sample| s.distance > band && s.distance <= reach;
    let outside: Vec<&Sample> = samples.iter().filter(|s| is_outside(s)).collect();
    let inside: Vec<&Sample> = samples.iter().filter(|s| is_inside(s)).collect();
    if outside.len() < 8 || inside.is_empty() {
        return None;
    }
    let light = Light::of(&outside, &inside)?;
    let (mut area, mut first, mut second) = (0.0, Vector2::zeros(), Matrix2::zeros());
    for sample in &samples {
        if sample.distance > band {
            continue;
        }
        let covered = if sample.distance < -band { 1.0 } else { light.covered(sample)? };
        area += covered;
        first += covered * sample.offset;
        second += covered * sample.offset * sample.offset.transpose();
    }
    if area <= 0.0 {
        return None;
    }
    let shift = first / area;
    // A pixel is a square, not a point: its own second moment is 1 / 12.
    let moments = second / area - shift * shift.transpose() + Matrix2::identity() / 12.0;
    if shift.norm() > axes[1] || moments.determinant() <= 0.0 {
        return None;
    }
    Some(Spot { centre: spot.centre + shift, shape: 4.0 * moments })
}

/// The shorter and the longer half axis; `None` unless the shape is an ellipse.
fn half_axes(shape: &Matrix2<f64>) -> Option<[f64; 2]> {
    let mean = 0.5 * shape.trace();
    let spread = (0.5 * (shape[(0, 0)] - shape[(1, 1)])).hypot(shape[(0, 1)]);
    (mean - spread > 1e-9 && mean.is_finite()).then(|| [(mean - spread).sqrt(), (mean + spread).sqrt()])
}

fn samples<T: Copy + Into<f64>>(
    picture: &Picture<'_, T>,
    spot: &Spot,
    extent: &Vector2<f64>,
    axis: f64,
    reach: f64,
    band: f64,
) -> Option<Vec<Sample>> {
    let grown = 1.0 + reach / axis;
    // The distance from the edge is at least (1 - q) times the shorter half axis.
    let deep = (1.0 - band / axis).max(0.0).powi(2);
    let far = grown.powi(2) * 4.0;
    let inverse = spot.shape.try_inverse()?;
    let [column, row] = nearest([spot.centre[0], spot.centre[1]]);
    #[expect(clippy::cast_possible_truncation, reason = "no spot is so large")]
    let [across, down] = [extent[0], extent[1]].map(|e| (e * grown).ceil() as i64 + 1);
    let mut samples = Vec::new();
    for v in row - down..=row + down {
        for u in column - across..=column + across {
            let Some(grey) = picture.at(u, v) else { continue };
            let offset = Vector2::new(u as f64, v as f64) - spot.centre;
            // Signed distance from the edge, to first order: (q - 1) / |grad q| with q the elliptical radius.
            let solved = inverse * offset;
            let squared = offset.dot(&solved);
            if squared > far {
                continue;
            }
            let distance = if squared < deep {
                f64::NEG_INFINITY
            } else {
                let q = squared.max(1e-12).sqrt();
                (q - 1.0) * q / (solved[0] * solved[0] + solved[1] * solved[1]).sqrt().max(1e-12)
            };
            samples.push(Sample { offset, distance, grey });
        }
    }
    Some(samples)
}

/// What ink and paper look like: levels at the centre, and a slope of the light that both share.
struct Light {
    slope: Vector2<f64>,
    bright: f64,
    dim: f64,
}

impl Light {
    fn of(outside: &[&Sample], inside: &[&Sample]) -> Option<Self> {
        // Ink and paper get the same light, `level (1 + slope' x)`: one slope from both, by least squares.
        let (mut information, mut right) = (Matrix2::identity() * 1e-9, Vector2::zeros());
        for part in [outside, inside] {
            let number = part.len() as f64;
            let level = part.iter().map(|s| s.grey).sum::<f64>() / number;
            let middle = part.iter().map(|s| s.offset).sum::<Vector2<f64>>() / number;
            for sample in part {
                let x = sample.offset - middle;
                information += level * level * x * x.transpose();
                right += level * x * sample.grey;
            }
        }
        let slope = information.try_inverse()? * right;
        let level = |part: &[&Sample]| {
            part.iter().map(|s| s.grey / (1.0 + s.offset.dot(&slope))).sum::<f64>() / part.len() as f64
        };
        let (bright, dim) = (level(outside), level(inside));
        ((bright - dim).abs() >= LEAST_CONTRAST).then_some(Self { slope, bright, dim })
    }

    /// The share of a pixel that the spot covers; `None` where the light would be none.
    fn covered(&self, sample: &Sample) -> Option<f64> {
        let light = 1.0 + sample.offset.dot(&self.slope);
        (light > 0.1).then(|| (self.bright - sample.grey / light) / (self.bright - self.dim))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 48;
    const PARTS: usize = 40;

    /// A dark ellipse with axes along the picture's; each pixel holds the mean over its square.
    fn drawn(centre: [f64; 2], axes: [f64; 2], light: f64) -> Vec<f64> {
        let part = |i: usize| (i as f64 + 0.5) / PARTS as f64 - 0.5;
        (0..SIDE * SIDE)
            .map(|i| {
                let (column, row) = ((i % SIDE) as f64, (i / SIDE) as f64);
                let covered = (0..PARTS * PARTS)
                    .filter(|&k| {
                        let x = (column + part(k % PARTS) - centre[0]) / axes[0];
                        let y = (row + part(k / PARTS) - centre[1]) / axes[1];
                        x * x + y * y < 1.0
                    })
                    .count() as f64
                    / (PARTS * PARTS) as f64;
                (200.0 - 160.0 * covered) * (1.0 + light * (column - 24.0))
            })
            .collect()
    }

    #[test]
    fn centroids_are_exact_also_in_uneven_light() {
        for (centre, axes) in [([23.3, 24.8], [8.0, 6.5]), ([24.0, 23.1], [3.0, 3.4])] {
            for light in [0.0, 0.004] {
                let grey = drawn(centre, axes, light);
                let picture = Picture::new(&grey, SIDE, SIDE).unwrap();
                let shape =
                    Matrix2::from_diagonal(&Vector2::new(axes[0] + 0.4, axes[1] - 0.3)).map(|a| a * a);
                let guess = Spot { centre: Vector2::new(centre[0] + 0.5, centre[1] - 0.4), shape };
                let found = area_centroid(&picture, &guess, 20.0).unwrap();
                let error = (found.centre - Vector2::from(centre)).norm();
                assert!(error < 6e-3, "{centre:?} {light}: {error}");
            }
        }
    }

    #[test]
    fn what_is_cut_or_flat_is_none() {
        let grey = drawn([3.0, 24.0], [8.0, 8.0], 0.0);
        let picture = Picture::new(&grey, SIDE, SIDE).unwrap();
        let spot = |centre: [f64; 2], axis: f64| Spot {
            centre: centre.into(),
            shape: Matrix2::identity() * (axis * axis),
        };
        assert!(area_centroid(&picture, &spot([3.0, 24.0], 8.0), 20.0).is_none());
        assert!(area_centroid(&picture, &spot([35.0, 24.0], 5.0), 20.0).is_none());
        assert!(area_centroid(&picture, &spot([f64::NAN, 24.0], 5.0), 20.0).is_none());
        assert!(area_centroid(&picture, &spot([20.0, 24.0], 1e9), 20.0).is_none());
    }
}
