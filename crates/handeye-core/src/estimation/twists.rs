//! Products, exponentials and logarithms of rigid transforms, one per lane: rotation row by row, then translation.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use crate::simd::{Mask, Simd, Vector, sin_cos};

/// `A B`.
#[inline(always)]
pub(super) fn product<V: Vector>(a: &[V; 12], b: &[V; 12]) -> [V; 12] {
    let mut out = *a;
    for i in 0..3 {
        let (p, q, r) = (a[3 * i], a[3 * i + 1], a[3 * i + 2]);
        for j in 0..3 {
            out[3 * i + j] = p.mul_add(b[j], q.mul_add(b[3 + j], r * b[6 + j]));
        }
        out[9 + i] = p.mul_add(b[9], q.mul_add(b[10], r.mul_add(b[11], a[9 + i])));
    }
    out
}

/// As [`Se3::exp`].
#[inline(always)]
pub(super) fn exponential<S: Simd>(simd: S, xi: &[S::Vector; 6]) -> [S::Vector; 12] {
    let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
    let phi = [xi[3], xi[4], xi[5]];
    let squared = phi[0].mul_add(phi[0], phi[1].mul_add(phi[1], phi[2] * phi[2]));
    let angle = squared.sqrt();
    let (sine, cosine) = sin_cos(simd, angle);
    let small = simd.splat(1e-6).greater(squared);
    let series = |a: f64, b: f64, c: f64| {
        squared.mul_add(squared.mul_add(simd.splat(c), simd.splat(b)), simd.splat(a))
    };
    let a = series(1.0, -1.0 / 6.0, 1.0 / 120.0).keep_or(small, sine / angle);
    let b = series(0.5, -1.0 / 24.0, 1.0 / 720.0).keep_or(small, (one - cosine) / squared);
    let c = series(1.0 / 6.0, -1.0 / 120.0, 1.0 / 5040.0).keep_or(small, (angle - sine) / (squared * angle));
    let mut out = [zero; 12];
    for i in 0..3 {
        let mut translation = zero;
        for j in 0..3 {
            // [phi]^2 = phi phi' - |phi|^2 I
            let outer = phi[i] * phi[j];
            let (same, twice) = if i == j { (one, outer - squared) } else { (zero, outer) };
            let k = (6 - i - j) % 3;
            let skew = if i == j {
                zero
            } else if (i + 1) % 3 == j {
                -phi[k]
            } else {
                phi[k]
            };
            out[3 * i + j] = twice.mul_add(b, skew.mul_add(a, same));
            let entry = twice.mul_add(c, skew.mul_add(b, same));
            translation = entry.mul_add(xi[j], translation);
        }
        out[9 + i] = translation;
    }
    out
}

/// As [`Se3::log`].
#[inline(always)]
pub(super) fn logarithm<S: Simd>(simd: S, t: &[S::Vector; 12]) -> [S::Vector; 6] {
    let (zero, half, one) = (simd.splat(0.0), simd.splat(0.5), simd.splat(1.0));
    let axis = [(t[7] - t[5]) * half, (t[2] - t[6]) * half, (t[3] - t[1]) * half];
    let sine = axis[0].mul_add(axis[0], axis[1].mul_add(axis[1], axis[2] * axis[2])).sqrt();
    let cosine = (t[0] + t[4] + t[8] - one) * half;
    let angle = arc(simd, sine, cosine);
    let tiny = simd.splat(1e-7).greater(sine);
    let scale = one.keep_or(tiny, angle / sine);
    let mut phi = [axis[0] * scale, axis[1] * scale, axis[2] * scale];
    // Near a half turn the antisymmetric part vanishes: read the axis off the symmetric part.
    let plain = cosine.max(sine - simd.splat(1e-3)).greater(zero);
    if !plain.all() {
        let share = one / (one - cosine);
        let outer = |i: usize, j: usize| {
            let symmetric = (t[3 * i + j] + t[3 * j + i]) * half;
            (if i == j { symmetric - cosine } else { symmetric }) * share
        };
        let mut column = [outer(0, 0), outer(1, 0), outer(2, 0)];
        for j in 1..3 {
            let larger = outer(j, j).greater(if j == 1 { outer(0, 0) } else { outer(0, 0).max(outer(1, 1)) });
            for (i, entry) in column.iter_mut().enumerate() {
                *entry = outer(i, j).keep_or(larger, *entry);
            }
        }
        let [p, q, r] = column;
        let along = p.mul_add(axis[0], q.mul_add(axis[1], r * axis[2]));
        let norm = p.mul_add(p, q.mul_add(q, r * r)).sqrt();
        let signed = angle.keep_or(along.at_least(zero), -angle) / norm;
        for (value, entry) in phi.iter_mut().zip(column) {
            *value = value.keep_or(plain, entry * signed);
        }
    }
    // J^-1 = I - [phi]/2 + (1 - a/2 cot(a/2)) / a^2 [phi]^2
    let squared = phi[0].mul_add(phi[0], phi[1].mul_add(phi[1], phi[2] * phi[2]));
    let cotangent = ((one + cosine) / sine).keep_or(cosine.greater(zero), sine / (one - cosine));
    let exact = (one - half * angle * cotangent) / squared;
    let series = squared.mul_add(simd.splat(1.0 / 720.0), simd.splat(1.0 / 12.0));
    let coefficient = series.keep_or(simd.splat(1e-6).greater(squared), exact);
    let v = [t[9], t[10], t[11]];
    let cross = |a: &[S::Vector; 3], b: &[S::Vector; 3], i: usize| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    };
    let once = [cross(&phi, &v, 0), cross(&phi, &v, 1), cross(&phi, &v, 2)];
    let mut out = [zero; 6];
    for i in 0..3 {
        out[i] = coefficient.mul_add(cross(&phi, &once, i), half.neg_mul_add(once[i], v[i]));
        out[3 + i] = phi[i];
    }
    out
}

/// Terms of the series of the arcus tangent below; the first that is left out is below rounding.
const TERMS: u8 = 11;
/// Tangents that the series is developed from, their angles, and from where on each is the nearest; and zero.
const ANCHORS: [(f64, f64, f64); 3] = [
    (0.28, 0.273_008_703_086_710_6, 0.1374),
    (0.6, 0.540_419_500_270_584_2, 0.4307),
    (1.0, std::f64::consts::FRAC_PI_4, 0.7808),
];

/// `atan2(sine, cosine)` for `sine >= 0`, up to a common factor of both, to about two units in the last place.
///
/// The smaller of both over the larger is in `[0, 1]`; with `c = tan a` of the nearest anchor,
/// `atan r = a + atan((r - c) / (1 + r c))`, a series in at most 0.14 (Abramowitz and Stegun, 4.4.34 and 4.4.42).
#[inline(always)]
fn arc<S: Simd>(simd: S, sine: S::Vector, cosine: S::Vector) -> S::Vector {
    let zero = simd.splat(0.0);
    let one = simd.splat(1.0);
    let size = cosine.abs();
    let steep = sine.greater(size);
    let ratio = size.keep_or(steep, sine) / sine.max(size);
    let (mut anchor, mut tangent) = (zero, zero);
    for (tangent_of, angle, limit) in ANCHORS {
        let beyond = ratio.greater(simd.splat(limit));
        anchor = simd.splat(angle).keep_or(beyond, anchor);
        tangent = simd.splat(tangent_of).keep_or(beyond, tangent);
    }
    let z = (ratio - tangent) / ratio.mul_add(tangent, one);
    let square = z * z;
    let mut series = simd.splat(0.0);
    for i in (1..TERMS).rev() {
        let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
        series = series.mul_add(square, simd.splat(sign / (2.0 * f64::from(i) + 1.0)));
    }
    let angle = anchor + (series * square).mul_add(z, z);
    let angle = (simd.splat(std::f64::consts::FRAC_PI_2) - angle).keep_or(steep, angle);
    angle.keep_or(cosine.at_least(zero), simd.splat(std::f64::consts::PI) - angle)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3, Vector6};

    use super::*;
    use crate::batched_algebra::{load, store};
    use crate::se3::Se3;
    use crate::se3::entries;
    use crate::simd::{Kernel, MAX_LANES, VectorUnit, dispatch};
    use crate::testing::Random;

    type Row = [f64; MAX_LANES];

    /// Logarithms of transforms, and exponentials of these.
    struct Both<'a> {
        transforms: &'a [Row; 12],
        twists: &'a mut [Row; 6],
        back: &'a mut [Row; 12],
    }

    impl Kernel for Both<'_> {
        type Output = ();

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) {
            for at in (0..MAX_LANES).step_by(S::LANES) {
                let twist = logarithm(simd, &load(simd, self.transforms, at));
                store(&twist, self.twists, at);
                store(&exponential(simd, &twist), self.back, at);
            }
        }
    }

    #[test]
    fn lanes_have_the_logarithms_and_exponentials_of_single_transforms() {
        let random = &mut Random::new(5);
        for round in 0..400 {
            // From nothing to a half turn, and very near to both.
            let angle = match round % 4 {
                0 => 10_f64.powf(random.uniform(-12.0, -2.0)),
                1 => std::f64::consts::PI - 10_f64.powf(random.uniform(-12.0, -2.0)),
                2 if round < 8 => std::f64::consts::PI,
                3 if round < 8 => 0.0,
                _ => random.uniform(0.0, std::f64::consts::PI),
            };
            let all: [Se3; MAX_LANES] = std::array::from_fn(|lane| {
                let mut axis = Vector3::from_fn(|_, _| random.normal());
                if lane < 3 && round < 8 {
                    axis = Vector3::zeros();
                    axis[lane] = 1.0;
                }
                let phi = axis.normalize() * angle;
                let rho = Vector3::from_fn(|_, _| random.normal());
                Se3::exp(&Vector6::new(rho.x, rho.y, rho.z, phi.x, phi.y, phi.z))
            });
            let mut rows = [[0.0; MAX_LANES]; 12];
            for (lane, one) in all.iter().enumerate() {
                for (row, entry) in rows.iter_mut().zip(entries(one)) {
                    row[lane] = entry;
                }
            }
            for unit in VectorUnit::ALL {
                let (mut twists, mut back) = ([[0.0; MAX_LANES]; 6], rows);
                dispatch(unit, Both { transforms: &rows, twists: &mut twists, back: &mut back });
                for (lane, one) in all.iter().enumerate() {
                    let found = Vector6::from_fn(|i, _| twists[i][lane]);
                    let expected = one.log();
                    // A half turn has two logarithms.
                    let near = (found - expected).amax() < 1e-8 || angle > std::f64::consts::PI - 1e-7;
                    assert!(near, "{angle} {} {}", found.transpose(), expected.transpose());
                    let again = transform(&back, lane);
                    assert!((again.to_matrix() - one.to_matrix()).amax() < 1e-8, "{angle}");
                }
            }
        }
    }

    fn transform(rows: &[Row; 12], lane: usize) -> Se3 {
        let e: [f64; 12] = std::array::from_fn(|i| rows[i][lane]);
        Se3::new(Matrix3::from_row_slice(&e[..9]), Vector3::from_column_slice(&e[9..]))
    }
}
