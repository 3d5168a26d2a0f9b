"""What is exported reads back, and a text that does not is never given out."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from answers import answer
from handeye.errors import InputError, OutputError
from handeye.export import EXPORTERS, Frames, Mount, checked_text, read_transform
from handeye.types import Mounting, Pose
from strategies import poses

HAND = Frames("tool0", camera="optical", link="camera_link", target="board")
BESIDE = Frames("base", "optical", "tool0", "board", "camera_link")
WORDS = (
    "static_transform_publisher --x 7 --frame-id a --child-frame-id b",
    '<joint type="fixed"> args="1 2 3"',
    "T_flange_camera: [1]",
)


@pytest.mark.parametrize("mounting", Mounting)
@pytest.mark.parametrize("name", EXPORTERS)
@settings(max_examples=15)
@given(pose=poses())
def test_every_export_is_read_back(name: str, mounting: Mounting, pose: Pose) -> None:
    mount = Mount(answer(pose, mounting), HAND if mounting is Mounting.EYE_IN_HAND else BESIDE)
    assert checked_text(EXPORTERS[name], mount) == EXPORTERS[name].text(mount)


@pytest.mark.parametrize("name", EXPORTERS)
def test_a_file_is_read_back(name: str, tmp_path: Path) -> None:
    path = tmp_path / f"file{EXPORTERS[name].suffix}"
    for words in WORDS:
        mount = Mount(answer(recording=words, warnings=WORDS), HAND)
        path.write_text(EXPORTERS[name].text(mount))
        back = read_transform(path)
        assert (back.parent, back.child) == ("tool0", "camera_link")
        assert np.abs(back.T_parent_child.matrix - mount.T_parent_child.matrix).max() < 1e-12


@pytest.mark.parametrize("name", EXPORTERS)
def test_an_export_that_reads_back_otherwise_is_refused(name: str) -> None:
    mount, other = Mount(answer(), HAND), Mount(answer(Pose.exp([0.1, 0, 0, 0, 0, 0])), HAND)
    for text in (
        lambda _: EXPORTERS[name].text(other),
        lambda _: "",
        lambda m: EXPORTERS[name].text(m).replace("tool0", "tool1"),
    ):
        with pytest.raises(OutputError):
            checked_text(replace(EXPORTERS[name], text=text), mount)


def test_easy_handeye_of_ros_1_is_read(tmp_path: Path) -> None:
    path = tmp_path / "arm_eye_on_hand.yaml"
    path.write_text(
        "parameters: {eye_on_hand: true, robot_base_frame: base_link, robot_effector_frame: tool0, "
        "tracking_base_frame: camera_link}\n"
        "transformation: {x: 0.1, y: 0.2, z: 0.3, qx: 0.0, qy: 0.0, qz: 0.6, qw: 0.8}\n"
    )
    back = read_transform(path)
    assert (back.parent, back.child) == ("tool0", "camera_link")
    assert back.T_parent_child.translation.tolist() == [0.1, 0.2, 0.3]
    path.write_text(path.read_text().replace("true", "false"))
    assert read_transform(path).parent == "base_link"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "a: 1",
        "[1, 2]",
        '{"quaternion_xyzw": [0, 0, 0, 2], "translation_m": [0, 0, 0], "parent_frame": "a", "child_frame": "b"}',
        '<node pkg="tf2_ros" type="static_transform_publisher" args="1 2 3"/>',
        '<joint type="fixed"><origin xyz="1 2" rpy="0 0 0"/><parent link="a"/><child link="b"/></joint>',
        '<joint type="fixed"/>',
        "ros2 run tf2_ros static_transform_publisher --x nan --frame-id a --child-frame-id b",
        "transform: {translation: {x: 1}}",
        "parent_frame: a\nchild_frame: b\nT_base_camera: {data: [1, 2]}",
    ],
)
def test_what_is_no_transform_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text(text)
    with pytest.raises(InputError, match="file"):
        read_transform(tmp_path / "file")
