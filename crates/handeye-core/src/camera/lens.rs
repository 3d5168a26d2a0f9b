//! The families of lenses, and what each file of a family provides.

use nalgebra::SMatrix;

use super::distortion::DistortedPoint;
use super::{brown_conrady, division, kannala_brandt, pinhole};
use crate::error::Error;

/// Most parameters a lens can have (Brown-Conrady with 12 coefficients).
pub const MAX_PARAMETERS: usize = 16;

/// Derivative of a pixel in the camera parameters; columns beyond the lens' count are zero.
pub type ParameterJacobian = SMatrix<f64, 2, MAX_PARAMETERS>;

/// Parameters of a camera, padded with zeros.
pub(super) type Parameters = [f64; MAX_PARAMETERS];

/// A point of the plane at unit depth.
pub(super) type At = (f64, f64);

/// What a lens is made of: the mapping of the plane at unit depth to itself, in a file of its own.
pub(super) struct Model {
    /// The name in files and messages.
    pub name: &'static str,
    /// Names of the coefficients, in the order of the parameters after `fx, fy, cx, cy`.
    pub coefficients: &'static [&'static str],
    /// Squared radius, before the lens, up to which it is one-to-one.
    pub max_squared_radius: fn(&Parameters) -> f64,
    /// A point after the lens.
    pub distort: fn(&Parameters, f64, f64) -> DistortedPoint<f64>,
    /// Derivative of the point after the lens in the coefficients: columns 4 and on.
    pub differentiate: fn(&Parameters, At, &DistortedPoint<f64>, &mut ParameterJacobian),
    /// The point before the lens; None where there is none within the squared radius.
    pub undistort: fn(&Parameters, f64, At) -> Option<At>,
}

/// The lens models; those of Brown and Conrady have their parameters in OpenCV's order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lens {
    /// No distortion: 4 parameters.
    Pinhole,
    /// Radial-tangential `k1 k2 p1 p2`: 8 parameters.
    BrownConrady4,
    /// `k1 k2 p1 p2 k3`: 9 parameters.
    BrownConrady5,
    /// Rational, `k1 k2 p1 p2 k3 k4 k5 k6`: 12 parameters.
    BrownConrady8,
    /// Rational with thin prism, `... s1 s2 s3 s4`: 16 parameters.
    BrownConrady12,
    /// Equidistant fisheye `k1 k2 k3 k4`: 8 parameters (Kannala-Brandt 2006).
    KannalaBrandt,
    /// Division model `k1`: 5 parameters (Fitzgibbon 2001).
    Division,
}

impl Lens {
    /// All lenses.
    pub const ALL: [Self; 7] = [
        Self::Pinhole,
        Self::BrownConrady4,
        Self::BrownConrady5,
        Self::BrownConrady8,
        Self::BrownConrady12,
        Self::KannalaBrandt,
        Self::Division,
    ];

    #[inline]
    pub(super) const fn model(self) -> &'static Model {
        match self {
            Self::Pinhole => &pinhole::MODEL,
            Self::BrownConrady4 => &brown_conrady::MODEL_4,
            Self::BrownConrady5 => &brown_conrady::MODEL_5,
            Self::BrownConrady8 => &brown_conrady::MODEL_8,
            Self::BrownConrady12 => &brown_conrady::MODEL_12,
            Self::KannalaBrandt => &kannala_brandt::MODEL,
            Self::Division => &division::MODEL,
        }
    }

    /// Number of parameters, focal lengths and principal point included.
    #[inline]
    pub const fn parameter_count(self) -> usize {
        4 + self.model().coefficients.len()
    }

    /// Names of the coefficients, in the order of the parameters after `fx, fy, cx, cy`.
    pub const fn coefficients(self) -> &'static [&'static str] {
        self.model().coefficients
    }

    /// The name in files and messages.
    pub const fn name(self) -> &'static str {
        self.model().name
    }

    /// Whether kernels that take many points at once know the lens: the pinhole and the family of Brown and Conrady.
    pub(crate) const fn in_lanes(self) -> bool {
        !matches!(self, Self::KannalaBrandt | Self::Division)
    }

    /// The lens of a name.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] that lists the names there are.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|lens| lens.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::invalid(format!("unknown lens \"{name}\"; the lenses are {names}"))
        })
    }
}
