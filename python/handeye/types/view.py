"""One look at the target: where the robot stood and what the camera saw."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.arrays import FloatArray, IndexArray, deviations, finite_array, index_array
from handeye.types.plain import Document, read_document, without_none
from handeye.types.pose import Pose

# A name is also the name of a file, on every system.
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,99}", re.ASCII)
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.ASCII | re.IGNORECASE)
MAX_PATH_LENGTH = 500
MAX_JOINTS = 100


def check_view_name(name: str) -> str:
    """Return the name if it can also name a file.

    Raises
    ------
    InputError
        Not 1 to 100 letters (a-z, A-Z), digits, dots, dashes and underscores, or a name that a system
        reserves.
    """
    if not _NAME.fullmatch(name) or name.endswith(".") or _RESERVED.fullmatch(name):
        raise InputError(
            f"view name {name[:120]!r}: expected 1 to 100 letters, digits, '_', '-' or '.', "
            "beginning with one of the first three, and no name that a system reserves",
            code=Code.INVALID_NAME,
            hint="rename the view, for example view_01",
        )
    return name


def check_relative_path(path: str, what: str) -> str:
    """Return the path if it is relative, with forward slashes, and stays in its folder.

    Raises
    ------
    InputError
        Absolute, with `..`, a backslash, a drive, a control character, or empty.
    """
    parts = path.split("/")
    if (
        not 0 < len(path) <= MAX_PATH_LENGTH
        or any(part in {"", ".", ".."} for part in parts)
        or "\\" in path
        or ":" in parts[0]
        or not path.isprintable()
    ):
        raise InputError(
            f"{what}: path {path[:120]!r}, expected a path below the folder, with '/' and without '..'",
            code=Code.PATH_OUTSIDE,
            hint="put the file into the folder and name it relative to it",
        )
    return path


class _ViewDocument(Document):
    name: str
    T_base_flange: list[list[float]]
    point_ids: list[int]
    pixels: list[list[float]]
    image: str | None = None
    timestamp_s: float | None = None
    joints_rad: list[float] | None = None
    sigmas_px: list[float] | None = None


@dataclass(frozen=True, eq=False, init=False)
class View:
    """One measurement: a robot pose and the target's points in the image.

    Parameters
    ----------
    name
        Name of the view; also the name of its files.
    T_base_flange
        Pose of the flange in the robot base, as the robot reports it.
    point_ids
        (N,) indices into the points of the target, N >= 1, each at most once.
    pixels
        (N, 2) where these points were found: u to the right, v down, pixel centres at whole numbers.
    image
        Path of the image relative to the folder of the recording, with `/`; None if not kept.
    timestamp_s
        Time of the exposure in seconds on any clock; None if unknown.
    joints_rad
        Joint positions (radians; metres for sliding joints); None if unknown.
    sigmas_px
        (N,) standard deviation of one coordinate of each point, in pixels, as the detector states it; None if
        unknown.

    Raises
    ------
    InputError
        A value of the wrong shape, not finite, a point twice, no point at all, or a path that leaves the
        folder.

    Examples
    --------
    >>> import handeye
    >>> view = View("img_1", handeye.Pose.identity(), [0, 1, 2, 3], [[10, 10], [90, 10], [10, 90], [90, 90]])
    >>> len(view)
    4
    """

    name: str
    T_base_flange: Pose
    point_ids: IndexArray
    pixels: FloatArray
    image: str | None
    timestamp_s: float | None
    joints_rad: tuple[float, ...] | None
    sigmas_px: FloatArray | None

    def __init__(
        self,
        name: str,
        T_base_flange: Pose,
        point_ids: ArrayLike,
        pixels: ArrayLike,
        image: str | None = None,
        timestamp_s: float | None = None,
        joints_rad: Sequence[float] | None = None,
        sigmas_px: ArrayLike | None = None,
    ) -> None:
        check_view_name(name)
        where = f"view {name}"
        if not isinstance(T_base_flange, Pose):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise InputError(f"{where}: T_base_flange is no Pose but {type(T_base_flange).__name__}")
        ids = index_array(point_ids, f"{where}: point_ids")
        if len(ids) == 0:
            raise InputError(
                f"{where}: no points",
                code=Code.NO_POINTS,
                hint="leave out views in which the target was not found",
            )
        values = finite_array(pixels, (None, 2), f"{where}: pixels")
        if len(ids) != len(values):
            raise InputError(
                f"{where}: {len(ids)} point ids but {len(values)} pixels, expected as many",
                code=Code.WRONG_SHAPE,
            )
        unique, counts = np.unique(ids, return_counts=True)
        if len(unique) < len(ids):
            raise InputError(
                f"{where}: point {unique[counts > 1][0]} is there {counts.max()} times, expected once",
                code=Code.DUPLICATE_POINT,
            )
        _set(self, "name", name)
        _set(self, "T_base_flange", T_base_flange)
        _set(self, "point_ids", ids)
        _set(self, "pixels", values)
        _set(self, "image", None if image is None else check_relative_path(image, f"{where}: image"))
        time = None if timestamp_s is None else float(finite_array(timestamp_s, (), f"{where}: timestamp_s"))
        _set(self, "timestamp_s", time)
        _set(self, "joints_rad", None if joints_rad is None else _joints(joints_rad, where))
        _set(self, "sigmas_px", None if sigmas_px is None else deviations(sigmas_px, len(ids), where))

    def __len__(self) -> int:
        return len(self.point_ids)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON or TOML; `from_dict` reads them back."""
        return without_none(
            name=self.name,
            T_base_flange=self.T_base_flange.to_list(),
            point_ids=self.point_ids.tolist(),
            pixels=self.pixels.tolist(),
            image=self.image,
            timestamp_s=self.timestamp_s,
            joints_rad=None if self.joints_rad is None else list(self.joints_rad),
            sigmas_px=None if self.sigmas_px is None else self.sigmas_px.tolist(),
        )

    @classmethod
    def from_dict(cls, data: object) -> "View":
        """Read what `to_dict` wrote.

        Raises
        ------
        InputError
            A missing, unknown or unusable field.
        """
        document = read_document(data, _ViewDocument, "view")
        return cls(
            document.name,
            Pose(document.T_base_flange),
            document.point_ids,
            document.pixels,
            document.image,
            document.timestamp_s,
            document.joints_rad,
            document.sigmas_px,
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, View) and self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        return hash((self.name, self.T_base_flange, self.point_ids.tobytes(), self.pixels.tobytes()))


def _set(view: View, name: str, value: object) -> None:
    object.__setattr__(view, name, value)  # the one way to fill a frozen dataclass


def _joints(values: Sequence[float], where: str) -> tuple[float, ...]:
    joints = finite_array(values, (None,), f"{where}: joints_rad")
    if not 1 <= len(joints) <= MAX_JOINTS:
        raise InputError(f"{where}: {len(joints)} joints, expected 1 to {MAX_JOINTS}", code=Code.WRONG_SHAPE)
    return tuple(joints.tolist())
