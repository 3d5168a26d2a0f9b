"""An arm as it is built: its flange is where the estimate says, and another reader of its URDF agrees."""

from xml.etree import ElementTree as ET

import numpy as np
import pytest

from handeye import _core
from handeye.estimation import Measurements, make_estimator
from handeye.robots import ArmKinematics, open_arm
from handeye.robots.corrected import corrected_arm, urdf_of
from handeye.robots.displaced import displaced, random_displacements
from handeye.robots.urdf import read_urdf
from handeye.simulation.cells import CellOptions, ErrorKind, simulate_cell
from handeye.types.calibration import ModelName


def rotation(rpy: list[float]) -> np.ndarray:
    """Turns about fixed x, y, z axes, as URDF has them."""
    (a, b, c), (d, e, f) = np.cos(rpy), np.sin(rpy)
    x = np.array([[1, 0, 0], [0, a, -d], [0, d, a]])
    y = np.array([[b, 0, e], [0, 1, 0], [-e, 0, b]])
    z = np.array([[c, -f, 0], [f, c, 0], [0, 0, 1]])
    return z @ y @ x


def read_apart(text: str, joints: np.ndarray) -> np.ndarray:
    """Flange (4, 4) of a serial URDF at joints (n,), by nothing of this package (Rodrigues' formula)."""
    pose, left = np.eye(4), list(joints)
    for joint in ET.fromstring(text).iter("joint"):
        origin = joint.find("origin")
        assert origin is not None
        here = np.eye(4)
        here[:3, :3] = rotation([float(v) for v in origin.attrib["rpy"].split()])
        here[:3, 3] = [float(v) for v in origin.attrib["xyz"].split()]
        pose = pose @ here
        axis = joint.find("axis")
        if axis is None:
            continue
        x, y, z = (float(v) for v in axis.attrib["xyz"].split())
        move, q = np.eye(4), left.pop(0)
        if joint.attrib["type"] == "prismatic":
            move[:3, 3] = q * np.array([x, y, z])
        else:
            hat = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            move[:3, :3] = np.eye(3) + np.sin(q) * hat + (1 - np.cos(q)) * hat @ hat
        pose = pose @ move
    return pose


@pytest.mark.parametrize("name", ["ur5e", "epson_c4l", "lbr_iiwa_14"])
def test_another_reader_agrees(name: str) -> None:
    random = np.random.default_rng(0)
    arm = open_arm(name)
    offsets = 0.01 * random.standard_normal(len(arm))
    built = corrected_arm(arm, random_displacements(random, arm, 1e-3, 1e-3), offsets)
    text = urdf_of(built, ["made -- for a test"])
    for _ in range(5):
        joints = random.uniform(-1, 1, len(arm))
        np.testing.assert_allclose(read_apart(text, joints), built.forward(joints), atol=1e-12)


def test_our_reader_agrees(tmp_path) -> None:  # noqa: ANN001
    arm = open_arm("ur5e")
    path = tmp_path / "arm.urdf"
    path.write_text(urdf_of(arm))
    again = read_urdf(path)
    joints = np.random.default_rng(1).uniform(-1, 1, 6)
    np.testing.assert_allclose(again.forward(joints), arm.forward(joints), atol=1e-12)
    np.testing.assert_allclose(again.limits, arm.limits)


def test_offsets_and_links_are_put_where_they_belong() -> None:
    random = np.random.default_rng(2)
    arm = open_arm("ur5e")
    twists = random_displacements(random, arm, 1e-3, 1e-3)
    twists[0] = 0.0
    twists[-1, [2, 5]] = 0.0
    joints, offsets = random.uniform(-1, 1, 6), 0.01 * random.standard_normal(6)
    found = corrected_arm(arm, twists, offsets).forward(joints)
    np.testing.assert_allclose(found, displaced(arm, twists).forward(joints + offsets), atol=1e-12)


def test_a_corrected_arm_is_nearer_to_the_truth_where_nobody_looked() -> None:
    """30 views of an arm with wrong links: the tool over unseen postures, before and after."""
    cell = simulate_cell(ErrorKind.MIXTURE_RANDOM, 3, CellOptions(views=(30, 30)), seed=5)
    assert cell.arm is not None
    arm = open_arm("ur5e")
    estimate = make_estimator(ModelName.AUTO, ArmKinematics(arm))(Measurements.of_recording(cell.recording))
    assert estimate.arm_correction is not None
    kinematics = ArmKinematics(arm)
    twists = kinematics.link_twists @ estimate.arm_correction.displacements
    built = corrected_arm(arm, twists, estimate.arm_correction.joint_offsets)
    random = np.random.default_rng(3)
    seen = np.array([view.joints_rad for view in cell.recording.views])
    postures = seen[random.integers(0, len(seen), 200)] + random.uniform(-0.3, 0.3, (200, 6))
    truth = cell.arm.built.forward(postures + cell.arm.offsets_rad)
    linear = estimate.poses_as_built(arm.forward(postures), postures)
    np.testing.assert_allclose(built.forward(postures), linear, atol=2e-5)

    def off(flange: np.ndarray) -> float:
        """Mean distance from the truth, up to where base and flange are."""
        base, tip = _core.closed_form("shah", flange, truth)
        return float(np.linalg.norm((base @ flange @ tip - truth)[:, :3, 3], axis=1).mean())

    assert off(built.forward(postures)) < off(arm.forward(postures)) / 3
