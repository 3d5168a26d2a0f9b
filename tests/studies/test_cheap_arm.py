"""Arms of hobby servos: rough ones are known to be rough, their play is found, and too much is refused early."""

import numpy as np

from handeye.estimation import Measurements
from handeye.estimation.arm import behind
from handeye.estimation.auto import AutoEstimator, AutoOptions
from handeye.estimation.cell_fit import fit_cell, roughness
from handeye.estimation.rig_measurements import RigMeasurements
from handeye.robots import ArmKinematics
from handeye.simulation.cells import ErrorKind, simulate, simulated_arm
from handeye.studies.cheap_arm import CheapArmStudy, five_joint_arm, made_cell, study_cheap_arms
from handeye.types import Mounting


def test_the_study_counts() -> None:
    found = study_cheap_arms(CheapArmStudy(cells=4, seed=78))
    assert found["refused_in_time"] == 1.0
    assert found["within"] >= 0.75


def test_play_is_found_where_the_arm_is_rough() -> None:
    """About what the plays of five joints were; an arm in good order is not asked for any."""
    kinematics = ArmKinematics(five_joint_arm())
    measurements, X = made_cell(np.random.default_rng(5), Mounting.EYE_IN_HAND, 30)
    found = fit_cell(RigMeasurements.of_one(measurements), kinematics).posterior
    levels = dict(zip(found.level_names, np.rad2deg(found.levels[0]), strict=True))
    assert 0.3 < levels["play_rad"] < 4.0
    assert levels["joint_rad"] < 0.5 * levels["play_rad"]
    estimate = AutoEstimator(AutoOptions(kinematics))(measurements)
    off = np.linalg.norm((estimate.X.inverse().matrix - X.inverse().matrix)[:3, 3])
    assert 1e3 * off < 2 * estimate.within_95.translation_mm
    healthy = Measurements.of_recording(simulate(ErrorKind.MIXTURE_CELL, 3))
    ur5e = ArmKinematics(simulated_arm())
    assert "play_rad" not in fit_cell(RigMeasurements.of_one(healthy), ur5e).posterior.level_names
    asked = fit_cell(RigMeasurements.of_one(healthy), ur5e, play=True)
    assert "play_rad" in asked.posterior.level_names
    assert roughness(asked.posterior, described=True) == 1.0


def test_of_the_side_before_a_joint_first_moves_nobody_knows() -> None:
    """Behind by half the play, on the side that the joint last came from; a joint that rests stays there."""
    by_joint = np.ones((4, 6, 2))
    found = behind(by_joint, np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.5, 0.5]]))
    known, unknown = found[:, 0, :2], found[:, 0, 2:]
    np.testing.assert_array_equal(known, [[0, 0], [-0.5, 0], [-0.5, -0.5], [0.5, -0.5]])
    np.testing.assert_array_equal(unknown, [[-0.5, -0.5], [0, -0.5], [0, 0], [0, 0]])


def test_a_rough_arm_is_believed_to_hide_as_much_as_it_shows() -> None:
    """Though nothing of what hides shows: levels that no residual needs do not fall to nothing."""
    measurements, _ = made_cell(np.random.default_rng([523, 31, 6]), Mounting.EYE_IN_HAND, 40)
    one = RigMeasurements.of_one(measurements.select(range(20)))
    undescribed = fit_cell(one).posterior
    levels = dict(zip(undescribed.level_names, np.rad2deg(undescribed.levels[0]), strict=True))
    assert min(levels["posture_flange_rad"], levels["posture_base_rad"]) > 0.05
    described = fit_cell(one, ArmKinematics(five_joint_arm())).posterior
    levels = dict(zip(described.level_names, np.rad2deg(described.levels[0]), strict=True))
    assert min(levels["offset_rad"], levels["link_rad"]) > 0.1
    assert levels["play_rad"] > 0.5
