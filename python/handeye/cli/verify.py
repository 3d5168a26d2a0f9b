"""`handeye verify`: whether points that were touched are where the calibration has them."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.arm import ArmSource
from handeye.cli.options import Common
from handeye.cli.output import check_output, write_json
from handeye.cli.source import Source
from handeye.datasets.touches import read_touches
from handeye.errors import ExitCode
from handeye.estimation import Measurements, make_estimator, require_determined
from handeye.estimation.faults import examine
from handeye.estimation.probing import verify as compared
from handeye.types.calibration import ModelName
from handeye.types.units import MM_PER_M

if TYPE_CHECKING:
    from rich.console import Console


def verify(
    folder: Path,
    touches: Path,
    /,
    *,
    output: Path | None = None,
    source: Source = Source(),  # noqa: B008 - frozen
    arm: ArmSource = ArmSource(),  # noqa: B008 - frozen
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Compare points of the board or the cell that were touched with where the calibration has them.

    Touches know nothing of the camera: they verify the calibration independently, and find a board that is
    larger or smaller than stated. The exit code is 9 where they disagree. `handeye solve --touches` takes
    them as measurements.

    Parameters
    ----------
    folder
        Folder with the views of the calibration.
    touches
        TOML file with tips and touches; its form is in the documentation of this command.
    output
        Also write the JSON object to this file.
    """
    check_output(output)
    probing = read_touches(touches)
    opened = source.open(folder, arm.described())
    kinematics = arm.kinematics(opened.recording.views, ModelName.AUTO)
    known = examine(
        Measurements.of_recording(opened.recording), by_joints=kinematics is not None
    ).measurements
    estimate = make_estimator(ModelName.AUTO, kinematics)(known)
    require_determined(estimate)
    together = make_estimator(ModelName.AUTO, kinematics, probing=probing)(known, estimate)
    found = compared(estimate, together, probing)
    data: dict[str, Any] = {
        "recording": opened.recording.name,
        "touches": [{"tip": touch.tip, "point": touch.point} for touch in probing.touches],
        **found.to_dict(),
        "tips": {
            name: {
                "on": tip.body.value,
                "at_mm": [MM_PER_M * value for value in tip.at_m],
                "sigma_mm": MM_PER_M * tip.sigma_m,
            }
            for name, tip in together.tips.items()
        },
        "within_95": estimate.within_95.to_dict(),
        "within_95_with_touches": together.within_95.to_dict(),
    }
    if output is not None:
        write_json(output, data)
    exit_code = ExitCode.MOVED if found.alarm else ExitCode.SUCCESS
    return Answer(data, lambda console: _show(console, data), exit_code=exit_code)


def _show(console: "Console", data: dict[str, Any]) -> None:
    from handeye.cli.wording import figures, heading, pairs  # noqa: PLC0415 - JSON need not wait for it

    heading(console, data["verdict"].replace("_", " "), data["sentence"])
    rows: list[tuple[str, str]] = []
    for touch, miss, expected in zip(data["touches"], data["misses_mm"], data["expected_mm"], strict=True):
        rows.append((f"{touch['tip']} at {touch['point']}", f"{miss:.2f} mm off, {expected:.2f} expected"))
    for name, tip in data["tips"].items():
        x, y, z = (f"{value:.2f}" for value in tip["at_mm"])
        rows.append((f"{name} ({tip['on']})", f"{x} {y} {z} mm, standard deviation {tip['sigma_mm']:.2f}"))
    before, after = data["within_95"], data["within_95_with_touches"]
    rows.append(
        (
            "hand-eye within",
            f"{figures(before['translation_mm'])} mm, with the touches {figures(after['translation_mm'])} mm",
        )
    )
    pairs(console, rows, indent=2)
