"""What a format of camera files has, and how its numbers are taken."""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types import Camera
from handeye.types.arrays import FloatArray

Table = Mapping[str, object]
MAX_NUMBERS = 100
# A lens that is said to have no distortion gets the usual five coefficients at zero, not none: that none were
# estimated is likelier than that there are none, and five can be refined.
_NO_DISTORTION = np.zeros(5)
_FISHEYE = frozenset({"equidistant", "fisheye", "kannala_brandt4", "kannala_brandt", "equi"})
_BROWN = frozenset(
    {"plumb_bob", "rational_polynomial", "brown_conrady", "modified_brown_conrady", "radtan", "thin_prism"}
)
# RealSense applies these coefficients from pixels to rays; no camera of OpenCV does.
_INVERSE = frozenset({"inverse_brown_conrady", "modified_brown_conrady"})


@dataclass(frozen=True)
class CameraFormat:
    """A format of camera files.

    Attributes
    ----------
    name
        What it is, for a person.
    recognises
        Tells whether a document is of this format, by its keys.
    read
        Reads it; raises `InputError`.
    """

    name: str
    recognises: Callable[[Table], bool]
    read: Callable[[Table], Camera]


def camera_of(
    matrix: FloatArray, distortion: Sequence[float], size: tuple[int, int], model: str = "plumb_bob"
) -> Camera:
    """Return the camera of a matrix (3, 3), coefficients in OpenCV's order, width and height, and a model.

    Raises
    ------
    InputError
        A matrix of zeros, a model that is not known or not OpenCV's, or a wrong number of coefficients.
    """
    name = model.strip().lower().rsplit(".", maxsplit=1)[-1]
    if not matrix.any():
        raise InputError(
            "a camera matrix of zeros: this camera was never calibrated",
            code=Code.NOT_CALIBRATED,
            hint="calibrate it, or leave the camera out: it is calibrated from the pictures then",
        )
    coefficients = np.array(distortion, dtype=np.float64)
    if not coefficients.any() and name not in _FISHEYE:
        # The model does not matter where nothing is distorted.
        coefficients = _NO_DISTORTION if len(coefficients) in {0, 4} else coefficients
        return Camera.from_opencv(matrix, coefficients, size)
    if name in _INVERSE:
        raise InputError(
            f"distortion model {name}: its coefficients lead from pixels to rays, expected those of OpenCV",
            code=Code.UNKNOWN_LENS,
            hint="calibrate it with OpenCV, or leave it out: it is calibrated from the pictures then",
        )
    if name not in _FISHEYE | _BROWN:
        known = ", ".join(sorted(_BROWN - _INVERSE | _FISHEYE))
        raise InputError(f"distortion model {model[:40]!r}, expected one of {known}", code=Code.UNKNOWN_LENS)
    return Camera.from_opencv(matrix, coefficients, size, fisheye=name in _FISHEYE)


def pinhole_matrix(fx: float, fy: float, cx: float, cy: float) -> FloatArray:
    """Return the camera matrix (3, 3)."""
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def table_at(document: Table, key: str) -> Table:
    """Return the table under a key.

    Raises
    ------
    InputError
        There is none.
    """
    inner = document.get(key)
    if not isinstance(inner, Mapping):
        raise InputError(f"{key}: expected a table", code=Code.INVALID_FIELD)
    return cast("Table", inner)


def number_at(document: Table, key: str) -> float:
    """Return the number under a key; text that spells one will do, also ``1200.``.

    Raises
    ------
    InputError
        There is none.
    """
    return _number(document.get(key), key)


def numbers_at(document: Table, key: str) -> list[float]:
    """Return the numbers of a list, of a list of lists, or of a matrix with rows, cols and data.

    Raises
    ------
    InputError
        There is no such list.
    """
    return _numbers(document.get(key), key)


def size_at(document: Table, width: str, height: str) -> tuple[int, int]:
    """Return width and height in pixels.

    Raises
    ------
    InputError
        One is missing or no whole number above zero.
    """
    size = [number_at(document, key) for key in (width, height)]
    if any(value != int(value) or value < 1 for value in size):
        raise InputError(
            f"{width} and {height}: {size[0]:g} x {size[1]:g}, expected pixels of the image",
            code=Code.OUT_OF_RANGE,
        )
    return int(size[0]), int(size[1])


def square(values: Sequence[float], what: str) -> FloatArray:
    """Return nine numbers as a matrix (3, 3) by rows.

    Raises
    ------
    InputError
        Another number of them.
    """
    if len(values) != 9:
        raise InputError(f"{what}: {len(values)} numbers, expected 9", code=Code.WRONG_SHAPE)
    return np.array(values, dtype=np.float64).reshape(3, 3)


def _numbers(item: object, key: str) -> list[float]:
    if isinstance(item, Mapping):
        return _numbers(cast("Table", item).get("data"), key)
    if isinstance(item, str):
        item = item.replace(",", " ").strip("[] \n").split()
    if not isinstance(item, list):
        raise InputError(f"{key}: expected a list of numbers", code=Code.INVALID_FIELD)
    values: list[float] = []
    for part in cast("list[object]", item):
        values += _numbers(cast("object", part), key) if isinstance(part, list) else [_number(part, key)]
        if len(values) > MAX_NUMBERS:
            raise InputError(f"{key}: more than {MAX_NUMBERS} numbers", code=Code.TOO_LARGE)
    return values


def _number(item: object, key: str) -> float:
    value = float("nan")
    if isinstance(item, (int, float, str)) and not isinstance(item, bool):
        with contextlib.suppress(ValueError, OverflowError):
            value = float(item) if "_" not in str(item)[:60] and len(str(item)) < 60 else value
    if not np.isfinite(value):
        found = "nothing" if item is None else repr(item)[:40]
        raise InputError(f"{key}: {found}, expected a finite number", code=Code.NOT_NUMBERS)
    return value
