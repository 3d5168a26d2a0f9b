"""Edges of a few markers that have moved, as corners of their bits tell."""

import numpy as np
import pytest

from handeye.detection.edge_shift import Corners, outwards, sharpened
from scenes import HEIGHT_PX, WIDTH_PX

SHIFT_PX, SMALL_WINDOWS_PX = 0.3, 0.26
OWN = np.array([[-3.5, -3.5], [3.5, -3.5], [3.5, 3.5], [-3.5, 3.5]])
BITS = np.stack(np.meshgrid(*[np.arange(-2.0, 3.0)] * 2), axis=-1).reshape(-1, 2)
AXES = np.array([[40.0, 6.0], [-8.0, 36.0]])


def corners(plane: np.ndarray, signs: np.ndarray, shift: float, sigma: float, off: np.ndarray) -> Corners:
    """Corners whose edges lie outwards of what is dark, off by so many of their deviations."""
    inwards = np.where(plane > 0, -1.0, 1.0) * np.array([1.0, 1.0])
    sides = inwards[:, :, np.newaxis] * AXES / np.linalg.norm(AXES, axis=1)[:, np.newaxis]
    pixels = plane @ AXES + [WIDTH_PX / 2, HEIGHT_PX / 2] + sigma * off
    moves = outwards(sides, np.ones((len(plane), 2, 1)))[0]
    return Corners(
        plane * 0.01, pixels + shift * signs[:, np.newaxis] * moves, sides, signs, np.full(len(plane), sigma)
    )


@pytest.mark.parametrize("worse", [1.0, 2.0])
def test_corners_scatter_as_stated_once_their_edges_are_put_right(worse: float) -> None:
    random = np.random.default_rng(6)
    signs = np.where(np.arange(len(BITS) + 4) % 3 > 0, 1.0, -1.0)
    signs[-4:] = 1.0
    ratios: list[float] = []
    for _ in range(300):
        off = worse * random.normal(size=(len(BITS) + 8, 2))
        own = corners(OWN, np.ones(4), SHIFT_PX, 0.01, off[:4])
        bits = corners(np.concatenate([BITS, OWN]), signs, SMALL_WINDOWS_PX, 0.03, off[4:])
        found = sharpened(own, bits, (WIDTH_PX, HEIGHT_PX))
        assert not found.shared_px.any()
        assert found.open_px.max() < 0.06
        truth = OWN @ AXES + [WIDTH_PX / 2, HEIGHT_PX / 2]
        ratios.extend((((found.pixels - truth) / found.sigmas_px[:, np.newaxis]) ** 2).ravel())
    # Bits that scatter less than their pictures tell leave the markers' corners as they are.
    assert 0.8 < np.mean(ratios) < 1.15


def test_without_bits_the_usual_shift_is_left_open() -> None:
    own = corners(OWN, np.ones(4), SHIFT_PX, 0.01, np.zeros((4, 2)))
    found = sharpened(own, None, (WIDTH_PX, HEIGHT_PX))
    assert np.array_equal(found.pixels, own.pixels)
    assert found.shared_px.min() > 0.15
