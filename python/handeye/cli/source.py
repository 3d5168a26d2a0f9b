"""The options that say how to read a folder, for every command that takes one."""

from collections.abc import Generator, Iterable
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from handeye.cli.failures import UsageError, WarnedError
from handeye.cli.progress import progress
from handeye.datasets import DataWarning, read_camera, read_target
from handeye.errors import HandeyeError
from handeye.importing import Opened, SourceOptions, open_folder
from handeye.types import Chessboard, Mounting, Target


@Parameter(name="*", group="What the files leave open")
@dataclass(frozen=True)
class Board:
    """The calibration target, where the files do not say."""

    rows: int | None = None
    """Rows of inner corners of a chessboard."""
    columns: int | None = None
    """Columns of inner corners of a chessboard."""
    pitch_mm: float | None = None
    """Side of its squares, where the files do not say."""
    target: Path | None = None
    """Any other board (ChArUco, AprilGrid, ArUco, circles): the file that `handeye target` writes."""

    def described(self) -> tuple[Target | None, tuple[int, int] | None]:
        """Return the target, or rows and columns of a chessboard whose squares the files describe.

        Raises
        ------
        UsageError
            Half a pattern, or a pattern and a target.
        InputError
            A file of a target that cannot be used.
        """
        if self.target is not None:
            if (self.rows, self.columns, self.pitch_mm) != (None, None, None):
                raise UsageError(
                    "--target describes the whole target", hint="do not give --rows, --columns or --pitch-mm"
                )
            return read_target(self.target), None
        if self.rows is None or self.columns is None:
            if (self.rows, self.columns, self.pitch_mm) != (None, None, None):
                raise UsageError(
                    "--rows and --columns go together",
                    hint="count inner corners of the chessboard, not squares; other boards: --target",
                )
            return None, None
        if self.pitch_mm is None:
            return None, (self.rows, self.columns)
        return Chessboard(self.rows, self.columns, self.pitch_mm / 1000), None


@Parameter(name="*", group="What the files leave open")
@dataclass(frozen=True)
class Source(Board):
    """What the files of a folder may leave open; a recording of ours leaves nothing open but the camera."""

    camera: Path | None = None
    """Camera, in TOML or JSON with the fields of [camera] in a recording, or ROS's camera_info .yaml."""
    mounting: Mounting | None = None
    """Where the camera sits."""
    layout: Annotated[str | None, Parameter(help="Layout of the files, where several fit.")] = None

    def options(self) -> SourceOptions:
        """Return the options as the library takes them.

        Raises
        ------
        UsageError
            Half a pattern, or a pattern and a target.
        InputError
            A file of a target or camera that cannot be used.
        """
        target, pattern = self.described()
        return SourceOptions(
            layout=self.layout,
            target=target,
            pattern=pattern,
            mounting=self.mounting,
            camera=None if self.camera is None else read_camera(self.camera),
        )

    def open(self, folder: Path) -> Opened:
        """Read a folder, with progress where the target has to be found in images first.

        Raises
        ------
        UsageError, InputError, DetectionError
            As `options` and `handeye.importing.open_folder`.
        """
        options = self.options()
        with progress("Looking for the target in the images") as advance:
            return open_folder(folder, options, progress=advance)


@contextmanager
def mindful_of(warnings: Iterable[DataWarning]) -> Generator[None]:
    """Keep what looks wrong with the data beside an error: it may well be the cause.

    Raises
    ------
    WarnedError
        Whatever of ours is raised inside.
    """
    try:
        yield
    except HandeyeError as error:
        raise WarnedError(error, tuple(map(str, warnings))) from error
