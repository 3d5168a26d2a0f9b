"""Public recordings: the target is found, the same with a prediction, and one camera explains all views."""

from pathlib import Path

import numpy as np
import pytest

from handeye.datasets import ImageSet, load
from handeye.detection import Detection, Prediction, calibrate_camera, detect

# Every so many views; `tools/measure_detection.py public` looks at all.
STEP = 9
SETS = {"CS_synthetic_1": 15, "CS_synthetic_2": 19, "CS_synthetic_3": 30, "kuka_1": 30, "kuka_2": 28}
# Largest difference made by the prediction.
SAME_PX = 0.01


def check(folder: Path, views: int, fewest: float, error_px: float) -> None:
    images = load(folder)
    assert isinstance(images, ImageSet)
    assert len(images.shots) == views
    count = images.target.point_count
    found: dict[str, Detection] = {}
    size = (0, 0)
    for shot in images.shots[::STEP]:
        image = images.grey(shot)
        size = (image.shape[1], image.shape[0])
        whole = detect(image, images.target)
        assert isinstance(whole, Detection), (shot.name, whole)
        assert len(whole) >= fewest * count
        pixels = np.full((count, 2), np.nan)
        pixels[whole.point_ids] = whole.pixels
        part = detect(image, images.target, predicted=Prediction(pixels + np.array([6.0, -5.0]), 15.0))
        assert isinstance(part, Detection), (shot.name, part)
        np.testing.assert_array_equal(part.point_ids, whole.point_ids)
        assert np.abs(part.pixels - whole.pixels).max() < SAME_PX
        found[shot.name] = whole
    if len(found) >= 4:
        lens = "brown_conrady_5" if "kuka" in folder.name else "pinhole"
        assert calibrate_camera(images.target, found, size, lens=lens).rmse_px < error_px


@pytest.mark.parametrize("name", SETS)
def test_chessboards_are_found(rwhe_calib: Path, name: str) -> None:
    check(rwhe_calib / name, SETS[name], 1.0, 0.1 if "kuka" in name else 0.02)


def test_circle_grids_are_found(circle_grid_10x10: Path) -> None:
    check(circle_grid_10x10, 15, 0.99, 1.0)
