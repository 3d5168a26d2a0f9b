//! Where the levels are averaged over: deterministic points around their mode, in pairs.
//!
//! The density of the levels is wide on one side and steep on the other: a component that the residuals hardly show may
//! be anything below where they would. So each axis has a deviation on either side, measured by how far the density falls
//! there (Martins et al., "Bayesian computing with INLA: New features", 2013), and points lie along the axes of random
//! rotations, which fill few directions more evenly than points drawn one by one (Yu et al., "Orthogonal Random
//! Features", 2016).

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Least curvature that is believed: no level is looked for further than two units of its logarithm away.
pub(super) const LEAST_CURVATURE: f64 = 0.25;
/// Where the density is looked at on either side, in deviations.
const LOOK: f64 = 1.0;
/// Narrowest and widest side, in deviations.
const SIDES: (f64, f64) = (0.6, 1.25);

/// Axes through the mode of the levels.
pub(super) struct Axes<'a> {
    mode: &'a DVector<f64>,
    /// An axis a column, as long as its deviation. Levels that do not depend on one another have one each.
    root: DMatrix<f64>,
    /// By how much either side, below and above the mode, is wider than its axis is long.
    sides: Vec<[f64; 2]>,
}

impl<'a> Axes<'a> {
    /// Those of the Gaussian with the curvature of the density at its mode; without any where that is not finite.
    pub fn of(mode: &'a DVector<f64>, curvature: &DMatrix<f64>) -> Self {
        let mut eigen = SymmetricEigen::new((curvature + curvature.transpose()) * 0.5);
        eigen.eigenvalues.apply(|x| *x = x.max(LEAST_CURVATURE));
        let mut root = DMatrix::identity(mode.len(), mode.len());
        match eigen.recompose().cholesky() {
            Some(factor) => factor.l_dirty().tr_solve_lower_triangular_mut(&mut root),
            None => return Self { mode, root: DMatrix::zeros(mode.len(), 0), sides: vec![] },
        };
        Self { mode, root, sides: vec![[1.0; 2]; mode.len()] }
    }

    /// With sides as wide as the density is: `fall` is by how much its logarithm is lower than at the mode.
    pub fn measured(mut self, fall: impl Fn(&DVector<f64>) -> f64) -> Self {
        for (axis, sides) in self.root.column_iter().zip(&mut self.sides) {
            for (side, way) in sides.iter_mut().zip([-LOOK, LOOK]) {
                let fall = fall(&(self.mode + axis * way));
                // Of a Gaussian the fall is half the square; where nothing can be said of it the side is steep.
                *side = (LOOK / (2.0 * fall).max(f64::MIN_POSITIVE).sqrt()).max(SIDES.0).min(SIDES.1);
            }
        }
        self
    }

    /// The mode and pairs of points around it, each with the logarithm of the density by which it was drawn.
    pub fn points(&self, pairs: usize) -> Vec<(DVector<f64>, f64)> {
        let wide = |[below, above]: &[f64; 2]| (0.5 * (below + above)).ln();
        let mut points = vec![(self.mode.clone(), -self.sides.iter().map(wide).sum::<f64>())];
        if self.sides.is_empty() {
            return points;
        }
        let directions = directions(self.sides.len(), pairs);
        for direction in &directions {
            for way in [1.0, -1.0] {
                let mut density = -0.5 * direction.norm_squared();
                let step = DVector::from_iterator(
                    direction.len(),
                    direction.iter().zip(&self.sides).map(|(z, sides)| {
                        let side = sides[usize::from(way * z > 0.0)];
                        density -= side.ln();
                        way * z * side
                    }),
                );
                points.push((self.mode + &self.root * step, density));
            }
        }
        points
    }
}

/// Vectors as of a standard normal distribution in `d` dimensions: axes of random rotations, with radii evenly through
/// their distribution (the cube root of a chi-square is nearly normal: Wilson and Hilferty 1931).
fn directions(d: usize, count: usize) -> Vec<DVector<f64>> {
    const GOLDEN: f64 = 0.618_033_988_75;
    let share = 2.0 / (9.0 * d as f64);
    let mut all = Vec::with_capacity(count);
    for block in 1.. {
        let mut uniform = Uniform::new(block);
        let axes = DMatrix::from_fn(d, d, |_, _| normal_quantile(uniform.next())).qr().q();
        for axis in axes.column_iter() {
            if all.len() == count {
                return all;
            }
            let even = ((all.len() as f64 + 0.5) * GOLDEN).fract();
            let root = 1.0 - share + normal_quantile(even) * share.sqrt();
            all.push(axis * (d as f64 * root.powi(3)).max(0.0).sqrt());
        }
    }
    all
}

/// Numbers between 0 and 1, both excluded, the same for the same seed (Marsaglia, "Xorshift RNGs", 2003).
struct Uniform(u64);

impl Uniform {
    fn new(seed: u64) -> Self {
        let mut new = Self(0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(seed));
        // Seeds that differ by little have to part.
        for _ in 0..10 {
            new.next();
        }
        new
    }

    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((self.0 >> 11) as f64 / (1_u64 << 53) as f64).clamp(1e-6, 1.0 - 1e-6)
    }
}

/// Quantile of the standard normal distribution, to 5e-4 (Abramowitz and Stegun, 26.2.23).
fn normal_quantile(p: f64) -> f64 {
    let tail = p.min(1.0 - p);
    let t = (-2.0 * tail.ln()).sqrt();
    let value = t
        - (2.515_517 + 0.802_853 * t + 0.010_328 * t * t)
            / (1.0 + 1.432_788 * t + 0.189_269 * t * t + 0.001_308 * t * t * t);
    if p < 0.5 { -value } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEVELS: usize = 8;

    /// Minus the logarithm of a density that is skewed as those of levels are: that of the logarithm of a chi-square of two
    /// degrees of freedom in every direction, zero at its mode.
    fn fall(t: &DVector<f64>) -> f64 {
        t.iter().map(|t| t.exp() - t - 1.0).sum()
    }

    /// Mean and variance over all levels, and how many points share what they say.
    fn averaged(points: &[(DVector<f64>, f64)]) -> (f64, f64, f64) {
        let weights: Vec<f64> = points.iter().map(|(t, density)| (-fall(t) - density).exp()).collect();
        let total: f64 = weights.iter().sum();
        let mean_of = |f: &dyn Fn(f64) -> f64| {
            let all = points.iter().zip(&weights).map(|((t, _), w)| w * t.iter().map(|t| f(*t)).sum::<f64>());
            all.sum::<f64>() / total / LEVELS as f64
        };
        let mean = mean_of(&|t| t);
        let effective = total * total / weights.iter().map(|w| w * w).sum::<f64>();
        (mean, mean_of(&|t| (t - mean).powi(2)), effective)
    }

    #[test]
    fn points_share_a_density_that_is_wide_on_one_side() {
        let (mode, curvature) = (DVector::zeros(LEVELS), DMatrix::identity(LEVELS, LEVELS));
        let plain = averaged(&Axes::of(&mode, &curvature).points(24));
        let (mean, variance, effective) = averaged(&Axes::of(&mode, &curvature).measured(fall).points(24));
        // Euler's constant and pi^2 / 6.
        // The truth: Euler's constant and pi^2 / 6.
        assert!((mean + 0.577).abs() < 0.75 * (plain.0 + 0.577).abs(), "{mean} {}", plain.0);
        assert!((variance - 1.645).abs() < (plain.1 - 1.645).abs(), "{variance} {}", plain.1);
        assert!(effective > 1.3 * plain.2, "{effective} {}", plain.2);
    }

    #[test]
    fn axes_are_as_long_as_deviations_and_no_longer_than_is_believed() {
        let mode = DVector::from_vec(vec![1.0, 2.0, 3.0]);
        let curvature = DMatrix::from_diagonal(&DVector::from_vec(vec![4.0, 25.0, 1e-9]));
        let axes = Axes::of(&mode, &curvature);
        for (i, length) in [0.5, 0.2, 2.0].into_iter().enumerate() {
            assert!((axes.root[(i, i)] - length).abs() < 1e-12);
        }
        let points = axes.points(5);
        assert_eq!(points.len(), 11);
        assert_eq!(points[0].0, mode);
        for pair in points[1..].chunks(2) {
            assert!(((&pair[0].0 + &pair[1].0) * 0.5 - &mode).amax() < 1e-12);
        }
        assert!(points.windows(2).all(|two| two[0].0 != two[1].0));
    }

    #[test]
    fn where_the_curvature_is_not_finite_the_mode_stands_alone() {
        let mode = DVector::zeros(2);
        let axes = Axes::of(&mode, &DMatrix::from_element(2, 2, f64::INFINITY));
        assert_eq!(axes.points(3).len(), 1);
    }
}
