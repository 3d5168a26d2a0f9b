//! One error type: every failure carries its evidence.

use std::fmt;

/// Why the core could not answer. Never accompanied by a plausible value.
#[derive(Clone, Debug, PartialEq)]
pub enum Error {
    /// A 4 x 4 matrix that is no rigid transform.
    NotRigid {
        /// Largest deviation from orthogonality or from the last row `0 0 0 1`; NaN if an entry is not finite.
        deviation: f64,
    },
    /// A value out of the range that its documentation states.
    InvalidInput {
        /// What is wrong, with the name of the value and what was expected.
        what: String,
    },
    /// Fewer views than the question needs.
    TooFewViews {
        /// Views given.
        given: usize,
        /// Views needed.
        needed: usize,
    },
    /// The motions or views leave directions of the answer undetermined.
    Degenerate {
        /// What is undetermined and why, in words.
        what: String,
    },
    /// A numerical step failed (a decomposition that does not exist, no valid pixel).
    Numerical {
        /// Which step and at what.
        what: String,
    },
}

impl Error {
    /// An [`Error::InvalidInput`].
    pub fn invalid(what: impl Into<String>) -> Self {
        Self::InvalidInput { what: what.into() }
    }

    /// An [`Error::Degenerate`].
    pub fn degenerate(what: impl Into<String>) -> Self {
        Self::Degenerate { what: what.into() }
    }

    /// An [`Error::Numerical`].
    pub fn numerical(what: impl Into<String>) -> Self {
        Self::Numerical { what: what.into() }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotRigid { deviation } if deviation.is_nan() => {
                write!(f, "not a rigid transform: an entry is not a finite number")
            }
            Self::NotRigid { deviation } => write!(
                f,
                "not a rigid transform: deviates from a rotation with last row 0 0 0 1 by {deviation:.2e}"
            ),
            Self::InvalidInput { what } | Self::Degenerate { what } | Self::Numerical { what } => {
                f.write_str(what)
            }
            Self::TooFewViews { given, needed } => {
                write!(f, "{given} views given, at least {needed} needed")
            }
        }
    }
}

impl std::error::Error for Error {}
