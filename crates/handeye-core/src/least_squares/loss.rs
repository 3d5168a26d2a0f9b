//! Robust losses on the whitened residual of a point.

/// How the squared whitened residual `s` of a point enters the cost: `rho(s)` in place of `s`.
///
/// Scales are in standard deviations of the pixel noise. Weights follow iteratively reweighted least squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// Least squares.
    Squared,
    /// Huber (1964): quadratic up to the scale, linear beyond.
    Huber(f64),
    /// Cauchy (Lorentzian): `c^2 ln(1 + s / c^2)`.
    Cauchy(f64),
    /// Tukey's biweight: constant beyond the scale.
    Tukey(f64),
}

impl Loss {
    /// `(rho(s), rho'(s))` of a squared whitened residual.
    #[inline]
    pub fn evaluate(self, s: f64) -> (f64, f64) {
        match self {
            Self::Squared => (s, 1.0),
            Self::Huber(c) => {
                if s <= c * c {
                    (s, 1.0)
                } else {
                    let r = s.sqrt();
                    (2.0 * c * r - c * c, c / r)
                }
            }
            Self::Cauchy(c) => {
                let c2 = c * c;
                (c2 * (1.0 + s / c2).ln(), c2 / (c2 + s))
            }
            Self::Tukey(c) => {
                let c2 = c * c;
                if s >= c2 {
                    (c2 / 3.0, 0.0)
                } else {
                    let q = 1.0 - s / c2;
                    (c2 / 3.0 * (1.0 - q * q * q), q * q)
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_the_slopes() {
        for loss in [Loss::Squared, Loss::Huber(1.5), Loss::Cauchy(2.0), Loss::Tukey(4.0)] {
            for s in [0.1, 1.0, 2.0, 5.0, 15.0] {
                let h = 1e-6;
                let slope = (loss.evaluate(s + h).0 - loss.evaluate(s - h).0) / (2.0 * h);
                assert!((slope - loss.evaluate(s).1).abs() < 1e-8, "{loss:?} at {s}");
            }
        }
    }
}
