//! What a target shows of itself: points and circles.

use nalgebra::Vector3;

use crate::error::Error;

/// A feature of a planar target, in the target's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feature {
    /// The point, or the centre of the circle; metres.
    pub position: Vector3<f64>,
    /// Radius of the circle, whose normal is the z axis of the target; metres; 0 for a point.
    pub radius: f64,
}

impl Feature {
    /// A feature, validated.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for a position that is not finite or a radius that is negative or not finite.
    pub fn new(position: Vector3<f64>, radius: f64) -> Result<Self, Error> {
        if !position.iter().all(|x| x.is_finite()) {
            return Err(Error::invalid("the position of a feature is not finite"));
        }
        if !(radius.is_finite() && radius >= 0.0) {
            return Err(Error::invalid(format!(
                "the radius of a feature must be 0 or positive metres, found {radius}"
            )));
        }
        Ok(Self { position, radius })
    }
}
