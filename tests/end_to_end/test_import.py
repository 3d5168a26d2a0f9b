"""`handeye import` gives a recording that solves to the same answer as the folder it came from."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from commands import Handeye
from folders import made_recording, photographed, written

PATTERN = ("--rows", "5", "--columns", "7")


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder, _ = photographed(tmp_path_factory.mktemp("pictures") / "set", 5)
    assert cv2.imwrite(str(folder / "im_04.png"), np.full((480, 640), 128, np.uint8))
    return folder


def test_pictures(handeye: Handeye, pictures: Path, tmp_path: Path) -> None:
    data = handeye.json("import", pictures, tmp_path / "new", *PATTERN)
    assert data["views"]["imported"] == ["im_01", "im_02", "im_03", "im_05"]
    assert [view["name"] for view in data["views"]["rejected"]] == ["im_04"]
    assert (data["layout"], data["camera_origin"]) == ("rwhe-calib", "calibrated")
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["corners", "recording.toml"]

    there = handeye.json("solve", tmp_path / "new")
    here = handeye.json("solve", pictures, *PATTERN)
    np.testing.assert_allclose(there["T_flange_camera"], here["T_flange_camera"], atol=1e-9)
    assert [view["name"] for view in here["views"]["rejected"]] == ["im_04"]
    assert there["camera_origin"] == "files"


def test_images_are_copied_when_asked(handeye: Handeye, pictures: Path, tmp_path: Path) -> None:
    outcome = handeye("import", pictures, tmp_path / "new", *PATTERN, "--images")
    assert outcome.code == 0
    names = sorted(path.name for path in (tmp_path / "new" / "images").iterdir())
    assert names == ["im_01.png", "im_02.png", "im_03.png", "im_05.png"]
    assert "im_04: " in outcome.out
    assert "Looking for the target in the images (5)" in outcome.err


def test_recording_with_another_camera(handeye: Handeye, tmp_path: Path) -> None:
    folder = written(made_recording(4), tmp_path / "made")
    camera = tmp_path / "camera.toml"
    camera.write_text(
        'lens = "pinhole"\nparameters = [1400.0, 1400.0, 640.0, 512.0]\nwidth_px = 1280\nheight_px = 1024\n'
    )
    data = handeye.json("import", folder, tmp_path / "new", "--camera", camera)
    assert data["camera"]["lens"] == "pinhole"
    # No distortion is no measured distortion: the lens is found, unless it is held.
    assert handeye.json("solve", tmp_path / "new")["camera"]["lens"] == "brown_conrady_5"
    held = handeye.json("solve", tmp_path / "new", "--camera-fixed")["camera"]
    assert (held["lens"], held["parameters"]) == ("pinhole", [1400.0, 1400.0, 640.0, 512.0])
