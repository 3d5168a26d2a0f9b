"""Version 2 of a recording: several cameras read back to the last bit, and faults are named."""

import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from datasets.layouts import some_recording
from handeye.datasets import (
    LoadedRecording,
    holds_several,
    load,
    read_recording,
    read_rig,
    write_recording,
    write_rig,
)
from handeye.errors import InputError
from handeye.types import (
    Body,
    CameraView,
    MountedCamera,
    MountedTarget,
    Pose,
    RigRecording,
    RigTruth,
)


@pytest.fixture
def rig() -> RigRecording:
    """Two cameras on the flange, one beside that sees the board on the table; every station as in one file."""
    one = some_recording()
    cameras = {
        "left": MountedCamera(one.camera, Body.FLANGE),
        "right": MountedCamera(one.camera, Body.FLANGE),
        "wall": MountedCamera(one.camera, Body.BASE),
    }
    targets = {"table": MountedTarget(one.target, Body.BASE)}
    views = [CameraView(name, "table", view) for view in one.views for name in cameras]
    truth = RigTruth({"left": Pose.exp([0.1, 0, 0, 0, 0, 0]), "wall": Pose.exp([1, 0, 0, 0, 1, 0])}, {})
    return RigRecording.of_views("three", cameras, targets, views, truth, "made up")


def test_several_cameras_read_back_to_the_last_bit(tmp_path: Path, rig: RigRecording) -> None:
    write_rig(rig, tmp_path / "rig")
    assert holds_several(tmp_path / "rig")
    assert read_rig(tmp_path / "rig").recording == rig
    document = tomllib.loads((tmp_path / "rig" / "recording.toml").read_text())
    assert document["version"] == 2
    assert [camera["on"] for camera in document["camera"]] == ["flange", "flange", "base"]
    with pytest.raises(InputError, match="several cameras or targets") as caught:
        read_recording(tmp_path / "rig")
    assert caught.value.code == "several_cameras"


def test_one_camera_is_written_as_version_1(tmp_path: Path) -> None:
    one = some_recording()
    write_recording(one, tmp_path / "one")
    write_rig(RigRecording.of(one), tmp_path / "same")
    texts = [(tmp_path / name / "recording.toml").read_bytes() for name in ("one", "same")]
    assert texts[0] == texts[1]
    assert not holds_several(tmp_path / "same")
    loaded = load(tmp_path / "same")
    assert isinstance(loaded, LoadedRecording)
    assert loaded.recording == one


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace('on = "base"', 'on = "ceiling"', 1), "expected flange or base"),
        (lambda text: text.replace('camera = "wall"', 'camera = "hall"', 1), "no such station or camera"),
        (lambda text: text.replace('target = "table"', 'target = "floor"', 1), "no target 'floor'"),
        (lambda text: text.replace('name = "right"', 'name = "left"', 1), "a name of its own"),
        (lambda text: text.replace("station_count = 3", "station_count = 4"), "station_count is 4"),
        (lambda text: text.replace("T_camera_base", "T_camera_flange"), "no camera 'wall' on the flange"),
        (lambda text: text.replace("version = 2", "version = 3"), "reads up to 2"),
        (lambda text: text.replace('corners = "corners/', 'corners = "../', 1), "path"),
        (lambda text: text + '\nlens_cap = "on"\n', "lens_cap"),
    ],
)
def test_every_fault_is_named(
    tmp_path: Path, rig: RigRecording, change: Callable[[str], str], message: str
) -> None:
    write_rig(rig, tmp_path / "rig")
    file = tmp_path / "rig" / "recording.toml"
    changed = change(file.read_text())
    assert changed != file.read_text()
    file.write_text(changed)
    with pytest.raises(InputError, match=message):
        read_rig(tmp_path / "rig")
