//! Every unit of this machine gives what plain arithmetic gives.

use super::{Kernel, MAX_LANES, Mask, Simd, Twin, Vector, VectorUnit, dispatch, ln};
use crate::testing::Random;

/// Lanes of the widest vectors side by side.
const WIDTH: usize = 2 * MAX_LANES;

/// The same kernel on vectors side by side.
struct SideBySide<K>(K);

impl<K: Kernel> Kernel for SideBySide<K> {
    type Output = K::Output;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> K::Output {
        self.0.run(Twin(simd))
    }
}

/// What every unit of this machine makes of a kernel, and its vectors side by side.
fn everywhere<K: Kernel + Copy>(kernel: K) -> Vec<(String, K::Output)> {
    let mut found = Vec::new();
    for unit in VectorUnit::ALL.into_iter().filter(|unit| unit.is_available()) {
        found.push((unit.name().to_string(), dispatch(unit, kernel)));
        found.push((format!("{} side by side", unit.name()), dispatch(unit, SideBySide(kernel))));
    }
    found
}

/// Applies all operations to pairs, lanes beyond the unit's width in further vectors.
#[derive(Clone, Copy)]
struct Everything<'a> {
    a: &'a [f64; WIDTH],
    b: &'a [f64; WIDTH],
}

const RESULTS: usize = 16;

impl Kernel for Everything<'_> {
    type Output = [[f64; WIDTH]; RESULTS];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let mut out = [[0.0; WIDTH]; RESULTS];
        for at in (0..WIDTH).step_by(S::LANES) {
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
        let (a, mut b): ([f64; WIDTH], [f64; WIDTH]) = (draw(), draw());
        b[usize::try_from(round).unwrap() % WIDTH] = a[usize::try_from(round).unwrap() % WIDTH];
        for (unit, found) in everywhere(Everything { a: &a, b: &b }) {
            for i in 0..WIDTH {
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
                        "{unit}: result {which} of {a}, {b}: {found} for {expected}",
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
        let a: [f64; WIDTH] = std::array::from_fn(|_| random.uniform(-span, span).exp());
        for (unit, found) in everywhere(Everything { a: &a, b: &a }) {
            for (a, found) in a.iter().zip(found[RESULTS - 1]) {
                let error = (found - a.ln()).abs();
                assert!(error <= 1.5 * f64::EPSILON * a.ln().abs(), "{unit}: ln {a}: {found}");
            }
        }
    }
}

#[derive(Clone, Copy)]
struct Sums<'a>(&'a [f64; WIDTH]);

impl Kernel for Sums<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> f64 {
        (0..WIDTH).step_by(S::LANES).map(|at| simd.load(&self.0[at..]).sum()).sum()
    }
}

#[derive(Clone, Copy)]
struct Transposed<'a>(&'a [f64]);

impl Kernel for Transposed<'_> {
    type Output = (Vec<[f64; WIDTH]>, bool);

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let mut out = vec![[0.0; WIDTH]; 4];
        let mut all = true;
        for at in (0..WIDTH).step_by(S::LANES) {
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
    let values: Vec<f64> = (0..7 * WIDTH).map(|i| i as f64).collect();
    let mut one_less = values.clone();
    one_less[5 * 7 + 3] = -1.0;
    for (unit, sum) in everywhere(Sums(&std::array::from_fn(|i| f64::from(1_u32 << i)))) {
        assert_eq!(sum, 65535.0, "{unit}");
    }
    for (unit, (four, all)) in everywhere(Transposed(&values)) {
        for (i, row) in four.iter().enumerate() {
            for (lane, value) in row.iter().enumerate() {
                assert_eq!(*value, (7 * lane + i) as f64, "{unit}");
            }
        }
        assert!(all);
    }
    for (unit, (_, all)) in everywhere(Transposed(&one_less)) {
        assert!(!all, "{unit}");
    }
}

#[test]
fn a_unit_that_is_not_there_falls_back() {
    // On any machine: whatever unit is asked for, the answer is right.
    for unit in VectorUnit::ALL {
        assert_eq!(dispatch(unit, Sums(&[1.0; WIDTH])), WIDTH as f64);
    }
    assert!(VectorUnit::widest().is_available());
}
