"""Arms: the notation of the makers, derivatives on the manifold, and the way back from a pose."""

import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handeye import _core
from handeye.errors import InputError, SolveError
from handeye.robots import Arm, Joint, denavit_hartenberg, open_arm, shipped_arms
from handeye.types import Pose
from handeye.types.arrays import FloatArray

# a (m), d (m), alpha (rad), offset (rad): as Universal Robots publishes them.
UR5E = [
    (0.0, 0.1625, np.pi / 2, 0.0),
    (-0.425, 0.0, 0.0, 0.0),
    (-0.3922, 0.0, 0.0, 0.0),
    (0.0, 0.1333, np.pi / 2, 0.0),
    (0.0, 0.0997, -np.pi / 2, 0.0),
    (0.0, 0.0996, 0.0, 0.0),
]


def by_scipy(rows: list[tuple[float, float, float, float]], joints: FloatArray) -> FloatArray:
    """Return the flange by SciPy's rotations, link after link."""
    pose = np.eye(4)
    for (a, d, alpha, offset), q in zip(rows, joints, strict=True):
        link = np.eye(4)
        turn = Rotation.from_euler("z", q + offset)
        link[:3, :3] = (turn * Rotation.from_euler("x", alpha)).as_matrix()
        link[:3, 3] = turn.apply([a, 0, d])
        pose = pose @ link
    return pose


def posture(random: np.random.Generator, arm: Arm) -> FloatArray:
    low, high = arm.limits.T
    return random.uniform(np.maximum(low, -3), np.minimum(high, 3))


def test_a_shipped_ur5e_is_the_published_one() -> None:
    random = np.random.default_rng(1)
    described, notation = open_arm("ur5e"), denavit_hartenberg("ur5e", UR5E, [[-7, 7]] * 6, [3] * 6)
    for _ in range(20):
        joints = random.uniform(-3, 3, 6)
        expected = by_scipy(UR5E, joints)
        assert np.abs(described.forward(joints) - expected).max() < 1e-9
        assert np.abs(notation.forward(joints) - expected).max() < 1e-13


def test_an_offset_of_the_notation_turns_its_joint() -> None:
    rows = [(a, d, alpha, 0.3 * i - 1) for i, (a, d, alpha, _) in enumerate(UR5E)]
    arm = denavit_hartenberg("turned", rows, [[-7, 7]] * 6, [3] * 6)
    joints = np.array([0.4, -1.2, 2.0, 0.1, -0.5, 3.0])
    assert np.abs(arm.forward(joints) - by_scipy(rows, joints)).max() < 1e-13


def test_an_epson_like_arm_has_its_reach_and_layout() -> None:
    arm = open_arm("epson_c4l")
    assert np.allclose(arm.forward(np.zeros(6))[:3, 3], [0.1 + 0.4 + 0.065, 0, 0.32 + 0.4])
    assert np.allclose(arm.forward(np.zeros(6))[:3, 2], [1, 0, 0])
    stretched = arm.forward(np.deg2rad([0, -90, 90, 0, 0, 0]))
    # 900 mm to the centre of the wrist, as the maker says, and 65 mm to the flange.
    assert np.allclose(stretched[:3, 3], [0.9 + 0.065, 0, 0.32], atol=1e-9)


@pytest.mark.parametrize("name", shipped_arms())
def test_shipped_arms_move_and_come_back(name: str) -> None:
    arm = open_arm(name)
    random = np.random.default_rng(2)
    assert np.all(np.isfinite(arm.limits))
    assert np.all(np.isfinite(arm.velocities))
    for _ in range(20):
        joints = posture(random, arm)
        goal = Pose(arm.forward(joints))
        found = arm.inverse(goal, joints + random.uniform(-0.02, 0.02, len(arm)))
        assert arm.within_limits(found)
        assert np.abs(arm.forward(found) - goal.matrix).max() < 1e-8
        assert np.abs(arm.forward(arm.inverse(goal)) - goal.matrix).max() < 1e-8


@pytest.mark.parametrize("name", shipped_arms())
def test_jacobians_are_derivatives(name: str) -> None:
    arm = open_arm(name)
    random = np.random.default_rng(3)
    joints = np.array([posture(random, arm) for _ in range(5)])
    here = arm.forward(joints)
    flange, base = arm.jacobian(joints), arm.jacobian(joints, "base")
    for i in range(len(arm)):
        step = np.zeros(len(arm))
        step[i] = 1e-6
        ahead, behind = arm.forward(joints + step), arm.forward(joints - step)
        back = np.linalg.inv(here)
        by_flange = (_core.se3_log(back @ ahead) - _core.se3_log(back @ behind)) / 2e-6
        by_base = (_core.se3_log(ahead @ back) - _core.se3_log(behind @ back)) / 2e-6
        assert np.abs(flange[:, :, i] - by_flange).max() < 1e-7
        assert np.abs(base[:, :, i] - by_base).max() < 1e-7


def test_shapes_follow_the_input() -> None:
    arm = open_arm("ur5e")
    joints = np.zeros((2, 3, 6))
    assert arm.forward(joints).shape == (2, 3, 4, 4)
    assert arm.jacobian(joints).shape == (2, 3, 6, 6)
    assert arm.forward(np.zeros(6)).shape == (4, 4)
    assert arm.forward(np.zeros((0, 6))).shape == (0, 4, 4)


def test_many_poses_at_once_say_which_are_reached() -> None:
    arm = open_arm("ur5e")
    goals = arm.forward(np.random.default_rng(4).uniform(-2, 2, (20, 6)))
    goals[7, :3, 3] = [2.0, 0, 0]
    joints, reached = arm.inverse_all(goals)
    assert list(np.flatnonzero(~reached)) == [7]
    assert np.abs(arm.forward(joints[reached]) - goals[reached]).max() < 1e-8


def test_all_postures_are_found() -> None:
    arm = open_arm("ur5e")
    goal = Pose(arm.forward([0.4, -1.6, 1.7, -1.5, -1.4, 0.3]))
    postures = arm.postures(goal, attempts=200)
    assert len(postures) == 8
    assert np.abs(arm.forward(postures) - goal.matrix).max() < 1e-8


def test_what_is_out_of_reach_is_said() -> None:
    with pytest.raises(SolveError, match=r"comes within [0-9.]+ mm") as caught:
        open_arm("ur5e").inverse(Pose.exp([1.5, 0, 0.2, 0, 0, 0]))
    assert caught.value.code == "out_of_reach"


def test_a_tool_moves_the_end() -> None:
    arm, tool = open_arm("ur5e"), Pose.exp([0, 0, 0.1, 0, 0.3, 0])
    joints = np.array([0.1, -1, 1, 0.2, 0.3, 0.4])
    assert np.allclose(arm.with_flange(tool).forward(joints), arm.forward(joints) @ tool.matrix)


def test_an_arm_can_be_limited_further() -> None:
    arm = open_arm("ur5e")
    theirs = np.where(np.arange(6)[:, None] == 2, [[-0.5, 0.4]], arm.limits * 2)
    narrow = arm.limited(theirs)
    assert np.array_equal(narrow.limits, np.where(np.arange(6)[:, None] == 2, [[-0.5, 0.4]], arm.limits))
    assert np.array_equal(narrow.forward(np.ones(6)), arm.forward(np.ones(6)))
    assert narrow.limited(arm.limits).fingerprint == narrow.fingerprint == arm.fingerprint
    assert narrow.with_flange(Pose.identity()).fingerprint != arm.fingerprint
    # It plans within them.
    found, reached = narrow.inverse_all(arm.forward(np.random.default_rng(0).uniform(-2, 2, (50, 6))))
    assert 0 < reached.sum() < 50
    assert all(narrow.within_limits(q) for q in found[reached])
    for wrong, words in (
        (arm.limits[:5], "shape"),
        (arm.limits + 20, "joint"),
        (arm.limits * np.nan, "joint"),
    ):
        with pytest.raises(InputError, match=words):
            arm.limited(wrong)


def test_arms_travel_between_processes() -> None:
    arm = open_arm("lbr_iiwa_14")
    copy = pickle.loads(pickle.dumps(arm))
    assert np.array_equal(copy.forward(np.ones(7)), arm.forward(np.ones(7)))


def test_unusable_arms_and_postures_are_refused() -> None:
    arm = open_arm("ur5e")
    with pytest.raises(InputError, match=r"expected \(..., 6\)"):
        arm.forward(np.zeros(7))
    with pytest.raises(InputError, match="not finite"):
        arm.forward([0, 0, np.nan, 0, 0, 0])
    with pytest.raises(InputError, match="frame must be"):
        arm.jacobian(np.zeros(6), "tool")
    one = Joint("a", Pose.identity())
    with pytest.raises(InputError, match="two joints of one name"):
        Arm("twice", (one, one))
    with pytest.raises(InputError, match="0 joints"):
        Arm("none", ())
    with pytest.raises(InputError, match="not in order"):
        Arm("crossed", (Joint("a", Pose.identity(), lower=1, upper=-1),))
    with pytest.raises(InputError, match="axis"):
        Arm("flat", (Joint("a", Pose.identity(), (0, 0, 0)),))
    with pytest.raises(InputError, match="largest speed"):
        Arm("still", (Joint("a", Pose.identity(), velocity=0),))
    with pytest.raises(InputError, match="the arms are epson_c4l"):
        raise_hint("no_such_arm")


def raise_hint(name: str) -> None:
    try:
        open_arm(name)
    except InputError as error:
        raise InputError(str(error.hint)) from error
