"""What a camera must be able to do: take one picture."""

import math
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from handeye.codes import Code
from handeye.errors import DeviceError, InputError
from handeye.types.arrays import FloatArray, IndexArray, finite_array, index_array
from handeye.types.camera import MAX_PIXELS
from handeye.types.target.base import MAX_POINTS

Grey = NDArray[np.uint8]
# Code of what a driver returned that is no picture.
BAD_FRAME = Code.BAD_FRAME


@dataclass(frozen=True, eq=False)
class Points:
    """Points of the target that a camera found by itself: ids (N,) and pixels (N, 2).

    `labels_known` says that the ids are to be taken as they are, also where the target looks the same turned.
    """

    point_ids: IndexArray
    pixels: FloatArray
    labels_known: bool = False


@dataclass(frozen=True, eq=False)
class Frame:
    """One exposure.

    Parameters
    ----------
    image
        (H, W) grey values; None from a camera that gives points only.
    points
        What the camera found by itself; None to have it found in the image.
    timestamp_s
        Time of the exposure on any clock; None if unknown.

    Raises
    ------
    InputError
        Neither image nor points, or an image that is not (H, W) of uint8.
    """

    image: Grey | None
    points: Points | None = None
    timestamp_s: float | None = None

    def __post_init__(self) -> None:
        if self.image is None and self.points is None:
            raise InputError("frame: neither image nor points", code=Code.INVALID_FIELD)
        if self.image is not None and (self.image.ndim != 2 or self.image.dtype != np.uint8):
            raise InputError(
                f"frame: shape {self.image.shape} of {self.image.dtype}, expected grey values of uint8",
                code=Code.WRONG_SHAPE,
            )


def checked_frame(answer: object) -> Frame:
    """Return what a driver answered if it is a frame, its picture and points as plain arrays.

    Raises
    ------
    DeviceError
        It is none, or its picture, its points or its time are not what they should be.
    """
    if not isinstance(answer, Frame):
        raise DeviceError(f"grab returns {type(answer).__name__}, expected Frame", code=BAD_FRAME)
    try:
        return _plain(answer)
    except InputError as error:
        raise DeviceError(error.message, code=BAD_FRAME) from error
    except Exception as error:
        raise DeviceError(f"frame: unreadable ({type(error).__name__})", code=BAD_FRAME) from error


def _plain(answer: Frame) -> Frame:
    time, image, points = answer.timestamp_s, answer.image, answer.points
    if time is not None and not (isinstance(time, int | float) and math.isfinite(time)):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError("frame: timestamp_s is no finite number")
    if image is not None:
        if not isinstance(image, np.ndarray):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise InputError(f"frame: image is {type(image).__name__}, expected an array of numpy")
        image = np.asarray(image)  # not one of its subclasses
        if image.size > MAX_PIXELS:
            raise InputError(f"frame: an image of shape {image.shape}, expected at most {MAX_PIXELS} pixels")
    if points is not None:
        if not isinstance(points, Points):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise InputError(f"frame: points are {type(points).__name__}, expected Points")
        if max(len(points.point_ids), len(points.pixels)) > MAX_POINTS:
            raise InputError(f"frame: {len(points.point_ids)} points, expected at most {MAX_POINTS}")
        ids = index_array(points.point_ids, "frame: point_ids")
        pixels = finite_array(points.pixels, (len(ids), 2), "frame: pixels")
        points = Points(ids, pixels, points.labels_known is True)
    return Frame(image, points, time)


@runtime_checkable
class ImageSource(Protocol):
    """A camera as a driver presents it.

    The arm is at rest while it is asked. It raises `handeye.errors.DeviceError` where it fails. It may be
    asked from another thread than the one that made it, and be given up while it hangs. A method `close`,
    where there is one, is called once, at the end of a session.
    """

    def grab(self, label: str) -> Frame:
        """Expose now and return the picture; the label names the attempt, such as `view_04.2`."""
        ...
