"""What a robot says of itself is taken only if it can be true, and the usual mistakes are named."""

from types import SimpleNamespace
from typing import NoReturn

import numpy as np
import pytest

from handeye.errors import DeviceError
from handeye.robots import Arm, Joint, open_arm
from handeye.robots.protocol import Reading
from handeye.robots.reading import checked_reading, typed_reading
from handeye.types import Pose

ARM = open_arm("epson_c4l")
RANDOM = np.random.default_rng(3)
TURN = Pose.exp([0, 0, 0, 0, 0, np.pi])


def postures(arm: Arm, count: int) -> np.ndarray:
    low, high = np.clip(arm.limits.T, -2.5, 2.5)
    return RANDOM.uniform(low, high, (count, len(arm)))


def reading(arm: Arm, joints: np.ndarray) -> Reading:
    return Reading(Pose(arm.forward(joints)), tuple(joints.tolist()))


def scaled(pose: Pose, factor: float) -> Pose:
    matrix = pose.matrix.copy()
    matrix[:3, 3] *= factor
    return Pose(matrix)


def complaint(answer: object, arm: Arm = ARM, expected: Pose | None = None) -> str:
    with pytest.raises(DeviceError) as error:
        checked_reading(answer, arm, expected=expected)
    assert error.value.code in {"bad_reading", "no_joints"}
    assert len(error.value.message) < 400
    return error.value.message


def test_what_is_true_is_taken_also_off_its_nominal_measures() -> None:
    for joints in postures(ARM, 20):
        true = reading(ARM, joints)
        assert checked_reading(true, ARM) == true
        off = Reading(true.T_base_flange @ Pose.exp([0.004, 0, 0.003, 0, 0.005, 0]), true.joints_rad)
        assert checked_reading(off, ARM) == off


@pytest.mark.parametrize("name", ["epson_c4l", "ur5e", "lbr_iiwa_14"])
def test_the_usual_mistakes_are_named(name: str) -> None:
    arm = open_arm(name)
    for joints in postures(arm, 20):
        true = reading(arm, joints)
        pose, degrees = true.T_base_flange, tuple(np.rad2deg(joints).tolist())
        for wrong, words in (
            (Reading(pose, degrees), "the joint positions are in degrees"),
            (Reading(scaled(pose, 1e3), true.joints_rad), "the pose is in millimetres"),
            (Reading(pose.inverse(), true.joints_rad), "the base in the flange"),
            (
                Reading(scaled(pose.inverse(), 1e3), true.joints_rad),
                "in millimetres, .* and the pose is that of the base in the flange",
            ),
            (Reading(scaled(pose, 1e3), degrees), "in degrees.* and the pose is in millimetres"),
            (Reading(TURN @ pose, true.joints_rad), "the base is turned by 180 deg about z"),
            (Reading(pose @ Pose.exp([0, 0, 0.15, 0, 0, 0]), true.joints_rad), r"\(0, 0, 150\) mm"),
        ):
            with pytest.raises(DeviceError, match=words):
                checked_reading(wrong, arm)


def test_another_arm_is_named() -> None:
    ur = open_arm("ur5e")
    joints = 0.3 + 0.1 * np.arange(6)
    assert "these are joints and pose of ur5e, not of epson_c4l" in complaint(reading(ur, joints))
    assert "7 joint positions" not in complaint(reading(ur, joints))
    assert "7 joint positions, expected 6" in complaint(Reading(Pose.identity(), (0.1,) * 7))


def test_limits_hold_even_where_the_pose_fits() -> None:
    joints = np.array([0.1, -0.2, 0.3, 0.1, 0.2, 0.3])
    beyond = joints.copy()
    beyond[5] = ARM.limits[5, 1] + 0.01
    assert "joint joint_6 is at" in complaint(reading(ARM, beyond))
    # An encoder reads a little beyond a limit at which the arm stands.
    beyond[5] = ARM.limits[5, 1] + 5e-4
    checked_reading(reading(ARM, beyond), ARM)


def test_sliding_joints_have_their_own_units() -> None:
    placement = Pose.exp([0.2, 0, 0.3, 0, 0, 0])
    arm = Arm(
        "gantry",
        (
            Joint("slide", Pose.identity(), sliding=True, lower=-0.1, upper=2.0),
            Joint("turn", placement, lower=-3, upper=3),
        ),
        placement,
    )
    true = reading(arm, np.array([0.4, 0.7]))
    with pytest.raises(DeviceError, match="in degrees and millimetres"):
        checked_reading(Reading(true.T_base_flange, (400.0, np.rad2deg(0.7))), arm)
    with pytest.raises(DeviceError, match="sliding joints are in millimetres"):
        checked_reading(Reading(true.T_base_flange, (400.0, 0.7)), arm)


def test_without_joints_no_way_can_be_checked() -> None:
    pose = Pose(ARM.forward([0.1, -0.2, 0.3, 0.1, 0.2, 0.3]))
    assert "does not tell its joint positions" in complaint(Reading(pose))
    assert "in millimetres" in complaint(Reading(scaled(pose, 1e3)), expected=pose)
    assert checked_reading(Reading(pose), ARM, joints_needed=False).joints_rad is None


class Trap:
    """Something that raises whatever is asked of it."""

    def __array__(self, *_: object, **__: object) -> NoReturn:
        raise RuntimeError("trap")


@pytest.mark.parametrize(
    "answer",
    [
        None,
        np.eye(4),
        "here",
        Reading(np.eye(4), (0.0,) * 6),  # type: ignore[arg-type]
        Reading(Pose.identity(), "abcdef"),  # type: ignore[arg-type]
        Reading(Pose.identity(), ()),
        Reading(Pose.identity(), (float("nan"),) * 6),
        Reading(Pose.identity(), (float("inf"),) * 6),
        Reading(Pose.identity(), (None,) * 6),  # type: ignore[arg-type]
        Reading(Pose.identity(), ((0.0,) * 6,)),  # type: ignore[arg-type]
        Reading(Pose.identity(), (0.0,) * 240),
        Reading(Pose.identity(), 3.0),  # type: ignore[arg-type]
        Reading(Pose.identity(), (1 + 2j,) * 6),  # type: ignore[arg-type]
        Reading(Pose.__new__(Pose), (0.0,) * 6),
        Reading(Pose.identity(), Trap()),  # type: ignore[arg-type]
    ],
)
def test_wrong_types_and_lengths_are_errors_of_the_device(answer: object) -> None:
    complaint(answer)


def test_arrays_of_numbers_become_plain_ones() -> None:
    joints = np.array([0.1, 0.2], dtype=np.float32)
    found = typed_reading(Reading(Pose.identity(), joints))  # type: ignore[arg-type]
    assert found.joints_rad == tuple(float(value) for value in joints)


def test_what_only_looks_like_a_reading_is_none() -> None:
    """Fields of the right names are not enough: what else comes with them nobody knows."""
    alike = SimpleNamespace(T_base_flange=Pose.identity(), joints_rad=None)
    with pytest.raises(DeviceError, match="expected Reading"):
        typed_reading(alike)


def test_joints_without_end_are_refused_before_they_are_copied() -> None:
    many = Reading(TURN, np.broadcast_to(0.0, (10**12,)))  # type: ignore[arg-type]
    assert "1000000000000 joints" in complaint(many)
