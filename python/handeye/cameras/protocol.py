"""What a camera must be able to do: take one picture."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from handeye.errors import InputError
from handeye.types.arrays import FloatArray, IndexArray

Grey = NDArray[np.uint8]


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
            raise InputError("frame: neither image nor points", code="invalid_field")
        if self.image is not None and (self.image.ndim != 2 or self.image.dtype != np.uint8):
            raise InputError(
                f"frame: shape {self.image.shape} of {self.image.dtype}, expected grey values of uint8",
                code="wrong_shape",
            )


@runtime_checkable
class ImageSource(Protocol):
    """A camera as a driver presents it.

    The arm is at rest while it is asked. It raises `handeye.errors.DeviceError` where it fails. It may be
    asked from another thread than the one that made it, and be given up while it hangs.
    """

    def grab(self, label: str) -> Frame:
        """Expose now and return the picture; the label names the attempt, such as `view_04.2`."""
        ...
