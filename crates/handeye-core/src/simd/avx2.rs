//! AVX2 with FMA: four doubles.

use std::arch::is_x86_feature_detected;
use std::arch::x86_64::{
    __m256d, _CMP_GE_OQ, _CMP_GT_OQ, _mm_add_pd, _mm_add_sd, _mm_cvtsd_f64, _mm_unpackhi_pd, _mm256_add_pd,
    _mm256_and_pd, _mm256_andnot_pd, _mm256_blendv_pd, _mm256_castpd_si256, _mm256_castpd256_pd128,
    _mm256_castsi256_pd, _mm256_cmp_pd, _mm256_div_pd, _mm256_extractf128_pd, _mm256_fmadd_pd,
    _mm256_fnmadd_pd, _mm256_loadu_pd, _mm256_max_pd, _mm256_movemask_pd, _mm256_mul_pd, _mm256_or_pd,
    _mm256_permute2f128_pd, _mm256_set1_pd, _mm256_sqrt_pd, _mm256_srli_epi64, _mm256_storeu_pd,
    _mm256_sub_pd, _mm256_unpackhi_pd, _mm256_unpacklo_pd, _mm256_xor_pd,
};
use std::hint::black_box;
use std::ops::{Add, BitAnd, Div, Mul, Neg, Sub};

use super::vector::{Kernel, Mask, Simd, Vector};

const LANES: usize = 4;

/// Proof that the machine has AVX2 and FMA.
#[derive(Clone, Copy)]
pub(super) struct Avx2(());

impl Avx2 {
    #[inline]
    pub(super) fn detect() -> Option<Self> {
        (is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")).then_some(Self(()))
    }
}

/// Runs a kernel with the unit's instructions enabled.
#[inline]
pub(super) fn run<K: Kernel>(simd: Avx2, kernel: K) -> K::Output {
    // SAFETY: `simd` exists only where the features of `enter` were detected.
    unsafe { enter(simd, kernel) }
}

#[target_feature(enable = "avx2,fma")]
fn enter<K: Kernel>(simd: Avx2, kernel: K) -> K::Output {
    // What does not fit into registers goes to the stack: aligned, it never lies across two cache lines.
    let frame = Aligned(0);
    black_box(&frame);
    kernel.run(simd)
}

/// Makes a function align its frame as vectors are.
#[repr(align(32))]
struct Aligned(#[expect(dead_code, reason = "takes a place")] u8);

#[derive(Clone, Copy)]
pub(super) struct Doubles(__m256d);

/// All bits of a lane set, or none.
#[derive(Clone, Copy)]
pub(super) struct Bits(__m256d);

// SAFETY, for every block below without a reason of its own: the intrinsic has no other condition than its feature,
// and a value of type `Avx2`, `Doubles` or `Bits` exists only where that was detected.

impl Simd for Avx2 {
    type Vector = Doubles;

    const LANES: usize = LANES;

    #[inline(always)]
    fn splat(self, value: f64) -> Doubles {
        // SAFETY: see above.
        Doubles(unsafe { _mm256_set1_pd(value) })
    }

    #[inline(always)]
    fn load(self, values: &[f64]) -> Doubles {
        let values = &values[..LANES];
        // SAFETY: four doubles are readable from the start of `values`; any alignment will do.
        Doubles(unsafe { _mm256_loadu_pd(values.as_ptr()) })
    }

    #[inline(always)]
    fn load_four(self, values: &[f64], stride: usize) -> [Doubles; 4] {
        assert!(values.len() >= (LANES - 1) * stride + 4);
        let start = values.as_ptr();
        // SAFETY: lane `i < 4` reads four doubles from `i * stride`, inside `values` by the assertion.
        unsafe {
            let (a, b) = (_mm256_loadu_pd(start), _mm256_loadu_pd(start.add(stride)));
            let (c, d) = (_mm256_loadu_pd(start.add(2 * stride)), _mm256_loadu_pd(start.add(3 * stride)));
            let (ab_even, ab_odd) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
            let (cd_even, cd_odd) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
            [
                Doubles(_mm256_permute2f128_pd::<0x20>(ab_even, cd_even)),
                Doubles(_mm256_permute2f128_pd::<0x20>(ab_odd, cd_odd)),
                Doubles(_mm256_permute2f128_pd::<0x31>(ab_even, cd_even)),
                Doubles(_mm256_permute2f128_pd::<0x31>(ab_odd, cd_odd)),
            ]
        }
    }
}

macro_rules! lanewise {
    ($trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for Doubles {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: see above.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    };
}

lanewise!(Add, add, _mm256_add_pd);
lanewise!(Sub, sub, _mm256_sub_pd);
lanewise!(Mul, mul, _mm256_mul_pd);
lanewise!(Div, div, _mm256_div_pd);

impl Neg for Doubles {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_xor_pd(_mm256_set1_pd(-0.0), self.0) })
    }
}

impl Vector for Doubles {
    type Mask = Bits;

    #[inline(always)]
    fn store(self, values: &mut [f64]) {
        let values = &mut values[..LANES];
        // SAFETY: four doubles are writable from the start of `values`; any alignment will do.
        unsafe { _mm256_storeu_pd(values.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_fmadd_pd(self.0, factor.0, addend.0) })
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_fnmadd_pd(self.0, factor.0, addend.0) })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0) })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_max_pd(self.0, other.0) })
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_sqrt_pd(self.0) })
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Bits {
        // SAFETY: see above.
        Bits(unsafe { _mm256_cmp_pd::<_CMP_GT_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn at_least(self, other: Self) -> Bits {
        // SAFETY: see above.
        Bits(unsafe { _mm256_cmp_pd::<_CMP_GE_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn keep(self, mask: Bits) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_and_pd(mask.0, self.0) })
    }

    #[inline(always)]
    fn keep_or(self, mask: Bits, other: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_blendv_pd(other.0, self.0, mask.0) })
    }

    #[inline(always)]
    fn mantissa_and_exponent(self) -> (Self, Self) {
        // SAFETY: see above.
        unsafe {
            // Positive: the exponent field is what is left of the 52 bits of the fraction. Put under the exponent
            // of 2^52 it reads as 2^52 plus itself.
            let field = _mm256_castsi256_pd(_mm256_srli_epi64::<52>(_mm256_castpd_si256(self.0)));
            let above = _mm256_or_pd(field, _mm256_set1_pd(TWO_52));
            let fraction = _mm256_and_pd(self.0, _mm256_set1_pd(f64::from_bits((1 << 52) - 1)));
            let mantissa = _mm256_or_pd(fraction, _mm256_set1_pd(1.0));
            (Self(mantissa), Self(_mm256_sub_pd(above, _mm256_set1_pd(TWO_52 + 1023.0))))
        }
    }

    #[inline(always)]
    fn sum(self) -> f64 {
        // SAFETY: see above.
        unsafe {
            let half = _mm_add_pd(_mm256_castpd256_pd128(self.0), _mm256_extractf128_pd::<1>(self.0));
            _mm_cvtsd_f64(_mm_add_sd(half, _mm_unpackhi_pd(half, half)))
        }
    }
}

const TWO_52: f64 = 4_503_599_627_370_496.0;

impl BitAnd for Bits {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm256_and_pd(self.0, other.0) })
    }
}

impl Mask for Bits {
    #[inline(always)]
    fn all(self) -> bool {
        // SAFETY: see above.
        unsafe { _mm256_movemask_pd(self.0) == 0b1111 }
    }
}
