"""Points that were touched: what a person knows of the arm and the board without the camera."""

from dataclasses import dataclass

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.arrays import FloatArray, finite_array
from handeye.types.pose import Pose
from handeye.types.rig import Body

# A tip of which nothing is said is somewhere within a metre of its body's origin.
UNKNOWN_M = 1.0


@dataclass(frozen=True)
class Tip:
    """A point that is not on the board: the tip of a tool on the flange, or a fixed point in the cell.

    Parameters
    ----------
    body
        What it is fixed to.
    at_m
        (3,) where it is believed to be in the frame of the flange or the base.
    sigma_m
        Standard deviation of that per axis; zero for one that is exact.

    Raises
    ------
    InputError
        Numbers that are not finite, or a deviation below zero.
    """

    body: Body
    at_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sigma_m: float = UNKNOWN_M

    def __post_init__(self) -> None:
        finite_array(self.at_m, (3,), "tip")
        if not 0 <= self.sigma_m < float("inf"):
            raise InputError(
                f"tip: standard deviation {self.sigma_m} m, expected zero or more", code=Code.OUT_OF_RANGE
            )


@dataclass(frozen=True)
class Touch:
    """The arm at rest with a tip at a point.

    Parameters
    ----------
    tip
        Name of the tip.
    point
        Number of the point of the board, or the name of another tip.
    T_base_flange, joints_rad
        The arm as it reports itself.
    """

    tip: str
    point: int | str
    T_base_flange: Pose
    joints_rad: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Probing:
    """Touches, and the tips that they were made with.

    Parameters
    ----------
    tips
        By name.
    touches
        In any order.
    sigma_m
        Standard deviation per axis of how well a tip meets a point.

    Raises
    ------
    InputError
        No touch, a tip that is not named, a touch of two points on one body, or a deviation that is not above
        zero.
    """

    tips: dict[str, Tip]
    touches: tuple[Touch, ...]
    sigma_m: float

    def __post_init__(self) -> None:
        if not self.touches:
            raise InputError("no touch", code=Code.NO_TOUCHES, hint="touch three corners of the board")
        if not 0 < self.sigma_m < float("inf"):
            raise InputError(
                f"touches: standard deviation {self.sigma_m} m, expected above zero", code=Code.OUT_OF_RANGE
            )
        for number, touch in enumerate(self.touches, start=1):
            names = [touch.tip, *([touch.point] if isinstance(touch.point, str) else [])]
            for name in names:
                if name not in self.tips:
                    raise InputError(
                        f"touch {number}: no tip {name[:80]!r}",
                        code=Code.UNKNOWN_TIP,
                        hint=f"tips are {', '.join(self.tips)}",
                    )
            bodies = [self.tips[name].body for name in names]
            if len(bodies) > 1 and bodies[0] is bodies[1]:
                raise InputError(
                    f"touch {number}: both points are on the {bodies[0].value}",
                    code=Code.SAME_BODY,
                    hint="one of them moves with the flange, the other stands still",
                )

    def check_board(self, body: Body, points: int) -> None:
        """Raise where a touch does not fit the board.

        Raises
        ------
        InputError
            A point that the board does not have, or a tip on the body that the board is on.
        """
        for number, touch in enumerate(self.touches, start=1):
            if isinstance(touch.point, str):
                continue
            if not 0 <= touch.point < points:
                raise InputError(
                    f"touch {number}: point {touch.point} of a board with points 0 to {points - 1}",
                    code=Code.UNKNOWN_POINT,
                )
            if self.tips[touch.tip].body is body:
                raise InputError(
                    f"touch {number}: the board and tip {touch.tip} are both on the {body.value}",
                    code=Code.SAME_BODY,
                    hint="a board on the flange is touched with a tip that stands still",
                )

    def joints(self, count: int) -> FloatArray:
        """(Q, n) joint positions at the touches.

        Raises
        ------
        InputError
            A touch has none, or another number of them.
        """
        for number, touch in enumerate(self.touches, start=1):
            if touch.joints_rad is None or len(touch.joints_rad) != count:
                raise InputError(
                    f"touch {number}: {len(touch.joints_rad or ())} joint positions, the arm has {count}",
                    code=Code.NO_JOINTS,
                    hint="write down the joints at every touch, or leave out --robot",
                )
        return np.array([touch.joints_rad for touch in self.touches], dtype=float)
