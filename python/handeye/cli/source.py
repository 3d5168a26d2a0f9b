"""The options that say how to read a folder, for every command that takes one."""

from collections.abc import Generator, Iterable
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from handeye.cli.failures import UsageError, WarnedError
from handeye.cli.progress import progress
from handeye.codes import Code
from handeye.datasets import DataWarning, PosePairs, Statement, read_camera, read_cameras, read_target
from handeye.datasets.recording_header import FILE_NAME
from handeye.errors import HandeyeError, InputError
from handeye.importing import (
    BagOptions,
    Opened,
    OpenedRig,
    SourceOptions,
    is_rig,
    one_camera,
    open_any,
    open_folder,
    open_rig,
)
from handeye.notations import Direction, Unit, notation_of
from handeye.robots import Arm
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
    """Camera: TOML or JSON of ours, ROS's camera_info, OpenCV's FileStorage, Kalibr, RealSense, Open3D."""
    mounting: Mounting | None = None
    """Where the camera sits."""
    poses: str | None = None
    """File or folder with the robot's poses: CSV, text, JSON or YAML."""
    notation: str | None = None
    """How they are written: ur, kuka, fanuc, abb, ..., or euler_zyx_moving_deg and its like."""
    unit: Unit | None = None
    """Unit of their lengths."""
    poses_are: Direction | None = None
    """Whose pose in which frame they are; the flange in the base if not given."""
    image_topic: str | None = None
    """In a bag: topic of the pictures."""
    pose_topic: str | None = None
    """In a bag: topic of the flange's poses or of the joints, in place of tf."""
    base_frame: str | None = None
    """In a bag: frame of the robot's base in tf."""
    flange_frame: str | None = None
    """In a bag: frame of the flange in tf."""
    layout: Annotated[str | None, Parameter(help="Layout of the files, where several fit.")] = None
    only: Annotated[str | None, Parameter(help="Of several cameras, this one alone.")] = None

    def options(self, arm: Arm | None = None) -> SourceOptions:
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
            poses=self.poses,
            stated=self.stated(),
            bag=BagOptions(self.image_topic, self.pose_topic, self.base_frame, self.flange_frame),
            arm=arm,
        )

    def stated(self) -> Statement:
        """Return what is said about the robot's poses.

        Raises
        ------
        InputError
            A notation that is not known.
        """
        notation = None if self.notation is None else notation_of(self.notation)
        return Statement(notation, self.unit, self.poses_are)

    def of_a_recording(self, folder: Path) -> "Source":
        """Return the options for a folder where what is said about poses means those of another file.

        A recording says itself how its poses are written; pictures beside the other file are taken to be
        written the same way.
        """
        if self.poses is not None or not (folder / FILE_NAME).is_file():
            return self
        return replace(self, notation=None, unit=None, poses_are=None)

    def open_any(self, folder: Path, arm: Arm | None = None) -> Opened | PosePairs:
        """Read a folder or a file, also one that holds poses of the target instead of pictures.

        Raises
        ------
        UsageError, InputError, DetectionError
            As `options` and `handeye.importing.open_any`.
        """
        if is_rig(folder):
            return self._one_camera(folder)
        options = self.options(arm)
        with progress("Looking for the target in the images") as advance:
            return open_any(folder, options, progress=advance)

    def open_rig(self, folder: Path) -> OpenedRig:
        """Read a folder with several cameras; `--camera` may be a chain of Kalibr.

        Raises
        ------
        UsageError, InputError, DetectionError
            As `options` and `handeye.importing.open_rig`.
        """
        options = replace(self, camera=None).options()
        cameras = None if self.camera is None else read_cameras(self.camera)
        with progress("Looking for the target in the images") as advance:
            return open_rig(folder, options, cameras=cameras, progress=advance)

    def open(self, folder: Path, arm: Arm | None = None) -> Opened:
        """Read a folder, with progress where the target has to be found in images first.

        Raises
        ------
        UsageError, InputError, DetectionError
            As `options` and `handeye.importing.open_folder`.
        """
        if is_rig(folder):
            return self._one_camera(folder)
        options = self.options(arm)
        with progress("Looking for the target in the images") as advance:
            return open_folder(folder, options, progress=advance)

    def _one_camera(self, folder: Path) -> Opened:
        opened = self.open_rig(folder)
        if self.only is None:
            raise InputError(
                f"{folder}: several cameras ({', '.join(opened.recording.cameras)}), expected one",
                code=Code.SEVERAL_CAMERAS,
                hint="name one with --only; handeye solve and handeye plan take them together",
            )
        return one_camera(opened, self.only)


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
