//! Two vectors side by side: while one waits for its last result, the other computes.

use std::ops::{Add, BitAnd, Div, Mul, Neg, Sub};

use super::vector::{Mask, Simd, Vector};

/// Twice the lanes of a unit, for kernels that are chains of dependent operations: in the time from the operands of one
/// to its result a unit begins several.
#[derive(Clone, Copy)]
pub(crate) struct Twin<S>(pub S);

/// Lanes of the first vector, then those of the second.
#[derive(Clone, Copy)]
pub(crate) struct Both<T>(T, T);

impl<S: Simd> Twin<S> {
    /// Vectors of the unit side by side.
    #[inline(always)]
    pub fn pair<const N: usize>(self, first: [S::Vector; N], second: [S::Vector; N]) -> [Both<S::Vector>; N] {
        let mut out = [self.splat(0.0); N];
        for i in 0..N {
            out[i] = Both(first[i], second[i]);
        }
        out
    }
}

impl<S: Simd> Simd for Twin<S> {
    type Vector = Both<S::Vector>;

    const LANES: usize = 2 * S::LANES;

    #[inline(always)]
    fn splat(self, value: f64) -> Self::Vector {
        Both(self.0.splat(value), self.0.splat(value))
    }

    #[inline(always)]
    fn load(self, values: &[f64]) -> Self::Vector {
        Both(self.0.load(values), self.0.load(&values[S::LANES..]))
    }

    #[inline(always)]
    fn load_four(self, values: &[f64], stride: usize) -> [Self::Vector; 4] {
        let [a, b, c, d] = self.0.load_four(values, stride);
        let [e, f, g, h] = self.0.load_four(&values[S::LANES * stride..], stride);
        [Both(a, e), Both(b, f), Both(c, g), Both(d, h)]
    }
}

macro_rules! both {
    ($($trait:ident $method:ident)*) => {
        $(impl<V: $trait<Output = V>> $trait for Both<V> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0), self.1.$method(other.1))
            }
        })*
    };
}

both!(Add add Sub sub Mul mul Div div BitAnd bitand);

impl<V: Neg<Output = V>> Neg for Both<V> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl<V: Vector> Vector for Both<V> {
    type Mask = Both<V::Mask>;

    #[inline(always)]
    fn store(self, values: &mut [f64]) {
        self.0.store(values);
        self.1.store(&mut values[size_of::<V>() / size_of::<f64>()..]);
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(self.0.mul_add(factor.0, addend.0), self.1.mul_add(factor.1, addend.1))
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, addend: Self) -> Self {
        Self(self.0.neg_mul_add(factor.0, addend.0), self.1.neg_mul_add(factor.1, addend.1))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs(), self.1.abs())
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0), self.1.max(other.1))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Self::Mask {
        Both(self.0.greater(other.0), self.1.greater(other.1))
    }

    #[inline(always)]
    fn at_least(self, other: Self) -> Self::Mask {
        Both(self.0.at_least(other.0), self.1.at_least(other.1))
    }

    #[inline(always)]
    fn keep(self, mask: Self::Mask) -> Self {
        Self(self.0.keep(mask.0), self.1.keep(mask.1))
    }

    #[inline(always)]
    fn keep_or(self, mask: Self::Mask, other: Self) -> Self {
        Self(self.0.keep_or(mask.0, other.0), self.1.keep_or(mask.1, other.1))
    }

    #[inline(always)]
    fn mantissa_and_exponent(self) -> (Self, Self) {
        let ((m, k), (n, l)) = (self.0.mantissa_and_exponent(), self.1.mantissa_and_exponent());
        (Self(m, n), Self(k, l))
    }

    #[inline(always)]
    fn sum(self) -> f64 {
        self.0.sum() + self.1.sum()
    }
}

impl<M: Mask> Mask for Both<M> {
    #[inline(always)]
    fn all(self) -> bool {
        self.0.all() & self.1.all()
    }
}
