//! The area centroid of a spot, from grey values.
//!
//! The first moment of the grey values of a spot is the centroid of its area, exactly, as long as every pixel holds
//! the mean over its square: no edge has to be located. Only pixels near the edge can be partly covered; the others
//! are taken as inside or outside, so that their noise does not count.

use nalgebra::{Matrix2, Vector2};

use super::spot_sums::{Bounds, Levels, Moments, Ring};
use super::{Picture, nearest};
use crate::interrupt::checked;
use crate::simd::VectorUnit;

/// Half the width of the band around the edge in which pixels are partly covered: the pixel itself, and blur.
const BAND_PX: f64 = 2.5;
const SMALLEST_BAND_PX: f64 = 1.0;
const PASSES: usize = 3;
/// Grey values between a spot and what is around it.
const LEAST_CONTRAST: f64 = 3.0;
/// No spot is larger: half axes in pixels.
const LARGEST_AXIS_PX: f64 = 5000.0;
/// Least light at an edge, as a share of that at the centre.
const LEAST_LIGHT: f64 = 0.1;
/// Fewer pixels around a spot say nothing of the level there.
const FEWEST_OUTSIDE: f64 = 8.0;

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
pub fn area_centroid<T: Copy + Into<f32>>(picture: &Picture<'_, T>, guess: &Spot, gap: f64) -> Option<Spot> {
    let mut ring = Ring::default();
    (0..PASSES).try_fold(*guess, |spot, _| measured(picture, &spot, gap, &mut ring))
}

/// The narrowest free distance in pixels from the edge of each spot to that of another one, at least one.
pub fn free_gaps(spots: &[Spot]) -> Vec<f64> {
    let inverses: Vec<_> = spots.iter().map(|s| s.shape.try_inverse().unwrap_or_default()).collect();
    let longest: Vec<_> = spots.iter().map(|s| half_axes(&s.shape).map_or(0.0, |axes| axes[1])).collect();
    let to_edge = |inverse: &Matrix2<f64>, along: &Vector2<f64>| 1.0 / along.dot(&(inverse * along)).sqrt();
    checked(0..spots.len())
        .map(|i| {
            let mut gap = f64::INFINITY;
            for k in (0..spots.len()).filter(|k| *k != i) {
                let offset = spots[k].centre - spots[i].centre;
                let distance = offset.norm();
                if distance - longest[i] - longest[k] < gap {
                    let along = offset / distance;
                    let between = distance - to_edge(&inverses[i], &along) - to_edge(&inverses[k], &along);
                    gap = gap.min(if distance > 0.0 { between } else { 0.0 });
                }
            }
            gap.max(1.0)
        })
        .collect()
}

fn measured<T: Copy + Into<f32>>(
    picture: &Picture<'_, T>,
    spot: &Spot,
    gap: f64,
    ring: &mut Ring,
) -> Option<Spot> {
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
    let bounds = Bounds { inverse: spot.shape.try_inverse()?, inner: band.min(0.5 * axes[0]), band, reach };
    let deep = gathered(picture, spot, &bounds, axes[0], ring);
    let unit = VectorUnit::widest();
    let (outside, rim) = ring.sorted(unit, bounds);
    let inside = deep + rim;
    if outside.number < FEWEST_OUTSIDE || inside.number < 1.0 {
        return None;
    }
    let levels = levels(&outside, &inside)?;
    let edge = ring.covered(unit, levels);
    if edge.least_light <= LEAST_LIGHT {
        return None;
    }
    let area = deep.number + edge.area;
    if area <= 0.0 {
        return None;
    }
    let shift = (deep.first + edge.first) / area;
    // A pixel is a square, not a point: its own second moment is 1 / 12.
    let second = (deep.second + edge.second) / area;
    let moments = second - shift * shift.transpose() + Matrix2::identity() / 12.0;
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

/// Puts the pixels near the edge into the ring, and adds up those that are surely further inside.
fn gathered<T: Copy + Into<f32>>(
    picture: &Picture<'_, T>,
    spot: &Spot,
    bounds: &Bounds,
    axis: f64,
    ring: &mut Ring,
) -> Moments {
    // The distance from the edge is at least |1 - q| times the shorter half axis, q the elliptical radius.
    let far = (1.0 + bounds.reach / axis).powi(2);
    let near = (1.0 - bounds.band / axis).max(0.0).powi(2);
    let (xx, xy, yy) = (bounds.inverse[(0, 0)], bounds.inverse[(0, 1)], bounds.inverse[(1, 1)]);
    // Columns of the pixels of a row whose squared elliptical radius is below a limit.
    let span = |y: f64, limit: f64| -> [i64; 2] {
        let middle = -xy * y;
        let root = (middle * middle - xx * (yy * y * y - limit)).sqrt();
        if !root.is_finite() {
            return [i64::MAX, i64::MIN];
        }
        let ends = [(middle - root) / xx, (middle + root) / xx];
        #[expect(clippy::cast_possible_truncation, reason = "no spot is so large")]
        [(spot.centre[0] + ends[0]).ceil() as i64, (spot.centre[0] + ends[1]).floor() as i64]
    };
    let half_height = (far * spot.shape[(1, 1)]).sqrt();
    let [_, first] = nearest([0.0, (spot.centre[1] - half_height).max(0.0)]);
    let [_, last] = nearest([0.0, (spot.centre[1] + half_height).min(picture.height as f64 - 1.0)]);
    let mut deep = Moments::default();
    ring.clear();
    for row in first..=last {
        let y = row as f64 - spot.centre[1];
        let [from, to] = span(y, far);
        let (from, to) = (from.max(0), to.min(picture.size()[0] - 1));
        let [inner_from, inner_to] = span(y, near);
        if inner_from > inner_to {
            ring.extend(picture.part(row, from, to), from as f64 - spot.centre[0], y);
            continue;
        }
        ring.extend(picture.part(row, from, inner_from - 1), from as f64 - spot.centre[0], y);
        deep.add_row(picture.part(row, inner_from, inner_to), inner_from as f64 - spot.centre[0], y);
        ring.extend(picture.part(row, inner_to + 1, to), (inner_to + 1) as f64 - spot.centre[0], y);
    }
    ring.pad();
    deep
}

/// What ink and paper look like, from the moments of the pixels outside and inside.
///
/// Ink and paper get the same light, `level (1 + slope' x)`: one slope from both, by least squares.
fn levels(outside: &Moments, inside: &Moments) -> Option<Levels> {
    let (mut information, mut right) = (Matrix2::identity() * 1e-9, Vector2::zeros());
    for part in [outside, inside] {
        let level = part.grey / part.number;
        let middle = part.first / part.number;
        information += level * level * (part.second - part.first * middle.transpose());
        right += level * (part.grey_first - part.grey * middle);
    }
    let slope = information.try_inverse()? * right;
    let [bright, dim] = [outside, inside].map(|part| part.grey / (part.number + part.first.dot(&slope)));
    ((bright - dim).abs() >= LEAST_CONTRAST).then_some(Levels { slope, bright, dim })
}

#[cfg(test)]
mod tests {
    use super::super::single;
    use super::*;

    const SIDE: usize = 48;
    const PARTS: usize = 40;

    /// A dark ellipse with axes along the picture's; each pixel holds the mean over its square.
    fn drawn(centre: [f64; 2], axes: [f64; 2], light: f64) -> Vec<f32> {
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
                single((200.0 - 160.0 * covered) * (1.0 + light * (column - 24.0)))
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
    fn gaps_are_from_edge_to_edge() {
        let spot = |x: f64, y: f64, axes: [f64; 2]| Spot {
            centre: Vector2::new(x, y),
            shape: Matrix2::from_diagonal(&Vector2::from(axes.map(|a| a * a))),
        };
        let spots = [spot(0.0, 0.0, [4.0, 2.0]), spot(10.0, 0.0, [3.0, 5.0]), spot(0.0, 30.0, [1.0, 9.0])];
        let gaps = free_gaps(&spots);
        for (gap, expected) in gaps.iter().zip([3.0, 3.0, 19.0]) {
            assert!((gap - expected).abs() < 1.0, "{gaps:?}");
        }
        assert!((gaps[0] - 3.0).abs() < 1e-12);
        assert_eq!(free_gaps(&spots[..1]), [f64::INFINITY]);
        assert_eq!(free_gaps(&[spots[0], spots[0]]), [1.0, 1.0]);
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
