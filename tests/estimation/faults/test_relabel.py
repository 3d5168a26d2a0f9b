"""Other readings of the labels give the pose that they say."""

import numpy as np
import pytest

from handeye.estimation.faults.relabel import Relabeling, reflections, shifts, turns
from handeye.estimation.measurements import view_pose
from handeye.studies.planted import made_up
from handeye.types import Chessboard, CircleGrid, Target

BOARDS = (
    Chessboard(8, 11, 0.025),
    CircleGrid(4, 4, 0.06, 0.03),
    CircleGrid(4, 3, 0.03, 0.02, asymmetric=True),
)


@pytest.mark.parametrize("target", BOARDS)
def test_permutation_and_factor_say_the_same(target: Target) -> None:
    for relabeling in turns(target) + reflections(target):
        moved = target.points @ np.linalg.inv(relabeling.factor)[:3, :3].T
        moved += np.linalg.inv(relabeling.factor)[:3, 3]
        np.testing.assert_allclose(target.points[relabeling.permutation], moved, atol=1e-9)


@pytest.mark.parametrize("number", [0, 1])
def test_a_view_read_anew_has_the_pose_that_follows(number: int) -> None:
    recording = made_up(number, 3)
    view = recording.views[0]
    pose = view_pose(recording.camera, recording.target, view)
    for relabeling in turns(recording.target)[1:]:
        anew = view_pose(recording.camera, recording.target, relabeling.applied(view))
        expected = relabeling.applied_to_pose(pose).T_camera_target
        np.testing.assert_allclose(anew.T_camera_target.matrix, expected.matrix, atol=1e-6)


def test_square_grids_have_eight_readings_and_others_four() -> None:
    square, board = CircleGrid(4, 4, 0.06, 0.03), Chessboard(8, 11, 0.025)
    assert (len(turns(square)), len(reflections(square))) == (4, 4)
    assert (len(turns(board)), len(reflections(board))) == (2, 2)


def test_part_of_a_board_may_be_another_part() -> None:
    board = Chessboard(4, 5, 0.03)
    lower = np.arange(5, 20)
    found = shifts(board, lower, turns(board)[:1])
    assert [r.words for r in found] == ["shifted by (0, -30) mm"]
    np.testing.assert_array_equal(found[0].permutation[lower], lower - 5)
    assert shifts(board, np.arange(20), turns(board)) == []


def test_labels_outside_the_board_do_not_fit() -> None:
    relabeling = Relabeling("", np.array([1, -1]), np.eye(4), False)
    assert relabeling.fits(np.array([0]))
    assert not relabeling.fits(np.array([0, 1]))
