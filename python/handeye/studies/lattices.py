"""Fixed poses that tools of the field drive to, and those that people choose: policies without a model.

Each is a list of motions of the moved part (camera in the hand, or target on the flange), from where the arm
stands first. They are drawn from published descriptions; no code of another tool is behind them.
"""

from collections.abc import Callable

import numpy as np

from handeye import _core
from handeye.types.arrays import FloatArray

Lattice = Callable[[FloatArray, np.random.Generator], FloatArray]
"""From the first `T_camera_target` (4, 4) to those (N, 4, 4) that the lattice drives to, in its order."""

EASY_TURN_RAD, EASY_STEP_M = np.deg2rad(25.0), 0.1
SENTIAC_STEPS_M, SENTIAC_DISTANCES, SENTIAC_ROLL_RAD = (0.06, 0.05), (0.85, 1.0, 1.15), 0.2
SERPENTINE_ROWS, SERPENTINE_TILT_RAD = 5, np.deg2rad(35.0)
# How far a person turns and shifts the tool between two pictures of a board in front of them.
HUMAN_TURN_RAD, HUMAN_SHIFT_M, HUMAN_POSES = np.deg2rad(10.0), 0.04, 40


def easy_handeye(first: FloatArray, random: np.random.Generator) -> FloatArray:
    """17 moves of the flange: half a turn step and a whole one about each axis, both ways, and five shifts.

    As easy_handeye's automatic movements, 25 degrees and 0.1 m.
    """
    del random
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    turns = np.concatenate([EASY_TURN_RAD * axes, EASY_TURN_RAD / 2 * axes])
    shifts = EASY_STEP_M * np.array([[0.5, 0, 0], [-0.5, 0, 0], [0, 0.5, 0], [0, -0.5, 0], [0, 0, 0.5]])
    twists = np.zeros((17, 6))
    twists[:12, 3:], twists[12:, :3] = turns, shifts
    return _core.se3_exp(twists) @ first


def sentiac(first: FloatArray, random: np.random.Generator) -> FloatArray:
    """44 views about the first: a grid of 6 by 5 cm, three distances, turned to and fro by 0.2 rad.

    As Sentiac's auto_handeye_calibration has its candidates; which is taken is chosen by ln det of the 12
    parameters (see `POLICY_ROWS`). The camera looks at the target from each place.
    """
    del random
    views: list[FloatArray] = []
    distance = first[2, 3]
    for factor in SENTIAC_DISTANCES:
        for x in (-1, 0, 1):
            for y in (-1, 0, 1):
                rolls = (-1, 1) if (x, y) != (0, 0) else (0,)
                for roll in rolls:
                    at = np.array([x * SENTIAC_STEPS_M[0], y * SENTIAC_STEPS_M[1], 0.0])
                    views.append(_looking(first, at, factor * distance, roll * SENTIAC_ROLL_RAD))
    # 51 places of the grid; the seven farthest are left out, as only the number and the extent are published.
    return np.array(sorted(views, key=lambda view: _offset(first, view))[:44])


def serpentine(first: FloatArray, random: np.random.Generator) -> FloatArray:
    """A lattice of camera places on a sphere about the target, row by row to and fro, looking at it."""
    del random
    steps = np.linspace(-1, 1, SERPENTINE_ROWS)
    views: list[FloatArray] = []
    for number, row in enumerate(steps):
        for column in steps if number % 2 == 0 else steps[::-1]:
            tilt = SERPENTINE_TILT_RAD * np.array([row, column, 0.0])
            views.append(_turned_about_target(first, tilt))
    return np.array(views)


def human(first: FloatArray, random: np.random.Generator) -> FloatArray:
    """Small turns and shifts of the moved part about one place, as people drive an arm with a pendant."""
    sigma = np.repeat([HUMAN_SHIFT_M, HUMAN_TURN_RAD], 3)
    return _core.se3_exp(random.standard_normal((HUMAN_POSES, 6)) * sigma) @ first


LATTICES: dict[str, Lattice] = {
    "easy_handeye_17": easy_handeye,
    "sentiac_44": sentiac,
    "serpentine": serpentine,
    "human": human,
}


def _looking(first: FloatArray, at: FloatArray, distance_m: float, roll_rad: float) -> FloatArray:
    """Return the target seen by a camera shifted by `at`, turned to look at it from a distance, rolled."""
    moved = first.copy()
    moved[:3, 3] -= at
    to = moved[:3, 3] / np.linalg.norm(moved[:3, 3])
    axis = np.cross(to, [0.0, 0.0, 1.0])
    sine = float(np.linalg.norm(axis))
    turn = np.zeros((2, 6))
    if sine > 0:
        turn[0, 3:] = axis / sine * np.arctan2(sine, to[2])
    turn[1, 5] = roll_rad
    turns = _core.se3_exp(turn)
    seen = turns[1] @ turns[0] @ moved
    seen[:3, 3] *= distance_m / np.linalg.norm(seen[:3, 3])
    return seen


def _turned_about_target(first: FloatArray, rotation_vector: FloatArray) -> FloatArray:
    """Return the target turned on the spot, as seen by a camera that goes round it."""
    turned = first.copy()
    turn = _core.se3_exp(np.concatenate([np.zeros(3), rotation_vector])[np.newaxis])[0]
    turned[:3, :3] = turn[:3, :3] @ first[:3, :3]
    return turned


def _offset(first: FloatArray, view: FloatArray) -> float:
    """How far a view is from the first, a metre and two radians weighing alike."""
    twist = _core.se3_log((view @ np.linalg.inv(first))[np.newaxis])[0]
    return float(np.linalg.norm(twist[:3]) + 0.5 * np.linalg.norm(twist[3:]))
