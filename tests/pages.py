"""Reports of made-up cells."""

from pathlib import Path

import numpy as np

from cells import Cell
from handeye.importing import CameraOrigin, Opened
from handeye.report import Gathered, gather_recording
from handeye.types import Mounting, Recording, Truth, View
from handeye.types.calibration import ModelName


def opened_cell(
    mounting: Mounting = Mounting.EYE_IN_HAND,
    count: int = 8,
    *,
    name: str = "cell 7",
    source: str = "made up",
    missed: dict[str, str] | None = None,
    spoiled: bool = False,
) -> Opened:
    """Return a cell with its truth; `spoiled` adds a view with too few points."""
    cell = Cell(np.random.default_rng(4), mounting)
    sigma = np.array([3e-4] * 3 + [2e-4] * 3)
    views = cell.views([cell.robot_pose(cell.look()) for _ in range(count)], sigma_px=0.05, robot_sigma=sigma)
    if spoiled:
        view = views[0]
        views.append(View("spoiled", view.T_base_flange, view.point_ids[:3], view.pixels[:3]))
    recording = Recording(
        name, mounting, cell.camera, cell.target, tuple(views), Truth(cell.X, cell.Y), source
    )
    return Opened(recording, Path("/nonexistent"), "handeye", CameraOrigin.FILES, missed or {})


def gathered_cell(
    mounting: Mounting = Mounting.EYE_IN_HAND, model: ModelName = ModelName.AUTO, **parts: object
) -> Gathered:
    """Return what a report of such a cell is made from."""
    return gather_recording(opened_cell(mounting, **parts), model, command="handeye report cell")  # type: ignore[arg-type]
