"""An arm that is not what it says: it reports nominal poses and stands elsewhere."""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import DeviceError, InputError, SolveError
from handeye.robots.displaced import displaced, random_displacements
from handeye.robots.model import Arm
from handeye.robots.protocol import Goal, Reading
from handeye.types import Pose
from handeye.types.arrays import FloatArray


@dataclass(frozen=True)
class ArmErrors:
    """What is wrong with an arm, per axis or joint; zero is exact.

    Parameters
    ----------
    encoder_sigma_rad
        New at every motion.
    offset_sigma_rad
        Constant offsets of the joints but the first and the last: theirs only say where base and flange are.
    length_sigma_m, twist_sigma_rad
        Constant errors of where each joint sits on the link before it.
    flange_sigma_m, flange_sigma_rad, base_sigma_m, base_sigma_rad
        New at every motion, in the frame of the flange or of the base.
    backlash_rad
        Play of each joint: it stops half of this short of where it is going.

    Raises
    ------
    InputError
        A negative value.
    """

    encoder_sigma_rad: float = 0.0
    offset_sigma_rad: float = 0.0
    length_sigma_m: float = 0.0
    twist_sigma_rad: float = 0.0
    flange_sigma_m: float = 0.0
    flange_sigma_rad: float = 0.0
    base_sigma_m: float = 0.0
    base_sigma_rad: float = 0.0
    backlash_rad: float = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0 <= value < float("inf"):
                raise InputError(f"{name} {value}, expected zero or more", code=Code.OUT_OF_RANGE)


class SimulatedArm:
    """Moves at once; chance depends on the seed and the label of the goal alone.

    So a motion that is repeated after a break ends where it ended before.

    Parameters
    ----------
    arm
        What it claims to be.
    errors
        How it differs.
    seed
        Of the differences.
    start_rad
        Where it stands at first.

    Raises
    ------
    InputError
        A start outside the joint limits.
    """

    def __init__(self, arm: Arm, errors: ArmErrors, seed: int, start_rad: Sequence[float]) -> None:
        if not arm.within_limits(start_rad):
            raise InputError(f"{arm.name}: the start is outside the joint limits", code=Code.OUT_OF_RANGE)
        self._arm = arm
        self._errors = errors
        self._seed = seed
        random = np.random.default_rng([seed, 1])
        self._offsets = errors.offset_sigma_rad * random.standard_normal(len(arm))
        self._offsets[[0, -1]] = 0.0
        built = random_displacements(random, arm, errors.length_sigma_m, errors.twist_sigma_rad)
        self._true = displaced(arm, built)
        self._commanded = np.array(start_rad, dtype=np.float64)
        self._T_base_flange = self._stand(self._commanded, self._commanded, "start")

    @property
    def hidden_pose(self) -> Pose:
        """`T_base_flange` where it truly stands: for the simulated camera only."""
        return self._T_base_flange

    def place(self, joints_rad: Sequence[float]) -> None:
        """Put it where an earlier process left it."""
        self._commanded = np.array(joints_rad, dtype=np.float64)

    def move_to(self, goal: Goal) -> None:
        """Go to the goal's joints, or find some.

        Raises
        ------
        DeviceError
            Out of reach or beyond the joint limits.
        """
        joints = self._joints(goal)
        self._T_base_flange = self._stand(joints, self._commanded, goal.label)
        self._commanded = joints

    def read_pose(self) -> Reading:
        """Return where its controller believes it stands."""
        nominal = self._arm.forward(self._commanded)
        return Reading(Pose(nominal), tuple(self._commanded.tolist()))

    def stop(self) -> None:
        """Do nothing: it stands already."""

    def _joints(self, goal: Goal) -> FloatArray:
        if goal.joints_rad is not None:
            joints = np.array(goal.joints_rad, dtype=np.float64)
            if len(joints) != len(self._arm) or not self._arm.within_limits(joints):
                raise DeviceError(f"{goal.label}: beyond the joint limits", code=Code.MOTION_REFUSED)
            return joints
        try:
            return self._arm.inverse(goal.T_base_flange, self._commanded)
        except SolveError as error:
            raise DeviceError(f"{goal.label}: {error.message}", code=Code.MOTION_REFUSED) from error

    def _stand(self, joints: FloatArray, before: FloatArray, label: str) -> Pose:
        errors = self._errors
        random = np.random.default_rng([self._seed, 2, zlib.crc32(label.encode())])
        encoder = errors.encoder_sigma_rad * random.standard_normal(len(joints))
        play = 0.5 * errors.backlash_rad * np.sign(joints - before)
        pose = self._true.forward(joints + self._offsets + encoder - play)
        sigma = np.repeat(
            [errors.base_sigma_m, errors.base_sigma_rad, errors.flange_sigma_m, errors.flange_sigma_rad], 3
        )
        base, flange = _core.se3_exp((sigma * random.standard_normal(12)).reshape(2, 6))
        return Pose(base @ pose @ flange)
