"""`handeye ui`: the page in the browser, about a folder or with a simulated cell to drive."""

import tempfile
from pathlib import Path

from handeye.cli.answer import Answer
from handeye.cli.arm import ArmSource
from handeye.cli.options import Common, Seed
from handeye.cli.page import Page
from handeye.cli.run import run
from handeye.cli.solve import solve
from handeye.cli.source import Source
from handeye.types import Mounting
from handeye.types.calibration import ModelName


def ui(
    folder: Path | None = None,
    /,
    *,
    session: Path | None = None,
    robot: str | None = None,
    mounting: Mounting | None = None,
    seed: Seed = 0,
    model: ModelName = ModelName.AUTO,
    ui_host: str = "127.0.0.1",
    ui_port: int = 0,
    common: Common = Common(),  # noqa: B008 - frozen
) -> Answer:
    """Open the page in the browser: on a folder of views, or on a simulated cell to drive.

    With a folder it is `handeye solve FOLDER --ui`: the answer, the views and their residuals. Without one a
    simulated arm is driven from the page, as `handeye run --ui` does. Real arms are driven with `handeye run
    --ui` and its options, a session that was broken off with `handeye run --resume --session FOLDER --ui`.

    Parameters
    ----------
    folder
        Folder with views; none for a simulated cell.
    session
        Where the simulated session is written; a new folder for temporary files without it.
    robot
        Description of the arm.
    mounting
        Where the camera of the simulated cell sits.
    seed
        Of the simulated cell.
    model
        auto: the data say how noisy robot and camera are. paper: robot and camera are taken as exact.
    ui_host
        Address to listen on; beyond this machine the printed address holds a token.
    ui_port
        Port to listen on; any that is free without it.
    """
    page = Page(ui=True, ui_host=ui_host, ui_port=ui_port)
    if folder is not None:
        source = Source(mounting=mounting)
        return solve(folder, model=model, source=source, arm=ArmSource(robot), page=page, common=common)
    place = session or Path(tempfile.mkdtemp(prefix="handeye-")) / "session"
    return run(
        session=place, robot=robot, mounting=mounting, seed=seed, model=model, page=page, common=common
    )
