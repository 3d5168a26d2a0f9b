"""Files that other tools wrote themselves, cut from their repositories: read as the tools meant them."""

import json
from pathlib import Path

import numpy as np
import pytest

from datasets.layouts import png
from handeye.datasets import ImageSet, PosePairs, load, read_camera
from handeye.export import read_transform
from handeye.importing import SourceOptions, open_any, solve_poses
from handeye.types import Camera, Charuco, Mounting

GOLDEN = Path(__file__).resolve().parents[2] / "fixtures" / "golden"


@pytest.mark.parametrize(("kind", "mounting"), [("eih", Mounting.EYE_IN_HAND), ("eob", Mounting.EYE_TO_HAND)])
def test_the_demonstrations_of_easy_handeye2(kind: str, mounting: Mounting) -> None:
    samples = load(GOLDEN / f"easy_handeye2_{kind}.samples", mounting=mounting)
    assert isinstance(samples, PosePairs)
    assert samples.layout == "easy_handeye2"
    own = read_transform(GOLDEN / f"easy_handeye2_{kind}.calib")
    assert (own.parent, own.child) == (
        "panda_link8" if kind == "eih" else "panda_link0",
        "tracking_base_frame",
    )
    off = (own.T_parent_child.inverse() @ solve_poses(samples).X.inverse()).log()
    assert np.linalg.norm(off[:3]) < 5e-4
    assert np.linalg.norm(off[3:]) < 1e-3


def test_the_poses_of_moveit_calibrations_own_test() -> None:
    samples = load(GOLDEN / "moveit_pose_samples.json", mounting=Mounting.EYE_TO_HAND)
    assert isinstance(samples, PosePairs)
    assert samples.layout == "moveit_samples"
    # What its test expects, to one part in a hundred.
    expected = np.array([0.659, -0.249, 0.830])
    found = solve_poses(samples).X.inverse().translation
    assert np.linalg.norm(found - expected) < 0.01 * np.linalg.norm(expected)


def test_the_charuco_set_of_industrial_calibration(tmp_path: Path) -> None:
    (tmp_path / "cal_data.yaml").write_bytes((GOLDEN / "industrial_calibration.yaml").read_bytes())
    (tmp_path / "poses").mkdir()
    for k in range(16):
        png(tmp_path / "images" / f"{k}.png", (1600, 1200))
        (tmp_path / "poses" / f"{k}.yaml").write_text(
            f"x: 0.{k + 1}\ny: 0.0\nz: 0.0\nqx: 0.0\nqy: 0.0\nqz: 0.0\nqw: 1.0\n"
        )
    found = load(tmp_path)
    assert isinstance(found, ImageSet)
    assert found.layout == "industrial_calibration"
    assert found.mounting is Mounting.EYE_TO_HAND
    assert found.target == Charuco(7, 5, 0.036195, 0.018256, "DICT_6X6_250")
    assert found.camera is not None
    assert found.camera.parameters.tolist() == [1352.02747, 1356.14287, 789.67065, 627.2995]
    assert [shot.image for shot in found.shots] == [f"images/{k}.png" for k in range(16)]


@pytest.mark.parametrize(
    ("name", "camera"),
    [
        (
            "usb_cam_camera_info.yaml",
            Camera("brown_conrady_5", [438.783367, 437.302876, 305.593336, 243.738352, -0.361976, 0.110510, 0.001014, 0.000505, 0], 640, 480),
        ),
        (
            "image_pipeline_ost.txt",
            Camera("brown_conrady_5", [430.215550, 430.531693, 306.691343, 227.224800, -0.337586, 0.111612, -0.000218, -0.000030, 0], 640, 480),
        ),
        ("open3d_camera.json", Camera("brown_conrady_5", [415.69219381653068] * 2 + [319.5, 239.5] + [0] * 5, 640, 480)),
    ],
)  # fmt: skip
def test_cameras(name: str, camera: Camera) -> None:
    assert read_camera(GOLDEN / name) == camera


@pytest.mark.parametrize(("configuration", "layout"), [("eye_in_hand", "tum"), ("eye_to_hand", "kinhec")])
def test_tracks_that_kinhec_wrote(configuration: str, layout: str, tmp_path: Path) -> None:
    for path in GOLDEN.glob(f"kinhec_{configuration}_*"):
        if layout == "kinhec" or path.suffix == ".tum":
            (tmp_path / path.name).write_bytes(path.read_bytes())
    mounting = None if layout == "kinhec" else Mounting(configuration)
    samples = open_any(tmp_path, SourceOptions(mounting=mounting))
    assert isinstance(samples, PosePairs)
    assert samples.layout == layout
    assert samples.mounting is Mounting(configuration)
    known = json.loads((GOLDEN / f"kinhec_{configuration}_groundtruth.json").read_text())
    (lag,) = (warning.message for warning in samples.warnings if warning.code == "lag")
    assert float(lag.split("stamped ")[1].split(" ms")[0]) == pytest.approx(
        1e3 * known["time_offset_s"], abs=3
    )
    # Their X is the camera or the target on the flange, their Y the other one in the base.
    solved = solve_poses(samples)
    camera = known["X_matrix"] if configuration == "eye_in_hand" else known["Y_matrix"]
    off = 1e3 * np.linalg.norm(solved.X.inverse().translation - np.array(camera)[:3, 3])
    assert off < solved.within_95.translation_mm
