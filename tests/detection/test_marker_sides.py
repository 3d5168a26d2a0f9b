"""Corners of few markers: where their sides meet, whatever lies upon a corner or beside it."""

from typing import Any

import cv2
import numpy as np
import pytest

from handeye.cameras.render import Appearance, render
from handeye.detection import Detection, NotFound, detect
from handeye.detection.corner_fit import curvatures
from handeye.detection.marker_sides import side_meetings
from handeye.types import ArucoMarker, Camera, Pose

CAMERA = Camera("brown_conrady_5", [700, 698, 322, 238, -0.2, 0.1, 5e-4, -4e-4, 0.0], 640, 480)
MARKER = ArucoMarker(0.1, "DICT_5X5_100", 17)


def picture(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A marker that takes much of the picture, and where (4, 2) its corners are."""
    random = np.random.default_rng([41, seed])
    tilt = random.uniform(-1, 1, 3) * [0.5, 0.5, np.pi]
    matrix = Pose.exp(np.concatenate([np.zeros(3), tilt])).matrix.copy()
    matrix[:3, 3] = [*random.uniform(-0.02, 0.02, 2), random.uniform(0.3, 0.4)]
    matrix[:3, 3] -= matrix[:3, :3] @ MARKER.points.mean(axis=0)
    look = Appearance(margin_m=0.05, blur_px=0.8, noise=2.0)
    image = render(CAMERA, MARKER, Pose(matrix), look, random=random)
    return image, CAMERA.project(Pose(matrix).act(MARKER.points))[0]


@pytest.mark.parametrize("seed", range(12))
def test_a_corner_that_something_covers_is_where_the_sides_meet(seed: int) -> None:
    """Something round on one corner, and something straight beside another."""
    image, truth = picture(seed)
    random = np.random.default_rng([42, seed])
    at, grey = np.rint(truth[seed % 4] + random.uniform(-4, 4, 2)).astype(int), int(random.integers(256))
    cv2.circle(image, (int(at[0]), int(at[1])), int(random.integers(4, 14)), grey, -1, cv2.LINE_AA)
    outwards = truth[(seed + 1) % 4] - truth.mean(axis=0)
    middle = truth[(seed + 1) % 4] + 14 * outwards / np.linalg.norm(outwards)
    box = (middle.tolist(), (9.0, 9.0), float(random.uniform(0, 90)))
    cv2.fillConvexPoly(image, np.rint(cv2.boxPoints(box)).astype(np.int32), 255 - grey)
    found = detect(image, MARKER)
    assert isinstance(found, Detection)
    away = np.linalg.norm(found.pixels - truth[found.point_ids], axis=1)
    assert len(found) == 4
    assert away.max() < 0.6


@pytest.mark.parametrize("seed", range(8))
def test_a_marker_half_of_whose_sides_are_hidden_is_not_found(seed: int) -> None:
    """Where the sides are not seen there is no saying where they meet."""
    image, truth = picture(seed)
    a, b, c = (truth[(seed + k) % 4] for k in range(3))
    hidden = np.array([a, (a + b) / 2, (c + a) / 2 + 0.2 * (b - a), truth[(seed + 3) % 4]])
    cv2.fillConvexPoly(image, np.rint(hidden).astype(np.int32), 230)
    found = detect(image, MARKER)
    if isinstance(found, Detection):
        assert np.linalg.norm(found.pixels - truth[found.point_ids], axis=1).max() < 1.0
    else:
        assert isinstance(found, NotFound)


def test_sides_are_followed_where_the_lens_bends_them() -> None:
    """They are off the straight lines by several pixels."""
    image, truth = picture(3)
    off = np.array([[1.5, -1], [-1, 1], [0.5, 1], [-1, -0.5]])
    meetings = side_meetings(image, (truth + off)[np.newaxis], 20.0)
    assert np.linalg.norm(meetings.places[0] - truth, axis=1).max() < 0.15
    assert (meetings.sigmas_px < 0.2).all()


def test_a_marker_that_is_none_has_no_sides() -> None:
    """In noise alone nothing meets."""
    noise = np.random.default_rng(5).integers(0, 256, (200, 200)).astype(np.uint8)
    quad = np.array([[[50.0, 50], [150, 52], [148, 150], [49, 148]]])
    assert np.isnan(side_meetings(noise, quad, 10.0).places).all()


class Parabolic:
    """A map in which lines along x are parabolas, and lines along y are straight."""

    def pixels(self, plane: np.ndarray) -> np.ndarray:
        """Places in px, 100 of them to the metre."""
        x, y = 100 * plane.T
        return np.column_stack([x, y + 0.5 * 0.01 * x**2])


def test_curvatures_are_those_of_the_lines() -> None:
    """Towards the normal (-sin, cos), as the fit of a corner takes them."""
    lens: Any = Parabolic()
    found = curvatures(lens, np.array([[0.0, 0.0], [1.0, 0.5]]), 0.01)
    np.testing.assert_allclose(found[0], [0.01, 0.0], atol=1e-9)
    np.testing.assert_allclose(found[1], [0.01 / 2**1.5, 0.0], atol=1e-6)
    np.testing.assert_array_equal(curvatures(None, np.zeros((3, 2)), 0.01), np.zeros((3, 2)))
