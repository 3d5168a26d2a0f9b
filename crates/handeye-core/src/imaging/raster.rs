//! Pictures in single precision that are computed with: samples between pixels, and what is left without the light.

#![expect(clippy::inline_always, reason = "kernels exist only inside the entry point of their unit")]

use super::Picture;
use crate::simd::{Kernel, Simd, VectorUnit, dispatch};

/// Grey values row by row.
#[derive(Clone, Debug, Default)]
pub(super) struct Raster {
    pub values: Vec<f32>,
    pub width: usize,
    pub height: usize,
}

impl Raster {
    pub fn new(width: usize, height: usize) -> Self {
        Self { values: vec![0.0; width * height], width, height }
    }

    pub fn row(&self, row: usize) -> &[f32] {
        &self.values[row * self.width..][..self.width]
    }

    /// The value between pixels, linear in each direction; beyond the edge it is that of the edge.
    #[inline(always)]
    pub fn clamped(&self, x: f32, y: f32) -> f32 {
        let x = x.max(0.0).min((self.width - 1) as f32);
        let y = y.max(0.0).min((self.height - 1) as f32);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let (column, row) =
            ((x as usize).min(self.width.max(2) - 2), (y as usize).min(self.height.max(2) - 2));
        let (right, down) = (x - column as f32, y - row as f32);
        let next = usize::from(self.width > 1);
        let above = &self.values[row * self.width + column..];
        let below = &above[self.width * usize::from(self.height > 1)..];
        let top = above[0] + right * (above[next] - above[0]);
        let bottom = below[0] + right * (below[next] - below[0]);
        top + down * (bottom - top)
    }

    /// The values between pixels at places `(x, y)`, as [`Raster::clamped`], but beyond the edge another value.
    #[inline(always)]
    pub fn sample(&self, x: &[f32], y: &[f32], beyond: f32, room: &mut Room, out: &mut [f32]) {
        let (right, down) = ((self.width - 1) as f32, (self.height - 1) as f32);
        if self.width < 2 || self.height < 2 {
            out.fill(beyond);
            return;
        }
        // The middle of four pixels; all that can be done side by side first, then the four values are fetched.
        #[expect(clippy::cast_possible_truncation, reason = "clamped")]
        let cell = |place: f32, last: f32| place.max(0.0).min(last - 1.0) as i32;
        let stride = i32::try_from(self.width).unwrap_or(i32::MAX);
        room.index.resize(x.len(), 0);
        room.right.resize(x.len(), 0.0);
        room.down.resize(x.len(), 0.0);
        let parts = room.index.iter_mut().zip(room.right.iter_mut().zip(&mut room.down));
        let mut outside = 0.0_f32;
        for ((index, parts), (x, y)) in parts.zip(x.iter().zip(y)) {
            let (column, row) = (cell(*x, right), cell(*y, down));
            *index = row * stride + column;
            *parts.0 = x - column as f32;
            *parts.1 = y - row as f32;
            // Without branches, so that it is done side by side.
            outside = outside.max(-x).max(-y).max(x - right).max(y - down);
        }
        let parts = room.index.iter().zip(room.right.iter().zip(&room.down));
        for (out, (index, (right, down))) in out.iter_mut().zip(parts) {
            #[expect(clippy::cast_sign_loss, reason = "clamped")]
            let from = *index as usize;
            let (above, below) = (&self.values[from..from + 2], &self.values[from + self.width..][..2]);
            let top = above[0] + right * (above[1] - above[0]);
            let bottom = below[0] + right * (below[1] - below[0]);
            *out = top + down * (bottom - top);
        }
        if outside > 0.0 {
            for (out, (x, y)) in out.iter_mut().zip(x.iter().zip(y)) {
                if !((0.0..=right).contains(x) && (0.0..=down).contains(y)) {
                    *out = beyond;
                }
            }
        }
    }

    /// Without the mean and the contrast of the surroundings of each pixel: squares of an odd side, as a mirror at
    /// the edge would continue them.
    pub fn flattened(&self, unit: VectorUnit, side: usize, floor: f32) -> Self {
        dispatch(unit, Flattening { raster: self, side, floor })
    }
}

/// Room for places in a raster: the upper left of four pixels, and the way from there.
#[derive(Default)]
pub(super) struct Room {
    index: Vec<i32>,
    right: Vec<f32>,
    down: Vec<f32>,
}

/// The part of an image from one pixel on, averaged over squares of so many pixels.
pub(super) fn reduced<T: Copy + Into<f32>>(
    unit: VectorUnit,
    picture: &Picture<'_, T>,
    low: [usize; 2],
    size: [usize; 2],
    factor: usize,
) -> Raster {
    dispatch(unit, Reducing { picture, low, size, factor })
}

struct Reducing<'a, 'p, T> {
    picture: &'a Picture<'p, T>,
    low: [usize; 2],
    size: [usize; 2],
    factor: usize,
}

impl<T: Copy + Into<f32>> Kernel for Reducing<'_, '_, T> {
    type Output = Raster;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> Raster {
        let ([width, height], factor) = (self.size, self.factor);
        let mut out = Raster::new(width, height);
        let mut sums = vec![0.0_f32; width * factor];
        let share = 1.0 / (factor * factor) as f32;
        for (row, values) in out.values.chunks_exact_mut(width).enumerate() {
            sums.fill(0.0);
            for k in 0..factor {
                let line = &self.picture.row(self.low[1] + row * factor + k)[self.low[0]..][..width * factor];
                for (sum, grey) in sums.iter_mut().zip(line) {
                    *sum += (*grey).into();
                }
            }
            for (value, parts) in values.iter_mut().zip(sums.chunks_exact(factor)) {
                *value = share * parts.iter().sum::<f32>();
            }
        }
        out
    }
}

struct Flattening<'a> {
    raster: &'a Raster,
    side: usize,
    floor: f32,
}

impl Kernel for Flattening<'_> {
    type Output = Raster;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> Raster {
        let Raster { width, height, .. } = *self.raster;
        let half = self.side / 2;
        let mut out = Raster::new(width, height);
        // Sums along the rows first, then a window that moves down them.
        let (mut sums, mut squares) = (Raster::new(width, height), Raster::new(width, height));
        let mut padded = vec![0.0; width + 2 * half];
        let mut squared = padded.clone();
        let mut partial = padded.clone();
        for row in 0..height {
            mirror(self.raster.row(row), half, &mut padded);
            for (square, value) in squared.iter_mut().zip(&padded) {
                *square = value * value;
            }
            let here = row * width..(row + 1) * width;
            running(&mut padded, &mut partial, self.side, &mut sums.values[here.clone()]);
            running(&mut squared, &mut partial, self.side, &mut squares.values[here]);
        }
        let (mut sum, mut square) = (vec![0.0_f32; width], vec![0.0_f32; width]);
        let (reach, last) = (half.cast_signed(), height.cast_signed() - 1);
        let reflected = |row: isize| {
            let row = row.abs();
            (if row > last { 2 * last - row } else { row }).clamp(0, last).cast_unsigned()
        };
        let share = 1.0 / (self.side * self.side) as f32;
        let floor = self.floor * self.floor;
        for row in 0..height.cast_signed() {
            if row == 0 {
                for other in -reach..=reach {
                    add(&mut sum, sums.row(reflected(other)), 1.0);
                    add(&mut square, squares.row(reflected(other)), 1.0);
                }
            } else {
                for (to, from) in [(&mut sum, &sums), (&mut square, &squares)] {
                    add(to, from.row(reflected(row + reach)), 1.0);
                    add(to, from.row(reflected(row - reach - 1)), -1.0);
                }
            }
            let here = row.cast_unsigned() * width..(row.cast_unsigned() + 1) * width;
            let values = self.raster.row(row.cast_unsigned()).iter().zip(&sum).zip(&square);
            for (out, ((value, sum), square)) in out.values[here].iter_mut().zip(values) {
                let mean = share * sum;
                let contrast = (share * square - mean * mean).max(0.0) + floor;
                *out = (value - mean) / contrast.sqrt();
            }
        }
        out
    }
}

#[inline(always)]
fn add(to: &mut [f32], from: &[f32], sign: f32) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += sign * from;
    }
}

/// A row with what a mirror at its first and last pixel shows on both sides.
#[inline(always)]
fn mirror(row: &[f32], half: usize, out: &mut [f32]) {
    let last = row.len() - 1;
    out[half..half + row.len()].copy_from_slice(row);
    for k in 1..=half {
        out[half - k] = row[k.min(last)];
        out[half + last + k] = row[last.saturating_sub(k)];
    }
}

/// Sums of so many neighbours from each on, by sums of one, two, four...
#[inline(always)]
fn running(values: &mut [f32], next: &mut [f32], count: usize, out: &mut [f32]) {
    out.fill(0.0);
    let (mut done, mut length) = (0, 1);
    while length <= count {
        if count & length != 0 {
            for (sum, value) in out.iter_mut().zip(&values[done..]) {
                *sum += value;
            }
            done += length;
        }
        if 2 * length <= count {
            let last = values.len() - length;
            for (next, (here, there)) in next[..last].iter_mut().zip(values.iter().zip(&values[length..])) {
                *next = here + there;
            }
            values[..last].copy_from_slice(&next[..last]);
        }
        length *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    fn random(width: usize, height: usize) -> Raster {
        let mut random = Random::new(5);
        let values =
            (0..width * height).map(|_| super::super::single(100.0 + 30.0 * random.normal())).collect();
        Raster { values, width, height }
    }

    #[test]
    fn flat_pictures_have_no_mean_and_one_contrast() {
        let (raster, side) = (random(37, 23), 9_isize);
        for unit in VectorUnit::ALL {
            let flat = raster.flattened(unit, 9, 4.0);
            for (row, column) in [(0, 0), (10, 12), (22, 36), (3, 35)] {
                let at = |row: isize, column: isize| {
                    let place = |x: isize, size: isize| {
                        if x < 0 {
                            -x
                        } else if x >= size {
                            2 * size - 2 - x
                        } else {
                            x
                        }
                    };
                    raster.row(place(row, 23).cast_unsigned())[place(column, 37).cast_unsigned()]
                };
                let around: Vec<f32> =
                    (0..side * side).map(|i| at(row + i / side - 4, column + i % side - 4)).collect();
                let mean = around.iter().sum::<f32>() / 81.0;
                let variance = around.iter().map(|x| (x - mean).powi(2)).sum::<f32>() / 81.0;
                let expected = (at(row, column) - mean) / (variance + 16.0).sqrt();
                let found = flat.row(row.cast_unsigned())[column.cast_unsigned()];
                assert!((found - expected).abs() < 1e-3, "{row} {column}: {found} {expected}");
            }
        }
    }

    #[test]
    fn samples_lie_between_pixels() {
        let raster = Raster { values: vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0], width: 3, height: 2 };
        for (x, y, expected) in [(0.0, 0.0, 0.0), (2.0, 1.0, 5.0), (0.5, 0.5, 2.0), (-3.0, 7.0, 3.0)] {
            assert_eq!(raster.clamped(x, y), expected);
        }
        let mut out = [0.0; 4];
        raster.sample(&[2.1, 2.0, 0.5, -0.1], &[0.0, 0.25, 0.5, 0.0], 9.0, &mut Room::default(), &mut out);
        assert_eq!(out, [9.0, 2.75, 2.0, 9.0]);
        assert_eq!(Raster { values: vec![7.0], width: 1, height: 1 }.clamped(0.3, 4.0), 7.0);
    }

    #[test]
    fn reduction_averages_squares() {
        let grey: Vec<u8> = (0..48).collect();
        let picture = Picture::new(&grey, 8, 6).unwrap();
        let small = reduced(VectorUnit::widest(), &picture, [1, 2], [3, 2], 2);
        assert_eq!(small.values, [21.5, 23.5, 25.5, 37.5, 39.5, 41.5]);
    }
}
