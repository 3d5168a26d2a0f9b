//! Corners to a hundredth of a pixel: a picture of the corner is fitted to the grey values around it.
//!
//! Two edges cross, each blurred by a Gaussian (the lens, and the area of a pixel), and divide the window into four
//! parts of uniform grey. Place, directions, blur and greys are found by least squares on the pixels along the edges.

use nalgebra::{SMatrix, SVector};

use super::Picture;
use super::corner_equations::{Equations, FIRST, Greys, LOG_BLUR, MEAN, N, PRODUCT, SECOND, Sum, X, Y};
pub use super::corner_guess::CornerGuess;
use super::corner_symmetry::Asymmetry;
use super::corner_window::{SMOOTHING_PX, Window};
use crate::simd::{VectorUnit, dispatch};

/// Radii of windows in pixels; what is asked for is clamped to them.
pub const RADIUS_RANGE_PX: [f64; 2] = [2.0, 24.0];
/// Half the width of the strip along each edge that is looked at.
pub const BAND_PX: f64 = 4.0;
const MAX_ITERATIONS: usize = 12;
/// Steps below which a fit is at its end, and below which it is near: then another window is laid around it.
const STEP_TOLERANCE_PX: f64 = 5e-4;
const ROUGH_TOLERANCE_PX: f64 = 0.01;
/// A window of this radius is enough to come near.
const ROUGH_RADIUS_PX: f64 = 16.0;
/// A pixel alone blurs like a Gaussian of 0.29 px; more than 4 px is no corner.
const BLUR_RANGE_PX: [f64; 2] = [0.25, 4.0];
/// Least grey step across an edge.
const LEAST_CONTRAST: f64 = 4.0;
/// Residuals of a smoothed picture are like their neighbours: variances are larger by this factor than independent
/// ones would make them.
const CORRELATED: f64 = 4.0;
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

/// A corner that was fitted.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// Where it is.
    pub place: [f64; 2],
    /// Covariance of the place in px^2, for independent residuals of one grey value.
    pub spread: [[f64; 2]; 2],
    /// Root mean square of the residuals, in grey values of the smoothed picture.
    pub misfit: f64,
    /// The same of those residuals alone that may move the place: of a crossing, not those that look the same after
    /// half a turn.
    pub noise: f64,
    /// Standard deviation of the Gaussian that blurs the edges of the smoothed picture, in pixels.
    pub blur: f64,
    /// Grey step across the edges.
    pub contrast: f64,
}

/// Directions of the edges as others tell them.
struct Told {
    angles: [f64; 2],
    /// Weight of their squared differences, for each square of a grey value that the residuals cost.
    per_cost: f64,
}

impl Told {
    /// What differences from the directions told cost, where residuals cost so much.
    fn cost(&self, cost: f64, p: &Parameters) -> f64 {
        let [a, b] = [p[FIRST] - self.angles[0], p[SECOND] - self.angles[1]];
        cost * self.per_cost * (a * a + b * b)
    }

    /// Adds the directions told to equations at some parameters.
    fn join(&self, equations: &mut Equations, p: &Parameters) {
        let weight = equations.cost * self.per_cost;
        equations.cost += self.cost(equations.cost, p);
        for (i, angle) in [FIRST, SECOND].into_iter().zip(self.angles) {
            equations.normal[(i, i)] += weight;
            equations.right[i] += weight * (angle - p[i]);
        }
    }
}

/// Fits corners in a picture, one after the other.
pub struct CornerFitter<'a, T> {
    picture: Picture<'a, T>,
    kind: CornerKind,
    unit: VectorUnit,
    window: Window,
    /// That of the corner before, which is much the same all over a picture.
    log_blur: f64,
}

impl<'a, T: Copy + Into<f32>> CornerFitter<'a, T> {
    /// A fitter for corners of one kind.
    pub fn new(picture: Picture<'a, T>, kind: CornerKind) -> Self {
        Self {
            picture,
            kind,
            unit: VectorUnit::widest(),
            window: Window::default(),
            log_blur: SMOOTHING_PX.ln(),
        }
    }

    /// Fits a corner; `None` where there is none, or where it is not near the guess.
    ///
    /// A `rough` fit ends near the place, as is enough where it tells another fit where to begin.
    pub fn fit(&mut self, guess: &CornerGuess, rough: bool) -> Option<Corner> {
        if !guess.is_usable() {
            return None;
        }
        let largest = if rough { ROUGH_RADIUS_PX } else { RADIUS_RANGE_PX[1] };
        let radius = guess.radius.clamp(RADIUS_RANGE_PX[0], largest);
        let beyond = guess.beyond.clamp(RADIUS_RANGE_PX[0], radius);
        let guess = CornerGuess { radius, beyond, band: guess.band.min(BAND_PX), ..*guess };
        let share_inside = self.window.lay(self.unit, &self.picture, &guess);
        if share_inside < LEAST_INSIDE {
            return None;
        }
        let origin = self.window.origin.map(|x| x as f64);
        let mut start = Parameters::zeros();
        start[X] = guess.place[0] - origin[0];
        start[Y] = guess.place[1] - origin[1];
        for (i, d) in [FIRST, SECOND].into_iter().zip(guess.directions) {
            start[i] = d[1].atan2(d[0]);
        }
        start[LOG_BLUR] = self.log_blur;
        self.solve_greys(&mut start)?;
        let tolerance = if rough { ROUGH_TOLERANCE_PX } else { STEP_TOLERANCE_PX };
        let weight: f64 = self.window.samples.root.iter().map(|root| root * root).sum::<f64>().max(1.0);
        let told = Told {
            angles: [start[FIRST], start[SECOND]],
            per_cost: CORRELATED / (weight * guess.turn * guess.turn),
        };
        let (fit, mut equations) = self.minimised(start, guess.curvatures, &told, tolerance)?;
        let moved = (fit[X] - start[X]).hypot(fit[Y] - start[Y]);
        let good = moved <= (0.25 * radius).max(1.5)
            && fit[PRODUCT].abs() * 2.0 >= LEAST_CONTRAST
            && fit[LOG_BLUR] < BLUR_RANGE_PX[1].ln() - 1e-6;
        if !good {
            return None;
        }
        self.log_blur = fit[LOG_BLUR];
        let ridge =
            SMatrix::<f64, N, N>::from_diagonal(&equations.normal.diagonal().map(|d| 1e-9 * d + 1e-12));
        let cost = equations.cost;
        let moving = if self.kind == CornerKind::Crossing && !rough {
            let p = fit.as_slice().try_into().unwrap_or([0.0; N]);
            let samples = &self.window.samples;
            dispatch(self.unit, Asymmetry { samples, p, bends: guess.curvatures }).min(cost)
        } else {
            cost
        };
        told.join(&mut equations, &fit);
        let covariance = (equations.normal + ridge).cholesky()?.inverse();
        Some(Corner {
            place: [origin[0] + fit[X], origin[1] + fit[Y]],
            spread: [X, Y].map(|i| [X, Y].map(|k| covariance[(i, k)])),
            misfit: (cost.max(0.0) / weight).sqrt(),
            noise: (moving.max(0.0) / weight).sqrt(),
            blur: fit[LOG_BLUR].exp(),
            contrast: 2.0 * fit[PRODUCT].abs(),
        })
    }

    /// Solves for the greys, which enter linearly, once for the first guess of the rest.
    fn solve_greys(&self, p: &mut Parameters) -> Option<()> {
        let (samples, p_now) = (&self.window.samples, p.as_slice().try_into().unwrap_or([0.0; N]));
        let (normal, right) = match self.kind {
            CornerKind::Crossing => dispatch(self.unit, Greys::<true> { samples, p: p_now }),
            CornerKind::Quadrants => dispatch(self.unit, Greys::<false> { samples, p: p_now }),
        };
        let ridge = SMatrix::<f64, 4, 4>::from_diagonal(&normal.diagonal().map(|d| 1e-6 * d + 1e-9));
        p.fixed_rows_mut::<4>(MEAN).copy_from(&(normal + ridge).cholesky()?.solve(&right));
        Some(())
    }

    /// Levenberg-Marquardt; also the equations at the end or one short step before it.
    fn minimised(
        &self,
        mut p: Parameters,
        bends: [f64; 2],
        told: &Told,
        tolerance: f64,
    ) -> Option<(Parameters, Equations)> {
        let mut current = self.equations(&p, bends);
        let mut damping = 1e-3;
        for _ in 0..MAX_ITERATIONS {
            let ridge =
                SMatrix::<f64, N, N>::from_diagonal(&current.normal.diagonal().map(|d| damping * d + 1e-9));
            let mut joined = current;
            told.join(&mut joined, &p);
            let mut step = (joined.normal + ridge).cholesky()?.solve(&joined.right);
            step[X] = step[X].clamp(-1.0, 1.0);
            step[Y] = step[Y].clamp(-1.0, 1.0);
            step[LOG_BLUR] = step[LOG_BLUR].clamp(-0.5, 0.5);
            let mut trial = p + step;
            trial[LOG_BLUR] = trial[LOG_BLUR].clamp(BLUR_RANGE_PX[0].ln(), BLUR_RANGE_PX[1].ln());
            if step[X].abs().max(step[Y].abs()) < tolerance {
                // So short a step needs no proof.
                p = trial;
                break;
            }
            let tried = self.equations(&trial, bends);
            if tried.cost + told.cost(current.cost, &trial) <= joined.cost {
                (p, current) = (trial, tried);
                damping /= 10.0;
            } else {
                damping *= 10.0;
            }
        }
        p.iter().all(|x| x.is_finite()).then_some((p, current))
    }

    fn equations(&self, p: &Parameters, bends: [f64; 2]) -> Equations {
        let (samples, p) = (&self.window.samples, p.as_slice().try_into().unwrap_or([0.0; N]));
        match self.kind {
            CornerKind::Crossing => dispatch(self.unit, Sum::<true> { samples, p, bends }),
            CornerKind::Quadrants => dispatch(self.unit, Sum::<false> { samples, p, bends }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::single;
    use super::*;

    const SIDE: usize = 41;

    /// The sides of a Gaussian cloud of spread one around a place at a distance from an edge, -1 to 1.
    fn side(distance: f64) -> f64 {
        let n = 400;
        let step = distance.clamp(-6.0, 6.0) / f64::from(n);
        let bell = |i: i32| (-0.5 * ((f64::from(i) + 0.5) * step).powi(2)).exp();
        (2.0 * std::f64::consts::FRAC_1_PI).sqrt() * step * (0..n).map(bell).sum::<f64>()
    }

    /// Mean product of both sides, for distances from two edges and the cosine between them: slices along the first.
    fn sides(a: f64, b: f64, cosine: f64) -> f64 {
        let (n, step) = (96, 0.125);
        let across = (1.0 - cosine * cosine).sqrt();
        // The slice in which the first edge lies counts by its parts.
        (0..n)
            .map(|i| {
                let u = (f64::from(i) + 0.5 - 0.5 * f64::from(n)) * step;
                let weight = (-0.5 * u * u).exp() * step / (2.0 * std::f64::consts::PI).sqrt();
                weight * ((a + u) / (0.5 * step)).clamp(-1.0, 1.0) * side((b + cosine * u) / across)
            })
            .sum()
    }

    /// A corner at a place: dark and light as `greys` says, by the sides of two edges; straight and blurred.
    fn drawn(place: [f64; 2], angles: [f64; 2], blur: f64, greys: [f64; 4]) -> Vec<f32> {
        let turns = angles.map(f64::sin_cos);
        (0..SIDE * SIDE)
            .map(|i| {
                let (x, y) = ((i % SIDE) as f64 - place[0], (i / SIDE) as f64 - place[1]);
                let [a, b] = turns.map(|(sine, cosine)| (cosine * y - sine * x) / blur);
                let both = sides(a, b, (angles[0] - angles[1]).cos());
                single(greys[0] + greys[1] * side(a) + greys[2] * side(b) + greys[3] * both)
            })
            .collect()
    }

    fn guess(place: [f64; 2], angles: [f64; 2]) -> CornerGuess {
        let directions = angles.map(|angle| [angle.cos(), angle.sin()]);
        CornerGuess {
            place,
            directions,
            curvatures: [0.0; 2],
            radius: 12.0,
            beyond: 12.0,
            band: 4.0,
            turn: f64::INFINITY,
        }
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
                let mut fitter = CornerFitter::new(picture, kind);
                let near = fitter.fit(&start, true).unwrap().place;
                let error = (near[0] - place[0]).hypot(near[1] - place[1]);
                assert!(error < 0.05, "{kind:?} {place:?}: {error}");
                let found = fitter.fit(&CornerGuess { place: near, ..start }, false).unwrap().place;
                let error = (found[0] - place[0]).hypot(found[1] - place[1]);
                assert!(error < 1e-3, "{kind:?} {place:?}: {error}");
            }
        }
    }

    #[test]
    fn directions_that_are_told_hold_the_edges_as_firmly_as_they_are_known() {
        let grey = drawn([20.0, 20.0], [0.1, 1.6], 1.1, [150.0, 40.0, -40.0, 40.0]);
        let picture = Picture::new(&grey, SIDE, SIDE).unwrap();
        let wrong = guess([20.0, 20.0], [0.15, 1.6]);
        let off = |turn: f64| {
            let found =
                CornerFitter::new(picture, CornerKind::Quadrants).fit(&CornerGuess { turn, ..wrong }, false);
            let place = found.unwrap().place;
            (place[0] - 20.0).hypot(place[1] - 20.0)
        };
        assert!(off(f64::INFINITY) < 1e-3);
        assert!(off(0.05) < 0.01, "{}", off(0.05));
        assert!(off(1e-6) > 0.05, "{}", off(1e-6));
    }

    #[test]
    fn what_lies_beyond_a_corner_is_left_out() {
        let mut grey = drawn([20.0, 20.0], [0.0, 1.57], 1.1, [150.0, 40.0, -40.0, 40.0]);
        for (i, value) in grey.iter_mut().enumerate() {
            if i % SIDE < 12 {
                *value = 20.0;
            }
        }
        let picture = Picture::new(&grey, SIDE, SIDE).unwrap();
        let off = |beyond: f64| {
            let start = CornerGuess { beyond, ..guess([20.0, 20.0], [0.0, 1.57]) };
            let found = CornerFitter::new(picture, CornerKind::Quadrants).fit(&start, false);
            found.map_or(f64::INFINITY, |c| (c.place[0] - 20.0).hypot(c.place[1] - 20.0))
        };
        assert!(off(4.0) < 1e-3, "{}", off(4.0));
        assert!(off(12.0) > 1e-2, "{}", off(12.0));
    }

    #[test]
    fn no_corner_is_none() {
        let flat = vec![90_u8; SIDE * SIDE];
        let picture = Picture::new(&flat, SIDE, SIDE).unwrap();
        for kind in [CornerKind::Crossing, CornerKind::Quadrants] {
            assert!(CornerFitter::new(picture, kind).fit(&guess([20.0, 20.0], [0.0, 1.5]), false).is_none());
        }
        let grey = drawn([20.0, 20.0], [0.0, 1.5], 1.0, [120.0, 0.0, 0.0, 80.0]);
        let picture = Picture::new(&grey, SIDE, SIDE).unwrap();
        for place in [[20.0, 1.0], [-1e12, 5.0], [f64::NAN, 20.0], [26.0, 20.0]] {
            let start = guess(place, [0.0, 1.5]);
            let mut fitter = CornerFitter::new(picture, CornerKind::Crossing);
            assert!(fitter.fit(&start, false).is_none(), "{place:?}");
        }
    }
}
