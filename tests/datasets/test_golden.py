"""Files that other tools wrote themselves, from their repositories or by their own libraries."""

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from datasets.layouts import png
from handeye.datasets import ImageSet, PosePairs, load, read_camera
from handeye.datasets.pose_pairs import PoseStreams
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


def test_samples_as_moveits_widget_saves_them() -> None:
    samples = load(GOLDEN / "moveit_samples.yaml", mounting=Mounting.EYE_IN_HAND)
    assert isinstance(samples, PosePairs)
    assert samples.layout == "moveit_samples"
    for k, pair in enumerate(samples.pairs, start=1):
        np.testing.assert_allclose(pair.T_base_flange.log()[3:], [0, 0, 0.3 * k], atol=1e-12)
        np.testing.assert_allclose(pair.T_base_flange.translation, [0.4 + 0.01 * k, -0.1, 0.5])
        np.testing.assert_allclose(pair.T_camera_target.log()[3:], [0, 0, -0.3 * k], atol=1e-12)
        np.testing.assert_allclose(pair.T_camera_target.translation, [0.02, 0.03 * k, 0.6])
    assert len(samples.pairs) == 5


def test_poses_that_visp_wrote(tmp_path: Path) -> None:
    for path in GOLDEN.glob("visp_pose_*.yaml"):
        (tmp_path / path.name.removeprefix("visp_")).write_bytes(path.read_bytes())
    samples = load(tmp_path, mounting=Mounting.EYE_IN_HAND)
    assert isinstance(samples, PosePairs)
    assert samples.layout == "visp"
    assert len(samples.pairs) == 3
    for k, pair in enumerate(samples.pairs, start=1):
        turned = [0.3 * k if k == 1 else 0.1, 0.3 * k if k == 2 else -0.2, 0.05 * k]
        np.testing.assert_allclose(pair.T_base_flange.translation, [0.4 + 0.05 * k, -0.1, 0.5])
        np.testing.assert_allclose(pair.T_base_flange.log()[3:], turned, atol=1e-6)
        board = [0.1 * k, -0.1, 2**0.5 * k]  # six digits are written
        length = np.linalg.norm(board)
        wrapped = np.array(board) * (1 if length < np.pi else 1 - 2 * np.pi / length)
        np.testing.assert_allclose(pair.T_camera_target.translation, [-0.05, 0.02 * k, 0.5])
        np.testing.assert_allclose(pair.T_camera_target.log()[3:], wrapped, atol=1e-5)


def test_the_simulated_arm_of_hand_eye_calibration(tmp_path: Path) -> None:
    with zipfile.ZipFile(GOLDEN / "ethz_robot_arm_sim.zip") as archive:
        for own, as_its_manual_calls_it in (("hand", "poses_B_H.csv"), ("camera", "poses_W_E.csv")):
            data = archive.read(f"robot_arm_w_color_camera_sim/robot_arm_sim_{own}.csv")
            (tmp_path / as_its_manual_calls_it).write_bytes(data)
    streams = load(tmp_path, mounting=Mounting.EYE_IN_HAND)
    assert isinstance(streams, PoseStreams)
    assert streams.layout == "ethz"
    np.testing.assert_allclose(
        streams.robot.poses[0][:3, 3], [0.692350080409, -0.181575632634, 0.516287455651]
    )
    assert len(streams.seen.poses) == 1065  # of 1,067 lines two have the time of the one before
    samples = open_any(tmp_path, SourceOptions(mounting=Mounting.EYE_IN_HAND))
    assert isinstance(samples, PosePairs)
    assert solve_poses(samples).within_95.rotation_deg < 2


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
        (
            "ros2_topic_echo_camera_info.yaml",
            Camera("brown_conrady_8", [912.5, 911.75, 640.25, 360.5, 0.1025, -0.2125, 0.0005, -0.00025, 0.0875, 0.0125, -0.0375, 0.00625], 1280, 720),
        ),
        (
            "realsense_intrinsics.json",
            Camera("brown_conrady_5", [606.5, 605.75, 321.25, 246.5, 0.125, -0.25, *map(float, np.float32([0.0005, -0.00025])), 0.0625], 640, 480),
        ),
        ("visp_camera.xml", Camera("brown_conrady_4", [600.5, 601.25, 320.125, 240.75, -0.17, 0, 0, 0], 640, 480)),
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
