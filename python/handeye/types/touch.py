"""How far off the tool lands over a place of work, as people read it."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.arrays import FloatArray, finite_array
from handeye.types.units import MM_PER_M

# What share of the variance a thing must have to be named as what limits it.
_WORTH_NAMING = 0.1
_ADVICE = {
    "camera": "the camera's parameters limit it most: calibrate the camera apart, with more pictures",
    "hand_eye": "the hand-eye limits it most: more views, planned for the touch error, help",
    "arm": "constants of the arm limit it most: more views spread over the postures of the work help",
    "board": "the size of the board limits it most: measure the board, or touch three points of it",
    "robot_noise": "what the arm errs by each time limits it most: more views do not help",
}


@dataclass(frozen=True)
class WorkBox:
    """A box in the frame of the base in which things are seen and touched, metres.

    Raises
    ------
    InputError
        Numbers that are not finite, or a lower corner that is not below the upper one.
    """

    lower_m: tuple[float, float, float]
    upper_m: tuple[float, float, float]

    def __post_init__(self) -> None:
        lower = finite_array(self.lower_m, (3,), "box of work")
        upper = finite_array(self.upper_m, (3,), "box of work")
        if (lower >= upper).any():
            raise InputError(
                f"box of work: from {lower * MM_PER_M} to {upper * MM_PER_M} mm, expected the lower first",
                code=Code.OUT_OF_RANGE,
                hint="give the least x y z, then the largest x y z",
            )

    @classmethod
    def of_mm(cls, corners_mm: tuple[float, float, float, float, float, float]) -> "WorkBox":
        """Take least x y z and largest x y z in millimetres."""
        x, y, z, x2, y2, z2 = (value / MM_PER_M for value in corners_mm)
        return cls((x, y, z), (x2, y2, z2))

    def grid(self, per_axis: int) -> FloatArray:
        """(N, 3) points spread evenly over the box, corners among them."""
        axes = [np.linspace(a, b, per_axis) for a, b in zip(self.lower_m, self.upper_m, strict=True)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class TouchMap:
    """Touch error over a box of work: radii within which a touch lands with 95 % probability.

    Parameters
    ----------
    box
        The box, in the base.
    stated
        Whether it was asked for; otherwise it is where the board was seen.
    tool_m
        (3,) tip of the tool in the flange.
    depth
        Where the distance of a seen point comes from; see `handeye.estimation.touch.Depth`.
    points_m
        (P, 3) points of the map.
    radii_m
        (P,) the radius at each, the worst over the postures tried.
    mean_m, worst_m
        Mean and largest over the map.
    as_reported_m
        Mean where the arm's poses are taken as they are reported; what was found of the arm is not put right.
    limits
        By what share the variance would fall if one thing were known exactly.
    out_of_reach, out_of_sight
        Touches that were left out: points times postures.
    """

    box: WorkBox
    stated: bool
    tool_m: FloatArray
    depth: str
    points_m: FloatArray
    radii_m: FloatArray
    as_reported_m: float
    limits: dict[str, float]
    out_of_reach: int
    out_of_sight: int

    @property
    def mean_m(self) -> float:
        """Mean of the radii."""
        return float(self.radii_m.mean())

    @property
    def worst_m(self) -> float:
        """Largest of the radii."""
        return float(self.radii_m.max())

    @property
    def worst_at_m(self) -> FloatArray:
        """(3,) where the largest is."""
        return self.points_m[int(self.radii_m.argmax())]

    @property
    def advice(self) -> str:
        """What limits it most, and what would help."""
        name = max(self.limits, key=lambda key: self.limits[key])
        return _ADVICE[name]

    @property
    def named_limits(self) -> tuple[tuple[str, float], ...]:
        """What limits it, the largest share first, without what hardly matters."""
        ordered = sorted(self.limits.items(), key=lambda item: -item[1])
        return tuple((name, share) for name, share in ordered if share >= _WORTH_NAMING)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, with units in the keys."""
        return {
            "mean_mm": self.mean_m * MM_PER_M,
            "worst_mm": self.worst_m * MM_PER_M,
            "worst_at_mm": (self.worst_at_m * MM_PER_M).tolist(),
            "as_reported_mm": self.as_reported_m * MM_PER_M,
            "probability": 0.95,
            "box_mm": [[v * MM_PER_M for v in self.box.lower_m], [v * MM_PER_M for v in self.box.upper_m]],
            "box_stated": self.stated,
            "tool_mm": (self.tool_m * MM_PER_M).tolist(),
            "depth": self.depth,
            "limits": dict(self.limits),
            "advice": self.advice,
            "out_of_reach": self.out_of_reach,
            "out_of_sight": self.out_of_sight,
            "map": [
                {"point_mm": (point * MM_PER_M).tolist(), "radius_mm": float(radius) * MM_PER_M}
                for point, radius in zip(self.points_m, self.radii_m, strict=True)
            ],
        }
