"""Recordings: what exists is consistent."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handeye.errors import InputError
from handeye.types import Camera, Chessboard, Mounting, Pose, Recording, Truth, View
from strategies import plain_values, recordings

CAMERA = Camera("pinhole", [1000, 1000, 640, 480], 1280, 960)


def view(name: str = "a", ids: tuple[int, ...] = (0, 1, 2), pixel: tuple[float, float] = (100, 100)) -> View:
    return View(name, Pose.identity(), ids, np.add.outer(np.arange(len(ids)), pixel))


def recording(*views: View) -> Recording:
    return Recording("set", Mounting.EYE_IN_HAND, CAMERA, Chessboard(4, 5, 0.02), views)


@given(recordings())
def test_dict_reads_back(value: Recording) -> None:
    assert Recording.from_dict(value.to_dict()) == value


def test_select_takes_views_in_the_order_asked_for() -> None:
    whole = recording(view("a"), view("b"), view("c"))
    assert [v.name for v in whole.select(["c", "a"]).views] == ["c", "a"]
    assert len(whole) == 3
    assert whole.view("b").name == "b"
    for names in (["a", "d"], ["a", "a"]):
        with pytest.raises(InputError):
            whole.select(names)


def test_mounting_may_be_given_as_text() -> None:
    as_text: Any = "eye_to_hand"
    assert replace(recording(), mounting=as_text).mounting is Mounting.EYE_TO_HAND


def test_points_and_pixels_must_fit_target_and_camera() -> None:
    recording(view(ids=(19,)))
    recording(view(pixel=(-60, -60)))
    for bad, code in [
        (view(ids=(20,)), "point_out_of_range"),
        (view(pixel=(-70, 100)), "pixel_outside"),
        (view(pixel=(100, 1030)), "pixel_outside"),
        (view(pixel=(1350, 100)), "pixel_outside"),
        (view(pixel=(100, 1e12)), "pixel_outside"),
    ]:
        with pytest.raises(InputError, match="view a") as caught:
            recording(bad)
        assert caught.value.code == code


def test_names_are_unique_also_without_case() -> None:
    with pytest.raises(InputError, match="twice"):
        recording(view("im_a"), view("IM_A"))


@pytest.mark.parametrize(
    "changes", [{"name": ""}, {"name": "a\nb"}, {"name": "x" * 201}, {"source": "\x1b[31m"}]
)
def test_texts_are_checked(changes: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        replace(recording(), **changes)


def test_a_truth_says_something() -> None:
    with pytest.raises(InputError):
        Truth()
    truth = Truth(Y=Pose.exp([1, 2, 3, 0, 0, 1]))
    assert Truth.from_dict(truth.to_dict()) == truth


@given(plain_values(), st.sampled_from(["name", "source", "mounting", "camera", "target", "truth", "views"]))
def test_hostile_values_raise_only_our_error(value: object, field: str) -> None:
    with pytest.raises(InputError):
        Recording.from_dict(value)
    try:
        Recording.from_dict({**recording(view()).to_dict(), field: value})
    except InputError:
        return
