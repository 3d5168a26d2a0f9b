//! A better distribution of fractional weights over a few views: the quadratic model of `phi` in their weights,
//! maximised under `sum d = 0` and `0 <= w + d <= 1` by moving weight between two views at a time (Platt 1998; the
//! pair by the second-order rule of Fan, Chen and Lin 2005).

use nalgebra::DMatrix;

/// Moves of weight at most, per view.
const MOVES: usize = 50;

/// Violations below this fraction of the first are left to the next model.
const ENOUGH: f64 = 1e-3;

/// Curvature that is taken for none, relative to that of the two views.
const FLAT: f64 = 1e-12;

/// Change of the weights: `slopes` and `curvatures` of `phi` (the latter negated, positive semi-definite) at `weights`.
pub(super) fn reweigh(slopes: &[f64], curvatures: &DMatrix<f64>, weights: &[f64]) -> Vec<f64> {
    let count = weights.len();
    let mut change = vec![0.0; count];
    // Slopes of the model where the change has led.
    let mut slopes = slopes.to_vec();
    let mut enough = 0.0;
    for turn in 0..MOVES * count {
        let room = |i: usize| 1.0 - weights[i] - change[i];
        let left = |i: usize| weights[i] + change[i];
        let Some(up) = (0..count).filter(|i| room(*i) > 0.0).max_by(|a, b| slopes[*a].total_cmp(&slopes[*b]))
        else {
            break;
        };
        let bend = |down: usize| {
            let sum = curvatures[(up, up)] + curvatures[(down, down)];
            (sum - 2.0 * curvatures[(up, down)]).max(FLAT * sum)
        };
        let mut widest: f64 = 0.0;
        let mut best = (0.0, up);
        for down in (0..count).filter(|i| *i != up && left(*i) > 0.0) {
            let gap = slopes[up] - slopes[down];
            if gap > 0.0 {
                widest = widest.max(gap);
                let gain = gap * gap / bend(down);
                if gain > best.0 {
                    best = (gain, down);
                }
            }
        }
        let down = best.1;
        if turn == 0 {
            enough = ENOUGH * widest;
        }
        if down == up || widest <= enough {
            break;
        }
        let wanted = (slopes[up] - slopes[down]) / bend(down);
        let (room, left) = (room(up), left(down));
        let moved = wanted.min(room).min(left);
        // Limits are met exactly: what is rounding away from one would stay in play.
        change[up] = if moved == room { 1.0 - weights[up] } else { change[up] + moved };
        change[down] = if moved == left { -weights[down] } else { change[down] - moved };
        for (i, slope) in slopes.iter_mut().enumerate() {
            *slope -= moved * (curvatures[(i, up)] - curvatures[(i, down)]);
        }
    }
    change
}
