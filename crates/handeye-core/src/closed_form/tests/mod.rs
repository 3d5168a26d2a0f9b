//! What every method must do: find the truth where there is one, refuse where there is none.

mod ranking;
mod refusals;
mod truth;

use nalgebra::{Matrix3, Vector3, Vector6};

use super::{Estimate, Method, solve};
use crate::error::Error;
use crate::se3::{Se3, so3_exp};
use crate::testing::Random;

/// Views of a camera and an arm: `C = X A Y`.
struct Scene {
    truth: Estimate,
    a: Vec<Se3>,
    c: Vec<Se3>,
}

impl Scene {
    fn new(x: Se3, y: Se3, a: Vec<Se3>) -> Self {
        let c = a.iter().map(|a| x * *a * y).collect();
        Self { truth: Estimate { x, y }, a, c }
    }

    /// Generic truth; the arm turned by up to `radians` about random axes away from some pose.
    fn random(random: &mut Random, views: usize, radians: f64) -> Self {
        let (x, y) = (turned(random, 0.5, 3.0), turned(random, 2.0, 3.0));
        let home = turned(random, 1.0, 3.0);
        let a = (0..views).map(|_| turned(random, 0.4, radians) * home).collect();
        Self::new(x, y, a)
    }

    /// Independent left perturbations of every `A` and `C`.
    fn noisy(&self, random: &mut Random, hand: (f64, f64), eye: (f64, f64)) -> Self {
        let mut disturb = |t: &Se3, (metres, radians): (f64, f64)| {
            let mut xi = Vector6::zeros();
            for i in 0..6 {
                xi[i] = random.normal() * if i < 3 { metres } else { radians };
            }
            Se3::exp(&xi) * *t
        };
        let a = self.a.iter().map(|t| disturb(t, hand)).collect();
        let c = self.c.iter().map(|t| disturb(t, eye)).collect();
        Self { truth: self.truth, a, c }
    }

    fn solve(&self, method: Method) -> Result<Estimate, Error> {
        solve(method, &self.a, &self.c)
    }

    /// Errors of X and Y: radians, metres.
    fn errors(&self, found: &Estimate) -> [f64; 4] {
        let x = self.truth.x.inverse() * found.x;
        let y = self.truth.y.inverse() * found.y;
        [x.angle(), x.translation.norm(), y.angle(), y.translation.norm()]
    }
}

/// A transform turned by 0.3 to 1 times `radians` about a uniform axis.
fn turned(random: &mut Random, metres: f64, radians: f64) -> Se3 {
    let axis = Vector3::from_fn(|_, _| random.normal()).normalize();
    let translation = Vector3::from_fn(|_, _| random.uniform(-metres, metres));
    Se3::new(so3_exp(&(axis * random.uniform(0.3 * radians, radians))), translation)
}

fn assert_close(scene: &Scene, method: Method, tolerance: f64) {
    let found = scene.solve(method).unwrap_or_else(|e| panic!("{}: {e}", method.name()));
    let difference = (found.x.to_matrix() - scene.truth.x.to_matrix())
        .amax()
        .max((found.y.to_matrix() - scene.truth.y.to_matrix()).amax());
    assert!(difference < tolerance, "{} is off by {difference:.2e}", method.name());
    for t in [found.x, found.y] {
        assert!((t.rotation.transpose() * t.rotation - Matrix3::identity()).amax() < 1e-12);
        assert!(t.rotation.determinant() > 0.0);
    }
}
