"""Corrected arms as others read them: MuJoCo reads the kinematics, nothing of this package does."""

import csv
import io
import json
import re

import numpy as np
import pytest
import yaml

from handeye.errors import InputError
from handeye.robots import Arm, Joint, open_arm
from handeye.robots.displaced import random_displacements
from handeye.robots.formats import ARM_FORMATS, CorrectedArm
from handeye.types import Pose

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
ARMS = ("ur5e", "epson_c4l", "lbr_iiwa_14")


def corrected(arm: Arm, seed: int = 0, size: float = 1e-3, previous: str | None = None) -> CorrectedArm:
    random = np.random.default_rng(seed)
    offsets = 0.01 * random.standard_normal(len(arm))
    return CorrectedArm(
        arm, random_displacements(random, arm, size, size), offsets, ("made -- here",), previous
    )


def scara() -> Arm:
    turn = Joint("shoulder", Pose.exp([0, 0, 0.3, 0, 0, 0]))
    elbow = Joint("elbow", Pose.exp([0.3, 0, 0, 0, 0, 0]))
    quill = Joint("quill", Pose.exp([0.25, 0, 0, np.pi, 0, 0]), sliding=True, lower=0.0, upper=0.2)
    return Arm("scara", (turn, elbow, quill, Joint("roll", Pose.identity())))


def read_by_mujoco(urdf: str, postures: np.ndarray) -> np.ndarray:
    """Pose of the last body (K, 4, 4) at postures; MuJoCo keeps fixed links, which carry masses here."""
    mass = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    text = re.sub(r'(<link name="[^"]*") ?/>', rf"\1>{mass}</link>", urdf)
    settings = '<mujoco><compiler fusestatic="false" strippath="false"/></mujoco></robot>'
    model = mujoco.MjModel.from_xml_string(text.replace("</robot>", settings))
    data = mujoco.MjData(model)
    found = []
    for joints in postures:
        data.qpos[:] = joints
        mujoco.mj_kinematics(model, data)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = data.xmat[-1].reshape(3, 3), data.xpos[-1]
        found.append(pose)
    return np.array(found)


def placed(name: str, kind: str, parent: str, pose: np.ndarray) -> str:
    """A joint and the link that it carries, in URDF."""
    x, y, z = pose[:3, 3].tolist()
    roll, pitch, yaw = (float(angle) for angle in Pose(pose).roll_pitch_yaw_rad)
    limit = '<limit lower="-9" upper="9" effort="0" velocity="0"/>' if kind == "prismatic" else ""
    return (
        f'<link name="{name}"/><joint name="to_{name}" type="{kind}"><parent link="{parent}"/><child link="{name}"/>'
        f'<origin xyz="{x!r} {y!r} {z!r}" rpy="{roll!r} {pitch!r} {yaw!r}"/><axis xyz="0 0 1"/>{limit}</joint>'
    )


def postures(arm: Arm) -> np.ndarray:
    return np.random.default_rng(1).uniform(-1, 1, (10, len(arm)))


@pytest.mark.parametrize("arm", [*map(open_arm, ARMS), scara()], ids=lambda arm: arm.name)
@pytest.mark.parametrize("name", ["urdf", "xacro"])
def test_descriptions_are_read_by_mujoco(arm: Arm, name: str) -> None:
    one = corrected(arm)
    text = ARM_FORMATS[name].text(one)
    if name == "xacro":  # what xacro makes of the one use in the file
        body = re.search(r"<xacro:macro[^>]*>(.*)</xacro:macro>", text, re.DOTALL)
        assert body is not None
        text = f'<robot name="arm">{body[1].replace("${prefix}", "left_")}</robot>'
        assert 'link name="left_base"' in text
    found = read_by_mujoco(text, postures(arm))
    np.testing.assert_allclose(found, one.built.forward(postures(arm)), atol=1e-9)


def test_the_calibration_of_universal_robots_is_read_by_mujoco() -> None:
    arm = open_arm("ur5e")
    one = corrected(arm)
    frames = yaml.safe_load(ARM_FORMATS["ur"].text(one))["kinematics"]
    assert frames.pop("hash") == "handeye"
    # As ur_description makes a URDF of it: one joint after the other, each about its z axis.
    parts, parent = ['<robot name="ur"><link name="base"/>'], "base"
    for link, f in frames.items():
        origin = f'<origin xyz="{f["x"]!r} {f["y"]!r} {f["z"]!r}" rpy="{f["roll"]!r} {f["pitch"]!r} {f["yaw"]!r}"/>'
        parts.append(
            f'<link name="{link}"/><joint name="{link}" type="continuous"><parent link="{parent}"/>'
            f'<child link="{link}"/>{origin}<axis xyz="0 0 1"/></joint>'
        )
        parent = link
    found = read_by_mujoco("".join(parts) + "</robot>", postures(arm))
    np.testing.assert_allclose(found, one.built.forward(postures(arm)), atol=1e-9)
    # Told nothing, it is the table that the maker publishes.
    nothing = CorrectedArm(arm, np.zeros((6, 6)), np.zeros(6))
    wrist = yaml.safe_load(ARM_FORMATS["ur"].text(nothing))["kinematics"]["wrist_1"]
    assert (wrist["x"], round(wrist["z"], 12)) == (-0.3922, 0.1333)
    with pytest.raises(InputError, match="six that turn"):
        ARM_FORMATS["ur"].text(corrected(scara()))
    with pytest.raises(InputError, match="not on the axis"):
        ARM_FORMATS["ur"].text(corrected(open_arm("epson_c4l").with_flange(Pose.exp([0.1, 0, 0, 0, 0, 0]))))


@pytest.mark.parametrize("arm", [*map(open_arm, ARMS), scara()], ids=lambda arm: arm.name)
@pytest.mark.parametrize("size", [0.0, 1e-6, 1e-3])
@pytest.mark.parametrize("name", ["dh", "dh_modified"])
def test_tables_are_the_arm(arm: Arm, size: float, name: str) -> None:
    one = corrected(arm, size=size)
    text = ARM_FORMATS[name].text(one)
    before, after = (
        np.vstack([np.array(line.split(": ")[1].split(), float).reshape(3, 4), [0, 0, 0, 1]])
        for line in text.split("\n")
        if "three rows of four" in line
    )
    rows = list(csv.DictReader(io.StringIO("\n".join(x for x in text.split("\n") if not x.startswith("#")))))
    assert [row["joint"] for row in rows] == list(arm.joint_names)

    def about(axis: int, angle: float) -> np.ndarray:
        pose, (i, j) = np.eye(4), ((axis + 1) % 3, (axis + 2) % 3)
        pose[[i, j], [i, j]] = np.cos(angle)
        pose[j, i], pose[i, j] = np.sin(angle), -np.sin(angle)
        return pose

    def along(axis: int, way: float) -> np.ndarray:
        pose = np.eye(4)
        pose[axis, 3] = way
        return pose

    # A chain of joints about or along z, as MuJoCo reads it.
    parts, here, parent = ['<robot name="table"><link name="base"/>'], before, "base"
    for row in rows:
        screw = about(2, float(row["theta_rad"])) @ along(2, float(row["d_m"]))
        normal = about(0, float(row["alpha_rad"])) @ along(0, float(row["a_m"]))
        here = here @ (screw if name == "dh" else normal @ screw)
        kind = "prismatic" if row["slides"] == "1" else "continuous"
        parts.append(placed(row["joint"], kind, parent, here))
        here, parent = normal if name == "dh" else np.eye(4), row["joint"]
    parts.append(placed("flange", "fixed", parent, here @ after))
    found = read_by_mujoco("".join(parts) + "</robot>", postures(arm))
    np.testing.assert_allclose(found, one.built.forward(postures(arm)), atol=1e-9)


def test_zeros_are_where_the_joints_truly_are_at_zero() -> None:
    arm = open_arm("epson_c4l")
    one = corrected(arm, size=0.0)
    described = CorrectedArm(arm, np.zeros((6, 6)), np.zeros(6))
    at_zero = read_by_mujoco(ARM_FORMATS["urdf"].text(described), np.zeros((1, 6)))
    patterns = {"fanuc": r"J\d = (\S+) deg", "kuka": r"A\d (\S+?)[,}]", "abb": r"(-?\d+\.\d+)"}
    for name, pattern in patterns.items():
        said = [line for line in ARM_FORMATS[name].text(one).split("\n") if line[:1] not in "!;"]
        readings = np.deg2rad([float(value) for value in re.findall(pattern, "\n".join(said))])
        found = read_by_mujoco(ARM_FORMATS["urdf"].text(one), readings[np.newaxis])
        np.testing.assert_allclose(found, at_zero, atol=1e-9)
        assert not ARM_FORMATS[name].whole


def test_the_calibration_of_lerobot_is_changed_by_whole_steps() -> None:
    arm = open_arm("epson_c4l")
    motors = {
        name: {"id": i, "drive_mode": i % 2, "homing_offset": 100 * i}
        for i, name in enumerate(arm.joint_names)
    }
    one = corrected(arm, previous=json.dumps(motors))
    found = json.loads(ARM_FORMATS["lerobot"].text(one))
    for motor, offset in zip(found.values(), one.joint_offsets, strict=True):
        direction = -1 if motor["drive_mode"] else 1
        steps = direction * (100 * motor["id"] - motor["homing_offset"])
        assert abs(steps / 4096 * 2 * np.pi - offset) <= np.pi / 4096
    with pytest.raises(InputError, match="changed, not made"):
        ARM_FORMATS["lerobot"].text(corrected(arm))
    for wrong in ("[", "[]", '{"joint_1": {"homing_offset": true}}', '{"joint_1": 3}'):
        with pytest.raises(InputError, match="previous calibration"):
            ARM_FORMATS["lerobot"].text(corrected(arm, previous=wrong))
    far = {
        name: {"homing_offset": 2047 if one.joint_offsets[i] < 0 else -2047} for i, name in enumerate(motors)
    }
    with pytest.raises(InputError, match="the servo keeps at most"):
        ARM_FORMATS["lerobot"].text(corrected(arm, previous=json.dumps(far)))
