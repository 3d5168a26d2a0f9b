"""`handeye diff`: how two calibrations of one camera differ."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from handeye.cli.answer import Answer
from handeye.cli.arm import ArmSource
from handeye.cli.options import Common
from handeye.cli.output import check_output, write_json
from handeye.cli.source import Source
from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation import solve
from handeye.estimation.difference import difference
from handeye.export.result import read_result
from handeye.types import Mounting, Pose
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName

if TYPE_CHECKING:
    from rich.console import Console


def diff(
    first: Path,
    second: Path,
    /,
    *,
    output: Path | None = None,
    source: Source = Source(),  # noqa: B008 - frozen
    arm: ArmSource = ArmSource(),  # noqa: B008 - frozen
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Say how far the camera has moved between two calibrations, and whether that is more than chance.

    Both covariances count. The two should be of other views: what they share, such as one calibration of the
    lens, makes a real difference look smaller than it is.

    Parameters
    ----------
    first
        JSON that `handeye solve` wrote, or a folder, which is solved.
    second
        The later one.
    output
        Also write the JSON object to this file.
    """
    check_output(output)
    mounting, one = _read(first, source, arm)
    other, two = _read(second, source, arm)
    if mounting is not other:
        raise InputError(
            f"{first} is {mounting.value}, {second} is {other.value}: two different transforms",
            code=Code.WRONG_MOUNTING,
            hint="compare calibrations of one camera",
        )
    found = difference(one, two)
    data: dict[str, Any] = {
        "first": str(first),
        "second": str(second),
        "mounting": mounting.value,
        "transform": mounting.result_names[0],
        **found.to_dict(),
    }
    if output is not None:
        write_json(output, data)
    return Answer(data, lambda console: _show(console, data))


def _read(path: Path, source: Source, arm: ArmSource) -> tuple[Mounting, tuple[Pose, FloatArray, float]]:
    if path.suffix.lower() == ".json" and not path.is_dir():
        result = read_result(path)
        return result.mounting, (result.T_parent_camera, result.covariance, result.degrees_of_freedom)
    opened = source.open(path, arm.described())
    kinematics = arm.kinematics(opened.recording.views, ModelName.AUTO)
    calibration = solve(opened.recording, kinematics=kinematics)
    return calibration.mounting, (
        calibration.X.inverse(),
        calibration.covariance,
        calibration.degrees_of_freedom,
    )


def _show(console: "Console", data: dict[str, Any]) -> None:
    from handeye.cli.wording import figures, heading, pairs  # noqa: PLC0415 - JSON need not wait for it

    heading(console, data["transform"], f"from {data['first']} to {data['second']}")
    x, y, z = (figures(value) for value in data["translation_mm"])
    frame = data["transform"].split("_")[1]
    pairs(
        console,
        [
            ("moved", f"{x}  {y}  {z}  mm, along the axes of the {frame}"),
            ("turned", f"{figures(data['angle_deg'], 2)} deg"),
            ("verdict", data["sentence"]),
        ],
        indent=2,
    )
