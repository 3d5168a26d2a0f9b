"""Cameras calibrated from detections: the lens that made them comes back, or an error says why not."""

import numpy as np
import pytest

from handeye.detection import CameraCalibration, Detection, calibrate_camera
from handeye.errors import DegenerateError, HandeyeError, InputError
from handeye.types import Camera, Chessboard, CircleGrid, Target
from scenes import CAMERAS, PINHOLE, TARGETS, scene

SIGMA_PX = 0.03
TURNS = [
    (0.5, 0.1, 0.0), (-0.5, 0.2, 0.3), (0.1, 0.5, -0.2), (0.1, -0.5, 0.4), (0.4, 0.4, 1.0), (-0.4, 0.4, -1.0),
    (-0.3, -0.5, 0.7), (0.5, -0.3, 2.0), (0.0, 0.1, 0.1), (0.3, -0.1, -2.0),
]  # fmt: skip


def detections(
    target: Target, camera: Camera, views: int = 10, *, sigma_px: float = SIGMA_PX
) -> dict[str, Detection]:
    """Points of views tilted in all directions, near the middle and the edges of the image."""
    random = np.random.default_rng(3)
    found: dict[str, Detection] = {}
    for index, turn in enumerate(TURNS[:views]):
        at = (0.5 * np.cos(2.4 * index), 0.4 * np.sin(2.4 * index))
        pixels = scene(target, camera, turn, share=0.55, at=at).pixels
        ids = np.flatnonzero(np.isfinite(pixels[:, 0]))
        found[f"im_{index:02d}"] = Detection(ids, pixels[ids] + sigma_px * random.normal(size=(len(ids), 2)))
    return found


def calibrated(lens: str, asked: str | None = None, target: Target | None = None) -> CameraCalibration:
    board = target or TARGETS["chessboard"]
    camera = CAMERAS[lens]
    return calibrate_camera(board, detections(board, camera), camera.size_px, lens=asked)


def test_a_pinhole_is_a_pinhole() -> None:
    assert calibrated("pinhole").camera.lens == "pinhole"


@pytest.mark.parametrize("lens", ["brown_conrady_4", "brown_conrady_5"])
def test_distortion_is_seen(lens: str) -> None:
    camera = calibrated(lens).camera
    assert camera.lens in {"brown_conrady_4", "brown_conrady_5"}
    np.testing.assert_allclose(camera.parameters[:4], CAMERAS[lens].parameters[:4], atol=2.0)


@pytest.mark.parametrize("lens", CAMERAS)
def test_a_lens_that_is_asked_for_comes_back(lens: str) -> None:
    fit = calibrated(lens, lens)
    truth = CAMERAS[lens]
    assert fit.camera.lens == lens
    assert fit.camera.size_px == truth.size_px
    assert fit.rmse_px == pytest.approx(SIGMA_PX * np.sqrt(2), rel=0.1)
    assert fit.sigma_px == pytest.approx(SIGMA_PX, rel=0.1)
    rays, _ = truth.unproject(np.array([[100.0, 100.0], [258.0, 210.0], [420.0, 300.0]]))
    seen, _ = fit.camera.project(rays)
    np.testing.assert_allclose(seen, [[100.0, 100.0], [258.0, 210.0], [420.0, 300.0]], atol=2.5)


def test_the_covariance_covers_the_error() -> None:
    fit = calibrated("brown_conrady_4", "brown_conrady_4")
    assert fit.camera.covariance is not None
    error = fit.camera.parameters - CAMERAS["brown_conrady_4"].parameters
    squared = float(error @ np.linalg.solve(fit.camera.covariance, error))
    assert 0.5 < squared < 25  # chi square with 8 degrees of freedom


def test_without_noise_poses_and_parameters_are_exact() -> None:
    board = TARGETS["circles"]
    found = detections(board, PINHOLE, sigma_px=0.0)
    fit = calibrate_camera(board, found, PINHOLE.size_px, lens="pinhole")
    np.testing.assert_allclose(fit.camera.parameters, PINHOLE.parameters, atol=1e-5)
    assert set(fit.poses) == set(found) == set(fit.view_rmse_px)
    assert not fit.rejected


def test_circles_are_seen_at_their_centroids() -> None:
    board = CircleGrid(6, 8, 0.03, 0.028)
    found = detections(board, PINHOLE, sigma_px=0.0)
    assert calibrate_camera(board, found, PINHOLE.size_px, lens="pinhole").rmse_px < 1e-6
    centres = {
        name: Detection(view.point_ids, scene(Chessboard(6, 8, 0.03), turn=turn).pixels)
        for (name, view), turn in zip(found.items(), TURNS, strict=True)
    }
    # The images of the centres, where centroids are expected, are found out.
    assert calibrate_camera(board, centres, PINHOLE.size_px, lens="pinhole").rmse_px > 1e-3


@pytest.mark.parametrize("views", [0, 1, 2])
def test_too_few_views(views: int) -> None:
    board = TARGETS["chessboard"]
    with pytest.raises(InputError, match=f"{views} views") as caught:
        calibrate_camera(board, detections(board, PINHOLE, views), PINHOLE.size_px)
    assert caught.value.code == "too_few_views"


def test_views_with_few_points_do_not_count() -> None:
    board = TARGETS["charuco"]
    found = detections(board, PINHOLE, 4)
    found["poor"] = Detection([0, 1, 2], found["im_00"].pixels[:3])
    assert set(calibrate_camera(board, found, PINHOLE.size_px).rejected) == {"poor"}
    poor = {name: Detection([0, 1, 2], view.pixels[:3]) for name, view in found.items()}
    with pytest.raises(InputError, match="0 views"):
        calibrate_camera(board, poor, PINHOLE.size_px)


def test_views_that_all_face_the_board_do_not_determine_a_camera() -> None:
    board = TARGETS["chessboard"]
    random = np.random.default_rng(8)
    found: dict[str, Detection] = {}
    for index in range(6):
        pixels = scene(board, PINHOLE, (0.0, 0.0, 0.5 * index), share=0.4 + 0.05 * index).pixels
        found[str(index)] = Detection(
            np.arange(len(pixels)), pixels + 0.05 * random.normal(size=pixels.shape)
        )
    with pytest.raises(HandeyeError) as caught:
        calibrate_camera(board, found, PINHOLE.size_px)
    assert caught.value.code == "camera_not_determined"
    assert isinstance(caught.value, DegenerateError)
    assert caught.value.hint


def test_unknown_lens() -> None:
    with pytest.raises(InputError, match="fish") as caught:
        calibrate_camera(TARGETS["chessboard"], {}, PINHOLE.size_px, lens="fish")
    assert caught.value.code == "unknown_lens"
    assert "pinhole" in caught.value.message


def test_a_wrong_board_does_not_fit() -> None:
    found = detections(Chessboard(6, 9, 0.03), PINHOLE)
    # The same points as a board of 9 columns would have them with 6: a scrambled grid.
    try:
        fit = calibrate_camera(Chessboard(9, 6, 0.03), found, PINHOLE.size_px)
    except HandeyeError:
        return
    assert fit.rmse_px > 5


def test_a_lens_is_an_ordinary_one_until_views_say_otherwise() -> None:
    """A few small boards in the middle say nothing of the edge: coefficients must not run off to fit noise."""
    random, found = np.random.default_rng(5), dict[str, Detection]()
    board, camera = TARGETS["chessboard"], CAMERAS["brown_conrady_5"]
    for index, turn in enumerate(TURNS[:4]):
        pixels = scene(board, camera, turn, share=0.3).pixels
        found[f"im_{index}"] = Detection(
            np.arange(len(pixels)), pixels + 0.2 * random.normal(size=pixels.shape)
        )
    believed, free = (
        calibrate_camera(board, found, camera.size_px, lens="brown_conrady_5", ordinary=ordinary).camera
        for ordinary in (True, False)
    )
    assert np.abs(believed.distortion).max() < 0.4
    assert np.abs(free.distortion).max() > 1.0
