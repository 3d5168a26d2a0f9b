//! Corners to a hundredth of a pixel: a picture of the corner is fitted to the grey values around it.
//!
//! Two edges cross, each blurred by a Gaussian (the lens, and the area of a pixel), and divide the window into four
//! parts of uniform grey. Place, directions, blur and greys are found by least squares on the pixels along the edges.

use nalgebra::{SMatrix, SVector};

use super::corner_equations::{Equations, FIRST, LOG_BLUR, MEAN, N, PRODUCT, SECOND, Samples, Sum, X, Y};
use super::{Picture, nearest};
use crate::simd::{VectorUnit, dispatch};

/// Radii of windows in pixels; what is asked for is clamped to them.
pub const RADIUS_RANGE_PX: [f64; 2] = [2.0, 30.0];
/// Half the width of the strip along each edge that is looked at.
pub const BAND_PX: f64 = 4.0;
const MAX_ITERATIONS: usize = 12;
const STEP_TOLERANCE_PX: f64 = 5e-4;
/// A pixel alone blurs like a Gaussian of 0.29 px; more than 4 px is no corner.
const BLUR_RANGE_PX: [f64; 2] = [0.25, 4.0];
/// Least grey step across an edge.
const LEAST_CONTRAST: f64 = 4.0;
/// Least share of the window that lies inside the picture.
const LEAST_INSIDE: f64 = 0.75;

type Parameters = SVector<f64, N>;

/// What meets at a corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CornerKind {
    /// Two dark and two light squares, diagonally equal; the light may change across the window.
    Crossing,
    /// Four parts of any grey: the corner of a tag, with or without a square that touches it.
    Quadrants,
}

/// A first guess of a corner.
#[derive(Clone, Copy, Debug)]
pub struct CornerGuess {
    /// Where it is, off by no more than a pixel or two.
    pub place: [f64; 2],
    /// Directions of the two edges.
    pub directions: [[f64; 2]; 2],
    /// Curvatures of the edges in 1 / px, towards their normals `(-sin, cos)`.
    pub curvatures: [f64; 2],
    /// Radius in pixels in which there are no other edges.
    pub radius: f64,
    /// Distance from the edges in pixels beyond which there is something else.
    pub band: f64,
}

struct Window {
    samples: Samples,
    share_inside: f64,
}

impl Window {
    /// Takes the pixels near the edges; those further away tell nothing about the corner.
    fn around<T: Copy + Into<f64>>(
        picture: &Picture<'_, T>,
        guess: &CornerGuess,
        origin: [i64; 2],
        radius: f64,
    ) -> Self {
        let [column, row] = origin;
        let (dx, dy) = (guess.place[0] - column as f64, guess.place[1] - row as f64);
        let band = guess.band.min(BAND_PX);
        #[expect(clippy::cast_possible_truncation, reason = "a radius is in its range")]
        let reach = radius.ceil() as i64 + 1;
        let (mut samples, mut inside, mut whole) = (Samples::default(), 0.0, 0.0);
        for v in -reach..=reach {
            for u in -reach..=reach {
                let (x, y) = (u as f64 - dx, v as f64 - dy);
                let from_edge = guess
                    .directions
                    .iter()
                    .map(|d| (d[0] * y - d[1] * x).abs())
                    .fold(f64::INFINITY, f64::min);
                let strip = (band - from_edge + 0.5).clamp(0.0, 1.0);
                if strip == 0.0 {
                    continue;
                }
                // A soft rim, so that no pixel leaps in or out as the corner moves.
                let weight = strip * (radius - (x * x + y * y).sqrt() + 0.5).clamp(0.0, 1.0);
                if weight > 0.0 {
                    whole += weight;
                    if let Some(grey) = picture.at(column + u, row + v) {
                        inside += weight;
                        samples.push([u as f64, v as f64], grey, weight);
                    }
                }
            }
        }
        samples.pad();
        Self { samples, share_inside: inside / whole.max(1e-9) }
    }
}

/// Fits a corner; `None` where there is none, or where it is not near the guess.
///
/// `smoothing` is the standard deviation in pixels by which the picture was smoothed. After the first of several
/// `passes` the window is laid anew where the corner was found, so that the guess does not matter.
pub fn fit_corner<T: Copy + Into<f64>>(
    picture: &Picture<'_, T>,
    guess: &CornerGuess,
    kind: CornerKind,
    smoothing: f64,
    passes: usize,
) -> Option<[f64; 2]> {
    let fitted = (0..passes).try_fold(*guess, |guess, _| fitted(picture, &guess, kind, smoothing))?;
    Some(fitted.place)
}

fn fitted<T: Copy + Into<f64>>(
    picture: &Picture<'_, T>,
    guess: &CornerGuess,
    kind: CornerKind,
    smoothing: f64,
) -> Option<CornerGuess> {
    let numbers = [guess.place, guess.directions[0], guess.directions[1], guess.curvatures];
    if !numbers.iter().flatten().chain([&guess.radius, &guess.band]).all(|x| x.is_finite())
        || guess.radius <= 0.0
    {
        return None;
    }
    let radius = guess.radius.clamp(RADIUS_RANGE_PX[0], RADIUS_RANGE_PX[1]);
    let origin = nearest(guess.place);
    let window = Window::around(picture, guess, origin, radius);
    if window.share_inside < LEAST_INSIDE {
        return None;
    }
    let mut start = Parameters::zeros();
    start[X] = guess.place[0] - origin[0] as f64;
    start[Y] = guess.place[1] - origin[1] as f64;
    for (i, d) in [FIRST, SECOND].into_iter().zip(guess.directions) {
        start[i] = d[1].atan2(d[0]);
    }
    start[LOG_BLUR] = smoothing.clamp(BLUR_RANGE_PX[0], BLUR_RANGE_PX[1]).ln();
    let fit = minimised(&window, with_greys(start, &window, guess, kind)?, guess, kind)?;
    let moved = (fit[X] - start[X]).hypot(fit[Y] - start[Y]);
    let good = moved <= (0.25 * radius).max(1.5)
        && fit[PRODUCT].abs() * 2.0 >= LEAST_CONTRAST
        && fit[LOG_BLUR] < BLUR_RANGE_PX[1].ln() - 1e-6;
    good.then(|| CornerGuess {
        place: [origin[0] as f64 + fit[X], origin[1] as f64 + fit[Y]],
        directions: [FIRST, SECOND].map(|i| [fit[i].cos(), fit[i].sin()]),
        ..*guess
    })
}

/// Solves for the greys, which enter linearly, once for the first guess of the rest.
fn with_greys(
    mut p: Parameters,
    window: &Window,
    guess: &CornerGuess,
    kind: CornerKind,
) -> Option<Parameters> {
    let equations = equations(&p, window, guess, kind);
    let normal: SMatrix<f64, 4, 4> = equations.normal.fixed_view::<4, 4>(MEAN, MEAN).into_owned();
    let ridge = SMatrix::<f64, 4, 4>::from_diagonal(&normal.diagonal().map(|d| 1e-6 * d + 1e-9));
    let right: SVector<f64, 4> = equations.right.fixed_rows::<4>(MEAN).into_owned();
    let greys = (normal + ridge).cholesky()?.solve(&right);
    p.fixed_rows_mut::<4>(MEAN).copy_from(&greys);
    Some(p)
}

/// Levenberg-Marquardt.
fn minimised(
    window: &Window,
    mut p: Parameters,
    guess: &CornerGuess,
    kind: CornerKind,
) -> Option<Parameters> {
    let mut current = equations(&p, window, guess, kind);
    let mut damping = 1e-3;
    for _ in 0..MAX_ITERATIONS {
        let ridge =
            SMatrix::<f64, N, N>::from_diagonal(&current.normal.diagonal().map(|d| damping * d + 1e-9));
        let mut step = (current.normal + ridge).cholesky()?.solve(&current.right);
        step[X] = step[X].clamp(-1.0, 1.0);
        step[Y] = step[Y].clamp(-1.0, 1.0);
        step[LOG_BLUR] = step[LOG_BLUR].clamp(-0.5, 0.5);
        let mut trial = p + step;
        trial[LOG_BLUR] = trial[LOG_BLUR].clamp(BLUR_RANGE_PX[0].ln(), BLUR_RANGE_PX[1].ln());
        let tried = equations(&trial, window, guess, kind);
        if tried.cost <= current.cost {
            (p, current) = (trial, tried);
            damping /= 10.0;
        } else {
            damping *= 10.0;
        }
        if step[X].abs().max(step[Y].abs()) < STEP_TOLERANCE_PX {
            break;
        }
    }
    p.iter().all(|x| x.is_finite()).then_some(p)
}

fn equations(p: &Parameters, window: &Window, guess: &CornerGuess, kind: CornerKind) -> Equations {
    let (p, bends) = (p.as_slice().try_into().unwrap_or([0.0; N]), guess.curvatures);
    let unit = VectorUnit::widest();
    match kind {
        CornerKind::Crossing => dispatch(unit, Sum::<true> { samples: &window.samples, p, bends }),
        CornerKind::Quadrants => dispatch(unit, Sum::<false> { samples: &window.samples, p, bends }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 41;

    /// Half the error function's way across an edge, by adding up.
    fn side(distance: f64) -> f64 {
        let n = 2000;
        let step = distance / f64::from(n);
        let bell = |i: i32| (-0.5 * ((f64::from(i) + 0.5) * step).powi(2)).exp();
        (2.0 * std::f64::consts::FRAC_1_PI).sqrt() * step * (0..n).map(bell).sum::<f64>()
    }

    /// A corner at a place: dark and light as `greys` says, by the sides of two edges; straight and blurred.
    fn drawn(place: [f64; 2], angles: [f64; 2], blur: f64, greys: [f64; 4]) -> Vec<f64> {
        let turns = angles.map(f64::sin_cos);
        (0..SIDE * SIDE)
            .map(|i| {
                let (x, y) = ((i % SIDE) as f64 - place[0], (i / SIDE) as f64 - place[1]);
                let [a, b] = turns.map(|(sine, cosine)| side((cosine * y - sine * x) / blur));
                greys[0] + greys[1] * a + greys[2] * b + greys[3] * a * b
            })
            .collect()
    }

    fn guess(place: [f64; 2], angles: [f64; 2]) -> CornerGuess {
        let directions = angles.map(|angle| [angle.cos(), angle.sin()]);
        CornerGuess { place, directions, curvatures: [0.0; 2], radius: 12.0, band: 4.0 }
    }

    #[test]
    fn corners_are_found_where_they_are() {
        for (kind, greys) in [
            (CornerKind::Crossing, [120.0, 0.0, 0.0, 80.0]),
            (CornerKind::Crossing, [120.0, 0.0, 0.0, -20.0]),
            (CornerKind::Quadrants, [150.0, 40.0, -40.0, 40.0]),
        ] {
            for (place, angles) in [([20.3, 19.6], [0.1, 1.7]), ([19.9, 20.45], [0.8, 2.1])] {
                let grey = drawn(place, angles, 1.1, greys);
                let picture = Picture::new(&grey, SIDE, SIDE).unwrap();
                let start = guess([place[0] + 0.7, place[1] - 0.5], [angles[0] + 0.05, angles[1] - 0.04]);
                let found = fit_corner(&picture, &start, kind, 1.0, 2).unwrap();
                let error = (found[0] - place[0]).hypot(found[1] - place[1]);
                assert!(error < 1e-3, "{kind:?} {place:?}: {error}");
            }
        }
    }

    #[test]
    fn no_corner_is_none() {
        let flat = vec![90.0; SIDE * SIDE];
        let picture = Picture::new(&flat, SIDE, SIDE).unwrap();
        for kind in [CornerKind::Crossing, CornerKind::Quadrants] {
            assert!(fit_corner(&picture, &guess([20.0, 20.0], [0.0, 1.5]), kind, 1.0, 1).is_none());
        }
        let grey = drawn([20.0, 20.0], [0.0, 1.5], 1.0, [120.0, 0.0, 0.0, 80.0]);
        let picture = Picture::new(&grey, SIDE, SIDE).unwrap();
        for place in [[20.0, 1.0], [-1e12, 5.0], [f64::NAN, 20.0], [26.0, 20.0]] {
            let start = guess(place, [0.0, 1.5]);
            assert!(fit_corner(&picture, &start, CornerKind::Crossing, 1.0, 1).is_none(), "{place:?}");
        }
    }
}
