"""What a detection is, and what a failure to detect says."""

from dataclasses import dataclass, replace
from enum import StrEnum
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handeye.codes import Code
from handeye.errors import DetectionError, InputError
from handeye.types import Target
from handeye.types.arrays import FloatArray, IndexArray, deviations, finite_array, index_array
from handeye.types.target import Coded

_Board = TypeVar("_Board", bound=Target)
Image = NDArray[np.uint8]
"""A grey picture (H, W)."""


@dataclass(frozen=True, eq=False, init=False)
class Detection:
    """Points of a target found in one image.

    Parameters
    ----------
    point_ids
        (N,) indices into the points of the target, N >= 1, each at most once.
    pixels
        (N, 2) where they are: u to the right, v down, pixel centres at whole numbers. A circle is where the
        area centroid of its image is, not the image of its centre.
    sigmas_px
        (N,) standard deviation of one coordinate of each point, in pixels; None if unknown.
    note
        What about the board is not as described, though its points are.

    Raises
    ------
    InputError
        Wrong shapes, a pixel that is not finite, or a point twice.

    Examples
    --------
    >>> Detection([0, 1], [[10.0, 20.0], [30.0, 20.0]]).pixels.shape
    (2, 2)
    """

    point_ids: IndexArray
    pixels: FloatArray
    sigmas_px: FloatArray | None
    note: str

    def __init__(
        self,
        point_ids: ArrayLike,
        pixels: ArrayLike,
        sigmas_px: ArrayLike | None = None,
        note: str = "",
    ) -> None:
        ids = index_array(point_ids, "detection: point_ids")
        values = finite_array(pixels, (None, 2), "detection: pixels")
        if len(ids) == 0 or len(ids) != len(values) or len(np.unique(ids)) != len(ids):
            raise InputError(
                f"detection: {len(ids)} point ids for {len(values)} pixels, expected as many, at least one, "
                "and none twice",
                code=Code.WRONG_SHAPE,
            )
        object.__setattr__(self, "point_ids", ids)
        object.__setattr__(self, "pixels", values)
        sigmas = None if sigmas_px is None else deviations(sigmas_px, len(ids), "detection")
        object.__setattr__(self, "sigmas_px", sigmas)
        object.__setattr__(self, "note", note)

    def __len__(self) -> int:
        return len(self.point_ids)


class Reason(StrEnum):
    """Why a target was not found, as far as the image tells.

    Examples
    --------
    >>> Reason("blurred") is Reason.BLURRED
    True
    """

    IMAGE_TOO_SMALL = "image_too_small"
    UNDEREXPOSED = "underexposed"
    OVEREXPOSED = "overexposed"
    LOW_CONTRAST = "low_contrast"
    BLURRED = "blurred"
    WRONG_SIZE = "wrong_size"
    OTHER_BOARD = "other_board"
    INCOMPLETE = "incomplete"
    INCONSISTENT = "inconsistent"
    REPEATED = "repeated"
    NO_PATTERN = "no_pattern"
    DETECTOR_FAILED = "detector_failed"


_HINTS = {
    Reason.IMAGE_TOO_SMALL: "use the full resolution of the camera",
    Reason.UNDEREXPOSED: "expose longer or add light",
    Reason.OVEREXPOSED: "expose shorter, or turn the board out of the reflection",
    Reason.LOW_CONTRAST: "check the light and that the lens is open",
    Reason.BLURRED: "focus the lens, or let the arm come to rest before the picture is taken",
    Reason.WRONG_SIZE: "count rows and columns again: inner corners on a chessboard, circles on a grid",
    Reason.OTHER_BOARD: "describe the board that is shown",
    Reason.INCOMPLETE: "bring the whole board into the image and nothing in front of it",
    Reason.INCONSISTENT: "check rows, columns and dictionary against the printed board",
    Reason.REPEATED: "leave one of them in the picture, or give their markers other numbers",
    Reason.NO_PATTERN: "check that the board is in the image, whole, with a white margin, not too oblique",
    Reason.DETECTOR_FAILED: "look at the image; if it is in order, please report it",
}


@dataclass(frozen=True)
class NotFound:
    """The target was not found.

    Attributes
    ----------
    reason
        The likeliest cause.
    evidence
        What was seen, for a person.
    shown
        The board that the picture shows instead; lengths that it does not tell are those described.
    advice
        How to describe it; empty for what usually helps.

    Examples
    --------
    >>> missed = detect(np.full((480, 640), 255, np.uint8), board)
    >>> missed.reason.value
    'overexposed'
    """

    reason: Reason
    evidence: str
    shown: Target | None = None
    advice: str = ""

    @property
    def hint(self) -> str:
        """What to do about it."""
        return self.advice or _HINTS[self.reason]

    def error(self, name: str) -> DetectionError:
        """Return the error to raise where the image of this name was needed."""
        return DetectionError(f"{name}: target not found: {self.evidence}", code=self.reason, hint=self.hint)


def relabeled(detection: Detection, permutation: IndexArray) -> Detection:
    """Return the detection with point i called `permutation[i]`, as the symmetries of a target have it.

    Parameters
    ----------
    detection
        The points.
    permutation
        (P,) the new name of every point of the target.

    Examples
    --------
    >>> swapped = relabeled(Detection([0, 1], [[10, 20], [30, 20]]), np.array([1, 0]))
    >>> swapped.point_ids
    array([1, 0])
    """
    return replace(detection, point_ids=permutation[detection.point_ids])


def ordered(
    target: Target, point_ids: ArrayLike, pixels: ArrayLike, sigmas_px: ArrayLike | None = None
) -> Detection:
    """Return a detection in the order of the points' ids.

    Where the target has symmetries the picture cannot tell its labelings apart; the one is taken whose x axis
    points furthest to the right in the image, so that views without much roll agree.
    """
    detection = Detection(point_ids, pixels, sigmas_px)
    if len(target.symmetries) > 1:
        named = (relabeled(detection, permutation) for permutation in target.symmetries)
        detection = max(named, key=lambda candidate: x_axis(target, candidate)[0])
    return chosen(detection, np.argsort(detection.point_ids))


def chosen(detection: Detection, which: IndexArray) -> Detection:
    """Return a detection with some of the points, in that order."""
    sigmas = detection.sigmas_px
    return replace(
        detection,
        point_ids=detection.point_ids[which],
        pixels=detection.pixels[which],
        sigmas_px=None if sigmas is None else sigmas[which],
    )


def x_axis(target: Target, detection: Detection) -> FloatArray:
    """Return the direction (2,) of the target's x axis in the image, in pixels per metre (affine fit)."""
    plane = target.points[detection.point_ids, :2]
    return affine(plane, detection.pixels)[0][0]


def affine(source: FloatArray, destination: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return A (2, 2) and b (2,) with `destination ~ source @ A + b`, least squares over points (N, 2)."""
    centre = source.mean(axis=0)
    shift = destination.mean(axis=0)
    flat = source - centre
    square = flat.T @ flat
    (a, b), (_, d) = square.tolist()
    determinant = a * d - b * b
    inverse = np.array([[d, -b], [-b, a]]) / (determinant or 1.0)
    if determinant <= 1e-12 * (a + d) ** 2:
        # Points on a line leave the rest open; then the least of all answers is taken.
        inverse = np.asarray(np.linalg.pinv(square), dtype=np.float64)
    A = np.asarray(inverse @ (flat.T @ (destination - shift)), dtype=np.float64)
    return A, shift - centre @ A


def inside(image: Image, pixels: FloatArray) -> NDArray[np.bool_]:
    """Tell which places (N, 2) are in an image."""
    last = np.array(image.shape[::-1]) - 1.0
    return np.asarray(((pixels >= 0) & (pixels <= last)).all(axis=1), dtype=np.bool_)


def is_mirrored(plane: FloatArray, pixels: FloatArray) -> bool:
    """Tell whether points (N, 2) of a board appear as in a mirror, which no view of its front shows.

    Both the plane of the target and the image have x to the right and y down.
    """
    return float(np.linalg.det(affine(plane, pixels)[0])) < 0


def upright(image: Image, target: _Board) -> tuple[Image, _Board]:
    """Return image and target as they are, in the negative where the target is printed light on dark."""
    if not isinstance(target, Coded) or not target.inverted:
        return image, target
    return np.asarray(255 - image, dtype=np.uint8), _positive(target)


@lru_cache(maxsize=16)
def _positive(target: _Board) -> _Board:
    """Return the target printed dark on light; the same object each time, for whatever is kept about it."""
    return target.changed(inverted=False)
