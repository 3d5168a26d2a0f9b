"""The Jacobians that estimates take: signs for both mountings, and frames found from the views."""

import numpy as np
import pytest

from handeye.errors import InputError
from handeye.robots import ArmKinematics, arm_kinematics, open_arm
from handeye.types import Mounting, Pose, View
from handeye.types.arrays import FloatArray

ARM = open_arm("ur5e")
ROOT, TOOL = Pose.exp([0.2, -0.1, 0.8, 0, 0, np.pi]), Pose.exp([0, 0.02, 0.15, 0.3, 0, 0.1])


def postures(count: int) -> FloatArray:
    return np.random.default_rng(count).uniform(-2.5, 2.5, (count, 6))


def views(poses: FloatArray, joints: FloatArray | None) -> list[View]:
    return [
        View(
            f"v{k}", Pose(pose), [0], [[0.0, 0.0]], joints_rad=None if joints is None else joints[k].tolist()
        )
        for k, pose in enumerate(poses)
    ]


@pytest.mark.parametrize("mounting", list(Mounting))
@pytest.mark.parametrize("frames", [(Pose.identity(), Pose.identity()), (ROOT, TOOL)])
def test_a_joint_that_is_elsewhere_moves_the_middle_of_the_chain(
    mounting: Mounting, frames: tuple[Pose, Pose]
) -> None:
    kinematics = ArmKinematics(ARM, *frames)
    joints = postures(6)
    jacobians = kinematics.motion_jacobians(mounting, joints)
    assert jacobians.shape == (6, 6, 6)
    offset = np.random.default_rng(1).normal(size=6) * 1e-5
    reported, true = kinematics.forward(joints), kinematics.forward(joints + offset)
    for k in range(6):
        A = mounting.chain(Pose(reported[k]))
        moved = Pose.exp(jacobians[k] @ offset) @ A
        assert np.abs(moved.matrix - mounting.chain(Pose(true[k])).matrix).max() < 1e-9


def test_frames_of_the_controller_are_found() -> None:
    joints = postures(8)
    reported = ArmKinematics(ARM, ROOT, TOOL).forward(joints)
    found = arm_kinematics(ARM, views(reported, joints))
    assert np.abs(found.T_base_root.matrix - ROOT.matrix).max() < 1e-8
    assert np.abs(found.T_tip_flange.matrix - TOOL.matrix).max() < 1e-8
    assert np.abs(found.forward(joints) - reported).max() < 1e-8


def test_an_arm_that_is_nearly_the_one_described_is_taken_as_it_is() -> None:
    joints = postures(8)
    off = ARM.forward(joints + np.deg2rad(0.1))
    found = arm_kinematics(ARM, views(off, joints))
    assert found.T_base_root == Pose.identity()
    assert found.T_tip_flange == Pose.identity()


@pytest.mark.parametrize("count", [1, 3, 8])
def test_poses_of_another_arm_are_refused(count: int) -> None:
    joints = postures(count)
    with pytest.raises(InputError, match="not those of arm ur5e at the reported joint positions: off by"):
        arm_kinematics(ARM, views(open_arm("epson_c4l").forward(joints), joints))
    degrees = views(ARM.forward(joints), np.rad2deg(joints))
    with pytest.raises(InputError, match="not those of arm") as caught:
        arm_kinematics(ARM, degrees)
    assert "radians" in str(caught.value.hint)


def test_missing_or_too_many_joints_are_named() -> None:
    joints = postures(4)
    poses = ARM.forward(joints)
    with pytest.raises(InputError, match="no view has joint positions"):
        arm_kinematics(ARM, views(poses, None))
    with pytest.raises(InputError, match="view v0: 6 joint positions, but arm lbr_iiwa_14 has 7"):
        arm_kinematics(open_arm("lbr_iiwa_14"), views(poses, joints))
