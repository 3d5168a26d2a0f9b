"""LeRobot's calibration of Feetech servos: `homing_offset` in steps of the encoder.

A servo reads its position less its offset, so a joint that stands beyond where it is read has its offset
lowered by as many steps (LeRobot, `motors/feetech`: "Present_Position = Actual_Position - Homing_Offset").
Steps are whole: at most half of one, 0.044 degrees, remains.
"""

import json
from typing import cast

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.robots.formats.base import ArmFormat, CorrectedArm

STEPS = 4096
MAX_CHARACTERS = 100_000
# The register has eleven bits and a sign.
LARGEST_OFFSET = 2047
_HINT = "give the file that lerobot-calibrate wrote, with --previous"


def _calibration(arm: CorrectedArm) -> str:
    if arm.previous is None:
        raise InputError("LeRobot's calibration is changed, not made", code=Code.MISSING_FILE, hint=_HINT)
    try:
        data: object = json.loads(arm.previous[:MAX_CHARACTERS])
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"previous calibration: not JSON: {str(error)[:200]}", code=Code.NOT_JSON, hint=_HINT
        ) from error
    motors = cast("dict[str, object]", data) if isinstance(data, dict) else {}
    for joint, offset in zip(arm.described.joints, arm.joint_offsets, strict=True):
        found = motors.get(joint.name)
        motor = cast("dict[str, object]", found) if isinstance(found, dict) else {}
        known = motor.get("homing_offset")
        if not isinstance(known, int) or isinstance(known, bool):
            raise InputError(
                f"previous calibration: no motor {joint.name} with a whole homing_offset, "
                f"found {', '.join(sorted(map(str, motors)))[:200]}",
                code=Code.INVALID_FIELD,
                hint="name the joints of the description as LeRobot names its motors",
            )
        direction = -1 if motor.get("drive_mode") == 1 else 1
        changed = known - direction * round(float(offset) / (2 * np.pi) * STEPS)
        if abs(changed) > LARGEST_OFFSET:
            raise InputError(
                f"motor {joint.name}: an offset of {changed} steps, the servo keeps at most {LARGEST_OFFSET}",
                code=Code.OUT_OF_RANGE,
                hint="calibrate it again in the middle of its range",
            )
        motor["homing_offset"] = changed
    return json.dumps(motors, indent=4) + "\n"


FORMAT = ArmFormat("lerobot", "LeRobot: calibration of its servos", whole=False, text=_calibration)
