"""Stated deviations of points: how they follow from how the points lie on the board."""

import cv2
import numpy as np
import pytest

from handeye.detection import Detection, detect
from handeye.detection.bent_board import BentBoard
from handeye.detection.quality import stated
from handeye.types import ArucoGrid, ArucoMarker, Chessboard, CircleGrid, Target
from scenes import CAMERAS, HEIGHT_PX, TARGETS, WIDTH_PX, scene

SIZE_PX = (WIDTH_PX, HEIGHT_PX)
NO_IMAGE = np.zeros((HEIGHT_PX, WIDTH_PX), dtype=np.uint8)
FEW: dict[str, Target] = {"corners": Chessboard(3, 4, 0.03), "few circles": CircleGrid(4, 3, 0.03, 0.015)}


@pytest.mark.parametrize("lens", ["pinhole", "brown_conrady_4", "brown_conrady_5"])
@pytest.mark.parametrize("name", [*FEW, "chessboard", "marked circles"])
def test_views_bend_a_board_as_lenses_do(name: str, lens: str) -> None:
    board = scene((TARGETS | FEW)[name], CAMERAS[lens], share=0.5)
    plane, radii = board.target.points[:, :2], board.target.radii_m
    bent = BentBoard.of(plane, radii, board.pixels, SIZE_PX)
    assert bent is not None
    assert bent.freedom > 0
    assert np.abs(bent.left(bent.off)).max() < 0.004


@pytest.mark.parametrize("name", ["corners", "chessboard", "aruco grid"])
def test_deviations_fit_how_points_scatter(name: str) -> None:
    board = scene((TARGETS | FEW)[name], CAMERAS["brown_conrady_4"], share=0.5)
    random = np.random.default_rng(8)
    ids, ratios = np.arange(board.target.point_count), list[float]()
    sigmas = random.uniform(0.01, 0.04, len(ids))
    for _ in range(200):
        off = sigmas[:, np.newaxis] * random.normal(size=(len(ids), 2))
        # What the points' own pictures tell is three times too much.
        found = stated(NO_IMAGE, board.target, ids, board.pixels + off, 3 * sigmas)
        assert found.sigmas_px is not None
        off = found.pixels - board.pixels[found.point_ids]
        ratios.extend(((off / found.sigmas_px[:, np.newaxis]) ** 2).ravel())
    assert 0.8 < np.mean(ratios) < 1.15


@pytest.mark.parametrize("which", [0, 53])
def test_a_corner_astray_at_the_rim_is_told_from_the_others(which: int) -> None:
    board = scene(TARGETS["chessboard"], CAMERAS["brown_conrady_4"], share=0.5)
    ids = np.arange(board.target.point_count)
    pixels = board.pixels + 0.005 * np.random.default_rng(2).normal(size=(len(ids), 2))
    pixels[which] += 0.15
    found = stated(NO_IMAGE, board.target, ids, pixels, np.full(len(ids), 0.01))
    assert found.sigmas_px is not None
    off = np.linalg.norm(found.pixels - board.pixels[found.point_ids], axis=1)
    astray = int(np.argmax(off))
    assert 0.08 < found.sigmas_px[astray] < 0.25
    assert np.delete(found.sigmas_px, astray).max() < 0.007


@pytest.mark.parametrize("gamma", [0.45, 1.0, 2.2])
@pytest.mark.parametrize(
    "target", [ArucoMarker(0.1, "DICT_5X5_100", 3), ArucoGrid(1, 2, 0.04, 0.008, "DICT_5X5_250")]
)
def test_bits_tell_how_far_the_edges_of_few_markers_have_moved(target: Target, gamma: float) -> None:
    board = scene(target, turn=(0.2, -0.2, 0.1), share=0.6)
    light = cv2.GaussianBlur(board.picture().astype(np.float64), (0, 0), 0.7)
    grey = 255 * (light / 255) ** gamma + np.random.default_rng(1).normal(size=light.shape)
    found = detect(np.rint(grey.clip(0, 255)).astype(np.uint8), target)
    assert isinstance(found, Detection), found
    assert found.sigmas_px is not None
    # Edges have moved by a quarter and a third of a pixel.
    assert board.errors_px(found).max() < 0.12
    assert found.sigmas_px.max() < 0.06
