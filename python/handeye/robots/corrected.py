"""An arm as it is built: joints as a calibration found them, and its description as URDF."""

from collections.abc import Sequence
from dataclasses import replace
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
from numpy.typing import ArrayLike

from handeye.robots.model import Arm, Joint
from handeye.types.arrays import FloatArray, finite_array
from handeye.types.pose import Pose

# URDF wants limits of joints that turn; without any they turn on and on.
_NO_EFFORT = "0"


def corrected_arm(arm: Arm, link_twists: ArrayLike, joint_offsets: ArrayLike) -> Arm:
    """Return an arm with each joint where it truly sits on its link, and zero where it truly is.

    Joint i sat at `placement` and stood at q; it truly sits at ``placement exp(twist)`` and stands at
    ``q + offset``: the corrected arm, told the joints as they are read, has the flange where it truly is.
    What only says where base and flange are (gauge) is zero in both.

    Parameters
    ----------
    arm
        As described.
    link_twists
        (n, 6) of each joint in its own frame, metres and radians: `Calibration.link_errors`.
    joint_offsets
        (n,) radians, metres for joints that slide.

    Raises
    ------
    InputError
        Another number of joints.
    """
    twists = finite_array(link_twists, (len(arm), 6), "link twists")
    offsets = finite_array(joint_offsets, (len(arm),), "joint offsets")
    joints: list[Joint] = []
    for joint, twist, offset in zip(arm.joints, twists, offsets, strict=True):
        axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
        screw = np.zeros(6)
        screw[slice(0, 3) if joint.sliding else slice(3, 6)] = offset * axis
        joints.append(replace(joint, placement=joint.placement @ Pose.exp(twist) @ Pose.exp(screw)))
    return replace(arm, joints=tuple(joints))


def urdf_of(arm: Arm, notes: Sequence[str] = ()) -> str:
    """Return an arm as URDF: its joints, without shapes and masses.

    Links are named after their joints, the last is the flange of the arm. Numbers have all their digits.

    Parameters
    ----------
    arm
        The arm.
    notes
        Lines of a comment at the top, such as where it comes from.
    """
    root = Element("robot", {"name": arm.name})
    parent = "base"
    SubElement(root, "link", {"name": parent})
    for joint in arm.joints:
        child = f"{joint.name}_link"
        SubElement(root, "link", {"name": child})
        bounded = bool(np.isfinite([joint.lower, joint.upper]).all())
        kind = "prismatic" if joint.sliding else "revolute" if bounded else "continuous"
        element = SubElement(root, "joint", {"name": joint.name, "type": kind})
        _place(element, joint.placement, parent, child)
        SubElement(element, "axis", {"xyz": _numbers(np.array(joint.axis) / np.linalg.norm(joint.axis))})
        limit = {"effort": _NO_EFFORT}
        limit["velocity"] = repr(float(joint.velocity)) if np.isfinite(joint.velocity) else "0"
        if bounded:
            limit |= {"lower": repr(float(joint.lower)), "upper": repr(float(joint.upper))}
        SubElement(element, "limit", limit)
        parent = child
    flange = arm.flange if arm.flange not in {parent, "base"} else "flange"
    SubElement(root, "link", {"name": flange})
    _place(
        SubElement(root, "joint", {"name": "flange_fixed", "type": "fixed"}),
        arm.T_last_flange,
        parent,
        flange,
    )
    indent(root)
    comment = "".join(f"<!-- {note.replace('--', '- -')} -->\n" for note in notes)
    return f'<?xml version="1.0"?>\n{comment}{tostring(root, encoding="unicode")}\n'


def _place(element: Element, pose: Pose, parent: str, child: str) -> None:
    SubElement(element, "parent", {"link": parent})
    SubElement(element, "child", {"link": child})
    xyz, rpy = _numbers(pose.translation), _numbers(np.array(pose.roll_pitch_yaw_rad))
    SubElement(element, "origin", {"xyz": xyz, "rpy": rpy})


def _numbers(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values)
