"""Pictures by rays: only the part around the board is worked on, and that changes nothing."""

import numpy as np
import pytest

from handeye.cameras import Appearance, BoardRenderer
from handeye.types import Camera, Chessboard, CircleGrid, Pose, Target

CAMERA = Camera("brown_conrady_5", [280, 280, 128, 102, -0.1, 0.05, 5e-4, -5e-4, 0.0], 256, 205)
POSES = {
    "whole": Pose.exp([-0.07, -0.05, 0.5, 0.3, -0.2, 0.4]),
    "cut off": Pose.exp([0.1, 0.05, 0.4, 0.4, 0.3, 0.5]),
    "beside the picture": Pose.exp([0.9, 0.0, 0.4, 0.0, 0.0, 0.0]),
    "partly behind the camera": Pose.exp([0.0, 0.0, 0.02, 1.0, 0.9, 0.0]),
    "behind the camera": Pose.exp([0.0, 0.0, -0.4, 0.0, 0.0, 0.0]),
}


@pytest.mark.parametrize("target", [Chessboard(5, 7, 0.02), CircleGrid(4, 4, 0.03, 0.02)])
@pytest.mark.parametrize("name", POSES)
def test_the_region_of_the_board_is_enough(
    target: Target, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    renderer = BoardRenderer(CAMERA, target, Appearance(blur_px=0.6, noise=2.0))
    picture = renderer.image(POSES[name], np.random.default_rng(1))
    _, columns = renderer._region(POSES[name])
    assert name != "whole" or (columns.stop - columns.start) < 200
    monkeypatch.setattr(BoardRenderer, "_region", lambda *_: (slice(0, 205), slice(0, 256)))
    assert np.array_equal(picture, renderer.image(POSES[name], np.random.default_rng(1)))
