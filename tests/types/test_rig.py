"""Stations with several cameras: consistent if they exist, and one camera as the simple case."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from handeye.errors import InputError
from handeye.types import (
    Body,
    Camera,
    CameraView,
    Chessboard,
    MountedCamera,
    MountedTarget,
    Pose,
    Recording,
    RigRecording,
    Station,
    View,
)
from strategies import recordings

CAMERA = Camera("pinhole", [1000, 1000, 640, 480], 1280, 960)
CAMERAS = {"left": MountedCamera(CAMERA, Body.FLANGE), "wall": MountedCamera(CAMERA, Body.BASE)}
TARGETS = {
    "table": MountedTarget(Chessboard(4, 5, 0.02), Body.BASE),
    "tool": MountedTarget(Chessboard(3, 4, 0.02), Body.FLANGE),
}


def view(name: str, x: float = 0.0, ids: tuple[int, ...] = (0, 1, 2)) -> View:
    pixels = np.add.outer(np.arange(len(ids)), (100, 100))
    return View(name, Pose.exp([x, 0, 0, 0, 0, 0]), ids, pixels)


def rig(*views: CameraView) -> RigRecording:
    return RigRecording.of_views("cell", CAMERAS, TARGETS, views)


@given(recordings())
def test_one_camera_is_the_simple_case(recording: Recording) -> None:
    assert RigRecording.of(recording).single == recording


def test_views_of_one_stop_are_one_station() -> None:
    made = rig(
        CameraView("left", "table", view("a")),
        CameraView("wall", "tool", view("a")),
        CameraView("left", "table", view("b", 0.1)),
    )
    assert [(s.name, len(s.views)) for s in made.stations] == [("a", 2), ("b", 1)]
    assert made.pairs == (("left", "table"), ("wall", "tool"))
    assert made.moves("left", "table")
    assert not made.moves("wall", "table")
    assert made.single is None
    assert [v.name for v in made.pair("left", "table").views] == ["a", "b"]


def test_cameras_on_one_body_have_a_pose_in_each_other() -> None:
    three = {"left": CAMERAS["left"], "wall": CAMERAS["wall"], "right": CAMERAS["left"]}
    made = RigRecording.of_views("cell", three, TARGETS, [CameraView("left", "table", view("a"))])
    assert made.rigid_pairs() == (("left", "right"),)


@pytest.mark.parametrize(
    ("views", "code"),
    [
        ([CameraView("left", "table", view("a")), CameraView("left", "table", view("a"))], "duplicate_view"),
        (
            [CameraView("left", "table", view("a")), CameraView("wall", "tool", view("a", 0.1))],
            "invalid_field",
        ),
        ([CameraView("right", "table", view("a"))], "invalid_field"),
        ([CameraView("left", "floor", view("a"))], "invalid_field"),
        ([CameraView("wall", "tool", view("a", ids=(12,)))], "point_out_of_range"),
        (
            [
                CameraView("left", "table", view("a")),
                CameraView("left", "table", view("b")),
                CameraView("wall", "tool", view("a")),
            ],
            "duplicate_view",
        ),
    ],
)
def test_what_does_not_fit_together_is_refused(views: list[CameraView], code: str) -> None:
    with pytest.raises(InputError) as caught:
        rig(*views)
    assert caught.value.code == code


def test_names_are_words_and_stations_hold_views() -> None:
    with pytest.raises(InputError, match="camera 'le ft'"):
        replace(rig(), cameras={"le ft": CAMERAS["left"]})
    with pytest.raises(InputError, match="without views"):
        Station(())
    with pytest.raises(InputError, match="needs a camera"):
        replace(rig(), targets={})
