"""Readings of the robot poses undo what was done to them, and are found."""

import numpy as np
import pytest

from handeye.errors import InputError
from handeye.estimation import solve
from handeye.estimation.mistakes import repaired
from handeye.estimation.mistakes.conventions import READINGS, possible_scales
from handeye.studies.mistakes import made_up
from handeye.types import Pose

# What turns right poses into those that a reading undoes.
UNDOES = {
    "inverse": "inverse",
    "transposed": "transposed",
    "scalar_first": "scalar_last",
    "scalar_last": "scalar_first",
    "moving_axes": "fixed_axes",
    "fixed_axes": "moving_axes",
}


@pytest.mark.parametrize(("name", "undone_by"), UNDOES.items())
def test_readings_undo_each_other(name: str, undone_by: str) -> None:
    clean = made_up(3, 3)
    again = repaired(repaired(clean, undone_by), name)
    for before, after in zip(clean.views, again.views, strict=True):
        np.testing.assert_allclose(after.T_base_flange.matrix, before.T_base_flange.matrix, atol=1e-12)


def test_fixed_axes_are_those_of_urdf() -> None:
    def about(axis: int, angle: float) -> Pose:
        return Pose.exp(np.eye(6)[3 + axis] * angle)

    a, b, c = 0.3, -0.5, 0.8
    moving = about(0, a) @ about(1, b) @ about(2, c)
    fixed = about(2, c) @ about(1, b) @ about(0, a)
    readings = {reading.name: reading for reading in READINGS}
    found = readings["moving_axes"].poses(fixed.matrix[np.newaxis])[0]
    np.testing.assert_allclose(found, moving.matrix, atol=1e-12)
    found = readings["fixed_axes"].poses(moving.matrix[np.newaxis])[0]
    np.testing.assert_allclose(found, fixed.matrix, atol=1e-12)


@pytest.mark.parametrize("name", ["transposed", "scalar_first", "moving_axes"])
def test_other_conventions_are_named(name: str) -> None:
    wrong = repaired(made_up(2, 3), UNDOES[name])
    sentence = next(reading.sentence for reading in READINGS if reading.name == name)
    with pytest.raises(InputError) as caught:
        solve(wrong)
    assert caught.value.code == "wrong_rotation"
    assert sentence in caught.value.message


def test_an_unknown_reading_is_refused() -> None:
    with pytest.raises(InputError, match="inverse"):
        repaired(made_up(0, 3), "sideways")


def test_units_are_named_by_what_is_unusual() -> None:
    def first(factor: float, reach: float, pitch: float) -> tuple[str, str | None]:
        scale = possible_scales(factor, reach, pitch)[0]
        return scale.blamed, scale.unit

    assert first(1005.0, 700.0, 0.025) == ("robot", "millimetres")
    assert first(0.00101, 0.7, 25.0) == ("target", "millimetres")
    assert first(1.3, 0.7, 0.025) == ("target", None)
    assert possible_scales(1.02, 0.7, 0.025) == []
