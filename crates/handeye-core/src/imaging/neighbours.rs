//! Which crossings of edges neighbour which on a chessboard.

use super::single;
use crate::interrupt::checked;

/// A place where two edges cross.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Where it is.
    pub place: [f64; 2],
    /// Angles of the edges from u towards v; between the first and the second, less than pi further, it is dark.
    pub angles: [f64; 2],
}

/// The neighbour of each crossing along its edges, both ways, counted from u towards v: the nearest crossing in that
/// direction at which dark and light have changed places, if that one finds this one in the same way.
///
/// Directions may be off by an angle in radians.
pub fn neighbours(crossings: &[Crossing], off: f64) -> Vec<[Option<usize>; 4]> {
    let all: Vec<Turned> = crossings.iter().map(Turned::of).collect();
    let (sine, cosine) = off.sin_cos();
    let (sine, cosine) = (single(sine), single(cosine));
    let nearest: Vec<[Option<usize>; 4]> =
        checked(&all).map(|here| here.nearest(&all, sine, cosine)).collect();
    let takes = |from: usize, to: usize| nearest[from].contains(&Some(to));
    nearest.iter().enumerate().map(|(from, rays)| rays.map(|ray| ray.filter(|&to| takes(to, from)))).collect()
}

/// A crossing in single precision, with its edges as directions.
struct Turned {
    place: [f32; 2],
    edges: [[f32; 2]; 2],
}

impl Turned {
    fn of(crossing: &Crossing) -> Self {
        let edges = crossing.angles.map(|angle| [single(angle.cos()), single(angle.sin())]);
        Self { place: crossing.place.map(single), edges }
    }

    /// The nearest of all along each ray.
    fn nearest(&self, all: &[Self], sine: f32, cosine: f32) -> [Option<usize>; 4] {
        let mut best = [None; 4];
        let mut least = [f32::INFINITY; 4];
        for (number, other) in all.iter().enumerate() {
            // The other's first edge runs along this one's second, and the other way round.
            if cross(self.edges[1], other.edges[0]).abs() > sine
                || cross(self.edges[0], other.edges[1]).abs() > sine
            {
                continue;
            }
            let step = [other.place[0] - self.place[0], other.place[1] - self.place[1]];
            let squared = dot(step, step);
            for edge in 0..2 {
                let along = dot(self.edges[edge], step);
                let ray = edge + if along < 0.0 { 2 } else { 0 };
                let near = cosine * cosine * squared;
                if squared > 0.0
                    && squared < least[ray]
                    && along * along > near
                    && dot(other.edges[1 - edge], step).powi(2) > near
                {
                    (best[ray], least[ray]) = (Some(number), squared);
                }
            }
        }
        best
    }
}

fn dot(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[1] - a[1] * b[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// Crossings of a board of three rows and four columns, turned by an angle; dark and light change places.
    fn board(turn: f64) -> Vec<Crossing> {
        let (sine, cosine) = turn.sin_cos();
        (0..12)
            .map(|i| {
                let (row, column) = (f64::from(i / 4), f64::from(i % 4));
                let place = [cosine * column - sine * row, sine * column + cosine * row].map(|x| 20.0 * x);
                let first = turn + if (i / 4 + i % 4) % 2 == 0 { 0.0 } else { FRAC_PI_2 };
                Crossing { place, angles: [first, first + FRAC_PI_2] }
            })
            .collect()
    }

    #[test]
    fn every_corner_finds_those_beside_it() {
        for turn in [0.0, 0.5, 2.0, -1.2] {
            let found = neighbours(&board(turn), 0.3);
            for (i, rays) in found.iter().enumerate() {
                let (row, column) = (i / 4, i % 4);
                let mut expected = Vec::new();
                for (v, u) in [(0, 1), (1, 0), (0, -1), (-1, 0)] {
                    let (row, column) = (row.checked_add_signed(v), column.checked_add_signed(u));
                    if let (Some(row @ 0..3), Some(column @ 0..4)) = (row, column) {
                        expected.push(4 * row + column);
                    }
                }
                let mut rays: Vec<_> = rays.iter().flatten().copied().collect();
                rays.sort_unstable();
                expected.sort_unstable();
                assert_eq!(rays, expected, "{turn} {i}");
            }
        }
    }

    #[test]
    fn where_one_is_missing_none_two_steps_on_is_taken() {
        let mut board = board(0.3);
        board.remove(5);
        let found = neighbours(&board, 0.3);
        assert_eq!(found[4].iter().flatten().count(), 2);
        assert!(!found[4].contains(&Some(5)));
    }
}
