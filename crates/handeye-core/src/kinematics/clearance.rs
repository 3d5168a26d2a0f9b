//! How far bodies of an arm are from one another: capsules, segments with a radius; a ball is one without length.

use nalgebra::Vector3;

use crate::error::Error;
use crate::interrupt::checked;

/// Two capsules: the ends of each among the points of a posture, and the sum of their radii.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CapsulePair {
    /// Ends of the first.
    pub one: [usize; 2],
    /// Ends of the second.
    pub other: [usize; 2],
    /// Sum of their radii, metres.
    pub radii: f64,
}

/// Least gap of any pair in each posture, metres; negative where two overlap, infinite without pairs.
///
/// `points` are those of one posture after another, `per_posture` of each.
///
/// # Errors
/// [`Error::InvalidInput`] if `points` is no whole number of postures or a pair names a point that is not there.
pub fn least_gaps(
    points: &[Vector3<f64>],
    per_posture: usize,
    pairs: &[CapsulePair],
) -> Result<Vec<f64>, Error> {
    let known = |pair: &CapsulePair| pair.one.iter().chain(&pair.other).all(|i| *i < per_posture);
    if per_posture == 0 || !points.len().is_multiple_of(per_posture) || !pairs.iter().all(known) {
        return Err(Error::invalid(format!("{} points of postures of {per_posture}", points.len())));
    }
    Ok(checked(points.chunks_exact(per_posture))
        .map(|at| {
            pairs.iter().fold(f64::INFINITY, |least, CapsulePair { one, other, radii }| {
                least.min(segment_distance(at[one[0]], at[one[1]], at[other[0]], at[other[1]]) - radii)
            })
        })
        .collect())
}

/// Distance of the segments `p0 p1` and `q0 q1` (Ericson, Real-Time Collision Detection, 2005, section 5.1.9).
fn segment_distance(p0: Vector3<f64>, p1: Vector3<f64>, q0: Vector3<f64>, q1: Vector3<f64>) -> f64 {
    const TINY: f64 = 1e-12;
    let (d1, d2, r) = (p1 - p0, q1 - q0, p0 - q0);
    let (a, e) = (d1.dot(&d1), d2.dot(&d2));
    let (b, c, f) = (d1.dot(&d2), d1.dot(&r), d2.dot(&r));
    let determinant = a * e - b * b;
    let s = if determinant > TINY { ((b * f - c * e) / determinant).clamp(0.0, 1.0) } else { 0.0 };
    let t = if e > TINY { ((b * s + f) / e).clamp(0.0, 1.0) } else { 0.0 };
    let s = if a > TINY { ((b * t - c) / a).clamp(0.0, 1.0) } else { 0.0 };
    ((p0 + d1 * s) - (q0 + d2 * t)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn no_two_points_of_segments_are_nearer() {
        let mut random = Random::new(3);
        let mut point = || Vector3::new(random.normal(), random.normal(), random.normal());
        for case in 0..200 {
            let (p0, p1, q0) = (point(), point(), point());
            let q1 = match case % 4 {
                0 => q0,
                1 => q0 + (p1 - p0) * 0.7,
                _ => point(),
            };
            let found = segment_distance(p0, p1, q0, q1);
            let tried =
                (0..=100).flat_map(|i| (0..=100).map(move |j| (f64::from(i) / 100.0, f64::from(j) / 100.0)));
            let least = tried
                .map(|(s, t)| ((p0 + (p1 - p0) * s) - (q0 + (q1 - q0) * t)).norm())
                .fold(f64::INFINITY, f64::min);
            assert!(found <= least + 1e-12 && found > least - 0.1, "case {case}: {found}, {least}");
        }
    }

    #[test]
    fn the_nearest_pair_decides() {
        let at = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.3, 0.0], [0.5, 0.0, 0.9]].map(Vector3::from);
        let pair = |other: usize, radii| CapsulePair { one: [0, 1], other: [other, other], radii };
        let gaps = least_gaps(&[at, at].concat(), 4, &[pair(2, 0.1), pair(3, 1.0)]).unwrap();
        assert!(gaps.iter().all(|gap| (gap + 0.1).abs() < 1e-15) && gaps.len() == 2);
        assert_eq!(least_gaps(&at, 4, &[]).unwrap(), [f64::INFINITY]);
        assert!(least_gaps(&at, 3, &[]).is_err() && least_gaps(&at, 4, &[pair(4, 0.0)]).is_err());
    }
}
