"""One JSON object in which frames, units and conventions are spelled out."""

import json
from typing import Any

from handeye.export.base import Exporter, fixed_axis_angles
from handeye.export.mount import Mount
from handeye.types import Pose
from handeye.types.calibration import TWIST_ORDER

FORMAT = "handeye-transform"
VERSION = 1


def text(mount: Mount) -> str:
    """Return the object."""
    return json.dumps(document(mount), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def document(mount: Mount) -> dict[str, Any]:
    """Return plain values, with units in the keys."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "mounting": mount.result.mounting.value,
        "parent_frame": mount.parent,
        "child_frame": mount.child,
        "meaning": f"p_parent = T p_child: coordinates in {mount.child} to coordinates in {mount.parent}",
        **_transform(mount.T_parent_child),
        "covariance": mount.covariance.tolist(),
        "covariance_order": list(TWIST_ORDER),
        "covariance_frame": mount.child,
        "target": {
            "parent_frame": mount.target_parent,
            "child_frame": mount.frames.target,
            **_transform(mount.result.T_fixed_target),
        },
        "recording": mount.result.recording,
        "views_used": mount.result.view_count,
        "remarks": list(mount.remarks),
    }


def _transform(pose: Pose) -> dict[str, Any]:
    return {
        "translation_m": pose.translation.tolist(),
        "quaternion_xyzw": pose.quaternion_xyzw.tolist(),
        "roll_pitch_yaw_rad": fixed_axis_angles(pose).tolist(),
        "roll_pitch_yaw_convention": "fixed axes x, y, z, as in URDF: R = Rz(yaw) Ry(pitch) Rx(roll)",
        "T_parent_child": pose.to_list(),
    }


EXPORTER = Exporter("json", "JSON with frames and units spelled out", ".json", text)
