//! Places measured in grey values: corners where edges cross, and centroids of spots.

pub mod alignment;
pub mod corner;
mod corner_equations;
mod corner_guess;
mod corner_symmetry;
mod corner_window;
mod correlation;
pub mod neighbours;
pub mod plane_map;
pub mod printed;
mod raster;
pub mod spot;
mod spot_sums;

use crate::error::Error;

/// Grey values row by row.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a, T> {
    grey: &'a [T],
    width: usize,
    height: usize,
}

impl<'a, T: Copy + Into<f32>> Picture<'a, T> {
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

    /// The grey values of a row from one column to another, both included; none if the first is the larger.
    ///
    /// All of them must be inside.
    fn part(&self, row: i64, from: i64, to: i64) -> &[T] {
        if from > to { &[] } else { &self.row(index(row))[index(from)..=index(to)] }
    }

    /// Width and height, to be compared with places that may be outside.
    fn size(&self) -> [i64; 2] {
        [self.width, self.height].map(|side| i64::try_from(side).unwrap_or(i64::MAX))
    }

    /// The grey values of a row, which must be inside.
    fn row(&self, row: usize) -> &[T] {
        &self.grey[row * self.width..][..self.width]
    }
}

/// In single precision, which is enough for grey values.
#[expect(clippy::cast_possible_truncation, reason = "meant")]
fn single(value: f64) -> f32 {
    value as f32
}

/// A place inside as an index.
fn index(place: i64) -> usize {
    usize::try_from(place).unwrap_or(0)
}

/// The pixel nearest to a place; places far outside any picture all come out as one that is outside.
#[expect(clippy::cast_possible_truncation, reason = "clamped")]
fn nearest(place: [f64; 2]) -> [i64; 2] {
    place.map(|x| x.clamp(-1e9, 1e9).round_ties_even() as i64)
}
