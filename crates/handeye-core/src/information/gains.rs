//! What candidates gain by a criterion: by the scorer where it knows the criterion, one by one otherwise.

use nalgebra::DMatrix;

use super::belief::Belief;
use super::candidate::{ArmColumns, CandidateModel, Execution, Motions};
use super::criteria::Criterion;
use super::scorer::{Scorer, in_sight};
use crate::error::Error;
use crate::se3::Se3;

impl CandidateModel<'_> {
    /// Gains of candidates at the motions; NaN where too little would be in sight.
    ///
    /// # Errors
    /// [`Error::InvalidInput`] if the belief has other parameters than this model.
    pub fn gains(
        &self,
        belief: &Belief,
        criterion: &dyn Criterion,
        motions: &[Se3],
    ) -> Result<Vec<f64>, Error> {
        self.gains_by(belief, criterion, Motions::Transforms(motions), None, &Execution::default())
    }

    /// As [`CandidateModel::gains`], of motions in either form, of an arm whose joints and links err where its columns
    /// are given, and with a say in how the machine is used.
    ///
    /// # Errors
    /// As [`CandidateModel::gains`], [`Error::NotRigid`] if a matrix is no rigid transform, and
    /// [`Error::InvalidInput`] if the arm is not that of these candidates.
    pub fn gains_by(
        &self,
        belief: &Belief,
        criterion: &dyn Criterion,
        motions: Motions<'_>,
        arm: Option<ArmColumns<'_>>,
        execution: &Execution,
    ) -> Result<Vec<f64>, Error> {
        if belief.len() != self.parameter_count() {
            return Err(Error::invalid(format!(
                "the belief has {} parameters, the candidates {}",
                belief.len(),
                self.parameter_count()
            )));
        }
        if let Some(arm) = &arm {
            arm.check(motions.len(), self.kinematic_count)?;
        }
        let prepared = criterion.prepare(belief)?;
        if let Some(quantity) = criterion.quantity() {
            let mut gains = vec![0.0; motions.len()];
            let scorer = Scorer::new(self, execution.unit, (belief, &quantity, prepared), arm.as_ref())?;
            scorer.score(motions, arm, execution, &mut gains)?;
            return Ok(gains);
        }
        (0..motions.len())
            .map(|i| {
                let joints = arm.as_ref().map(|arm| arm.of(i));
                let candidate = self.candidate(&motions.get(i)?, joints.as_ref());
                Ok(candidate.map_or(f64::NAN, |c| prepared.gain(&c.factor)))
            })
            .collect()
    }

    /// Information of each candidate in all parameters; zero where too little would be in sight.
    ///
    /// # Errors
    /// As [`CandidateModel::gains_by`].
    pub fn informations(
        &self,
        motions: Motions<'_>,
        arm: Option<ArmColumns<'_>>,
    ) -> Result<Vec<DMatrix<f64>>, Error> {
        if let Some(arm) = &arm {
            arm.check(motions.len(), self.kinematic_count)?;
        }
        let n = self.parameter_count();
        (0..motions.len())
            .map(|i| {
                let joints = arm.as_ref().map(|arm| arm.of(i));
                let candidate = self.candidate(&motions.get(i)?, joints.as_ref());
                Ok(candidate.map_or_else(|| DMatrix::zeros(n, n), |c| &c.factor * c.factor.transpose()))
            })
            .collect()
    }

    /// Which motions would show enough of the target.
    ///
    /// # Errors
    /// [`Error::NotRigid`] if a matrix is no rigid transform.
    pub fn in_sight(&self, motions: Motions<'_>, execution: &Execution) -> Result<Vec<bool>, Error> {
        in_sight(self, motions, execution)
    }
}
