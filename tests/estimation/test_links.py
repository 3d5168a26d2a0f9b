"""Arms whose joints sit wrongly on their links: that is found, put right, and told from other errors."""

import json

import numpy as np
import pytest

from handeye.estimation import AutoEstimator, AutoOptions, Measurements, calibrate
from handeye.robots import ArmKinematics, Joint, arm_kinematics, open_arm
from handeye.robots.displaced import displaced, random_displacements
from handeye.robots.model import Arm
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types import Mounting, Pose
from handeye.types.calibration import RobotSide
from handeye.validation.metrics import absolute_error, relative_error

ARM = open_arm("ur5e")
OPTIONS = {"length_sigma_m": (0.5e-3, 0.5e-3), "twist_sigma_deg": (0.05, 0.05)}
BOTH = (Mounting.EYE_IN_HAND, Mounting.EYE_TO_HAND)


def sliding_arm() -> Arm:
    """Return an arm with a joint that slides along an axis of no special direction."""
    joints = (
        Joint("turn", Pose.exp([0.0, 0.0, 0.3, 0.1, 0.0, 0.0])),
        Joint("slide", Pose.exp([0.2, 0.1, 0.0, 0.0, 0.4, 0.0]), (0.6, 0.0, 0.8), sliding=True),
        Joint("wrist", Pose.exp([0.0, 0.3, 0.1, 0.0, 0.0, 0.5]), (0.0, 1.0, 0.0)),
    )
    return Arm("sliding", joints, Pose.exp([0.05, 0.0, 0.1, 0.0, 0.0, 0.2]))


@pytest.mark.parametrize("mounting", BOTH)
@pytest.mark.parametrize("arm", [ARM, sliding_arm()], ids=lambda arm: arm.name)
def test_jacobians_are_what_a_displaced_joint_does(arm: Arm, mounting: Mounting) -> None:
    random = np.random.default_rng(3)
    joints = random.uniform(-1, 1, (4, len(arm)))
    frames = (Pose.exp(random.uniform(-0.3, 0.3, 6)), Pose.exp(random.uniform(-0.3, 0.3, 6)))
    known = ArmKinematics(arm, *frames)
    jacobians = known.link_jacobians(mounting, joints)
    step = 1e-6
    for way in range(jacobians.shape[2]):
        wrong = ArmKinematics(displaced(arm, step * known.link_twists[:, :, way]), *frames)
        for k, (true, reported) in enumerate(zip(wrong.forward(joints), known.forward(joints), strict=True)):
            moved = mounting.chain(Pose(true)) @ mounting.chain(Pose(reported)).inverse()
            np.testing.assert_allclose(moved.log() / step, jacobians[k, :, way], atol=1e-5)


def test_every_displacement_is_counted_once() -> None:
    twists = ArmKinematics(ARM).link_twists
    assert twists.shape == (6, 6, 6 * 4 + 4)
    random = np.random.default_rng(1)
    drawn = random_displacements(random, ARM, 1e-3, 1e-3)
    flat = twists.reshape(36, -1)
    assert np.linalg.matrix_rank(flat) == flat.shape[1]
    # What is drawn and told apart from names is a sum of the ways; nothing else is.
    kept = flat @ flat.T @ drawn.ravel()
    same = displaced(ARM, kept.reshape(6, 6)).forward(np.ones(6))
    np.testing.assert_allclose(same, displaced(ARM, drawn).forward(np.ones(6)), atol=1e-12)


@pytest.mark.parametrize("mounting", BOTH)
def test_wrong_links_are_found_and_put_right(mounting: Mounting) -> None:
    cell = CellOptions(mounting=mounting, views=(12, 12), **OPTIONS)
    errors, relative, probability = [], [], []
    for seed in range(6):
        recording = simulate(ErrorKind.SMOOTH_KINEMATIC, seed, cell)
        assert recording.truth is not None
        assert recording.truth.X is not None
        measurements = Measurements.of_recording(recording)
        used, held_out = measurements.select(range(9)), measurements.select(range(9, 12))
        row, off = [], []
        for options in (AutoOptions(), AutoOptions(kinematics=ArmKinematics(ARM))):
            estimate = AutoEstimator(options)(used)
            row.append(absolute_error(estimate.X, recording.truth.X).translation_mm)
            off.append(relative_error(estimate, held_out).translation_mm)
        errors.append(row)
        relative.append(off)
        probability.append(estimate.noise.evidence["links"])
        assert len(estimate.link_errors) == 6
    unknown, known = np.mean(errors, axis=0)
    assert known < 0.6 * unknown
    as_reported, put_right = np.mean(relative, axis=0)
    assert put_right < 0.5 * as_reported
    assert np.mean(probability) > 0.8


@pytest.mark.parametrize("kind", [ErrorKind.PIXEL_ONLY, ErrorKind.WHITE_FLANGE, ErrorKind.ENCODER])
def test_other_errors_are_not_taken_for_wrong_links(kind: ErrorKind) -> None:
    found = []
    for seed in range(5):
        measurements = Measurements.of_recording(simulate(kind, seed, CellOptions(views=(12, 12))))
        estimate = AutoEstimator(AutoOptions(kinematics=ArmKinematics(ARM)))(measurements)
        found.append(estimate.noise.evidence["links"])
    assert np.mean(found) < 0.35


def test_links_stand_in_the_result() -> None:
    recording = simulate(ErrorKind.SMOOTH_KINEMATIC, 2, CellOptions(views=(14, 14), **OPTIONS))
    known = arm_kinematics(ARM, recording.views)
    calibration = calibrate(Measurements.of_recording(recording), kinematics=known)
    assert calibration.noise.robot_side is RobotSide.LINKS
    assert "blame_robot_links" in [finding.code for finding in calibration.diagnosis]
    told = json.loads(json.dumps(calibration.to_dict()))
    assert [error["joint"] for error in told["link_errors"]] == list(ARM.joint_names)
    assert told["link_errors"][0]["translation_mm"] == [0.0, 0.0, 0.0]
    assert 0.01 < np.abs(told["link_errors"][2]["rotation_deg"]).max() < 0.5
    plain = calibrate(Measurements.of_recording(recording))
    assert calibration.rmse_px < 0.5 * plain.rmse_px
    assert "link_errors" not in plain.to_dict()


def test_without_joint_positions_poses_stay_as_reported() -> None:
    recording = simulate(ErrorKind.SMOOTH_KINEMATIC, 1, CellOptions(views=(9, 9), **OPTIONS))
    measurements = Measurements.of_recording(recording)
    estimate = AutoEstimator(AutoOptions(kinematics=ArmKinematics(ARM)))(measurements)
    assert np.abs(estimate.corrected(measurements).motions - measurements.motions).max() > 1e-5
    blind = AutoEstimator()(measurements)
    assert blind.corrected(measurements) is measurements
