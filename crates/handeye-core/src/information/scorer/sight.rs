//! Which candidates show enough of the target.

use super::super::candidate::{CandidateModel, Execution, Motions, Visibility};
use super::Scorer;
use super::approach::MATRIX;
use crate::camera::Feature;
use crate::error::Error;

/// Directions in the plane of the target whose outermost features are looked at first.
const OUTWARDS: [(f64, f64); 8] =
    [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];

/// Which motions would show enough of the target.
pub(in crate::information) fn in_sight(
    model: &CandidateModel<'_>,
    motions: Motions<'_>,
    execution: &Execution,
) -> Result<Vec<bool>, Error> {
    // What a view tells of camera and board has no say in what it shows.
    let model = CandidateModel { pixel_parameters: None, ..model.clone() };
    let outermost = outermost(model.features);
    if model.visibility.fewest < model.features.len() || outermost.len() == model.features.len() {
        return shown(&model, motions, execution);
    }
    // Where all must be in sight most candidates fail by a corner.
    let visibility = Visibility { fewest: outermost.len(), ..model.visibility };
    let mut seen =
        shown(&CandidateModel { features: &outermost, visibility, ..model.clone() }, motions, execution)?;
    let left: Vec<usize> = (0..seen.len()).filter(|i| seen[*i]).collect();
    let mut matrices = vec![0.0; MATRIX * left.len()];
    for (to, i) in matrices.chunks_exact_mut(MATRIX).zip(&left) {
        motions.part(*i, 1).fill(to);
    }
    let whole = shown(&model, Motions::Matrices(&matrices), execution)?;
    for (i, whole) in left.into_iter().zip(whole) {
        seen[i] = whole;
    }
    Ok(seen)
}

fn shown(
    model: &CandidateModel<'_>,
    motions: Motions<'_>,
    execution: &Execution,
) -> Result<Vec<bool>, Error> {
    let mut seen = vec![0.0; motions.len()];
    Scorer::without_goal(model, execution.unit).score(motions, None, execution, &mut seen)?;
    Ok(seen.iter().map(|seen| !seen.is_nan()).collect())
}

/// Features that are outermost in some direction, each once.
fn outermost(features: &[Feature]) -> Vec<Feature> {
    let mut chosen: Vec<usize> = OUTWARDS
        .iter()
        .filter_map(|(a, b)| {
            let along = |i: &usize| a * features[*i].position.x + b * features[*i].position.y;
            (0..features.len()).max_by(|i, j| along(i).total_cmp(&along(j)))
        })
        .collect();
    chosen.sort_unstable();
    chosen.dedup();
    chosen.into_iter().map(|i| features[i]).collect()
}
