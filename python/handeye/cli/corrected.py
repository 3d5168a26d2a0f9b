"""`handeye arm`: the arm as it is built, as the views have it."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from handeye.cli.answer import Answer
from handeye.cli.arm import ArmSource
from handeye.cli.failures import UsageError
from handeye.cli.options import Common
from handeye.cli.output import check_output
from handeye.cli.source import Source
from handeye.datasets.writing import replace_file
from handeye.errors import DegenerateError
from handeye.estimation import solve
from handeye.robots.corrected import corrected_arm, urdf_of
from handeye.types.calibration import ModelName

if TYPE_CHECKING:
    from rich.console import Console


def corrected(
    folder: Path,
    /,
    *,
    output: Path,
    source: Source = Source(),  # noqa: B008 - frozen
    arm: ArmSource = ArmSource(),  # noqa: B008 - frozen
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Write the arm as it is built: its URDF with joints as the views have them, and the zeros of its joints.

    Only what the views determine is changed, the rest stays near the description: it holds near the
    postures that were seen. Offsets of the first and last joint only say where base and flange are, and stay.

    Parameters
    ----------
    folder
        Folder with the views; every one with joint positions.
    output
        The URDF. Joints, without shapes and masses.
    """
    check_output(output)
    described = arm.described()
    if described is None:
        raise UsageError("--robot is missing", hint="name the arm whose description is put right")
    opened = source.open(folder, described)
    kinematics = arm.kinematics(opened.recording.views, ModelName.AUTO)
    if kinematics is None:
        raise AssertionError  # an arm is described
    calibration = solve(opened.recording, kinematics=kinematics)
    correction = calibration.arm_correction
    if correction is None:
        raise DegenerateError("the views say nothing of the arm")
    twists = kinematics.link_twists @ correction.displacements
    built = corrected_arm(described, twists, correction.joint_offsets)
    joints = np.array([view.joints_rad or () for view in opened.recording.views], dtype=float)
    moved = (built.forward(joints) - described.forward(joints))[:, :3, 3]
    note = f"{described.name} as {len(calibration.used)} views of {opened.recording.name} have it, by handeye"
    replace_file(output, urdf_of(built, [note]).encode())
    data: dict[str, Any] = {
        "recording": opened.recording.name,
        "arm": described.name,
        "urdf": str(output),
        "joint_zeros": [offset.to_dict() for offset in calibration.joint_offsets],
        "link_errors": [error.to_dict() for error in calibration.link_errors],
        "flange_moves_mm": 1e3 * float(np.linalg.norm(moved)) / len(moved) ** 0.5,
    }
    return Answer(data, lambda console: _show(console, data))


def _show(console: "Console", data: dict[str, Any]) -> None:
    from handeye.cli.wording import heading, pairs  # noqa: PLC0415 - JSON need not wait for it

    heading(console, data["arm"], "joints beyond where they are read")
    rows: list[tuple[str, str]] = []
    for zero in data["joint_zeros"]:
        unit = "mm" if "offset_mm" in zero else "deg"
        value, sigma = zero[f"offset_{unit}"], zero[f"sigma_{unit}"]
        rows.append((zero["joint"], f"{value:+.4f} {unit}, standard deviation {sigma:.4f}"))
    rows.append(
        ("flange", f"stands {data['flange_moves_mm']:.2f} mm from where it is described, root mean square")
    )
    pairs(console, rows, indent=2)
    console.print(f"written: {data['urdf']}", markup=False, soft_wrap=True)
