//! Checkers shared by the tests of this crate and usable by others: numerical Jacobians on the manifold
//! and random transforms.

use nalgebra::{SMatrix, SVector};

/// Central differences of `f` at `at`, step `1e-6`: an `M x N` Jacobian.
///
/// For a function of a transform, perturb it on the manifold inside `f` and pass a zero `at`.
pub fn numerical_jacobian<const M: usize, const N: usize>(
    at: &SVector<f64, N>,
    f: impl Fn(&SVector<f64, N>) -> SVector<f64, M>,
) -> SMatrix<f64, M, N> {
    let step = 1e-6;
    let mut jacobian = SMatrix::<f64, M, N>::zeros();
    for i in 0..N {
        let mut ahead = *at;
        let mut behind = *at;
        ahead[i] += step;
        behind[i] -= step;
        jacobian.set_column(i, &((f(&ahead) - f(&behind)) / (2.0 * step)));
    }
    jacobian
}

/// A small deterministic generator (SplitMix64) so that tests need no other crate and no global state.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// A generator with the given seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in `[low, high)`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next_u64() >> 11) as f64 / (1_u64 << 53) as f64)
    }

    /// Standard normal (Box-Muller).
    pub fn normal(&mut self) -> f64 {
        let u = self.uniform(f64::MIN_POSITIVE, 1.0);
        let v = self.uniform(0.0, std::f64::consts::TAU);
        (-2.0 * u.ln()).sqrt() * v.cos()
    }

    /// A transform with translation components up to `metres` and rotation components up to `radians`.
    pub fn transform(&mut self, metres: f64, radians: f64) -> crate::se3::Se3 {
        let mut xi = SVector::<f64, 6>::zeros();
        for i in 0..6 {
            let range = if i < 3 { metres } else { radians };
            xi[i] = self.uniform(-range, range);
        }
        crate::se3::Se3::exp(&xi)
    }
}

/// Random twists for property tests: components up to `metres`, rotation angle up to `radians`.
#[cfg(test)]
pub fn twist(metres: f64, radians: f64) -> impl proptest::strategy::Strategy<Value = nalgebra::Vector6<f64>> {
    use proptest::prelude::*;
    (prop::array::uniform3(-metres..metres), prop::array::uniform3(-1.0..1.0_f64), 0.0..radians).prop_map(
        |(t, axis, angle)| {
            let axis = nalgebra::Vector3::from(axis);
            let norm = axis.norm().max(1e-9);
            let phi = axis * (angle / norm);
            nalgebra::Vector6::new(t[0], t[1], t[2], phi.x, phi.y, phi.z)
        },
    )
}
