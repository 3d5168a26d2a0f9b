//! A camera that is known from a calibration, and perhaps less well than that says.

use super::Component;
use crate::estimation::cell::{CameraPrior, Cell};
use crate::estimation::component::{Effect, Term};
use crate::estimation::levels::{Level, LevelPrior};
use crate::estimation::linearisation::Linearisation;

/// A plain inverse of J'J is too small by about this factor in deviation.
const USUAL_INFLATION: f64 = 1.1;

/// The covariance of a camera's calibration, inflated by a level that is found.
pub(in crate::estimation) struct CameraCovariance {
    camera: usize,
    prior: CameraPrior,
}

impl CameraCovariance {
    pub(in crate::estimation) fn new(camera: usize, prior: CameraPrior) -> Self {
        Self { camera, prior }
    }
}

impl Component for CameraCovariance {
    fn name(&self) -> &'static str {
        "camera"
    }

    fn levels(&self) -> Vec<Level> {
        let spread = if self.prior.inflated { 0.5 } else { 1e-3 };
        let start = if self.prior.inflated { USUAL_INFLATION } else { 1.0 };
        vec![Level { name: "camera_inflation", start, prior: LevelPrior::Ratio { spread } }]
    }

    fn terms(&self, cell: &Cell, _: &Linearisation) -> Vec<Term> {
        let effect = Effect::Prior {
            first: cell.columns().camera[self.camera],
            information: self.prior.information.clone(),
            mean: self.prior.mean.clone(),
        };
        vec![Term { levels: vec![0], effect }]
    }
}
