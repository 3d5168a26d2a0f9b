"""Folders with a folder for each camera become stations; a chain of Kalibr gives the cameras."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from folders import PICTURE_BOARD, PICTURE_CAMERA, made_cell, picture
from handeye.datasets import Statement, read_cameras, read_rig, write_rig
from handeye.errors import InputError
from handeye.estimation import solve_rig
from handeye.importing import SourceOptions, is_rig, open_rig
from handeye.notations import NOTATIONS, Direction, Unit
from handeye.types import Body, Pose
from handeye.validation import metrics

BETWEEN = Pose.exp([0.06, 0.0, 0.0, 0.0, -0.05, 0.02])  # T_right_left
COUNT = 6
STATED = Statement(NOTATIONS["matrix"], Unit.M, Direction.FLANGE_IN_BASE)
OPTIONS = SourceOptions(target=PICTURE_BOARD, stated=STATED)
CHAIN = """
cam0: {camera_model: pinhole, intrinsics: [620, 620, 319.5, 239.5], distortion_model: none, resolution: [640, 480]}
cam1:
  camera_model: pinhole
  intrinsics: [620, 620, 319.5, 239.5]
  distortion_model: none
  resolution: [640, 480]
  T_cn_cnm1: [[1, 0, 0, 0.06], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two cameras on one flange, as others file them: pictures and poses below each camera."""
    folder = tmp_path_factory.mktemp("rig")
    random = np.random.default_rng(4)
    cell = made_cell()
    middle = Pose.exp([*-PICTURE_BOARD.points.mean(axis=0), 0, 0, 0])
    for k in range(COUNT):
        turn = Pose.exp([0, 0, 0, *random.uniform(-0.45, 0.45, 2), random.uniform(-1.0, 1.0)])
        left = Pose.exp([-0.01, *random.uniform(-0.02, 0.02, 1), 0.52, 0, 0, 0]) @ turn @ middle
        flange = cell.Y @ left.inverse() @ cell.X
        for name, seen in (("camera1", left), ("camera2", BETWEEN @ left)):
            for kind in ("image", "pose"):
                (folder / name / kind).mkdir(parents=True, exist_ok=True)
            cv2.imwrite(str(folder / name / "image" / f"{k:04d}.png"), picture(seen, 2))
            rows = "\n".join(",".join(repr(float(v)) for v in row) for row in flange.matrix)
            (folder / name / "pose" / f"{k:04d}.csv").write_text(rows + "\n")
    (folder / "chain.yaml").write_text(CHAIN)
    return folder


def test_cameras_of_a_folder_are_stations_and_solve_together(folder: Path, tmp_path: Path) -> None:
    assert is_rig(folder)
    opened = open_rig(folder, OPTIONS, cameras=read_cameras(folder / "chain.yaml"))
    recording = opened.recording
    assert list(recording.cameras) == ["camera1", "camera2"]
    assert {one.body for one in recording.cameras.values()} == {Body.FLANGE}
    assert [len(station.views) for station in recording.stations] == [2] * COUNT
    rig = solve_rig(recording)
    found = rig.camera_to_camera["camera1", "camera2"]
    assert metrics.deviation(found.pose @ BETWEEN).translation_mm < 0.5
    write_rig(recording, tmp_path / "kept", images_from=opened.folder)
    back = read_rig(tmp_path / "kept")
    assert all(
        (back.folder / str(one.view.image)).is_file() for s in back.recording.stations for one in s.views
    )


def test_as_many_cameras_are_given_as_there_are(folder: Path, tmp_path: Path) -> None:
    chain = read_cameras(folder / "chain.yaml")
    assert list(chain) == ["cam0", "cam1"]
    assert all(camera.parameters[0] == PICTURE_CAMERA.parameters[0] for camera in chain.values())
    (tmp_path / "one.yaml").write_text(CHAIN.split("cam1:", maxsplit=1)[0])
    with pytest.raises(InputError, match="1 cameras given") as caught:
        open_rig(folder, OPTIONS, cameras=read_cameras(tmp_path / "one.yaml"))
    assert caught.value.code == "several_cameras"
    with pytest.raises(InputError, match="one camera given for several"):
        open_rig(folder, SourceOptions(target=PICTURE_BOARD, camera=PICTURE_CAMERA))


def test_what_is_wrong_with_one_camera_names_it(folder: Path) -> None:
    with pytest.raises(InputError, match="camera camera1: "):
        open_rig(folder)


def test_one_camera_or_none_is_no_rig(tmp_path: Path) -> None:
    assert not is_rig(tmp_path)
    assert not is_rig(tmp_path / "missing")
    (tmp_path / "camera1").mkdir()
    (tmp_path / "camera1" / "a.png").write_bytes(b"")
    assert not is_rig(tmp_path)
