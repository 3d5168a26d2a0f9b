"""Poses as the makers of robots write them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handeye.errors import InputError
from handeye.robots.notations import Notation, pose_numbers, pose_of_numbers, pose_text, read_pose_text
from handeye.types import Pose

ANGLE = st.floats(-3.1, 3.1)
LENGTH = st.floats(-2, 2)


@pytest.mark.parametrize("notation", list(Notation))
@given(twist=st.tuples(LENGTH, LENGTH, LENGTH, ANGLE, ANGLE, ANGLE))
def test_what_is_written_reads_back(notation: Notation, twist: tuple[float, ...]) -> None:
    pose = Pose.exp(np.array([0, 0, 0, *twist[3:]]))
    pose = Pose.exp([*twist[:3], 0, 0, 0]) @ pose
    back = read_pose_text(pose_text(pose, notation), notation)
    difference = pose.inverse() @ back
    assert np.linalg.norm(difference.translation) < 5e-7
    assert difference.rotation_angle_rad < 5e-7
    exact = pose.inverse() @ pose_of_numbers(pose_numbers(pose, notation), notation)
    assert np.abs(exact.matrix - np.eye(4)).max() < 1e-9


def test_each_maker_means_what_it_says() -> None:
    # A quarter turn about z, then a tilt about the new y: written out by hand.
    turn = Pose.exp([0, 0, 0, 0, 0, np.pi / 2]).rotation @ Pose.exp([0, 0, 0, 0, 0.5, 0]).rotation
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, [0.1, -0.2, 0.3]
    pose, tilt = Pose(matrix), np.rad2deg(0.5)
    assert np.allclose(pose_numbers(pose, Notation.KUKA), [100, -200, 300, 90, tilt, 0])
    assert np.allclose(pose_numbers(pose, Notation.FANUC), [100, -200, 300, 0, tilt, 90])
    assert np.allclose(pose_numbers(pose, Notation.EPSON), [100, -200, 300, 90, tilt, 0])
    c, s = np.cos([np.pi / 4, 0.25]), np.sin([np.pi / 4, 0.25])
    quaternion = [c[0] * c[1], -s[0] * s[1], c[0] * s[1], s[0] * c[1]]
    assert np.allclose(pose_numbers(pose, Notation.ABB), [100, -200, 300, *quaternion])
    half = Pose.exp([0.1, 0, 0, 0, np.pi, 0])
    assert np.allclose(np.abs(pose_numbers(half, Notation.UR)[3:]), [0, np.pi, 0])


def test_letters_may_come_in_any_order_and_missing_ones_are_named() -> None:
    there = read_pose_text("A=90.0 B=0 C: 180\nX 400, Y -10.5, Z=+300 mm", Notation.KUKA)
    assert np.allclose(pose_numbers(there, Notation.KUKA), [400, -10.5, 300, 90, 0, 180])
    with pytest.raises(InputError, match="P, R missing"):
        read_pose_text("X 1 Y 2 Z 3 W 4", Notation.FANUC)
    with pytest.raises(InputError, match="X is there twice"):
        read_pose_text("X 1 X 2", Notation.EPSON)


@pytest.mark.parametrize("text", ["", "1 2 3", "p[1, 2, 3, 4, 5, 6, 7]", "nan " * 6, "9" * 3000])
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(InputError):
        read_pose_text(text, Notation.UR)
