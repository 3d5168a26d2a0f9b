//! Where an estimate of a whole cell begins: pair by pair of camera and target.

use nalgebra::Matrix6;

use super::cell::{Cell, Measurement};
use super::start::start_from_poses;
use super::weak_prior::WeakPrior;
use crate::error::Error;
use crate::se3::Se3;

/// Poses of a cell to begin with.
#[derive(Clone, Debug)]
pub struct CellStart {
    /// `X` of each camera.
    pub x: Vec<Se3>,
    /// `Y` of each target.
    pub y: Vec<Se3>,
    /// Where the first pair began: a closed form's name, `"given"`, or `"axes"`.
    pub origin: &'static str,
}

/// Finds all poses of a cell from its measurements; `given` is tried among other starts.
///
/// # Errors
/// [`Error::InvalidInput`] where a camera or target is not tied to the arm by any measurement.
pub fn start_of_cell(
    cell: &Cell,
    weak: &WeakPrior,
    given: Option<(&[Se3], &[Se3])>,
) -> Result<CellStart, Error> {
    cell.check()?;
    if let Some((x, y)) = given
        && (x.len() != cell.cameras.len() || y.len() != cell.targets.len())
    {
        return Err(Error::invalid(format!(
            "a start of {} cameras and {} targets, expected {} and {}",
            x.len(),
            y.len(),
            cell.cameras.len(),
            cell.targets.len()
        )));
    }
    let mut x: Vec<Option<Se3>> = vec![None; cell.cameras.len()];
    let mut y: Vec<Option<Se3>> = vec![None; cell.targets.len()];
    let mut origin = None;
    let of = |c: usize, t: usize| -> Vec<&Measurement> {
        cell.measurements.iter().filter(|m| m.camera == c && m.target == t).collect()
    };
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for c in 0..cell.cameras.len() {
        for t in 0..cell.targets.len() {
            if !of(c, t).is_empty() {
                pairs.push((c, t));
            }
        }
    }
    // Most views first; pairs that move against each other before those that do not.
    pairs.sort_by_key(|(c, t)| {
        let still = cell.cameras[*c].body == cell.targets[*t];
        (still, std::cmp::Reverse(of(*c, *t).len()))
    });
    loop {
        if tie_rigidly(cell, &mut x, &mut y) {
            continue;
        }
        let open =
            |x: &[Option<Se3>], y: &[Option<Se3>], (c, t): (usize, usize)| x[c].is_none() || y[t].is_none();
        // Of those with a known end first: their other end follows.
        let next = pairs
            .iter()
            .find(|(c, t)| x[*c].is_some() != y[*t].is_some())
            .or_else(|| pairs.iter().find(|p| open(&x, &y, **p)))
            .copied();
        let Some((c, t)) = next else { break };
        let views = of(c, t);
        match (x[c], y[t]) {
            (Some(known), _) => {
                let implied = |m: &&Measurement| (known * cell.middle(m)).inverse() * m.pose.pose;
                y[t] = Some(middle_of(views.iter().map(implied)));
            }
            (None, Some(known)) => {
                let implied = |m: &&Measurement| m.pose.pose * (cell.middle(m) * known).inverse();
                x[c] = Some(middle_of(views.iter().map(implied)));
            }
            (None, None) if cell.cameras[c].body == cell.targets[t] => {
                return Err(Error::invalid(format!(
                    "camera {c} and target {t} do not move against each other and nothing ties them to the arm"
                )));
            }
            (None, None) => {
                let motions: Vec<Se3> = views.iter().map(|m| cell.middle(m)).collect();
                let poses: Vec<Se3> = views.iter().map(|m| m.pose.pose).collect();
                let covariances: Vec<Matrix6<f64>> =
                    views.iter().map(|m| m.pose.covariance * m.variance_px2 + slack()).collect();
                let given = given.map(|(x, y)| (x[c], y[t]));
                let found = start_from_poses(&motions, &poses, &covariances, weak, given)?;
                origin = origin.or(Some(found.origin));
                (x[c], y[t]) = (Some(found.x), Some(found.y));
            }
        }
    }
    let all = |poses: Vec<Option<Se3>>, what: &str| {
        poses
            .into_iter()
            .enumerate()
            .map(|(i, pose)| pose.ok_or_else(|| Error::invalid(format!("{what} {i} was never measured"))))
            .collect::<Result<Vec<_>, _>>()
    };
    Ok(CellStart { x: all(x, "camera")?, y: all(y, "target")?, origin: origin.unwrap_or("given") })
}

/// Finds an unknown camera from a known one that is fixed to the same body, by targets that both saw at the same stations,
/// or else a target from one known likewise: whatever the arm does, it does not part them. Whether there was any.
fn tie_rigidly(cell: &Cell, x: &mut [Option<Se3>], y: &mut [Option<Se3>]) -> bool {
    let together = || {
        let stations = cell.measurements.chunk_by(|a, b| a.station == b.station);
        stations.flat_map(|all| all.iter().flat_map(move |a| all.iter().map(move |b| (a, b))))
    };
    for c in (0..x.len()).filter(|c| x[*c].is_none()).collect::<Vec<_>>() {
        let implied = together().filter(|(a, b)| {
            b.camera == c && a.target == b.target && cell.cameras[a.camera].body == cell.cameras[c].body
        });
        let implied: Vec<Se3> =
            implied.filter_map(|(a, b)| Some(b.pose.pose * a.pose.pose.inverse() * x[a.camera]?)).collect();
        if !implied.is_empty() {
            x[c] = Some(middle_of(implied.into_iter()));
            return true;
        }
    }
    for t in (0..y.len()).filter(|t| y[*t].is_none()).collect::<Vec<_>>() {
        let implied = together().filter(|(a, b)| {
            b.target == t && a.camera == b.camera && cell.targets[a.target] == cell.targets[t]
        });
        let implied: Vec<Se3> =
            implied.filter_map(|(a, b)| Some(y[a.target]? * a.pose.pose.inverse() * b.pose.pose)).collect();
        if !implied.is_empty() {
            y[t] = Some(middle_of(implied.into_iter()));
            return true;
        }
    }
    false
}

/// Covariance added to the poses: a millimetre and 0.05 degrees per axis, so that a robot that is not exact does not
/// make every start look hopeless.
fn slack() -> Matrix6<f64> {
    let (t, r) = (1e-3_f64, 0.05_f64.to_radians());
    Matrix6::from_diagonal(&nalgebra::Vector6::new(t * t, t * t, t * t, r * r, r * r, r * r))
}

/// The pose that is nearest to all others: the medoid, which no outlier moves.
fn middle_of(poses: impl Iterator<Item = Se3>) -> Se3 {
    let poses: Vec<Se3> = poses.collect();
    let away = |a: &Se3| poses.iter().map(|b| (*a * b.inverse()).log().norm()).sum::<f64>();
    let best = poses.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
    best.copied().unwrap_or_else(Se3::identity)
}
