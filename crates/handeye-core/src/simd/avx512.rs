//! AVX-512: eight doubles.

use std::arch::is_x86_feature_detected;
use std::arch::x86_64::{
    __m512d, __mmask8, _CMP_GE_OQ, _CMP_GT_OQ, _MM_MANT_NORM_1_2, _MM_MANT_SIGN_ZERO, _mm256_loadu_pd,
    _mm512_abs_pd, _mm512_add_pd, _mm512_castpd256_pd512, _mm512_cmp_pd_mask, _mm512_div_pd, _mm512_fmadd_pd,
    _mm512_fnmadd_pd, _mm512_getexp_pd, _mm512_getmant_pd, _mm512_insertf64x4, _mm512_loadu_pd,
    _mm512_mask_blend_pd, _mm512_maskz_mov_pd, _mm512_max_pd, _mm512_mul_pd, _mm512_permutex2var_pd,
    _mm512_reduce_add_pd, _mm512_set_epi64, _mm512_set1_pd, _mm512_sqrt_pd, _mm512_storeu_pd, _mm512_sub_pd,
    _mm512_unpackhi_pd, _mm512_unpacklo_pd,
};
use std::hint::black_box;
use std::ops::{Add, BitAnd, Div, Mul, Neg, Sub};

use super::vector::{Kernel, Mask, Simd, Vector};

const LANES: usize = 8;

/// Proof that the machine has AVX-512 F, DQ and VL, AVX2 and FMA.
#[derive(Clone, Copy)]
pub(super) struct Avx512(());

impl Avx512 {
    #[inline]
    pub(super) fn detect() -> Option<Self> {
        let there = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma");
        there.then_some(Self(()))
    }
}

/// Runs a kernel with the unit's instructions enabled.
#[inline]
pub(super) fn run<K: Kernel>(simd: Avx512, kernel: K) -> K::Output {
    // SAFETY: `simd` exists only where the features of `enter` were detected.
    unsafe { enter(simd, kernel) }
}

#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2,fma")]
fn enter<K: Kernel>(simd: Avx512, kernel: K) -> K::Output {
    // What does not fit into registers goes to the stack: aligned, it never lies across two cache lines.
    let frame = Aligned(0);
    black_box(&frame);
    kernel.run(simd)
}

/// Makes a function align its frame as vectors are.
#[repr(align(64))]
struct Aligned(#[expect(dead_code, reason = "takes a place")] u8);

#[derive(Clone, Copy)]
pub(super) struct Doubles(__m512d);

#[derive(Clone, Copy)]
pub(super) struct Bits(__mmask8);

// SAFETY, for every block below without a reason of its own: the intrinsic has no other condition than its feature,
// and a value of type `Avx512` or `Doubles` exists only where that was detected.

impl Simd for Avx512 {
    type Vector = Doubles;

    const LANES: usize = LANES;

    #[inline(always)]
    fn splat(self, value: f64) -> Doubles {
        // SAFETY: see above.
        Doubles(unsafe { _mm512_set1_pd(value) })
    }

    #[inline(always)]
    fn load(self, values: &[f64]) -> Doubles {
        let values = &values[..LANES];
        // SAFETY: eight doubles are readable from the start of `values`; any alignment will do.
        Doubles(unsafe { _mm512_loadu_pd(values.as_ptr()) })
    }

    #[inline(always)]
    fn load_four(self, values: &[f64], stride: usize) -> [Doubles; 4] {
        assert!(values.len() >= (LANES - 1) * stride + 4);
        let start = values.as_ptr();
        // SAFETY: lane `i < 8` reads four doubles from `i * stride`, inside `values` by the assertion.
        unsafe {
            macro_rules! pair {
                ($i:literal) => {
                    _mm512_insertf64x4::<1>(
                        _mm512_castpd256_pd512(_mm256_loadu_pd(start.add($i * stride))),
                        _mm256_loadu_pd(start.add(($i + 4) * stride)),
                    )
                };
            }
            let (a, b, c, d) = (pair!(0), pair!(1), pair!(2), pair!(3));
            let (ab_even, ab_odd) = (_mm512_unpacklo_pd(a, b), _mm512_unpackhi_pd(a, b));
            let (cd_even, cd_odd) = (_mm512_unpacklo_pd(c, d), _mm512_unpackhi_pd(c, d));
            let low = _mm512_set_epi64(13, 12, 5, 4, 9, 8, 1, 0);
            let high = _mm512_set_epi64(15, 14, 7, 6, 11, 10, 3, 2);
            [
                Doubles(_mm512_permutex2var_pd(ab_even, low, cd_even)),
                Doubles(_mm512_permutex2var_pd(ab_odd, low, cd_odd)),
                Doubles(_mm512_permutex2var_pd(ab_even, high, cd_even)),
                Doubles(_mm512_permutex2var_pd(ab_odd, high, cd_odd)),
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

lanewise!(Add, add, _mm512_add_pd);
lanewise!(Sub, sub, _mm512_sub_pd);
lanewise!(Mul, mul, _mm512_mul_pd);
lanewise!(Div, div, _mm512_div_pd);

impl Neg for Doubles {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_sub_pd(_mm512_set1_pd(-0.0), self.0) })
    }
}

impl Vector for Doubles {
    type Mask = Bits;

    #[inline(always)]
    fn store(self, values: &mut [f64]) {
        let values = &mut values[..LANES];
        // SAFETY: eight doubles are writable from the start of `values`; any alignment will do.
        unsafe { _mm512_storeu_pd(values.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_fmadd_pd(self.0, factor.0, addend.0) })
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_fnmadd_pd(self.0, factor.0, addend.0) })
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_abs_pd(self.0) })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_max_pd(self.0, other.0) })
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_sqrt_pd(self.0) })
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Bits {
        // SAFETY: see above.
        Bits(unsafe { _mm512_cmp_pd_mask::<_CMP_GT_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn at_least(self, other: Self) -> Bits {
        // SAFETY: see above.
        Bits(unsafe { _mm512_cmp_pd_mask::<_CMP_GE_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn keep(self, mask: Bits) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_maskz_mov_pd(mask.0, self.0) })
    }

    #[inline(always)]
    fn keep_or(self, mask: Bits, other: Self) -> Self {
        // SAFETY: see above.
        Self(unsafe { _mm512_mask_blend_pd(mask.0, other.0, self.0) })
    }

    #[inline(always)]
    fn mantissa_and_exponent(self) -> (Self, Self) {
        // SAFETY: see above.
        unsafe {
            let mantissa = _mm512_getmant_pd::<_MM_MANT_NORM_1_2, _MM_MANT_SIGN_ZERO>(self.0);
            (Self(mantissa), Self(_mm512_getexp_pd(self.0)))
        }
    }

    #[inline(always)]
    fn sum(self) -> f64 {
        // SAFETY: see above.
        unsafe { _mm512_reduce_add_pd(self.0) }
    }
}

impl BitAnd for Bits {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl Mask for Bits {
    #[inline(always)]
    fn all(self) -> bool {
        self.0 == __mmask8::MAX
    }
}
