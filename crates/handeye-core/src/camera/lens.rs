//! The families of lenses and how many parameters each has.

use nalgebra::SMatrix;

use crate::error::Error;

/// Most parameters a lens can have (Brown-Conrady with 12 coefficients).
pub const MAX_PARAMETERS: usize = 16;

/// Derivative of a pixel in the camera parameters; columns beyond the lens' count are zero.
pub type ParameterJacobian = SMatrix<f64, 2, MAX_PARAMETERS>;

/// Parameters of a camera, padded with zeros.
pub(super) type Parameters = [f64; MAX_PARAMETERS];

/// The lens models, parameters in OpenCV's order after `fx, fy, cx, cy`.
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
}

impl Lens {
    /// All lenses.
    pub const ALL: [Self; 6] = [
        Self::Pinhole,
        Self::BrownConrady4,
        Self::BrownConrady5,
        Self::BrownConrady8,
        Self::BrownConrady12,
        Self::KannalaBrandt,
    ];

    /// Number of parameters, focal lengths and principal point included.
    #[inline]
    pub const fn parameter_count(self) -> usize {
        match self {
            Self::Pinhole => 4,
            Self::BrownConrady4 | Self::KannalaBrandt => 8,
            Self::BrownConrady5 => 9,
            Self::BrownConrady8 => 12,
            Self::BrownConrady12 => 16,
        }
    }

    /// The name in files and messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pinhole => "pinhole",
            Self::BrownConrady4 => "brown_conrady_4",
            Self::BrownConrady5 => "brown_conrady_5",
            Self::BrownConrady8 => "brown_conrady_8",
            Self::BrownConrady12 => "brown_conrady_12",
            Self::KannalaBrandt => "kannala_brandt",
        }
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
