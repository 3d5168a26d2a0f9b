"""Every format says the same transform, whatever the pose and whatever the names."""

import ast
import json
import shlex
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from xml.etree import ElementTree as ET

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from answers import CAMERA, GENERIC, TARGET, answer
from handeye.export import EXPORTERS, REP_103_OPTICAL, Frames, Mount
from handeye.export.base import fixed_axis_angles, number, rotation_of, xml_comment
from handeye.types import Mounting, Pose
from strategies import poses

FRAMES = Frames("tool0", camera="optical", link="camera_link", target="board")
HOSTILE = (
    "a --> <joint/> <!--",
    "x --",
    "-",
    "a\nros2 run evil",
    "a\r\nb: c",
    "'; rm -rf ~; '",
    '"""\nimport os\n"""',
    "*/ ]]> & < > \" '",
    "a\x00b\x1b[31m",
    "\u2028next\u202eline",
    "%YAML:1.0\n---\nT: 1",
    "- a: [1",
    "\\",
)


@dataclass
class Read:
    """What a reader of a format gets."""

    parent: str
    child: str
    translation: np.ndarray
    rotation: np.ndarray

    @classmethod
    def of_quaternion(cls, parent: str, child: str, values: list[float]) -> "Read":
        return cls(parent, child, np.array(values[:3]), Rotation.from_quat(values[3:]).as_matrix())


def read_command(arguments: list[str]) -> Read:
    values = dict(zip(arguments[::2], arguments[1::2], strict=True))
    names = ("--x", "--y", "--z", "--qx", "--qy", "--qz", "--qw")
    assert set(values) == {*names, "--frame-id", "--child-frame-id"}
    numbers = [float(values[name]) for name in names]
    return Read.of_quaternion(values["--frame-id"], values["--child-frame-id"], numbers)


def read_ros2(text: str) -> Read:
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    words = shlex.split(" ".join(line.removesuffix("\\") for line in lines))
    assert words[:4] == ["ros2", "run", "tf2_ros", "static_transform_publisher"]
    return read_command(words[4:])


def read_node(node: ET.Element) -> Read:
    assert node.attrib.keys() == {"pkg", "type", "name", "args"}
    assert (node.get("pkg"), node.get("type")) == ("tf2_ros", "static_transform_publisher")
    *values, parent, child = str(node.get("args")).split()
    return Read.of_quaternion(parent, child, [float(value) for value in values])


def read_ros1(text: str) -> Read:
    return read_node(ET.fromstring(text))


def read_moveit(text: str) -> Read:
    root = ET.fromstring(text)
    assert root.tag == "launch"
    (node,) = root
    return read_node(node)


def read_moveit2(text: str) -> Read:
    tree = ast.parse(text)
    assert [type(item) for item in tree.body] == [ast.ImportFrom, ast.ImportFrom, ast.FunctionDef]
    (arguments,) = (k.value for k in ast.walk(tree) if isinstance(k, ast.keyword) and k.arg == "arguments")
    return read_command(ast.literal_eval(arguments))


def read_urdf(text: str) -> Read:
    joint = ET.fromstring(text)
    assert joint.tag == "joint"
    assert joint.get("type") == "fixed"
    assert [child.tag for child in joint] == ["parent", "child", "origin"]
    parent, child, origin = joint
    xyz, rpy = ([float(v) for v in str(origin.get(name)).split()] for name in ("xyz", "rpy"))
    # Extrinsic x, y, z in SciPy's words.
    return Read(
        str(parent.get("link")),
        str(child.get("link")),
        np.array(xyz),
        Rotation.from_euler("xyz", rpy).as_matrix(),
    )


def read_easy_handeye2(text: str) -> Read:
    message = yaml.safe_load(text)
    assert message.keys() == {"parameters", "transform"}
    parameters, transform = message["parameters"], message["transform"]
    in_hand = {"eye_in_hand": True, "eye_on_base": False}[parameters["calibration_type"]]
    values = [transform["translation"][a] for a in "xyz"] + [transform["rotation"][a] for a in "xyzw"]
    assert all(isinstance(value, float) for value in values)
    parent = parameters["robot_effector_frame" if in_hand else "robot_base_frame"]
    return Read.of_quaternion(parent, parameters["tracking_base_frame"], values)


def read_opencv(text: str) -> Read:
    storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    matrix = storage.getNode("T_flange_camera_link").mat()
    if matrix is None:
        matrix = storage.getNode("T_base_camera_link").mat()
    names = [storage.getNode(name).string() for name in ("parent_frame", "child_frame")]
    return Read(*names, matrix[:3, 3], matrix[:3, :3])


def read_json(text: str) -> Read:
    data = json.loads(text)
    values = data["translation_m"] + data["quaternion_xyzw"]
    return Read.of_quaternion(data["parent_frame"], data["child_frame"], values)


READERS: dict[str, Callable[[str], Read]] = {
    "ros2": read_ros2,
    "ros1": read_ros1,
    "urdf": read_urdf,
    "moveit": read_moveit,
    "moveit2": read_moveit2,
    "easy_handeye2": read_easy_handeye2,
    "opencv": read_opencv,
    "json": read_json,
}


def check(read: Read, mount: Mount) -> None:
    assert (read.parent, read.child) == (mount.parent, mount.child)
    np.testing.assert_allclose(read.translation, mount.T_parent_child.translation, rtol=0, atol=1e-14)
    np.testing.assert_allclose(read.rotation, mount.T_parent_child.rotation, rtol=0, atol=1e-12)


def turned(roll: float, pitch: float, yaw: float) -> Pose:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler("xyz", [roll, pitch, yaw]).as_matrix()
    matrix[:3, 3] = [1e-7, -0.25, 0]
    return Pose(matrix)


# Straight up and down, and beside: there roll and yaw turn about the same axis.
LOCKED = [
    turned(r, s * (np.pi / 2 - d), y)
    for r, y in ((0.3, -2), (0, 0))
    for s in (1, -1)
    for d in (0, 1e-9, 1e-5)
]
EDGES = [Pose.identity(), turned(np.pi, 0, 0), turned(0, 0, np.pi), turned(1e-9, 0, -1e-9), *LOCKED]


def test_every_format_has_a_reader() -> None:
    assert set(EXPORTERS) == set(READERS)
    assert all(exporter.name == name for name, exporter in EXPORTERS.items())


@pytest.mark.parametrize("mounting", Mounting)
@pytest.mark.parametrize("name", EXPORTERS)
@settings(max_examples=20)
@given(pose=poses())
def test_readers_get_the_pose_back(name: str, mounting: Mounting, pose: Pose) -> None:
    frames = (
        FRAMES
        if mounting is Mounting.EYE_IN_HAND
        else Frames("base", "optical", "tool0", "board", "camera_link")
    )
    mount = Mount(answer(pose, mounting), frames)
    check(READERS[name](EXPORTERS[name].text(mount)), mount)


@pytest.mark.parametrize("name", EXPORTERS)
@pytest.mark.parametrize("pose", EDGES)
def test_readers_get_the_pose_back_at_the_edges(name: str, pose: Pose) -> None:
    mount = Mount(answer(pose @ REP_103_OPTICAL), FRAMES)
    check(READERS[name](EXPORTERS[name].text(mount)), mount)
    np.testing.assert_allclose(rotation_of(fixed_axis_angles(pose)), pose.rotation, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", EXPORTERS)
@pytest.mark.parametrize("words", HOSTILE)
def test_words_from_files_stay_words(name: str, words: str) -> None:
    mount = Mount(answer(recording=words, warnings=(words,)), FRAMES)
    check(READERS[name](EXPORTERS[name].text(mount)), mount)


@pytest.mark.parametrize("words", HOSTILE)
def test_a_shell_runs_one_command(words: str) -> None:
    mount = Mount(answer(recording=words, warnings=(words,)), FRAMES)
    script = 'ros2() { printf "%s\\n" "$@"; }\n' + EXPORTERS["ros2"].text(mount)
    run = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)
    assert not run.stderr
    called = run.stdout.splitlines()
    assert called[:3] == ["run", "tf2_ros", "static_transform_publisher"]
    check(read_command(called[3:]), mount)


@pytest.mark.parametrize("name", EXPORTERS)
@settings(max_examples=40)
@given(words=st.text())
def test_any_words_stay_words(name: str, words: str) -> None:
    mount = Mount(answer(recording=words, warnings=(words,)), FRAMES)
    check(READERS[name](EXPORTERS[name].text(mount)), mount)


@pytest.mark.parametrize("name", ["ros2", "urdf", "ros1", "moveit", "moveit2", "easy_handeye2", "opencv"])
def test_warnings_and_accuracy_are_in_the_file(name: str) -> None:
    text = EXPORTERS[name].text(Mount(answer(warnings=("the board was bent",)), FRAMES))
    assert "warning: the board was bent" in text
    assert "0.775 mm" in text  # root of 1e-7 + 2e-7 + 3e-7 m2


def test_no_exponents_and_no_negative_zero() -> None:
    assert number(1e-7) == "0.0000001"
    assert number(-0.0) == number(-1e-20) == "0.0"
    assert number(3.0) == "3.0"
    assert number(0.1 + 0.2) == "0.3"


def test_xml_comments_cannot_be_left() -> None:
    for text in ("--", "---", "a----b", "-->"):
        comment = xml_comment(text)
        assert "--" not in comment.removeprefix("<!--").removesuffix("-->")
        ET.fromstring(f"{comment}<a/>")


def test_angles_of_moveit_are_those_of_urdf() -> None:
    # The example of moveit_calibration's mistake: rotating axes would give (2.585, 2.830, -2.648).
    pose = turned(-0.4, 0.5, 0.3)
    np.testing.assert_allclose(fixed_axis_angles(pose), [-0.4, 0.5, 0.3], atol=1e-15)


def test_opencv_file_holds_target_and_camera() -> None:
    text = EXPORTERS["opencv"].text(Mount(answer(), Frames("tool0")))
    storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    np.testing.assert_allclose(storage.getNode("T_flange_camera").mat(), GENERIC.matrix, atol=1e-15)
    np.testing.assert_allclose(storage.getNode("T_base_target").mat(), TARGET.matrix, atol=1e-15)
    np.testing.assert_allclose(storage.getNode("camera_matrix").mat(), CAMERA.matrix)
    np.testing.assert_allclose(storage.getNode("distortion_coefficients").mat().ravel(), CAMERA.distortion)
    assert storage.getNode("image_width").real() == 1280


def test_calib_names_all_four_frames() -> None:
    beside = Frames("world", "optical", "panda_link8", "board")
    text = EXPORTERS["easy_handeye2"].text(
        Mount(answer(mounting=Mounting.EYE_TO_HAND, recording="a b/c"), beside)
    )
    parameters = yaml.safe_load(text)["parameters"]
    assert parameters["calibration_type"] == "eye_on_base"
    assert parameters["robot_base_frame"] == "world"
    assert parameters["robot_effector_frame"] == "panda_link8"
    assert parameters["tracking_marker_frame"] == "board"
    assert parameters["name"] == "a_b_c"


def test_json_says_frames_units_and_conventions() -> None:
    data = json.loads(EXPORTERS["json"].text(Mount(answer(), FRAMES)))
    assert data["format"] == "handeye-transform"
    assert data["covariance_frame"] == "camera_link"
    np.testing.assert_allclose(
        rotation_of(np.array(data["roll_pitch_yaw_rad"])), Pose(data["T_parent_child"]).rotation
    )
    assert data["target"]["parent_frame"] == "base"
    np.testing.assert_allclose(data["target"]["T_parent_child"], TARGET.matrix)
