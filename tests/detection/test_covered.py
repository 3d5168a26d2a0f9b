"""Things in front of a board: what they cover is left out, and no point is put beside its place."""

import cv2
import numpy as np
import pytest

from handeye.detection import Detection, NotFound, detect
from scenes import TARGETS, scene


def covered(image: np.ndarray, at: np.ndarray, size: tuple[float, float], grey: float) -> np.ndarray:
    """A picture with an ellipse over a place."""
    box = ((float(at[0]), float(at[1])), size, 30.0)
    return cv2.ellipse(image.copy(), box, grey, -1, cv2.LINE_AA)


@pytest.mark.parametrize("name", ["circles", "asymmetric circles", "marked circles"])
def test_a_circle_that_is_covered_in_part_is_left_out(name: str) -> None:
    board = scene(TARGETS[name], turn=(0.2, -0.2, 0.1), share=0.7)
    image, random = board.picture(), np.random.default_rng(6)
    left_out = 0
    for _ in range(12):
        which = int(random.integers(board.target.point_count))
        beside = board.pixels[which] + random.uniform(-9, 9, 2)
        found = detect(covered(image, beside, (22, 14), float(random.choice([0, 120, 255]))), board.target)
        if isinstance(found, NotFound):
            continue
        away = min(
            np.linalg.norm(found.pixels - board.pixels[p[found.point_ids]], axis=1).max()
            for p in board.target.symmetries
        )
        assert away < 1.0
        left_out += board.target.point_count - len(found)
    assert left_out > 0


def test_a_single_marker_with_a_covered_corner_is_not_found_elsewhere() -> None:
    board = scene(TARGETS["marker"], turn=(0.2, -0.2, 0.1), share=0.4)
    image, random = board.picture(), np.random.default_rng(7)
    whole = detect(image, board.target)
    assert isinstance(whole, Detection)
    for _ in range(12):
        at = board.pixels[int(random.integers(4))] + random.uniform(-6, 6, 2)
        size = tuple(random.uniform(14, 40, 2).tolist())
        found = detect(covered(image, at, size, float(random.choice([0, 128, 255]))), board.target)
        if isinstance(found, Detection):
            assert np.linalg.norm(found.pixels - board.pixels[found.point_ids], axis=1).max() < 3.0
