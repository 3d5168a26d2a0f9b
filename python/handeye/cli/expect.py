"""`handeye expect`: what accuracy to expect of a cell before it is built."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter, validators

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.cli.progress import progress
from handeye.cli.source import Board
from handeye.codes import Code
from handeye.errors import InputError
from handeye.types import Mounting

if TYPE_CHECKING:
    from rich.console import Console

    from handeye.studies.expectation import Expectation

LensName = Literal["ordinary", "wide", "fisheye"]
ViewCount = Annotated[int, Parameter(validator=validators.Number(gte=3, lte=200))]


def expect(
    *,
    views: Annotated[tuple[ViewCount, ...], Parameter(consume_multiple=True)] = (5, 8, 12, 20),
    robot: str = "epson_c4l",
    arm_errors: float = 1.0,
    pixel_sigma: float = 0.05,
    mounting: Mounting = Mounting.EYE_IN_HAND,
    distance_mm: tuple[float, float] = (250.0, 900.0),
    tilt_deg: float = 45.0,
    lens: LensName = "ordinary",
    focal_px: float | None = None,
    cells: Annotated[int, Parameter(validator=validators.Number(gte=1, lte=1000))] | None = None,
    workers: Annotated[int, Parameter(validator=validators.Number(gte=1))] = 1,
    board: Board = Board(),  # noqa: B008 - frozen
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Say what accuracy to expect from a board, distances, a number of views, a lens and an arm.

    Such cells are simulated and driven by the loop; beyond twelve views the planner's prediction takes over.
    Nothing is read but the target and the arm. The camera has 1280 x 1024 pixels and a good calibration.

    Parameters
    ----------
    views
        Numbers of views.
    robot
        Description of the arm: a shipped arm, a URDF or an MJCF file.
    arm_errors
        Factor on the errors of an arm in good order (encoders and play 0.005 deg, offsets 0.01 deg, links
        0.1 mm); 0 is an exact arm, 10 a cheap one.
    pixel_sigma
        Deviation of the points in the picture, px: 0.02 for a sharp chessboard, 0.1 for a fair picture.
    mounting
        Where the camera sits.
    distance_mm
        Nearest and farthest distance from camera to target.
    tilt_deg
        Largest angle at which the target is seen.
    lens
        ordinary (focal length 1400 px, 49 degrees across), wide (780 px, 79 degrees) or fisheye (520 px, 141
        degrees).
    focal_px
        Another focal length of that lens: that in mm over the size of a pixel in mm.
    cells
        Number of cells that are simulated; without it so many that their mean is known to about a fifteenth.
    workers
        Processes. The result does not depend on it.
    """
    from handeye.studies.expectation import CELLS  # noqa: PLC0415 - help need not wait for it
    from handeye.studies.expectation import expect as foretell  # noqa: PLC0415
    from handeye.studies.questions import AskedCell  # noqa: PLC0415

    target, pattern = board.described()
    if pattern is not None:
        raise InputError(
            "--pitch-mm is missing", code=Code.MISSING_VALUE, hint="say how large the squares are"
        )
    asked = AskedCell(robot, arm_errors, pixel_sigma, mounting, distance_mm, tilt_deg, lens, focal_px)
    with progress("Simulating cells") as advance:
        found = foretell(
            asked.configuration(),
            views,
            target=target,
            cells=cells or CELLS,
            workers=workers,
            progress=advance,
        )
    data = _data(found)
    return Answer(data, lambda console: _show(console, found))


def _data(found: "Expectation") -> dict[str, Any]:
    return {"cells": found.cells, "levels": [level.to_dict() for level in found.levels]}


def _show(console: "Console", found: "Expectation") -> None:
    from rich import box  # noqa: PLC0415 - a program reading JSON need not wait for it
    from rich.table import Table  # noqa: PLC0415

    from handeye.cli.wording import figures  # noqa: PLC0415

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in ("views", "mean error mm", "mean error deg", "95 % radius mm", "95 % radius deg"):
        table.add_column(name, justify="right")
    for level in found.levels:
        values = (level.mean_mm, level.mean_deg, level.within_mm, level.within_deg)
        table.add_row(str(level.views), *(figures(value, 2) for value in values))
    console.print(table)
    console.print(
        f"Of the camera's centre and its rotation, from {found.cells} simulated cells; the radius is what "
        "would be stated."
    )
