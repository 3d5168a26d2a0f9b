"""Checks: the rows are the derivatives of a view, what moved is found and named, and a quiet cell stays quiet."""

from dataclasses import replace

import numpy as np
import pytest

from handeye import _core
from handeye.errors import InputError
from handeye.estimation import Estimate, Measurements, make_estimator
from handeye.estimation.difference import difference
from handeye.estimation.shift import Moved, check_views, plan_check, rows_of
from handeye.robots import ArmKinematics, open_arm
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.studies.shift import ShiftStudy, study_shift
from handeye.types import Mounting, Pose, View
from handeye.types.calibration import ModelName

ARM = open_arm("ur5e")
BOTH = (Mounting.EYE_IN_HAND, Mounting.EYE_TO_HAND)


def solved(mounting: Mounting, *, arm_known: bool = True) -> tuple[Estimate, Measurements]:
    recording = simulate(ErrorKind.MIXTURE_CELL, 4, CellOptions(mounting=mounting, views=(12, 12)))
    measurements = Measurements.of_recording(recording)
    kinematics = ArmKinematics(ARM) if arm_known else None
    return make_estimator(ModelName.AUTO, kinematics)(measurements.select(range(8))), measurements


def pictures(estimate: Estimate, views: Measurements, X: Pose, Y: Pose) -> Measurements:
    """Exact pictures of the board at the views' poses, by what is believed of camera and board's scale."""
    taken = []
    target = estimate.target
    scale = 1 + (estimate.board_scale or 0.0)
    for view in estimate.corrected(views).views:
        seen = X @ estimate.mounting.chain(view.T_base_flange) @ Y
        pixels, _ = _core.project_features(
            estimate.camera.lens,
            estimate.camera.parameters,
            seen.matrix,
            scale * target.points,
            target.radii_m,
        )
        original = next(one for one in views.views if one.name == view.name)
        taken.append(
            View(view.name, original.T_base_flange, view.point_ids, pixels, joints_rad=view.joints_rad)
        )
    return Measurements.of(estimate.mounting, estimate.camera, target, taken)


@pytest.mark.parametrize("mounting", BOTH)
def test_what_the_estimate_predicts_is_no_shift_and_shifts_act_as_their_rows_say(mounting: Mounting) -> None:
    estimate, everything = solved(mounting)
    views = everything.select(range(8, 11))
    exact = rows_of(estimate, pictures(estimate, views, estimate.X, estimate.Y))
    np.testing.assert_allclose(exact.e, 0.0, atol=2e-8)
    for j in range(6):
        xi = 1e-4 * np.eye(6)[j]
        moved = pictures(estimate, views, Pose.exp(xi) @ estimate.X, estimate.Y)
        found = rows_of(estimate, moved).e
        np.testing.assert_allclose(found, -1e-4 * exact.shifts[Moved.CAMERA, ""][:, j], atol=3e-7)
        moved = pictures(estimate, views, estimate.X, Pose.exp(xi) @ estimate.Y)
        found = rows_of(estimate, moved).e
        np.testing.assert_allclose(found, -1e-4 * exact.shifts[Moved.BOARD, ""][:, j], atol=3e-7)


@pytest.mark.parametrize("mounting", BOTH)
def test_a_shift_is_found_and_named(mounting: Mounting) -> None:
    estimate, everything = solved(mounting)
    chosen, detectable = plan_check(estimate, everything.motions, everything.joints)
    assert len(set(chosen)) == 2
    views = everything.select(chosen)
    far = Pose.exp([4 * detectable, 0, 0, 0, 0, 0])
    quiet = check_views(estimate, pictures(estimate, views, estimate.X, estimate.Y))
    assert not quiet.alarm
    assert quiet.moved is Moved.NOTHING
    assert "nothing has moved" in quiet.sentence
    camera = check_views(estimate, pictures(estimate, views, far @ estimate.X, estimate.Y))
    assert camera.alarm
    assert camera.moved is Moved.CAMERA
    assert camera.causes[0].translation_mm == pytest.approx(4e3 * detectable, rel=0.1)
    board = check_views(estimate, pictures(estimate, views, estimate.X, estimate.Y @ far))
    assert board.moved is Moved.BOARD
    assert "the board, by" in board.sentence


def test_planned_views_show_more_than_others() -> None:
    estimate, everything = solved(Mounting.EYE_IN_HAND)
    _, best = plan_check(estimate, everything.motions, everything.joints)
    worst = max(
        plan_check(estimate, everything.motions[[i, i + 1]], everything.joints[[i, i + 1]])[1]
        for i in range(10)
    )
    assert best < worst
    _, three = plan_check(estimate, everything.motions, everything.joints, 3)
    assert three < best
    with pytest.raises(InputError, match="at least two"):
        plan_check(estimate, everything.motions[:1], everything.joints[:1])
    with pytest.raises(InputError, match="no view"):
        check_views(estimate, everything.select([]))


def test_without_the_arm_no_joint_is_named() -> None:
    estimate, everything = solved(Mounting.EYE_TO_HAND, arm_known=False)
    found = check_views(estimate, everything.select([8, 10]))
    assert {cause.moved for cause in found.causes} == {Moved.CAMERA, Moved.BOARD}


def test_the_study_counts() -> None:
    result = study_shift(ShiftStudy(trials=1, sigmas=5.0, seed=3))
    assert result["moved"]["nothing"]["alarms"] == 0.0
    assert result["moved"]["camera"]["alarms"] == result["moved"]["joint"]["alarms"] == 1.0


def test_a_difference_is_chance_or_not() -> None:
    covariance = np.diag([1e-8] * 3 + [1e-8] * 3)
    one = Pose.exp([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    same = difference((one, covariance, np.inf), (one @ Pose.exp([1e-4, 0, 0, 0, 0, 0]), covariance, 20.0))
    assert same.p_value > 0.5
    assert "no more than chance" in same.sentence
    other = one @ Pose.exp([1e-3, 0, 0, 0, 0, 1e-3])
    moved = difference((one, covariance, np.inf), (other, covariance, 20.0))
    assert moved.p_value < 0.01
    np.testing.assert_allclose(moved.translation_m, other.translation - one.translation)
    np.testing.assert_allclose(moved.rotation_rad, [0, 0, 1e-3], atol=1e-12)
    half = replace(moved, p_value=0.5)
    assert half.to_dict()["distance_mm"] == pytest.approx(1.0, rel=1e-3)


def test_false_alarms_are_as_rare_as_said() -> None:
    """Under the model itself: errors drawn from the covariance that the check believes in."""
    estimate, everything = solved(Mounting.EYE_IN_HAND)
    rows = rows_of(estimate, everything.select([8, 9]))
    root = np.linalg.cholesky(rows.covariance)
    random = np.random.default_rng(1)
    squares = [np.sum(np.linalg.solve(root, root @ random.standard_normal(12)) ** 2) for _ in range(2000)]
    assert np.mean(squares) == pytest.approx(12, rel=0.05)
