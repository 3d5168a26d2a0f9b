"""`handeye arm`: the arm as it is built, as the views have it."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter

from handeye.cli.answer import Answer
from handeye.cli.arm import ArmSource
from handeye.cli.failures import UsageError
from handeye.cli.options import Common
from handeye.cli.output import check_output
from handeye.cli.source import Source
from handeye.datasets.reading import MIB, read_text
from handeye.datasets.writing import replace_file
from handeye.errors import DegenerateError
from handeye.estimation import Measurements, make_estimator, solve
from handeye.estimation.arm_observability import observability_indices
from handeye.estimation.faults import examine
from handeye.planning.prediction import Prediction, Sight
from handeye.robots import ArmKinematics
from handeye.robots.formats import ARM_FORMATS, CorrectedArm
from handeye.types.calibration import ModelName

if TYPE_CHECKING:
    from rich.console import Console


def corrected(
    folder: Path,
    /,
    *,
    output: Path,
    format: Annotated[str, Parameter(name="--format")] = "urdf",  # noqa: A002 - the word of `export` too
    previous: Path | None = None,
    source: Source = Source(),  # noqa: B008 - frozen
    arm: ArmSource = ArmSource(),  # noqa: B008 - frozen
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Write the arm as it is built, as the views have it: joints as they sit, or the zeros of its joints.

    Only what the views determine is changed, the rest stays near the description: it holds near the
    postures that were seen. Offsets of the first and last joint only say where base and flange are, and stay.

    Parameters
    ----------
    folder
        Folder with the views; every one with joint positions.
    output
        The file to write.
    format
        urdf, xacro, ur (the calibration.yaml of Universal Robots' ROS driver), dh, dh_modified; zeros of
        joints alone: fanuc, kuka, abb, lerobot.
    previous
        The calibration file that lerobot changes.
    """
    check_output(output)
    chosen = ARM_FORMATS.get(format)
    if chosen is None:
        raise UsageError(f"no format {format[:80]!r}", hint=f"formats are {', '.join(ARM_FORMATS)}")
    described = arm.described()
    if described is None:
        raise UsageError("--robot is missing", hint="name the arm whose description is put right")
    opened = source.open(folder, described)
    kinematics = arm.kinematics(opened.recording.views, ModelName.AUTO)
    if kinematics is None:
        raise AssertionError  # an arm is described
    known = examine(Measurements.of_recording(opened.recording), by_joints=True).measurements
    calibration = solve(opened.recording, kinematics=kinematics)
    correction = calibration.arm_correction
    if correction is None:
        raise DegenerateError("the views say nothing of the arm")
    twists = kinematics.link_twists @ correction.displacements
    joints = np.array([view.joints_rad or () for view in opened.recording.views], dtype=float)
    note = f"{described.name} as {len(calibration.used)} views of {opened.recording.name} have it, by handeye"
    before = None if previous is None else read_text(previous, MIB)
    found = CorrectedArm(described, twists, correction.joint_offsets, (note,), before)
    built = found.built
    moved = (built.forward(joints) - described.forward(joints))[:, :3, 3]
    replace_file(output, chosen.text(found).encode())
    data: dict[str, Any] = {
        "recording": opened.recording.name,
        "arm": described.name,
        "format": chosen.name,
        "file": str(output),
        "joint_zeros": [offset.to_dict() for offset in calibration.joint_offsets],
        "link_errors": [error.to_dict() for error in calibration.link_errors],
        "observability": _observability(known, kinematics),
        "flange_moves_mm": 1e3 * float(np.linalg.norm(moved)) / len(moved) ** 0.5,
    }
    return Answer(data, lambda console: _show(console, data))


def _observability(known: Measurements, kinematics: ArmKinematics) -> dict[str, float]:
    estimate = make_estimator(ModelName.AUTO, kinematics)(known)
    told = Prediction(estimate, Sight(known=True)).informations(known.motions, known.joints)
    return observability_indices(estimate, told).to_dict()


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
    indices = ", ".join(f"{name.upper()} {value:.3g}" for name, value in data["observability"].items())
    rows.append(("observability", indices))
    pairs(console, rows, indent=2)
    console.print(f"written: {data['file']}", markup=False, soft_wrap=True)
