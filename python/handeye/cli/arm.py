"""The options that name the arm, for every command that can make use of its kinematics."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from cyclopts import Parameter

from handeye.cli.failures import UsageError
from handeye.robots import Arm, ArmKinematics, arm_kinematics, open_arm
from handeye.types import View
from handeye.types.calibration import ModelName


@Parameter(name="*", group="The arm, where it is known")
@dataclass(frozen=True)
class ArmSource:
    """Which arm it is; every view must then have joint positions."""

    robot: Annotated[
        str | None, Parameter(help="Name of an arm (epson_c4l, lbr_iiwa_14, ur5e), URDF or MJCF file.")
    ] = None
    robot_base: str | None = None
    """Link of the URDF at its base, where its root is not."""
    robot_tip: str | None = None
    """Link, or in MJCF body or site, whose pose is reported, where the last one is not."""

    def described(self) -> Arm | None:
        """Return the arm, None if none is named.

        Raises
        ------
        UsageError
            Links of no arm.
        InputError
            No such arm, or one that cannot be used.
        """
        if self.robot is None:
            if self.robot_base is not None or self.robot_tip is not None:
                raise UsageError("--robot-base and --robot-tip are links of the URDF given with --robot")
            return None
        return open_arm(self.robot, base=self.robot_base, tip=self.robot_tip)

    def kinematics(self, views: Sequence[View], model: ModelName) -> ArmKinematics | None:
        """Return the kinematics of the arm in the frames of the views' poses, None if no arm is named.

        Raises
        ------
        UsageError
            The paper's model, or links of no arm.
        InputError
            No such arm, one that cannot be used, or poses that are not this arm's.
        """
        if self.robot is not None and model is ModelName.PAPER:
            raise UsageError(
                "the paper's model takes the robot as exact, and has no use for --robot",
                hint="leave out --robot or --model paper",
            )
        arm = self.described()
        return None if arm is None else arm_kinematics(arm, views)
