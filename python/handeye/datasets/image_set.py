"""What a foreign layout gives: images and robot poses, before detection."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handeye.codes import Code
from handeye.datasets.image_header import image_size
from handeye.datasets.images import read_image
from handeye.datasets.joint_states import Forward
from handeye.datasets.plausibility import DataWarning
from handeye.datasets.pose_rows import NOTHING_STATED, PoseRows, Reading, Statement
from handeye.datasets.reading import inside
from handeye.errors import InputError
from handeye.types import Camera, Mounting, Pose, Recording, Target, Truth, View
from handeye.types.view import check_relative_path, check_view_name


@dataclass(frozen=True)
class Shot:
    """One image and the pose of the robot at that moment; the points are still to be found.

    Parameters
    ----------
    name
        Name of the view to be.
    image
        Path of the image relative to the folder of the image set, with `/`; None where it is in no file of
        its own.
    T_base_flange
        Pose of the flange in the robot base.
    joints_rad
        Joint positions (radians; metres for sliding joints); None if unknown.

    Raises
    ------
    InputError
        A name that no file can have, or a path that leaves the folder.

    Examples
    --------
    >>> Shot("img_1", "pictures/img_1.png", Pose.identity()).image
    'pictures/img_1.png'
    """

    name: str
    image: str | None
    T_base_flange: Pose
    joints_rad: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        check_view_name(self.name)
        if self.image is not None:
            check_relative_path(self.image, f"view {self.name}: image")

    def with_points(
        self, point_ids: ArrayLike, pixels: ArrayLike, sigmas_px: ArrayLike | None = None
    ) -> View:
        """Return the view with the points (N,) found at pixels (N, 2), with deviations (N,) in px.

        Raises
        ------
        InputError
            As `View`.
        """
        return View(
            self.name,
            self.T_base_flange,
            point_ids,
            pixels,
            image=self.image,
            joints_rad=self.joints_rad,
            sigmas_px=sigmas_px,
        )


@dataclass(frozen=True, eq=False)
class WrittenPoses:
    """How the poses of a set are written, as it was stated.

    Attributes
    ----------
    rows
        One for each picture.
    reading
        What the rows are said to mean.
    file
        The file, as the caller would name it.
    """

    rows: PoseRows
    reading: Reading
    file: str


@dataclass(frozen=True)
class ImageSet:
    """Images with robot poses, and what the files say about target and camera.

    Attributes
    ----------
    name
        Name of the set.
    layout
        Name of the layout it was read from.
    folder
        Where it was read from; images are relative to it.
    mounting
        Where the camera sits.
    target
        The calibration target.
    shots
        Images and poses, in the order of the files.
    image_size_px
        Width and height of all images; None where the format of the files does not tell without decoding.
    camera
        The camera's calibration, None if the files hold none.
    truth
        What is known to be true, None for most sets.
    source
        Where the data came from, in words; to be cited with results.
    warnings
        Values that are possible but hardly meant, and choices that the files left open.
    pictures
        What gives the grey values (H, W) of a shot that has no file of its own, by its name.
    written
        How the poses are written, where that was stated; None for formats that leave no choice.

    Examples
    --------
    >>> shot = Shot("img_1", "img_1.png", recording.views[0].T_base_flange)
    >>> ImageSet("mine", "pose-list", Path("mine"), recording.mounting, board, (shot,)).shots[0].image
    'img_1.png'
    """

    name: str
    layout: str
    folder: Path
    mounting: Mounting
    target: Target
    shots: tuple[Shot, ...]
    image_size_px: tuple[int, int] | None = None
    camera: Camera | None = None
    truth: Truth | None = None
    source: str = ""
    warnings: tuple[DataWarning, ...] = ()
    pictures: Mapping[str, Callable[[], NDArray[np.uint8]]] = field(
        default_factory=dict[str, Callable[[], NDArray[np.uint8]]]
    )
    written: WrittenPoses | None = None

    def grey(self, shot: Shot) -> NDArray[np.uint8]:
        """Return the grey values (H, W) of a shot.

        Raises
        ------
        InputError
            As `handeye.datasets.images.read_image`.
        """
        return self.pictures[shot.name]() if shot.image is None else read_image(self.folder / shot.image)

    def recording(self, camera: Camera, views: Iterable[View]) -> Recording:
        """Return the recording made of the views in which the target was found.

        Raises
        ------
        InputError
            As `Recording`.
        """
        return Recording(self.name, self.mounting, camera, self.target, tuple(views), self.truth, self.source)


@dataclass(frozen=True, eq=False)
class UnreadPoses:
    r"""Pictures and rows that belong to them, where it is not said what the rows mean.

    Attributes
    ----------
    images
        The pictures, in the order of the rows; their poses mean nothing yet.
    rows
        One for each picture.
    readings
        What the rows may mean.
    file
        The file, as the caller would name it.

    Examples
    --------
    >>> _ = Path("poses.csv").write_text("0.4,0,0.5,0,0,0\n")
    >>> rows = read_pose_rows("poses.csv")
    >>> images = ImageSet("mine", "pose-list", Path(), recording.mounting, board, ())
    >>> UnreadPoses(images, rows, (), "poses.csv").rows.values.shape
    (1, 6)
    """

    images: ImageSet
    rows: PoseRows
    readings: tuple[Reading, ...]
    file: str


@dataclass(frozen=True)
class ImportOptions:
    """What the files of a layout may leave open.

    Parameters
    ----------
    target
        The calibration target; takes the place of what the files say.
    pattern
        Rows and columns of inner corners of a chessboard, where the files have only the size of its squares.
    mounting
        Where the camera sits; None for what the files say, or else in the hand.
    poses
        File or folder with the robot's poses, where several fit or none is found.
    stated
        How these poses are written, as far as it is said.
    arm
        What turns joint positions into poses, where a file has these in their place.

    Examples
    --------
    >>> ImportOptions(pattern=(6, 9)).pattern  # the files tell the size of the squares only
    (6, 9)
    """

    target: Target | None = None
    pattern: tuple[int, int] | None = None
    mounting: Mounting | None = None
    poses: str | None = None
    stated: Statement = NOTHING_STATED
    arm: Forward | None = None


def common_image_size(folder: Path, shots: Iterable[Shot]) -> tuple[int, int] | None:
    """Return width and height that all images have; None where the format does not tell.

    Raises
    ------
    InputError
        An image that is missing, truncated, or of another size than the first.
    """
    first: tuple[Shot, tuple[int, int]] | None = None
    for shot in shots:
        if shot.image is None:
            continue
        size = image_size(inside(folder, shot.image, f"view {shot.name}: image"))
        if size is None:
            continue
        if first is None:
            first = shot, size
        elif size != first[1]:
            raise InputError(
                f"{folder}: image {shot.image} has {size[0]} x {size[1]} pixels, but {first[0].image} has "
                f"{first[1][0]} x {first[1][1]}",
                code=Code.IMAGE_SIZE,
                hint="a set must come from one camera at one resolution",
            )
    return None if first is None else first[1]
