//! The list of the lenses.

use super::lens_model::Model;
use super::{brown_conrady, division, kannala_brandt, pinhole};
use crate::error::Error;

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
