//! What candidates gain by a criterion: by the scorer where it knows the criterion, one by one otherwise.

use super::belief::Belief;
use super::candidate::{CandidateJoints, CandidateModel, Execution, Motions, Supposition};
use super::criteria::Criterion;
use super::scorer::Scorer;
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
        self.gains_by(belief, criterion, Motions::Transforms(motions), &Execution::default())
    }

    /// As [`CandidateModel::gains`], of motions in either form and with a say in how the machine is used.
    ///
    /// # Errors
    /// As [`CandidateModel::gains`], and [`Error::NotRigid`] if a matrix is no rigid transform.
    pub fn gains_by(
        &self,
        belief: &Belief,
        criterion: &dyn Criterion,
        motions: Motions<'_>,
        execution: &Execution,
    ) -> Result<Vec<f64>, Error> {
        let supposed = Supposition { weight: 1.0, belief, robot: self.robot };
        self.mean_gains(&[supposed], criterion, motions, execution)
    }

    /// As [`CandidateModel::gains_by`], averaged over what may be supposed of the robot in place of the model's; the
    /// points of a candidate are looked at once.
    ///
    /// # Errors
    /// As [`CandidateModel::gains_by`].
    pub fn mean_gains(
        &self,
        supposed: &[Supposition<'_>],
        criterion: &dyn Criterion,
        motions: Motions<'_>,
        execution: &Execution,
    ) -> Result<Vec<f64>, Error> {
        let mut gains = vec![0.0; motions.len()];
        if let Some(quantity) = criterion.quantity() {
            let mut scorer = Scorer::new(self, execution.unit);
            for one in supposed {
                self.check(one.belief)?;
                let prepared = criterion.prepare(one.belief)?;
                scorer.add_goal(one.weight, one.belief, &one.robot, &quantity, prepared)?;
            }
            scorer.score(motions, execution, &mut gains)?;
            return Ok(gains);
        }
        for one in supposed {
            self.check(one.belief)?;
            let model = Self { robot: one.robot, ..self.clone() };
            let prepared = criterion.prepare(one.belief)?;
            for (i, gain) in gains.iter_mut().enumerate() {
                let candidate = model.candidate(&motions.get(i)?, None);
                *gain += one.weight * candidate.map_or(f64::NAN, |c| prepared.gain(&c.factor));
            }
        }
        Ok(gains)
    }

    /// As [`CandidateModel::gains`], of an arm whose joints err: one [`CandidateJoints`] per motion.
    ///
    /// # Errors
    /// As [`CandidateModel::gains`], and if there are not as many or not with as many offsets.
    pub fn gains_with_joints(
        &self,
        belief: &Belief,
        criterion: &dyn Criterion,
        motions: &[Se3],
        joints: &[CandidateJoints],
    ) -> Result<Vec<f64>, Error> {
        self.check(belief)?;
        if joints.len() != motions.len() || joints.iter().any(|j| j.constants.ncols() != self.kinematic_count)
        {
            return Err(Error::invalid(format!(
                "expected joints of {} motions with {} free offsets each",
                motions.len(),
                self.kinematic_count
            )));
        }
        let prepared = criterion.prepare(belief)?;
        let gain = |(motion, joints)| {
            self.candidate(motion, Some(joints))
                .map_or(f64::NAN, |candidate| prepared.gain(&candidate.factor))
        };
        Ok(motions.iter().zip(joints).map(gain).collect())
    }

    fn check(&self, belief: &Belief) -> Result<(), Error> {
        if belief.len() == self.parameter_count() {
            return Ok(());
        }
        Err(Error::invalid(format!(
            "the belief has {} parameters, the candidates {}",
            belief.len(),
            self.parameter_count()
        )))
    }
}
