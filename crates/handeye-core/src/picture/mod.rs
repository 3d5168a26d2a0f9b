//! Places measured in grey values: corners where edges cross, and centroids of spots.

pub mod corner;
mod corner_equations;
pub mod spot;

use crate::error::Error;

/// Grey values row by row.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a, T> {
    grey: &'a [T],
    width: usize,
    height: usize,
}

impl<'a, T: Copy + Into<f64>> Picture<'a, T> {
    /// A picture of `height` rows of `width` values.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] where there are more or fewer values, or none.
    pub fn new(grey: &'a [T], width: usize, height: usize) -> Result<Self, Error> {
        if grey.is_empty() || grey.len() != width * height {
            return Err(Error::invalid(format!("{} grey values for {width} x {height} pixels", grey.len())));
        }
        Ok(Self { grey, width, height })
    }

    /// The grey value of a pixel, `None` outside.
    fn at(&self, column: i64, row: i64) -> Option<f64> {
        let (column, row) = (usize::try_from(column).ok()?, usize::try_from(row).ok()?);
        (column < self.width && row < self.height).then(|| self.grey[row * self.width + column].into())
    }
}

/// The pixel nearest to a place; places far outside any picture all come out as one that is outside.
#[expect(clippy::cast_possible_truncation, reason = "clamped")]
fn nearest(place: [f64; 2]) -> [i64; 2] {
    place.map(|x| x.clamp(-1e9, 1e9).round_ties_even() as i64)
}
