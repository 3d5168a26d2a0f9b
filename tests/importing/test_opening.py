"""From a folder of pictures to a recording that can be solved."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from folders import PICTURE_CAMERA, made_recording, photographed, written
from handeye.errors import DetectionError, InputError
from handeye.estimation import solve
from handeye.importing import CameraOrigin, SourceOptions, open_folder
from handeye.types import Chessboard, Mounting, Pose

PATTERN = SourceOptions(pattern=(5, 7))


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Pose]:
    return photographed(tmp_path_factory.mktemp("pictures") / "set")


def test_pictures_become_a_recording(pictures: tuple[Path, Pose]) -> None:
    folder, X = pictures
    steps: list[tuple[int, int]] = []
    opened = open_folder(folder, PATTERN, progress=lambda done, total: steps.append((done, total)))
    assert opened.layout == "rwhe-calib"
    assert opened.camera_origin is CameraOrigin.CALIBRATED
    assert opened.missed == {}
    assert steps == [(done, 8) for done in range(9)]
    assert opened.recording.camera.size_px == (640, 480)
    assert opened.recording.camera.covariance is not None
    np.testing.assert_allclose(opened.recording.camera.matrix, PICTURE_CAMERA.matrix, atol=6)
    error = solve(opened.recording).X.inverse() @ X
    assert np.linalg.norm(error.translation) < 3e-3
    assert error.rotation_angle_rad < np.deg2rad(0.2)


def test_given_camera_is_used(pictures: tuple[Path, Pose]) -> None:
    folder, X = pictures
    options = SourceOptions(target=Chessboard(5, 7, 0.03), camera=PICTURE_CAMERA)
    opened = open_folder(folder, options)
    assert opened.camera_origin is CameraOrigin.GIVEN
    assert opened.recording.camera == PICTURE_CAMERA
    error = solve(opened.recording).X.inverse() @ X
    assert np.linalg.norm(error.translation) < 1e-3


def test_picture_without_target_is_missed(tmp_path: Path) -> None:
    folder, _ = photographed(tmp_path / "set", 4)
    assert cv2.imwrite(str(folder / "im_02.png"), np.full((480, 640), 128, np.uint8))
    opened = open_folder(folder, PATTERN)
    assert list(opened.missed) == ["im_02"]
    assert [view.name for view in opened.recording.views] == ["im_01", "im_03", "im_04"]


def test_wrong_pattern_is_an_error_of_detection(tmp_path: Path) -> None:
    folder, _ = photographed(tmp_path / "set", 3)
    with pytest.raises(DetectionError) as caught:
        open_folder(folder, SourceOptions(pattern=(6, 8)))
    assert "none of 3 images" in caught.value.message


def test_wrong_pattern_is_refused_before_all_images_are_searched(pictures: tuple[Path, Pose]) -> None:
    steps: list[int] = []
    with pytest.raises(DetectionError) as caught:
        open_folder(pictures[0], SourceOptions(pattern=(6, 8)), progress=lambda done, _: steps.append(done))
    assert "the first 4 of 8 images show another target" in caught.value.message
    assert (caught.value.code, max(steps)) == ("not_detected", 4)


def test_damaged_picture_is_no_missed_view(tmp_path: Path) -> None:
    folder, _ = photographed(tmp_path / "set", 4)
    whole = (folder / "im_03.png").read_bytes()
    (folder / "im_03.png").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError) as caught:
        open_folder(folder, PATTERN)
    assert "im_03" in caught.value.message


def test_recording_passes(tmp_path: Path) -> None:
    recording = made_recording(4)
    opened = open_folder(written(recording, tmp_path / "made"))
    assert opened.recording == recording
    assert (opened.layout, opened.camera_origin) == ("handeye", CameraOrigin.FILES)
    other = open_folder(tmp_path / "made", SourceOptions(camera=recording.camera))
    assert other.camera_origin is CameraOrigin.GIVEN
    with pytest.raises(InputError) as caught:
        open_folder(tmp_path / "made", SourceOptions(mounting=Mounting.EYE_TO_HAND))
    assert caught.value.code == "options_unused"
