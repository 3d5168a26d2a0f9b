"""The noise of a picture: how strong it is, and a calmer picture for the search."""

import numpy as np
import pytest

from handeye.detection import Detection, NotFound, detect
from handeye.detection.noise import STRONG, calmed, pixel_noise
from scenes import TARGETS, TILTED, scene


@pytest.mark.parametrize("sigma", [1.0, 6.0, 12.0])
def test_noise_is_told_from_what_is_shown(sigma: float) -> None:
    image = scene(TARGETS["charuco"], turn=TILTED, share=0.5).picture(noise=sigma, blur_px=1.0)
    # Texture adds a little.
    assert sigma - 0.2 <= pixel_noise(image) <= sigma + 1.5


def test_only_strong_noise_is_smoothed() -> None:
    board = scene(TARGETS["charuco"], turn=TILTED, share=0.5)
    quiet, loud = board.picture(noise=0.5 * STRONG), board.picture(noise=3 * STRONG)
    assert calmed(quiet) is quiet
    assert pixel_noise(calmed(loud)) < STRONG


@pytest.mark.parametrize("name", ["charuco", "april grid", "circles"])
def test_boards_are_found_in_strong_noise(name: str) -> None:
    board = scene(TARGETS[name], turn=(0.2, -0.1, 0.1), share=0.7)
    found = detect(board.picture(noise=14.0, blur_px=0.7), board.target)
    assert isinstance(found, Detection), found
    assert np.median(np.linalg.norm(found.pixels - board.pixels[found.point_ids], axis=1)) < 0.5


@pytest.mark.parametrize("name", ["circles", "charuco", "april grid"])
def test_noise_alone_shows_no_board(name: str) -> None:
    random = np.random.default_rng(2)
    image = random.normal(120, 14, (400, 500)).clip(0, 255).astype(np.uint8)
    assert isinstance(detect(image, TARGETS[name]), NotFound)
