"""Touches: predicted misses are what is made up, boards of another size are found, and what does not fit is refused."""

from dataclasses import replace

import numpy as np
import pytest

from handeye.errors import InputError
from handeye.estimation import Estimate, Measurements, make_estimator
from handeye.estimation.probing import predicted, verify
from handeye.robots import ArmKinematics
from handeye.simulation.cells import CellOptions, ErrorKind, SimulatedCell, simulate_cell, simulated_arm
from handeye.studies.probing import ProbingStudy, study_probing, touch_corners
from handeye.types import Chessboard, Mounting, Pose
from handeye.types.calibration import ModelName
from handeye.types.probing import Probing, Tip, Touch
from handeye.types.rig import Body

BOTH = (Mounting.EYE_IN_HAND, Mounting.EYE_TO_HAND)


def solved(
    mounting: Mounting, scale: float = 0.0, *, described: bool = True
) -> tuple[SimulatedCell, Estimate, Measurements]:
    board = Chessboard(8, 11, 0.025 * (1 + scale))
    cell = simulate_cell(ErrorKind.MIXTURE_CELL, 3, CellOptions(mounting=mounting, target=board), seed=9)
    cell = replace(cell, recording=replace(cell.recording, target=Chessboard(8, 11, 0.025)))
    measurements = Measurements.of_recording(cell.recording)
    kinematics = ArmKinematics(simulated_arm()) if described else None
    return cell, make_estimator(ModelName.AUTO, kinematics)(measurements), measurements


@pytest.mark.parametrize("mounting", BOTH)
@pytest.mark.parametrize("described", [True, False])
def test_a_board_as_stated_agrees_and_one_that_is_larger_is_named(
    mounting: Mounting, described: bool
) -> None:
    kinematics = ArmKinematics(simulated_arm()) if described else None
    for scale, verdict in ((0.0, "agrees"), (0.005, "board_size")):
        cell, estimate, measurements = solved(mounting, scale, described=described)
        points = Chessboard(8, 11, 0.025 * (1 + scale)).points
        probing = touch_corners(np.random.default_rng(1), cell, points)
        together = make_estimator(ModelName.AUTO, kinematics, probing=probing)(measurements, estimate)
        found = verify(estimate, together, probing)
        assert found.verdict == verdict
        assert found.board_scale is not None
        assert found.board_sigma is not None
        assert abs(found.board_scale - scale) < 4 * found.board_sigma
        assert found.to_dict()["verdict"] == verdict
        assert ("larger than stated" in found.sentence) == (verdict == "board_size")


def test_predictions_are_derivatives_of_what_is_touched() -> None:
    """The misses of the estimate itself are zero, and move as their covariance says when the tip does."""
    cell, estimate, _ = solved(Mounting.EYE_IN_HAND)
    tip = np.array([0.0, 0.0, 0.15])
    touches = []
    scale = 1 + (estimate.board_scale or 0.0)
    random = np.random.default_rng(2)
    for point in (0, 10, 77):
        joints = np.array(cell.recording.views[0].joints_rad) + random.uniform(-0.1, 0.1, 6)
        pose = simulated_arm().forward(joints)
        built = estimate.poses_as_built(pose[None], joints[None])[0]
        # The reported pose moved so that the flange as built has the tip on the point.
        short = estimate.Y.act([scale * estimate.target.points[point]])[0] - (
            built[:3, :3] @ tip + built[:3, 3]
        )
        moved = pose.copy()
        moved[:3, 3] += short
        touches.append(Touch("tool", point, Pose(moved), tuple(joints.tolist())))
    tips = {"tool": Tip(Body.FLANGE, (0.0, 0.0, 0.15), 0.0)}
    misses, exact = predicted(estimate, Probing(tips, tuple(touches), 1e-4))
    np.testing.assert_allclose(misses, 0.0, atol=1e-4)
    loose = {"tool": Tip(Body.FLANGE, (0.0, 0.0, 0.15), 1e-3)}
    _, more = predicted(estimate, Probing(loose, tuple(touches), 1e-4))
    np.testing.assert_allclose(np.diag(more - exact), 1e-6, rtol=1e-3)


def test_a_tool_is_found_by_pivoting() -> None:
    cell, estimate, measurements = solved(Mounting.EYE_IN_HAND)
    random = np.random.default_rng(4)
    tip, fixed = np.array([0.02, 0.01, 0.2]), np.array([0.45, 0.05, 0.1])
    touches = []
    for _ in range(8):
        turn = Pose.exp([0, 0, 0, np.pi, 0, 0]) @ Pose.exp([0, 0, 0, *random.normal(0, 0.4, 3)])
        goal = turn.matrix.copy()
        goal[:3, 3] = fixed - goal[:3, :3] @ tip
        joints = np.array(cell.recording.views[0].joints_rad)
        touches.append(Touch("tool", "cone", Pose(goal), tuple(joints.tolist())))
    probing = Probing({"tool": Tip(Body.FLANGE), "cone": Tip(Body.BASE)}, tuple(touches), 1e-4)
    found = make_estimator(ModelName.AUTO, probing=probing)(measurements, estimate).tips
    np.testing.assert_allclose(found["tool"].at_m, tip, atol=2e-3)
    np.testing.assert_allclose(found["cone"].at_m, fixed, atol=2e-3)
    assert found["tool"].sigma_m < 2e-3


def test_what_does_not_fit_is_refused() -> None:
    _, estimate, _ = solved(Mounting.EYE_TO_HAND)
    at = Touch("tool", 3, Pose.identity())
    on_flange = {"tool": Tip(Body.FLANGE)}
    with pytest.raises(InputError, match="both on the flange"):
        predicted(estimate, Probing(on_flange, (at,), 1e-4))
    standing = {"tool": Tip(Body.BASE), "other": Tip(Body.BASE)}
    with pytest.raises(InputError, match="joint positions"):
        predicted(estimate, Probing(standing, (at,), 1e-4))
    with pytest.raises(InputError, match="point 88 of a board"):
        predicted(estimate, Probing(standing, (replace(at, point=88),), 1e-4))
    with pytest.raises(InputError, match="no tip 'none'"):
        Probing(standing, (replace(at, tip="none"),), 1e-4)
    with pytest.raises(InputError, match="both points are on the base"):
        Probing(standing, (replace(at, point="other"),), 1e-4)
    with pytest.raises(InputError, match="no touch"):
        Probing(standing, (), 1e-4)
    with pytest.raises(InputError, match="expected above zero"):
        Probing(standing, (at,), 0.0)
    with pytest.raises(InputError, match="zero or more"):
        Tip(Body.BASE, sigma_m=-1.0)


def test_the_study_counts() -> None:
    found = study_probing(ProbingStudy(cells=2, seed=1))
    assert found["alarms"] == found["named"] == 1.0
