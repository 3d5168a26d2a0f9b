"""A real rig: an arm over the protocol of its controller, and a driver for each camera."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from commands import Handeye
from handeye.cameras.protocol import Frame, ImageSource
from handeye.datasets import read_rig, read_rig_description
from handeye.datasets.toml_text import toml_text
from handeye.errors import DeviceError, InputError
from handeye.robots import Arm
from handeye.robots.drivers.universal_robots import UniversalRobot
from handeye.robots.protocol import Goal
from handeye.session import rig_devices
from handeye.session.rig_devices import prepare_rig
from handeye.session.rig_prepared import RigPrepared
from handeye.session.settings import Configuration, RigSettings
from handeye.studies.rig_cell import rig_cell
from handeye.testing.universal_robots import MockUniversalRobot
from handeye.types import AprilGrid, Chessboard, Pose, Target

SPACE_MM = ["-1100", "-1100", "20", "1100", "1100", "1300"]


class Wired:
    """A camera of the rig behind a cable; `lost` pulls it, from the label that is named on."""

    def __init__(self, source: ImageSource) -> None:
        self.source, self.lost, self.closed = source, "", 0

    def grab(self, label: str) -> Frame:
        if self.lost and label >= self.lost:
            raise DeviceError("cable", code="no_image")
        return self.source.grab(label)

    def close(self) -> None:
        self.closed += 1


@dataclass
class Cell:
    """What the controller moves: the arm of a simulated rig, errors and all."""

    prepared: RigPrepared
    arm: Arm

    @property
    def start_rad(self) -> tuple[float, ...]:
        return self.prepared.start.joints_rad

    def stand(self, joints_rad: tuple[float, ...]) -> None:
        assert self.prepared.hidden_arm is not None
        self.prepared.hidden_arm.move_to(Goal("motion.1", Pose(self.arm.forward(joints_rad)), joints_rad))


@dataclass
class Rig:
    """Controller, cameras, and the file that describes them."""

    prepared: RigPrepared
    robot: MockUniversalRobot
    cameras: dict[str, Wired]
    file: Path

    def options(self, session: Path) -> list[str | Path]:
        driver = ["--robot", "ur5e", "--driver", f"ur:{self.robot.address}", "--workspace-mm", *SPACE_MM]
        return [
            "run",
            "--session",
            session,
            *driver,
            "--rig-file",
            self.file,
            "--no-confirm",
            "--speed-deg-s",
            "170",
            "--distance-mm",
            "250",
            "1800",
        ]


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Rig]:
    prepared = rig_cell(Configuration("ur5e", seed=3, rig=RigSettings(("left", "right"))))
    assert prepared.cell.arm is not None
    cameras = {eye.name[0]: Wired(eye.source) for eye in prepared.cell.eyes}
    tables = {"camera": list[object](), "target": list[object]()}
    for name, one in prepared.recording.cameras.items():
        (tmp_path / f"{name}.toml").write_text(toml_text({"camera": one.camera.to_dict()}))
        tables["camera"].append(
            {"name": name, "on": one.body.value, "images": f"mock:{name}", "calibration": f"{name}.toml"}
        )
    for name, one in prepared.recording.targets.items():
        tables["target"].append({"name": name, "on": one.body.value, **one.target.to_dict()})
    (tmp_path / "rig.toml").write_text(toml_text(tables))
    monkeypatch.setattr(rig_devices, "open_camera", lambda spec, *_: cameras[spec.partition(":")[2]])
    robot = MockUniversalRobot(Cell(prepared, prepared.cell.arm), pace=4.0)  # pyright: ignore[reportArgumentType]
    yield Rig(prepared, robot, cameras, tmp_path / "rig.toml")
    robot.close()


def test_a_real_rig_is_calibrated_by_its_drivers(handeye: Handeye, rig: Rig, tmp_path: Path) -> None:
    data = handeye.json(*rig.options(tmp_path / "s"))
    assert data["request_met"]
    assert set(data["cameras"]) == {"left", "right"}
    assert data["cameras"]["left"]["true_error"] is None
    recording = read_rig(tmp_path / "s").recording
    assert data["stations"] == len(recording)
    assert len(recording.stations[0].views) == 2
    assert rig.prepared.truth is not None
    for name, camera in data["calibration"]["cameras"].items():
        off = Pose(camera["T_flange_camera"]).inverse() @ rig.prepared.truth.cameras[name].inverse()
        assert 1e3 * np.linalg.norm(off.translation) < 0.5
        assert np.rad2deg(off.rotation_angle_rad) < 0.05
    assert [camera.closed for camera in rig.cameras.values()] == [1, 1]
    # A session of its own kind: it ends at once where it had ended.
    again = handeye.json("run", "--resume", "--session", tmp_path / "s", "--no-confirm")
    assert again["stations"] == data["stations"]
    assert again["calibration"] == data["calibration"]


def test_a_camera_that_is_lost_costs_its_views_alone(handeye: Handeye, rig: Rig, tmp_path: Path) -> None:
    rig.cameras["right"].lost = "station_05"
    data = handeye.json(*rig.options(tmp_path / "s"), "--max-views", "7", "--accuracy-mm", "0.01")
    assert (data["end"], data["stations"]) == ("views_taken", 7)
    seen = [{one.camera for one in station.views} for station in read_rig(tmp_path / "s").recording.stations]
    assert {"left", "right"} in seen[:4]
    assert seen[4:] == [{"left"}] * 3
    entries = [json.loads(line) for line in (tmp_path / "s" / "journal.jsonl").read_text().splitlines()]
    assert sum("camera right: cable" in entry.get("detail", "") for entry in entries) == 3


def test_a_robot_that_is_lost_is_gone_on_with(handeye: Handeye, rig: Rig, tmp_path: Path) -> None:
    asked = rig.options(tmp_path / "s")
    first = rig.cameras["left"].source

    class Cutting:
        """Pulls the robot's cable as the fourth station is looked at."""

        def grab(self, label: str) -> Frame:
            if label.startswith("station_04"):
                rig.robot.cut()
            return first.grab(label)

    rig.cameras["left"].source = Cutting()
    error = handeye.fails(*asked)
    assert error["code"] in {"too_many_failures", "robot_hangs"}, error
    taken = len(read_rig(tmp_path / "s").recording)
    assert taken >= 3
    rig.cameras["left"].source = first
    rig.robot.mend()
    data = handeye.json("run", "--resume", "--session", tmp_path / "s", "--no-confirm")
    assert data["request_met"]
    assert data["stations"] > taken


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ('images = "mock:left"', "", "camera left: images"),
        ('calibration = "left.toml"', 'calibration = "none.toml"', "none.toml"),
        ('calibration = "left.toml"', 'calibration = "left.toml"\nlens = "pinhole"', "lens beside it"),
        ('on = "flange"', 'on = "tool"', "expected flange or base"),
        ('name = "right"', 'name = "left"', "a name of its own"),
        ("[[target]]", "[[goal]]", "unknown field `goal`"),
    ],
)
def test_a_file_that_describes_no_rig_is_refused(rig: Rig, old: str, new: str, named: str) -> None:
    text = rig.file.read_text()
    assert old in text
    rig.file.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=named):
        read_rig_description(rig.file)


@pytest.mark.parametrize(
    ("one", "other", "refused"),
    [
        (Chessboard(6, 9, 0.025), Chessboard(6, 9, 0.04), True),
        (Chessboard(6, 9, 0.025), Chessboard(9, 6, 0.04), True),
        (Chessboard(6, 9, 0.025), Chessboard(6, 8, 0.025), False),
        (AprilGrid(4, 4, 0.03, 0.3), AprilGrid(2, 2, 0.03, 0.3, first_id=15), True),
        (AprilGrid(4, 4, 0.03, 0.3), AprilGrid(4, 4, 0.03, 0.3, first_id=16), False),
    ],
)
def test_targets_that_a_picture_does_not_tell_apart(
    rig: Rig, one: Target, other: Target, refused: bool
) -> None:
    tables = [{"name": n, "on": "base", **t.to_dict()} for n, t in (("a", one), ("b", other))]
    cameras = rig.file.read_text().partition("[[target]]")[0]
    rig.file.write_text(cameras + toml_text({"target": tables}))
    if refused:
        with pytest.raises(InputError, match="targets a and b"):
            read_rig_description(rig.file)
    else:
        assert set(read_rig_description(rig.file).recording.targets) == {"a", "b"}


def test_what_is_asked_of_a_rig_must_be_there(handeye: Handeye, rig: Rig, tmp_path: Path) -> None:
    asked = rig.options(tmp_path / "s")
    assert handeye.fails(*asked, "--cameras", "front")["code"] == "unknown_camera"
    assert handeye.fails(*asked, "--rig")["exit_code"] == 2
    assert handeye.fails(*asked, "--target", rig.file)["exit_code"] == 2
    assert handeye.fails("run", "--session", tmp_path / "s", "--rig-file", rig.file)["exit_code"] == 2
    described = read_rig_description(rig.file)
    configuration = Configuration("ur5e", driver="ur:127.0.0.1", images="rig", rig=RigSettings(images={}))
    with pytest.raises(InputError, match="no workspace"):
        prepare_rig(configuration, described.recording)
    on_flange = rig.file.read_text().replace('on = "base"', 'on = "flange"')
    rig.file.write_text(on_flange)
    assert handeye.fails(*asked)["code"] == "not_tied"
    assert not (tmp_path / "s").exists()


def test_a_rig_is_planned_within_the_limits_that_its_driver_states(
    handeye: Handeye, rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = np.array(rig.prepared.start.joints_rad)
    monkeypatch.setattr(
        UniversalRobot, "joint_limits", np.stack([here - 0.7, here + 0.7], axis=1), raising=False
    )
    handeye.json(*rig.options(tmp_path / "s"), "--max-views", "7", "--accuracy-mm", "0.01", "--anyway")
    stations = read_rig(tmp_path / "s").recording.stations
    assert len(stations) == 7
    # As the encoders say; those of the arm are off by less than this.
    assert all(
        np.abs(np.subtract(station.joints_rad or (9.0,) * 6, here)).max() < 0.71 for station in stations
    )
