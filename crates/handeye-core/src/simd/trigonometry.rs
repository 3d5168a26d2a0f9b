//! Sine and cosine together, lane by lane.

use super::vector::{Simd, Vector};

/// Largest angle, in radians, up to which the reduction below is exact to rounding.
pub(crate) const LARGEST_ANGLE: f64 = 1e5;

/// `pi/2` in three parts; the first two have so many trailing zeros that their products with a quadrant are exact.
const HALF_PI: [f64; 3] = [
    f64::from_bits(0x3FF9_21FB_5440_0000),
    f64::from_bits(0x3DD0_B461_1A60_0000),
    f64::from_bits(0x3BA3_198A_2E03_7073),
];

/// Adding and subtracting it rounds to a whole number.
const ROUNDER: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52

/// Series of `(sin x - x) / x` and `(cos x - 1 + x^2 / 2) / x^2` in `x^2`, highest power first: the minimax
/// coefficients of fdlibm (Sun Microsystems 1993) for `|x| <= pi/4`.
const SINE: [f64; 6] = [
    1.589_690_995_211_55e-10,
    -2.505_076_025_340_686_3e-8,
    2.755_731_370_707_007e-6,
    -1.984_126_982_985_795e-4,
    8.333_333_333_322_49e-3,
    -1.666_666_666_666_663_2e-1,
];
const COSINE: [f64; 6] = [
    -1.135_964_755_778_819_5e-11,
    2.087_572_321_298_175e-9,
    -2.755_731_435_139_066_3e-7,
    2.480_158_728_947_673e-5,
    -1.388_888_888_887_411e-3,
    4.166_666_666_666_66e-2,
];

/// Sine and cosine of angles up to [`LARGEST_ANGLE`], to about one unit in the last place of one.
///
/// Cody and Waite's reduction to `[-pi/4, pi/4]`, then a turn by the quadrant `m`, whose sine and cosine are
/// polynomials in `m = -2..2` that give 0 and 1 exactly.
#[inline(always)]
pub(crate) fn sin_cos<S: Simd>(simd: S, angle: S::Vector) -> (S::Vector, S::Vector) {
    let quadrant = round(simd, angle * simd.splat(std::f64::consts::FRAC_2_PI));
    let mut r = quadrant.neg_mul_add(simd.splat(HALF_PI[0]), angle);
    r = quadrant.neg_mul_add(simd.splat(HALF_PI[1]), r);
    r = quadrant.neg_mul_add(simd.splat(HALF_PI[2]), r);
    let z = r * r;
    let mut sine = simd.splat(SINE[0]);
    let mut cosine = simd.splat(COSINE[0]);
    for i in 1..6 {
        sine = sine.mul_add(z, simd.splat(SINE[i]));
        cosine = cosine.mul_add(z, simd.splat(COSINE[i]));
    }
    let sine = (sine * z).mul_add(r, r);
    let one = simd.splat(1.0);
    let cosine = (cosine * z).mul_add(z, z.neg_mul_add(simd.splat(0.5), one));
    let m = quadrant - simd.splat(4.0) * round(simd, quadrant * simd.splat(0.25));
    let m2 = m * m;
    let turn_cosine = one - (m2 * (simd.splat(7.0) - m2)) * simd.splat(1.0 / 6.0);
    let turn_sine = (m * (simd.splat(4.0) - m2)) * simd.splat(1.0 / 3.0);
    (sine.mul_add(turn_cosine, cosine * turn_sine), cosine.mul_add(turn_cosine, -(sine * turn_sine)))
}

/// The nearest whole number, for numbers far below 2^51.
#[inline(always)]
fn round<S: Simd>(simd: S, x: S::Vector) -> S::Vector {
    (x + simd.splat(ROUNDER)) - simd.splat(ROUNDER)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Kernel, MAX_LANES, VectorUnit, dispatch};
    use crate::testing::Random;

    struct SinCos<'a>(&'a [f64; MAX_LANES]);

    impl Kernel for SinCos<'_> {
        type Output = ([f64; MAX_LANES], [f64; MAX_LANES]);

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let mut out = ([0.0; MAX_LANES], [0.0; MAX_LANES]);
            for at in (0..MAX_LANES).step_by(S::LANES) {
                let (s, c) = sin_cos(simd, simd.load(&self.0[at..]));
                s.store(&mut out.0[at..]);
                c.store(&mut out.1[at..]);
            }
            out
        }
    }

    #[test]
    fn sines_are_exact_to_rounding() {
        let mut random = Random::new(3);
        for round in 0..40_000 {
            let span = [1e-9, 0.8, 7.0, LARGEST_ANGLE][round % 4];
            let mut angles: [f64; MAX_LANES] = std::array::from_fn(|_| random.uniform(-span, span));
            if round % 5 == 0 {
                for (i, a) in angles.iter_mut().enumerate() {
                    *a = std::f64::consts::FRAC_PI_4 * (i as f64 - 4.0 + (round / 5) as f64);
                }
            }
            for unit in VectorUnit::ALL.into_iter().filter(|unit| unit.is_available()) {
                let (sine, cosine) = dispatch(unit, SinCos(&angles));
                for i in 0..MAX_LANES {
                    let (s, c) = angles[i].sin_cos();
                    let error = (sine[i] - s).abs().max((cosine[i] - c).abs());
                    assert!(error <= 2.3e-16, "{}: {} of {}", unit.name(), error, angles[i]);
                }
            }
        }
    }
}
