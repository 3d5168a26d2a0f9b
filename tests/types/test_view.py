"""Views: what exists is valid."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handeye.errors import InputError
from handeye.types import Chessboard, Pose, View
from strategies import plain_values, views

GOOD: dict[str, Any] = {
    "name": "im_01",
    "T_base_flange": Pose.identity(),
    "point_ids": [3, 1, 2],
    "pixels": [[1.5, 2.5], [3, 4], [5, 6]],
    "image": "images/im_01.png",
    "timestamp_s": 12.5,
    "joints_rad": [0, 1, 2],
}


def test_a_good_view() -> None:
    view = View(**GOOD)
    assert len(view) == 3
    assert view.point_ids.dtype == np.int64
    assert view.joints_rad == (0.0, 1.0, 2.0)
    for array in (view.point_ids, view.pixels):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    with pytest.raises(AttributeError):
        view.name = "other"  # type: ignore[misc]


@given(views("view", Chessboard(4, 5, 0.02)))
def test_dict_reads_back(view: View) -> None:
    twin = View.from_dict(view.to_dict())
    assert twin == view
    assert hash(twin) == hash(view)


def test_views_of_other_points_differ() -> None:
    assert View(**GOOD) != View(**{**GOOD, "point_ids": [3, 1, 4]})
    assert View(**GOOD) != View(**{**GOOD, "timestamp_s": None})


@pytest.mark.parametrize(
    ("field", "value", "code"),
    [
        ("point_ids", [1, 1, 2], "duplicate_point"),
        ("point_ids", [-1, 1, 2], "out_of_range"),
        ("point_ids", [1, 2], "wrong_shape"),
        ("point_ids", [1.0, 2.0, 3.0], "not_numbers"),
        ("point_ids", [True, False, True], "not_numbers"),
        ("point_ids", np.array([2**63, 1, 2], dtype=np.uint64), "out_of_range"),
        ("pixels", [[1, 2], [3, 4], [5, math.nan]], "not_finite"),
        ("pixels", [[1, 2, 3]] * 3, "wrong_shape"),
        ("T_base_flange", np.eye(4), "invalid_input"),
        ("name", "", "invalid_name"),
        ("name", "a/b", "invalid_name"),
        ("name", "..", "invalid_name"),
        ("name", ".hidden", "invalid_name"),
        ("name", "-rf", "invalid_name"),
        ("name", "a b", "invalid_name"),
        ("name", "im.", "invalid_name"),
        ("name", "im\n", "invalid_name"),
        ("name", "Nul.txt", "invalid_name"),
        ("name", "x" * 101, "invalid_name"),
        ("image", "/etc/passwd", "path_outside"),
        ("image", "../x.png", "path_outside"),
        ("image", "images/../../x.png", "path_outside"),
        ("image", "images//x.png", "path_outside"),
        ("image", "./x.png", "path_outside"),
        ("image", "C:/x.png", "path_outside"),
        ("image", "images\\x.png", "path_outside"),
        ("image", "a\0b", "path_outside"),
        ("image", "", "path_outside"),
        ("image", "x" * 501, "path_outside"),
        ("timestamp_s", math.inf, "not_finite"),
        ("joints_rad", [], "wrong_shape"),
        ("joints_rad", [0, math.nan], "not_finite"),
        ("joints_rad", [0.0] * 101, "wrong_shape"),
    ],
)
def test_what_is_no_view_is_refused(field: str, value: Any, code: str) -> None:
    with pytest.raises(InputError) as caught:
        View(**{**GOOD, field: value})
    assert caught.value.code == code


def test_a_view_without_points_is_refused() -> None:
    with pytest.raises(InputError, match="no points") as caught:
        View("im_01", Pose.identity(), [], np.zeros((0, 2)))
    assert caught.value.hint is not None


@given(plain_values(), st.sampled_from(sorted(GOOD)))
def test_hostile_values_raise_only_our_error(value: object, field: str) -> None:
    with pytest.raises(InputError):
        View.from_dict(value)
    try:
        View.from_dict({**View(**GOOD).to_dict(), field: value})
    except InputError:
        return
