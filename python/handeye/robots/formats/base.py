"""What every form of a corrected arm is made from."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from handeye.robots.corrected import corrected_arm
from handeye.robots.model import Arm, Joint
from handeye.types.arrays import FloatArray
from handeye.types.pose import Pose


@dataclass(frozen=True, eq=False)
class CorrectedArm:
    """An arm as described, and what was found of it.

    Parameters
    ----------
    described
        The description.
    link_twists, joint_offsets
        As of `handeye.robots.corrected.corrected_arm`.
    notes
        Where it comes from, lines for a comment.
    previous
        Text of the controller's own file, where a form changes one; None without.
    """

    described: Arm
    link_twists: FloatArray
    joint_offsets: FloatArray
    notes: tuple[str, ...] = ()
    previous: str | None = None

    @property
    def built(self) -> Arm:
        """The arm as it is built."""
        return corrected_arm(self.described, self.link_twists, self.joint_offsets)


@dataclass(frozen=True)
class ArmFormat:
    """One form.

    Attributes
    ----------
    name
        Stable name, as on the command line.
    title
        What it is, for a person.
    whole
        Whether links are told, not the zeros of the joints alone.
    text
        Writes it.
    """

    name: str
    title: str
    whole: bool
    text: Callable[[CorrectedArm], str]


def with_z_axes(arm: Arm) -> Arm:
    """Return the same arm with every joint's axis along z of its frame."""
    joints: list[Joint] = []
    before = Pose.identity()
    for joint in arm.joints:
        turn = _z_to(np.array(joint.axis))
        joints.append(
            replace(joint, placement=before.inverse() @ joint.placement @ turn, axis=(0.0, 0.0, 1.0))
        )
        before = turn
    return replace(arm, joints=tuple(joints), T_last_flange=before.inverse() @ arm.T_last_flange)


def _z_to(axis: FloatArray) -> Pose:
    """Return the shortest rotation of z onto an axis (3,)."""
    direction = axis / np.linalg.norm(axis)
    cross = np.cross([0.0, 0.0, 1.0], direction)
    sine = float(np.linalg.norm(cross))
    if sine == 0.0:
        return Pose.identity() if direction[2] > 0 else Pose.exp([0, 0, 0, np.pi, 0, 0])
    angle = float(np.arctan2(sine, direction[2]))
    return Pose.exp([0, 0, 0, *(angle / sine * cross)])


def commented(lines: tuple[str, ...], mark: str) -> str:
    """Return lines as comments of a language; what could end the comment is left out."""
    return "".join(f"{mark} {''.join(c if c.isprintable() else ' ' for c in line)}\n" for line in lines)
