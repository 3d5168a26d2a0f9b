"""Warnings appear where something is wrong and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.layouts import some_recording
from handeye.datasets import recording_warnings
from handeye.types import AprilGrid, Camera, Chessboard, CircleGrid, Mounting, Pose, Recording, Target, View

CAMERA = Camera("pinhole", [1080, 1080, 959.5, 539.5], 1920, 1080)


def seen(
    target: Target, distance_m: float, flange_m: float, joints: tuple[float, ...] | None = None
) -> Recording:
    """A target seen squarely at a distance."""
    points = target.points - target.points.mean(axis=0) + np.array([0, 0, distance_m])
    pixels, valid = CAMERA.project(points)
    assert valid.all()
    pose = Pose.from_quaternion([flange_m, 0, 0], [0, 0, 0, 1])
    view = View("a", pose, np.arange(target.point_count), pixels, joints_rad=joints)
    return Recording("set", Mounting.EYE_IN_HAND, CAMERA, target, (view,))


def codes(recording: Recording) -> set[str]:
    return {warning.code for warning in recording_warnings(recording)}


@pytest.mark.parametrize(
    "recording",
    [
        seen(Chessboard(6, 9, 0.2), 7.5, 6.0),  # a large simulated cell
        seen(Chessboard(17, 28, 0.02), 1.2, 1.5),
        seen(AprilGrid(2, 2, 0.003, 0.3), 0.05, 0.3),  # under a microscope
        seen(CircleGrid(4, 4, 0.05, 0.02), 0.5, 0.6, (3.1, -6.2)),
        seen(Chessboard(3, 3, 0.3), 15.0, 12.0),  # a gantry
        some_recording(),
        some_recording(0),
    ],
)
def test_usual_set_ups_have_no_warning(recording: Recording) -> None:
    assert codes(recording) == set()


@pytest.mark.parametrize(
    ("recording", "expected"),
    [
        (seen(Chessboard(6, 9, 0.03), 0.5, 650.0), {"poses_not_metres"}),
        (seen(Chessboard(6, 9, 20.0), 700.0, 0.7), {"target_not_metres", "target_far"}),
        (seen(Chessboard(3, 4, 0.9), 100.0, 0.7), {"target_far"}),
        (seen(Chessboard(6, 9, 0.0001), 0.01, 0.7), {"target_not_metres"}),
        (seen(Chessboard(6, 9, 0.03), 0.5, 0.65, (90.0, -45.0)), {"joints_not_radians"}),
    ],
)
def test_what_is_hardly_meant(recording: Recording, expected: set[str]) -> None:
    assert codes(recording) == expected
    for warning in recording_warnings(recording):
        assert str(warning) == warning.message


@pytest.mark.parametrize(
    ("parameters", "code"),
    [
        ([4.0, 4.0, 959.5, 539.5], "camera_focal_length"),  # millimetres of the lens
        ([1e6, 1e6, 959.5, 539.5], "camera_focal_length"),
        ([1080, 1080, 2400, 539.5], "camera_centre"),
        ([1080, 1400, 959.5, 539.5], "camera_pixel_shape"),
    ],
)
def test_cameras_that_hardly_belong_to_the_images(parameters: list[float], code: str) -> None:
    recording = seen(Chessboard(6, 9, 0.03), 0.5, 0.65)
    assert code in codes(replace(recording, camera=Camera("pinhole", parameters, 1920, 1080)))
