"""Numbers from outside: checked once, then frozen."""

import operator
from typing import SupportsIndex

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handeye.codes import Code
from handeye.errors import InputError

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

# No length or parameter is larger; squares and products of such numbers still are numbers.
LARGEST = 1e9


def finite_array(values: ArrayLike, shape: tuple[int | None, ...], what: str) -> FloatArray:
    """Copy `values` into a read-only float64 array of the given shape.

    Parameters
    ----------
    values
        Anything numpy can turn into an array of real numbers.
    shape
        Expected shape; None stands for any length.
    what
        Name of the value, for the error message.

    Raises
    ------
    InputError
        Not numbers, another shape, or an entry that is not finite.
    """
    array = _numbers(values, what)
    if array.dtype.kind not in "iuf":
        raise InputError(f"{what}: expected real numbers, found {array.dtype}", code=Code.NOT_NUMBERS)
    _check_shape(array.shape, shape, what)
    frozen = np.array(array, dtype=np.float64, order="C")
    finite = np.isfinite(frozen)
    if not finite.all():
        where = [int(i) for i in np.argwhere(~finite)[0]]
        entry = f"entry {where}" if where else "the value"
        raise InputError(
            f"{what}: {entry} is {frozen[tuple(where)]}, expected a finite number",
            code=Code.NOT_FINITE,
            hint="remove the view or repair the file that the number came from",
        )
    frozen.flags.writeable = False
    return frozen


def index_array(values: ArrayLike, what: str) -> IndexArray:
    """Copy `values` into a read-only (N,) int64 array of numbers from 0 upwards.

    Raises
    ------
    InputError
        Not whole numbers, not one-dimensional, or negative.
    """
    array = _numbers(values, what)
    if array.size == 0:
        array = array.astype(np.int64)
    if array.dtype.kind not in "iu":
        raise InputError(f"{what}: expected whole numbers, found {array.dtype}", code=Code.NOT_NUMBERS)
    _check_shape(array.shape, (None,), what)
    if array.size and (array.min() < 0 or array.max() > np.iinfo(np.int64).max):
        raise InputError(
            f"{what}: {array.min()} to {array.max()}, expected 0 or more", code=Code.OUT_OF_RANGE
        )
    frozen = np.array(array, dtype=np.int64, order="C")
    frozen.flags.writeable = False
    return frozen


def count(value: SupportsIndex, low: int, high: int, what: str) -> int:
    """Return `value` as an int from `low` to `high`, both included.

    Raises
    ------
    InputError
        Not a whole number, or outside the range.
    """
    try:
        number = operator.index(value)
    except TypeError:
        number = None
    if number is None or isinstance(value, bool):
        raise InputError(f"{what}: {value!r}, expected a whole number", code=Code.NOT_NUMBERS)
    if not low <= number <= high:
        raise InputError(f"{what}: {_short(number)}, expected {low} to {high}", code=Code.OUT_OF_RANGE)
    return number


def positive(value: float, what: str) -> float:
    """Return `value` as a float above zero and at most 1e9.

    Raises
    ------
    InputError
        Not a number, not finite, or outside the range.
    """
    number = float(finite_array(value, (), what))
    if not 0.0 < number <= LARGEST:
        raise InputError(
            f"{what}: {number}, expected a number above zero to {LARGEST:g}", code=Code.OUT_OF_RANGE
        )
    return number


def deviations(values: ArrayLike, count: int, what: str) -> FloatArray:
    """Return standard deviations (N,) of so many points, in pixels.

    Raises
    ------
    InputError
        Another number of them, or one that is not finite and above zero.
    """
    sigmas = finite_array(values, (count,), f"{what}: sigmas_px")
    if not (sigmas > 0).all():
        raise InputError(
            f"{what}: sigmas_px: {sigmas.min():g}, expected numbers above zero", code=Code.INVALID_FIELD
        )
    return sigmas


def _numbers(values: ArrayLike, what: str) -> NDArray[np.generic]:
    try:
        return np.asarray(values)
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise InputError(
            f"{what}: not numbers, or rows of different length", code=Code.NOT_NUMBERS
        ) from error


def _check_shape(found: tuple[int, ...], expected: tuple[int | None, ...], what: str) -> None:
    fits = len(found) == len(expected) and all(
        want is None or have == want for have, want in zip(found, expected, strict=True)
    )
    if not fits:
        wanted = "(" + ", ".join("N" if want is None else str(want) for want in expected) + ")"
        raise InputError(f"{what}: shape {found}, expected {wanted}", code=Code.WRONG_SHAPE)


def _short(number: int) -> str:
    """Return the digits of a number, unless they would fill the message."""
    return str(number) if abs(number) < 10**12 else f"a number of {number.bit_length()} bits"
