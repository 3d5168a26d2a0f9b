"""Numbers and directions in words."""

import numpy as np

from handeye.types.arrays import FloatArray

# A direction within this of an axis is called by the axis alone.
NEAR_AXIS_DEG = 30.0
_ALONG = ("across the image", "up and down the image", "along the optical axis")
_ABOUT = ("the camera nods", "the camera pans", "the image rolls")


def figures(value: float, digits: int = 3) -> str:
    """Return a number with so many digits that count, without an exponent where that can be read."""
    if value == 0 or not np.isfinite(value) or not 1e-6 <= abs(value) < 1e7:
        return f"{value:.{digits}g}"
    decimals = max(digits - 1 - int(np.floor(np.log10(abs(value)))), 0)
    return f"{value:.{decimals}f}"


def fixed(value: float, decimals: int) -> str:
    """Return a number with so many decimals, with a true minus sign."""
    text = f"{value:.{decimals}f}"
    return text.removeprefix("-") if not text.strip("-0.") else text.replace("-", "\N{MINUS SIGN}")


def direction(vector: FloatArray, frame: str) -> str:
    """Name a direction (3,) by the axes of a frame, its sign left open: `x of the flange`."""
    unit = vector / np.linalg.norm(vector)
    order = np.argsort(-np.abs(unit))
    first, second = int(order[0]), int(order[1])
    if np.abs(unit[first]) >= np.cos(np.deg2rad(NEAR_AXIS_DEG)):
        return f"{'xyz'[first]} of the {frame}"
    # Which diagonal it is depends on whether the two go together.
    sign = "" if unit[first] * unit[second] > 0 else "\N{MINUS SIGN}"
    return f"a line between {'xyz'[first]} and {sign}{'xyz'[second]} of the {frame}"


def in_camera(vector: FloatArray) -> str:
    """Say how a direction (3,) of the camera frame lies in the picture."""
    axis = _camera_axis(vector)
    return "oblique to the image" if axis is None else _ALONG[axis]


def turning_camera(vector: FloatArray) -> str:
    """Say what a turn about a direction (3,) of the camera frame does to the camera."""
    axis = _camera_axis(vector)
    return "oblique to the image" if axis is None else _ABOUT[axis]


def _camera_axis(vector: FloatArray) -> int | None:
    unit = np.abs(vector / np.linalg.norm(vector))
    first = int(np.argmax(unit))
    return first if unit[first] >= np.cos(np.deg2rad(NEAR_AXIS_DEG)) else None
