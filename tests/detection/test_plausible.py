"""Points that no view of a flat board shows are refused, whatever found them."""

import numpy as np
import pytest

from handeye.detection import Detection, NotFound
from handeye.detection.plausible import implausible
from scenes import CAMERAS, TARGETS, TILTED, scene

FAMILIES = ("chessboard", "asymmetric circles", "charuco", "april grid", "marker")


@pytest.mark.parametrize("lens", list(CAMERAS))
@pytest.mark.parametrize("name", FAMILIES)
def test_views_of_a_board_are_plausible(name: str, lens: str) -> None:
    random = np.random.default_rng(3)
    for _ in range(10):
        turn = random.uniform(-1, 1, 3) * [0.8, 0.8, 0.8]
        board = scene(TARGETS[name], turn=tuple(turn.tolist()), share=0.4, camera=CAMERAS[lens])
        noisy = board.pixels + random.normal(scale=0.3, size=board.pixels.shape)
        ids = np.flatnonzero(np.isfinite(noisy[:, 0]))
        for some in (ids, random.permutation(ids)[: max(4, len(ids) // 3)]):
            assert implausible(board.target, Detection(some, noisy[some])) is None


@pytest.mark.parametrize("name", FAMILIES)
def test_a_board_that_is_folded_over_is_refused(name: str) -> None:
    board = scene(TARGETS[name], turn=TILTED, share=0.5)
    plane = board.target.points[:, :2]
    middle = plane.mean(axis=0)
    size = float(np.ptp(plane, axis=0).max())
    random = np.random.default_rng(4)
    for _ in range(20):
        # The line of the horizon runs through the board.
        angle, at = random.uniform(0, 2 * np.pi), random.uniform(-0.2, 0.2) * size
        depth = (plane - middle) @ [np.cos(angle), np.sin(angle)] - at + 1e-4 * size
        pixels = 200 + 20 * (plane - middle) / depth[:, np.newaxis]
        refused = implausible(board.target, Detection(np.arange(len(plane)), pixels))
        assert isinstance(refused, NotFound)
        assert refused.reason == "inconsistent"


def test_points_that_are_not_flat_are_refused() -> None:
    board = scene(TARGETS["charuco"], turn=TILTED, share=0.5)
    random = np.random.default_rng(5)
    for _ in range(20):
        which = random.permutation(board.target.point_count)[:8]
        # Two of eight corners bear each other's names.
        pixels = board.pixels[which]
        pixels[[0, 1]] = pixels[[1, 0]]
        assert implausible(board.target, Detection(which, pixels)) is not None
