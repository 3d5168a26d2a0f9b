"""Arms of hobby servos: rough ones are known to be rough, their play is found, and too much is refused early."""

import numpy as np

from handeye.estimation.auto import AutoEstimator, AutoOptions
from handeye.estimation.cell_fit import fit_cell, roughness
from handeye.estimation.rig_measurements import RigMeasurements
from handeye.robots import ArmKinematics
from handeye.studies.cheap_arm import CheapArmStudy, five_joint_arm, made_cell, study_cheap_arms
from handeye.types import Mounting


def test_the_study_counts() -> None:
    found = study_cheap_arms(CheapArmStudy(cells=4, seed=78))
    assert found["refused_in_time"] == 1.0
    assert found["within"] >= 0.75


def test_play_is_found_where_the_joints_came_straight() -> None:
    """The mean square of what the plays of five joints were, and what was found."""
    kinematics = ArmKinematics(five_joint_arm())
    measurements, X = made_cell(np.random.default_rng(5), Mounting.EYE_IN_HAND, 30)
    fits = [fit_cell(RigMeasurements.of_one(measurements), kinematics, play=play) for play in (False, True)]
    levels = dict(zip(fits[1].posterior.level_names, fits[1].posterior.levels[0], strict=True))
    assert "play_rad" not in fits[0].posterior.level_names
    assert 0.3 < np.rad2deg(levels["play_rad"]) < 4.0
    noise = [fit.posterior.levels[0][fit.posterior.level_names.index("joint_rad")] for fit in fits]
    assert noise[1] < 0.8 * noise[0]
    assert roughness(fits[0].posterior, described=True) > 5.0
    with_play = AutoEstimator(AutoOptions(kinematics, play=True))(measurements)
    off = np.linalg.norm((with_play.X.inverse().matrix - X.inverse().matrix)[:3, 3])
    assert 1e3 * off < 2 * with_play.within_95.translation_mm
