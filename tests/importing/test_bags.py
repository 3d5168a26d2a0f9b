"""From bags of a made-up cell that moves between stations to a calibration, and the lag."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from bags_written import KINDS, Journey, encoded, write
from commands import Handeye
from handeye.datasets.bags import grey_of
from handeye.datasets.bags.messages import Raw
from handeye.errors import InputError
from handeye.estimation import solve
from handeye.importing import BagOptions, Opened, SourceOptions, open_folder
from handeye.robots import open_arm
from handeye.types import Mounting

pytest.importorskip("rosbags", reason="rosbags, which writes the bags, is not installed")
pytest.importorskip("lz4", reason="lz4 is not installed (extra bags)")
Write = Callable[..., Path]


@pytest.fixture(scope="module")
def journey() -> Journey:
    return Journey(seed=3, stations=5, picture_hz=7, lag_s=0.030)


def opened(path: Path, journey: Journey, **options: object) -> Opened:
    return open_folder(path, SourceOptions(target=journey.target, mounting=journey.mounting, **options))


@pytest.fixture(scope="module")
def folder(journey: Journey, tmp_path_factory: pytest.TempPathFactory) -> Opened:
    """The same views as pictures and a list of poses."""
    path = tmp_path_factory.mktemp("folder")
    (path / "camera.json").write_text(json.dumps(journey.camera.to_dict()))
    rows = ["image,x,y,z,qx,qy,qz,qw"]
    period = journey.stand_s + journey.move_s
    for k in range(journey.stations):
        middle = k * period + journey.stand_s / 2
        _, grey = min(journey.pictures, key=lambda p: abs(p[0] - journey.lag_s - middle))
        cv2.imwrite(str(path / f"{k}.png"), grey)
        pose = journey.pose(middle)
        rows.append(",".join(map(str, [f"{k}.png", *pose.translation, *pose.quaternion_xyzw])))
    (path / "poses.csv").write_text("# notation: quaternion_xyzw\n# unit: m\n" + "\n".join(rows))
    return opened(path, journey)


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_equals_the_folder_and_tells_the_lag(
    kind: str, journey: Journey, folder: Opened, tmp_path: Path
) -> None:
    bag = opened(write(tmp_path / "bag", kind, journey), journey)
    assert len(bag.recording) == journey.stations
    assert bag.timing is not None
    assert bag.timing.stations == journey.stations
    assert bag.timing.lag is not None
    assert abs(bag.timing.lag.seconds - journey.lag_s) < 0.003
    mine, theirs = solve(bag.recording), solve(folder.recording)
    between = (mine.X @ theirs.X.inverse()).log()
    assert between @ np.linalg.solve(mine.covariance + theirs.covariance, between) < 12.6


@pytest.mark.parametrize("picture", ["jpeg", "bgr8"])
def test_pictures_in_many_encodings(picture: str, journey: Journey, tmp_path: Path) -> None:
    bag = opened(write(tmp_path / "bag", "mcap", journey, picture=picture), journey)
    assert len(bag.recording) == journey.stations
    assert bag.timing is not None
    assert bag.timing.lag is not None
    assert abs(bag.timing.lag.seconds - journey.lag_s) < 0.003


def test_poses_on_a_topic_and_pictures_without_a_time(journey: Journey, tmp_path: Path) -> None:
    path = write(tmp_path / "bag", "sqlite3", journey, poses="pose", stamps=False)
    bag = opened(path, journey)
    assert bag.timing is not None
    assert bag.timing.lag is not None
    # The recorder got the pictures 4 ms after they were stamped.
    assert abs(bag.timing.lag.seconds - journey.lag_s - 0.004) < 0.003
    assert any(warning.code == "received_times" for warning in bag.warnings)
    with pytest.raises(InputError, match="no /nowhere; the bag has /tcp_pose"):
        opened(path, journey, bag=BagOptions(pose_topic="/nowhere"))
    with pytest.raises(InputError, match="no /depth; the bag has /camera/image_raw"):
        opened(path, journey, bag=BagOptions(image_topic="/depth"))


def test_covariances_of_poses_are_said_not_to_be_used(journey: Journey, tmp_path: Path) -> None:
    bag = opened(write(tmp_path / "bag", "mcap", journey, poses="pose_with_covariance"), journey)
    plain = opened(write(tmp_path / "plain", "mcap", journey, poses="pose"), journey)
    assert len(bag.recording) == len(plain.recording) == journey.stations
    (said,) = [warning for warning in bag.warnings if warning.code == "accuracies_unused"]
    assert "covariance" in said.message
    assert all(warning.code != "accuracies_unused" for warning in plain.warnings)


def test_joint_states_with_a_description(tmp_path: Path) -> None:
    arm = open_arm("ur5e")
    journey = Journey(seed=5, stations=5, picture_hz=6, arm=arm, mounting=Mounting.EYE_TO_HAND, lag_s=-0.02)
    path = write(tmp_path / "bag", "mcap", journey, poses="joints")
    with pytest.raises(InputError, match="no description of the robot"):
        opened(path, journey)
    bag = opened(path, journey, arm=arm)
    assert all(len(view.joints_rad or ()) == 6 for view in bag.recording.views)
    assert bag.timing is not None
    assert bag.timing.lag is not None
    assert abs(bag.timing.lag.seconds + 0.02) < 0.003
    off = solve(bag.recording).results["T_base_camera"].inverse() @ journey.truth
    assert np.linalg.norm(off.translation) < 2e-3


def test_frames_that_are_named_and_frames_that_are_not_there(journey: Journey, tmp_path: Path) -> None:
    path = write(tmp_path / "bag", "mcap", journey)
    named = opened(path, journey, bag=BagOptions(base_frame="world", flange_frame="tool0"))
    usual = opened(path, journey)
    here = usual.recording.views[0].T_base_flange @ named.recording.views[0].T_base_flange.inverse()
    there = usual.recording.views[3].T_base_flange @ named.recording.views[3].T_base_flange.inverse()
    assert np.allclose(here.matrix, there.matrix, atol=1e-9)
    with pytest.raises(InputError, match="does not connect map with tool0"):
        opened(path, journey, bag=BagOptions(base_frame="map"))


def test_a_large_lag_moves_the_choice_of_pictures(journey: Journey, tmp_path: Path) -> None:
    later = replace(journey, lag_s=0.25)
    bag = opened(write(tmp_path / "bag", "mcap", later), later)
    assert bag.timing is not None
    assert bag.timing.lag is not None
    assert abs(bag.timing.lag.seconds - 0.25) < 0.003
    off = solve(bag.recording).results["T_flange_camera"].inverse() @ later.truth
    assert np.linalg.norm(off.translation) < 1e-3


def test_a_bag_that_breaks_off(journey: Journey, tmp_path: Path) -> None:
    path = write(tmp_path / "bag", "rosbag1", journey)
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * 0.8)])
    bag = opened(path, journey)
    assert any(warning.code == "bag_cut" for warning in bag.warnings)
    assert 3 <= len(bag.recording) < journey.stations


def test_one_command(journey: Journey, handeye: Handeye, tmp_path: Path) -> None:
    path = write(tmp_path / "bag", "sqlite3", journey)
    board = json.dumps(journey.target.to_dict())
    (tmp_path / "board.json").write_text(board)
    answer = handeye.json("solve", str(path), "--target", str(tmp_path / "board.json"))
    assert abs(answer["timing"]["lag_ms"] - 30) < 3
    assert answer["layout"] == "bag"
    handeye.json("import", str(path), str(tmp_path / "rec"), "--target", str(tmp_path / "board.json"))
    again = handeye.json("solve", str(tmp_path / "rec"))
    assert again["T_flange_camera"] == answer["T_flange_camera"]


def test_encodings() -> None:
    with pytest.raises(InputError, match="32FC1"):
        grey_of(Raw(0, 2, 2, "32FC1", False, 8, memoryview(bytes(16))), "x")
    with pytest.raises(InputError, match="in 3 bytes"):
        grey_of(Raw(0, 2, 2, "mono8", False, 2, memoryview(bytes(3))), "x")
    with pytest.raises(InputError, match="pixels of mono8"):
        grey_of(Raw(0, 1 << 31, 1 << 31, "mono8", False, 1 << 31, memoryview(bytes(3))), "x")
    grey = np.arange(16, dtype=np.uint8).reshape(4, 4) * 16
    for how in ("mono8", "rgb8", "mono16", "yuv422_yuy2"):
        content, channels = encoded(grey, how)
        raw = Raw(0, 4, 4, how, False, 4 * channels, memoryview(content))
        assert np.array_equal(grey_of(raw, "x"), grey)
    # Green is bright: where the first row begins with red, every second pixel from the second on is bright.
    mosaic = np.zeros((8, 8), np.uint8)
    mosaic[0::2, 0::2], mosaic[1::2, 1::2] = 200, 0
    red = grey_of(Raw(0, 8, 8, "bayer_rggb8", False, 8, memoryview(mosaic.ravel())), "x")
    blue = grey_of(Raw(0, 8, 8, "bayer_bggr8", False, 8, memoryview(mosaic.ravel())), "x")
    assert red[3, 3] == pytest.approx(0.299 * 200, abs=2)
    assert blue[3, 3] == pytest.approx(0.114 * 200, abs=2)
