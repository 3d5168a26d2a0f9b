"""Cameras: what exists is valid, and projection is OpenCV's."""

import math
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given

from handeye.errors import InputError
from handeye.types import Camera
from strategies import cameras, plain_values

K = np.array([[1000.0, 0, 640], [0, 1010, 480], [0, 0, 1]])
COEFFICIENTS = [0.1, -0.05, 1e-3, -2e-3, 0.01, 0.02, -0.01, 0.005, 1e-3, -1e-3, 2e-3, 1e-4]
POINTS = np.random.default_rng(3).uniform([-0.3, -0.2, 0.8], [0.3, 0.2, 2.0], (50, 3))


def test_the_division_model_is_that_of_its_paper() -> None:
    """Fitzgibbon 2001, eq. 3, from the pixel back: `r = r' / (1 + k1 r'^2)`."""
    for k1 in (-0.3, 0.0, 0.2):
        camera = Camera("division", [1000, 1010, 640, 480, k1], 1280, 960)
        uv, seen = camera.project(POINTS)
        assert seen.all()
        after = (uv - [640, 480]) / [1000, 1010]
        before = after / (1 + k1 * (after**2).sum(axis=1, keepdims=True))
        np.testing.assert_allclose(before, POINTS[:, :2] / POINTS[:, 2:], atol=1e-12)


@pytest.mark.parametrize("count", [0, 4, 5, 8, 12])
def test_projection_is_that_of_opencv(count: int) -> None:
    camera = Camera.from_opencv(K, COEFFICIENTS[:count], (1280, 960))
    uv, valid = camera.project(POINTS)
    expected, _ = cv2.projectPoints(POINTS, np.zeros(3), np.zeros(3), K, np.array(COEFFICIENTS[:count]))
    assert valid.all()
    np.testing.assert_allclose(uv, expected[:, 0], atol=1e-8)
    np.testing.assert_array_equal(camera.matrix, K)
    np.testing.assert_array_equal(camera.distortion, COEFFICIENTS[:count])


def test_fisheye_is_that_of_opencv() -> None:
    coefficients = np.array([0.01, -0.02, 0.003, -0.001])
    camera = Camera.from_opencv(K, coefficients, (1280, 960), fisheye=True)
    expected, _ = cv2.fisheye.projectPoints(POINTS[:, None], np.zeros(3), np.zeros(3), K, coefficients)
    np.testing.assert_allclose(camera.project(POINTS)[0], expected[:, 0], atol=1e-8)


@given(cameras())
def test_unproject_undoes_project(camera: Camera) -> None:
    uv, seen = camera.project(POINTS)
    rays, valid = camera.unproject(uv)
    assert seen.all()
    assert valid.all()
    np.testing.assert_allclose(rays, POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True), atol=1e-9)


def test_points_behind_the_camera_are_marked() -> None:
    uv, valid = Camera.from_opencv(K, None, (1280, 960)).project([[0, 0, 1], [0, 0, -1]])
    assert valid.tolist() == [True, False]
    assert np.isnan(uv[1]).all()


@given(cameras())
def test_dict_reads_back(camera: Camera) -> None:
    twin = Camera.from_dict(camera.to_dict())
    assert twin == camera
    assert hash(twin) == hash(camera)


def test_covariance_reads_back() -> None:
    covariance = np.diag([1.0, 1.0, 2.0, 2.0, 1e-8, 1e-6, 1e-10, 1e-10, 1e-4])
    camera = Camera("brown_conrady_5", [1000, 1000, 640, 480, *COEFFICIENTS[:5]], 1280, 960, covariance)
    twin = Camera.from_dict(camera.to_dict())
    assert twin == camera
    assert twin != Camera("brown_conrady_5", camera.parameters, 1280, 960)
    assert twin.covariance is not None
    np.testing.assert_array_equal(twin.covariance, covariance)


def test_fourteen_coefficients_without_tilt_are_twelve() -> None:
    assert Camera.from_opencv(K, [*COEFFICIENTS, 0, 0], (1280, 960)).lens == "brown_conrady_12"


@pytest.mark.parametrize(
    "changes",
    [
        {"lens": "fish"},
        {"parameters": [1000, 1000, 640]},
        {"parameters": [1000, 1000, 640, 480, 0.1]},
        {"parameters": [-1000, 1000, 640, 480]},
        {"parameters": [1000, 0, 640, 480]},
        {"parameters": [1000, math.nan, 640, 480]},
        {"parameters": [1e300, 1000, 640, 480]},
        {"width_px": 0},
        {"width_px": 640.5},
        {"height_px": 10**9},
        {"covariance": np.eye(3)},
        {"covariance": -np.eye(4)},
        {"covariance": np.eye(4) + np.eye(4, k=1)},
        {"covariance": np.eye(4) + 2 * (np.eye(4, k=1) + np.eye(4, k=-1))},
    ],
)
def test_what_is_no_camera_is_refused(changes: dict[str, Any]) -> None:
    good = {"lens": "pinhole", "parameters": [1000, 1000, 640, 480], "width_px": 1280, "height_px": 960}
    Camera(**good)
    with pytest.raises(InputError):
        Camera(**{**good, **changes})


@pytest.mark.parametrize(
    ("matrix", "coefficients", "fisheye"),
    [
        (K + 0.5 * np.eye(3, k=1), None, False),
        (K * 2, None, False),
        (K, [0.1] * 3, False),
        (K, [0.1] * 14, False),
        (K, [0.1] * 5, True),
        (K, [math.nan] * 5, False),
    ],
)
def test_what_opencv_would_not_give_is_refused(matrix: Any, coefficients: Any, fisheye: bool) -> None:
    with pytest.raises(InputError):
        Camera.from_opencv(matrix, coefficients, (1280, 960), fisheye=fisheye)


@given(plain_values())
def test_hostile_values_raise_only_our_error(value: object) -> None:
    with pytest.raises(InputError):
        Camera.from_dict(value)
    good = Camera.from_opencv(K, None, (1280, 960)).to_dict()
    for field in good:
        try:
            Camera.from_dict({**good, field: value})
        except InputError:
            continue
