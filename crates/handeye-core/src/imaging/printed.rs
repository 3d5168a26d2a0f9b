//! The printed picture of a board, and what aligning an image with it needs.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use nalgebra::{Matrix3, SMatrix, Vector2};

use super::raster::Raster;
use super::single;
use crate::error::Error;
use crate::simd::VectorUnit;

/// Added to the contrast, of ink and paper, where there is next to none.
const FLOOR: f32 = 0.05;
/// Entries of a homography that are free.
pub(super) const FREE: usize = 8;
/// Single values side by side.
const LANES: usize = 16;

/// A picture from 0 for ink to 1 for paper.
#[derive(Debug)]
pub struct Printed {
    pub(super) picture: Raster,
    /// Place in the plane of the target of the outer corner of the first pixel.
    pub(super) low: Vector2<f64>,
    /// Pixels per metre.
    pub(super) scale: f64,
    /// Distance of neighbouring points or squares in metres.
    pub(super) pitch: f64,
    /// Side of the surroundings that the light is taken from.
    pub(super) light: usize,
    /// The picture without its light.
    pub(super) flat: Raster,
    /// Derivatives of the flat picture by the entries of a homography of centred coordinates.
    pub(super) steepest: [Vec<f32>; FREE],
    /// Inverse of the normal equations over all pixels.
    pub(super) inverse: SMatrix<f64, FREE, FREE>,
}

impl Printed {
    /// A picture row by row, of which the first pixel begins at the place `low` and has `scale` pixels per metre;
    /// the light around a place is that of `light` pixels across.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] for a picture of no pixels, or of another number of them.
    pub fn new(
        values: Vec<f32>,
        [width, height]: [usize; 2],
        low: [f64; 2],
        scale: f64,
        pitch: f64,
        light: usize,
    ) -> Result<Self, Error> {
        if values.is_empty() || values.len() != width * height {
            return Err(Error::invalid(format!("{} values for {width} x {height} pixels", values.len())));
        }
        let picture = Raster { values, width, height };
        let flat = picture.flattened(VectorUnit::widest(), light | 1, FLOOR);
        let steepest = steepest(&flat);
        let inverse = inverse(&steepest, &steepest);
        Ok(Self { picture, low: low.into(), scale, pitch, light: light | 1, flat, steepest, inverse })
    }

    /// Where a place of the plane, in metres, is in the picture.
    pub fn pixel(&self, place: &Vector2<f64>) -> Vector2<f64> {
        (place - self.low) * self.scale - Vector2::repeat(0.5)
    }

    /// The place of the plane at a place in the picture.
    pub(super) fn place(&self, pixel: &Vector2<f64>) -> Vector2<f64> {
        (pixel + Vector2::repeat(0.5)) / self.scale + self.low
    }

    /// What the picture has at a place of the plane.
    pub fn drawn(&self, place: &Vector2<f64>) -> f32 {
        let pixel = self.pixel(place);
        self.picture.clamped(single(pixel[0]), single(pixel[1]))
    }

    /// From pixels to coordinates about the middle, of size one.
    pub(super) fn centring(&self) -> Matrix3<f64> {
        let (width, height) = (self.picture.width as f64, self.picture.height as f64);
        let half = half(&self.picture);
        Matrix3::new(
            1.0 / half,
            0.0,
            (1.0 - width) / 2.0 / half,
            0.0,
            1.0 / half,
            (1.0 - height) / 2.0 / half,
            0.0,
            0.0,
            1.0,
        )
    }
}

fn half(picture: &Raster) -> f64 {
    picture.width.max(picture.height) as f64 / 2.0
}

fn steepest(flat: &Raster) -> [Vec<f32>; FREE] {
    let (width, height) = (flat.width, flat.height);
    let half = single(half(flat));
    let mut rows: [Vec<f32>; FREE] = std::array::from_fn(|_| Vec::with_capacity(width * height));
    let reflected = |place: usize, step: isize, size: usize| {
        let (place, last) = (place.cast_signed() + step, size.cast_signed() - 1);
        (if place > last { 2 * last - place } else { place.abs() }).clamp(0, last).cast_unsigned()
    };
    for row in 0..height {
        for column in 0..width {
            let at = |u: isize, v: isize| flat.row(reflected(row, v, height))[reflected(column, u, width)];
            let slope = |along: fn(isize, isize) -> (isize, isize)| {
                let side = |ahead: isize| {
                    [(-1, 1.0), (0, 2.0), (1, 1.0)]
                        .into_iter()
                        .map(|(aside, weight)| {
                            let (u, v) = along(ahead, aside);
                            weight * at(u, v)
                        })
                        .sum::<f32>()
                };
                half * (side(1) - side(-1)) / 8.0
            };
            let (across, down) = (slope(|ahead, aside| (ahead, aside)), slope(|ahead, aside| (aside, ahead)));
            let x = (column as f32 - (width as f32 - 1.0) / 2.0) / half;
            let y = (row as f32 - (height as f32 - 1.0) / 2.0) / half;
            let outwards = across * x + down * y;
            let values =
                [across * x, across * y, across, down * x, down * y, down, -outwards * x, -outwards * y];
            for (row, value) in rows.iter_mut().zip(values) {
                row.push(value);
            }
        }
    }
    rows
}

/// The inverse of the products of rows with others.
pub(super) fn inverse(rows: &[Vec<f32>; FREE], others: &[Vec<f32>; FREE]) -> SMatrix<f64, FREE, FREE> {
    let normal: SMatrix<f64, FREE, FREE> = SMatrix::from_fn(|i, k| dot(&rows[i], &others[k]));
    normal.try_inverse().or_else(|| normal.pseudo_inverse(1e-12).ok()).unwrap_or_else(SMatrix::zeros)
}

/// The sum of products.
#[inline(always)]
pub(super) fn dot(a: &[f32], b: &[f32]) -> f64 {
    let mut sums = [0.0_f32; LANES];
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.into_iter().map(f64::from).sum::<f64>() + f64::from(rest)
}
