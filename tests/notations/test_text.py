"""Poses as the makers of robots write them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from handeye.errors import InputError
from handeye.notations import (
    EULER,
    MAKERS,
    NOTATIONS,
    PLAIN,
    Notation,
    Unit,
    notation_of,
    pose_text,
    read_pose_text,
    unit_of,
)
from handeye.types import Pose

ANGLE = st.floats(-3.1, 3.1)
LENGTH = st.floats(-2, 2)


@pytest.mark.parametrize("notation", [*MAKERS, *PLAIN], ids=lambda notation: notation.name)
@settings(max_examples=25)
@given(twist=st.tuples(LENGTH, LENGTH, LENGTH, ANGLE, ANGLE, ANGLE))
def test_what_is_written_reads_back(notation: Notation, twist: tuple[float, ...]) -> None:
    pose = Pose.exp(np.array([0, 0, 0, *twist[3:]]))
    pose = Pose.exp([*twist[:3], 0, 0, 0]) @ pose
    back = read_pose_text(pose_text(pose, notation), notation)
    difference = pose.inverse() @ back
    assert np.linalg.norm(difference.translation) < 5e-7
    assert difference.rotation_angle_rad < 5e-7
    exact = pose.inverse() @ notation.pose(notation.numbers(pose))
    assert np.abs(exact.matrix - np.eye(4)).max() < 1e-9


def test_each_maker_means_what_it_says() -> None:
    # A quarter turn about z, then a tilt about the new y: written out by hand.
    turn = Pose.exp([0, 0, 0, 0, 0, np.pi / 2]).rotation @ Pose.exp([0, 0, 0, 0, 0.5, 0]).rotation
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, [0.1, -0.2, 0.3]
    pose, tilt = Pose(matrix), np.rad2deg(0.5)
    assert np.allclose(NOTATIONS["kuka"].numbers(pose), [100, -200, 300, 90, tilt, 0])
    assert np.allclose(NOTATIONS["fanuc"].numbers(pose), [100, -200, 300, 0, tilt, 90])
    assert np.allclose(NOTATIONS["epson"].numbers(pose), [100, -200, 300, 90, tilt, 0])
    c, s = np.cos([np.pi / 4, 0.25]), np.sin([np.pi / 4, 0.25])
    quaternion = [c[0] * c[1], -s[0] * s[1], c[0] * s[1], s[0] * c[1]]
    assert np.allclose(NOTATIONS["abb"].numbers(pose), [100, -200, 300, *quaternion])
    half = Pose.exp([0.1, 0, 0, 0, np.pi, 0])
    assert np.allclose(np.abs(NOTATIONS["ur"].numbers(half)[3:]), [0, np.pi, 0])


def test_letters_may_come_in_any_order_and_missing_ones_are_named() -> None:
    there = read_pose_text("A=90.0 B=0 C: 180\nX 400, Y -10.5, Z=+300 mm", NOTATIONS["kuka"])
    assert np.allclose(NOTATIONS["kuka"].numbers(there), [400, -10.5, 300, 90, 0, 180])
    with pytest.raises(InputError, match="P, R missing"):
        read_pose_text("X 1 Y 2 Z 3 W 4", NOTATIONS["fanuc"])
    with pytest.raises(InputError, match="X is there twice"):
        read_pose_text("X 1 X 2", NOTATIONS["epson"])


@pytest.mark.parametrize("text", ["", "1 2 3", "p[1, 2, 3, 4, 5, 6, 7]", "nan " * 6, "9" * 3000])
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(InputError):
        read_pose_text(text, NOTATIONS["ur"])


@pytest.mark.parametrize("notation", EULER, ids=lambda notation: notation.name)
def test_angles_mean_what_scipy_says(notation: Notation) -> None:
    form = notation.form.rotation
    values = np.random.default_rng(5).uniform(-3, 3, (20, 3))
    axes = form.axes.upper() if form.moving else form.axes
    expected = Rotation.from_euler(axes, values, degrees=form.degrees).as_matrix()
    np.testing.assert_allclose(form.matrices(values), expected, atol=1e-12)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("quarters", [0, 1, 2, 3])
def test_quarter_turns_read_back_where_angles_are_not_unique(axis: int, quarters: int) -> None:
    turn = Pose.exp(np.eye(6)[3 + axis] * quarters * np.pi / 2)
    for notation in NOTATIONS.values():
        back = notation.pose(notation.numbers(turn))
        assert np.abs(back.matrix - turn.matrix).max() < 1e-12, notation.name


def test_the_unit_may_be_said() -> None:
    pose = read_pose_text("p[400, 0, 300, 0, 0, 0]", NOTATIONS["ur"], Unit.MM)
    assert pose.translation.tolist() == [0.4, 0.0, 0.3]
    assert pose_text(pose, NOTATIONS["ur"], Unit.MM).startswith("p[400.0000")
    assert {notation.unit for notation in MAKERS} == {None, Unit.MM, Unit.M}


def test_names_are_forgiving_and_strangers_refused() -> None:
    assert notation_of(" KUKA ") is NOTATIONS["kuka"]
    assert notation_of("Euler-ZYX-moving-deg") is NOTATIONS["euler_zyx_moving_deg"]
    for read in (notation_of, unit_of):
        with pytest.raises(InputError, match="expected one of"):
            read("lightyears")


@pytest.mark.parametrize(
    ("name", "numbers", "code"),
    [
        ("abb", [0, 0, 0, 1, 1, 0, 0], "not_rigid"),
        ("matrix", [1] * 16, "not_rigid"),
        ("franka", np.eye(4).ravel() * 2, "not_rigid"),
        ("kuka", [0] * 5, "wrong_shape"),
        ("ur", [0, 0, 0, 0, 0, np.inf], "not_finite"),
    ],
)
def test_numbers_that_are_no_pose_are_refused(name: str, numbers: list[float], code: str) -> None:
    with pytest.raises(InputError) as caught:
        NOTATIONS[name].pose(numbers)
    assert caught.value.code == code
