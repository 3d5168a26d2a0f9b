"""Zeros of the joints as FANUC, KUKA and ABB take them: where to stand to be at zero, and what to do there.

A joint that truly stands d beyond where it is read is at zero where -d is read. There the controller is told
that this is zero: mastering (FANUC, KUKA) or fine calibration (ABB). Nothing is written into a controller's
files, whose numbers are counts of motors behind gears.
"""

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.robots.formats.base import ArmFormat, CorrectedArm, commented
from handeye.types.units import MM_PER_M


def _readings(arm: CorrectedArm, most: int) -> list[float]:
    """Readings at which every joint truly is at zero, degrees and millimetres.

    Raises
    ------
    InputError
        More joints than the controller's form has.
    """
    if len(arm.described) > most:
        raise InputError(
            f"{arm.described.name}: {len(arm.described)} joints, at most {most} here", code=Code.OTHER_ARM
        )
    return [
        -float(offset) * MM_PER_M if slides else -float(np.rad2deg(offset)) + 0.0
        for offset, slides in zip(arm.joint_offsets, arm.described.sliding, strict=True)
    ]


def _fanuc(arm: CorrectedArm) -> str:
    how = (
        "joints of a position in JOINT representation; go there, then zero position master all axes",
        "FANUC counts J3 from the horizontal: where the description counts it from link 2, convert first",
    )
    values = _readings(arm, 9)
    rows = [f"  J{i + 1} = {value:.9f} deg" for i, value in enumerate(values)]
    return commented((*arm.notes, *how), "!") + "P[1]{\n" + ",\n".join(rows) + "\n};\n"


def _kuka(arm: CorrectedArm) -> str:
    how = ("go there, then master all axes by dial or reference at this position",)
    values = _readings(arm, 6)
    axes = ", ".join(f"A{i + 1} {value:.9f}" for i, value in enumerate(values))
    return commented((*arm.notes, *how), ";") + f"PTP {{{axes}}}\n"


def _abb(arm: CorrectedArm) -> str:
    how = ("go there, then fine calibrate all axes at this position and update the revolution counters",)
    values = [f"{value:.9f}" for value in _readings(arm, 6)]
    values += ["0"] * (6 - len(values))
    target = f"[[{','.join(values)}],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    return commented((*arm.notes, *how), "!") + f"MoveAbsJ {target},v50,fine,tool0;\n"


FORMATS = (
    ArmFormat("fanuc", "FANUC: joints at which to master", whole=False, text=_fanuc),
    ArmFormat("kuka", "KUKA: joints at which to master", whole=False, text=_kuka),
    ArmFormat("abb", "ABB: joints at which to fine calibrate", whole=False, text=_abb),
)
