//! Where a corner is looked for.

/// A first guess of a corner.
#[derive(Clone, Copy, Debug)]
pub struct CornerGuess {
    /// Where it is, off by no more than a pixel or two.
    pub place: [f64; 2],
    /// Directions of the two edges.
    pub directions: [[f64; 2]; 2],
    /// Curvatures of the edges in 1 / px, towards their normals `(-sin, cos)`.
    pub curvatures: [f64; 2],
    /// Radius in pixels in which there are no other edges.
    pub radius: f64,
    /// The same beyond the corner, away from where the two directions lead.
    pub beyond: f64,
    /// Distance from the edges in pixels beyond which there is something else.
    pub band: f64,
    /// Standard deviation of the directions in radians; infinite where nothing else tells them.
    pub turn: f64,
}

impl CornerGuess {
    pub(super) fn is_usable(&self) -> bool {
        let numbers = [self.place, self.directions[0], self.directions[1], self.curvatures];
        numbers.iter().flatten().chain([&self.radius, &self.beyond, &self.band]).all(|x| x.is_finite())
            && self.radius > 0.0
            && self.turn > 0.0
    }
}
