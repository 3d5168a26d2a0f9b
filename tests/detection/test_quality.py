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
    # Of circles the lens moves the centroids of their areas, not the images of their centres.
    assert np.abs(bent.left(bent.off)).max() < (0.0002 if name in FEW else 0.004)


# What the points' own pictures tell is some times too much; few points leave it at that for the most part.
@pytest.mark.parametrize(("name", "times"), [("corners", 1.0), ("chessboard", 3.0), ("aruco grid", 3.0)])
def test_deviations_fit_how_points_scatter(name: str, times: float) -> None:
    board = scene((TARGETS | FEW)[name], CAMERAS["brown_conrady_4"], share=0.5)
    random = np.random.default_rng(8)
    ids, ratios = np.arange(board.target.point_count), list[float]()
    sigmas = random.uniform(0.01, 0.04, len(ids))
    for _ in range(200):
        off = sigmas[:, np.newaxis] * random.normal(size=(len(ids), 2))
        found = stated(NO_IMAGE, board.target, ids, board.pixels + off, times * sigmas)
        assert found.sigmas_px is not None
        off = found.pixels - board.pixels[found.point_ids]
        ratios.extend(((off / found.sigmas_px[:, np.newaxis]) ** 2).ravel())
    assert 0.8 < np.mean(ratios) < 1.1


@pytest.mark.parametrize("count", [5, 6, 8, 12])
def test_deviations_of_few_points_are_right_on_average(count: int) -> None:
    board = scene(FEW["corners"], share=0.5)
    random = np.random.default_rng(9)
    ratios: list[float] = []
    for _ in range(600):
        ids = np.sort(random.permutation(12)[:count])
        off = 0.02 * random.normal(size=(count, 2))
        found = stated(NO_IMAGE, board.target, ids, board.pixels[ids] + off, np.full(count, 0.02))
        assert found.sigmas_px is not None
        off = found.pixels - board.pixels[found.point_ids]
        ratios.extend(((off / found.sigmas_px[:, np.newaxis]) ** 2).ravel())
    assert 0.92 < np.mean(ratios) < 1.08


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


@pytest.mark.parametrize("gamma", [0.45, 2.2])
def test_small_windows_of_bits_do_not_tell_that_edges_have_moved_less(gamma: float) -> None:
    board = scene(ArucoGrid(1, 3, 0.03, 0.006, "DICT_5X5_100"), turn=(0.2, -0.2, 0.1), share=0.4)
    light = cv2.GaussianBlur(board.picture().astype(np.float64), (0, 0), 0.7)
    found = detect(np.rint(255 * (light / 255) ** gamma).astype(np.uint8), board.target)
    assert isinstance(found, Detection), found
    assert board.rms_px(found) < 0.02
