//! Every unit of this machine gives what plain arithmetic gives.

use super::{Kernel, MAX_LANES, Mask, Simd, Vector, VectorUnit, dispatch, ln};
use crate::testing::Random;

/// Applies all operations to pairs, lanes beyond the unit's width in further vectors.
struct Everything<'a> {
    a: &'a [f64; MAX_LANES],
    b: &'a [f64; MAX_LANES],
}

const RESULTS: usize = 16;

impl Kernel for Everything<'_> {
    type Output = [[f64; MAX_LANES]; RESULTS];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let mut out = [[0.0; MAX_LANES]; RESULTS];
        for at in (0..MAX_LANES).step_by(S::LANES) {
            let (a, b) = (simd.load(&self.a[at..]), simd.load(&self.b[at..]));
            let c = simd.splat(3.25);
            let (mantissa, exponent) = a.abs().mantissa_and_exponent();
            let results = [
                a + b,
                a - b,
                a * b,
                a / b,
                -a,
                a.mul_add(b, c),
                a.neg_mul_add(b, c),
                a.abs(),
                a.max(b),
                a.abs().sqrt(),
                a.keep(a.greater(b)),
                a.keep_or(a.at_least(b), b),
                (a / simd.splat(0.0)).keep(a.greater(b) & c.greater(a)),
                mantissa,
                exponent,
                ln(simd, a.abs()),
            ];
            for (row, result) in out.iter_mut().zip(results) {
                result.store(&mut row[at..]);
            }
        }
        out
    }
}

#[test]
fn units_agree_with_scalar_arithmetic() {
    let mut random = Random::new(1);
    for round in 0..500 {
        let mut draw = || std::array::from_fn(|_| random.normal() * 10_f64.powi(round % 40 - 20));
        let (a, mut b): ([f64; MAX_LANES], [f64; MAX_LANES]) = (draw(), draw());
        b[usize::try_from(round).unwrap() % MAX_LANES] = a[usize::try_from(round).unwrap() % MAX_LANES];
        for unit in VectorUnit::ALL.into_iter().filter(|unit| unit.is_available()) {
            let found = dispatch(unit, Everything { a: &a, b: &b });
            for i in 0..MAX_LANES {
                let (a, b) = (a[i], b[i]);
                let positive = a.abs();
                let exponent = positive.log2().floor();
                let expected = [
                    a + b,
                    a - b,
                    a * b,
                    a / b,
                    -a,
                    a.mul_add(b, 3.25),
                    (-a).mul_add(b, 3.25),
                    positive,
                    a.max(b),
                    positive.sqrt(),
                    if a > b { a } else { 0.0 },
                    if a >= b { a } else { b },
                    if a > b && 3.25 > a { a / 0.0 } else { 0.0 },
                    positive / exponent.exp2(),
                    exponent,
                    positive.ln(),
                ];
                for (which, expected) in expected.into_iter().enumerate() {
                    let found = found[which][i];
                    // A sum of a product may cancel.
                    let size = if which == 5 || which == 6 { (a * b).abs() + 3.25 } else { expected.abs() };
                    assert!(
                        found == expected || (found - expected).abs() <= 2.0 * f64::EPSILON * size,
                        "{}: result {which} of {a}, {b}: {found} for {expected}",
                        unit.name()
                    );
                }
            }
        }
    }
}

#[test]
fn the_logarithm_is_exact_to_rounding() {
    let mut random = Random::new(2);
    for round in 0..20_000 {
        let span = [1e-12, 0.5, 40.0, 690.0][round % 4];
        let a: [f64; MAX_LANES] = std::array::from_fn(|_| random.uniform(-span, span).exp());
        for unit in VectorUnit::ALL.into_iter().filter(|unit| unit.is_available()) {
            let found = dispatch(unit, Everything { a: &a, b: &a })[RESULTS - 1];
            for (a, found) in a.iter().zip(found) {
                let error = (found - a.ln()).abs();
                assert!(error <= 1.5 * f64::EPSILON * a.ln().abs(), "{}: ln {a}: {found}", unit.name());
            }
        }
    }
}

struct Sums<'a>(&'a [f64; MAX_LANES]);

impl Kernel for Sums<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> f64 {
        (0..MAX_LANES).step_by(S::LANES).map(|at| simd.load(&self.0[at..]).sum()).sum()
    }
}

struct Transposed<'a>(&'a [f64]);

impl Kernel for Transposed<'_> {
    type Output = (Vec<[f64; MAX_LANES]>, bool);

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let mut out = vec![[0.0; MAX_LANES]; 4];
        let mut all = true;
        for at in (0..MAX_LANES).step_by(S::LANES) {
            let four = simd.load_four(&self.0[at * 7..], 7);
            for (row, vector) in out.iter_mut().zip(four) {
                vector.store(&mut row[at..]);
            }
            all &= four[3].greater(four[0]).all();
        }
        (out, all)
    }
}

#[test]
fn lanes_are_loaded_summed_and_asked_in_order() {
    let values: Vec<f64> = (0..7 * MAX_LANES).map(|i| i as f64).collect();
    for unit in VectorUnit::ALL.into_iter().filter(|unit| unit.is_available()) {
        assert_eq!(dispatch(unit, Sums(&[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0])), 255.0);
        let (four, all) = dispatch(unit, Transposed(&values));
        for (i, row) in four.iter().enumerate() {
            for (lane, value) in row.iter().enumerate() {
                assert_eq!(*value, (7 * lane + i) as f64, "{}", unit.name());
            }
        }
        assert!(all);
        let mut one_less = values.clone();
        one_less[5 * 7 + 3] = -1.0;
        assert!(!dispatch(unit, Transposed(&one_less)).1, "{}", unit.name());
    }
}

#[test]
fn a_unit_that_is_not_there_falls_back() {
    // On any machine: whatever unit is asked for, the answer is right.
    for unit in VectorUnit::ALL {
        assert_eq!(dispatch(unit, Sums(&[1.0; MAX_LANES])), 8.0);
    }
    assert!(VectorUnit::widest().is_available());
}
