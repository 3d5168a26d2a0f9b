"""The touch error over a place of work: which points are seen and touched, and from where.

A point of the box is seen as the board was seen in some of the views: the camera stands to the point as it
stood to the middle of the board, or, beside the robot, where it is. With the camera in the hand the tool
touches with the flange turned as in that view. Beside the robot that is how a board is held up to a camera,
not how an arm works: there the tool points straight down, turned about the vertical as in that view, and
only where the arm cannot do that as it was held.
"""

from dataclasses import dataclass

import numpy as np

from handeye.errors import InputError
from handeye.estimation.estimate import Estimate
from handeye.estimation.measurements import Measurements
from handeye.estimation.touch import Depth, TouchError, Touches, limits, touch_error
from handeye.types.arrays import BoolArray, FloatArray, IndexArray
from handeye.types.mounting import Mounting
from handeye.types.pose import Pose, inverses
from handeye.types.touch import TouchMap, WorkBox

# Where nothing is said: a tool as long as an ordinary gripper, and at least this much around the board.
USUAL_TOOL_M = (0.0, 0.0, 0.15)
LEAST_SIDE_M = 0.1
PER_AXIS = 3
NOTHING_TO_TOUCH = "nothing_to_touch"
POSTURES = 3
_PARALLEL = 1e-9


@dataclass(frozen=True)
class Work:
    """What is seen and touched, and how.

    Parameters
    ----------
    box
        Where, in the base; None for where the board was seen.
    tool_m
        Tip of the tool in the flange.
    depth
        Where the distance of a seen point comes from.
    """

    box: WorkBox | None = None
    tool_m: tuple[float, float, float] = USUAL_TOOL_M
    depth: Depth = Depth.SIZE


@dataclass(frozen=True, eq=False)
class Laid:
    """Touches laid out over a box.

    Parameters
    ----------
    touches
        Those that can be seen and reached.
    points
        (Q,) which point of the grid each is.
    grid_m
        (P, 3) the grid.
    """

    box: WorkBox
    touches: Touches
    points: IndexArray
    grid_m: FloatArray
    out_of_reach: int
    out_of_sight: int


def touch_map(estimate: Estimate, measurements: Measurements, work: Work) -> TouchMap:
    """Return the touch error over a place of work.

    Raises
    ------
    InputError
        No point of the box can be seen and reached.
    """
    laid = lay_out(estimate, measurements, work)
    error = touch_error(estimate, laid.touches)
    return _map(estimate, laid, error, work)


def touch_where_possible(estimate: Estimate, measurements: Measurements, work: Work) -> TouchMap | None:
    """Return the touch error; None where views leave something open, or no box was stated and none will do.

    Raises
    ------
    InputError
        No point of the stated box can be seen and reached.
    """
    if not estimate.determined:
        return None
    try:
        return touch_map(estimate, measurements, work)
    except InputError as error:
        if error.code == NOTHING_TO_TOUCH and work.box is None:
            return None
        raise


def _map(estimate: Estimate, laid: Laid, error: TouchError, work: Work) -> TouchMap:
    seen = np.unique(laid.points)
    worst = np.array([error.radii_m[laid.points == point].max() for point in seen])
    return TouchMap(
        box=laid.box,
        stated=work.box is not None,
        tool_m=laid.touches.tool_m,
        depth=laid.touches.depth.value,
        points_m=laid.grid_m[seen],
        radii_m=worst,
        as_reported_m=float(error.as_reported_m.mean()),
        limits=limits(estimate, error),
        out_of_reach=laid.out_of_reach,
        out_of_sight=laid.out_of_sight,
    )


def lay_out(estimate: Estimate, measurements: Measurements, work: Work) -> Laid:
    """Lay out the touches of a place of work.

    Raises
    ------
    InputError
        No point of the box can be seen and reached.
    """
    box = work.box or usual_box(estimate, measurements)
    grid = box.grid(PER_AXIS)
    last = len(measurements) - 1
    views = {round(i * last / (POSTURES - 1)) for i in range(POSTURES)}
    in_hand = estimate.mounting is Mounting.EYE_IN_HAND
    tool = np.array(work.tool_m)
    middle = estimate.Y.act(estimate.target.points).mean(axis=0)
    at: list[IndexArray] = []
    seen: list[FloatArray] = []
    touched: list[FloatArray] = []
    held: list[FloatArray] = []
    postures: list[FloatArray] = []
    for k in sorted(views):
        flange = measurements.views[k].T_base_flange.matrix
        seeing = np.tile(flange, (len(grid), 1, 1))
        if in_hand:
            seeing[:, :3, 3] += grid - middle
        at.append(np.arange(len(grid)))
        seen.append(seeing)
        held.append(_tip_at(grid, flange[:3, :3], tool))
        touched.append(held[-1] if in_hand else _tip_at(grid, _pointing_down(flange[:3, :3], tool), tool))
        if estimate.arm is not None:
            postures.append(np.tile(measurements.joints[k], (len(grid), 1)))
    points = np.concatenate(at)
    laid = Touches(grid[points], np.concatenate(seen), np.concatenate(touched), tool, depth=work.depth)
    visible = _visible(estimate, laid)
    joints = None
    reached = np.ones(len(points), dtype=bool)
    if estimate.arm is not None:
        kinematics = estimate.arm.kinematics
        first, there = kinematics.reach(laid.seen_from, np.concatenate(postures))
        second, also = kinematics.reach(laid.touched_from, first)
        if not in_hand and not also.all():
            as_held = np.concatenate(held)
            other, held_too = kinematics.reach(as_held, first)
            second[~also] = other[~also]
            laid.touched_from[~also] = as_held[~also]
            also = also | held_too
        reached = also & (there | (not in_hand))
        joints = (first, second)
    kept = visible & reached
    if not kept.any():
        raise InputError(
            f"the box of work: of {len(points)} touches {int((~visible).sum())} are out of sight of "
            f"the camera and {int((~reached).sum())} out of reach of the arm",
            code=NOTHING_TO_TOUCH,
            hint="state another box in the frame of the base, or a shorter tool",
        )
    return Laid(
        box,
        Touches(
            laid.points_m[kept],
            laid.seen_from[kept],
            laid.touched_from[kept],
            tool,
            None if joints is None else joints[0][kept],
            None if joints is None else joints[1][kept],
            work.depth,
        ),
        points[kept],
        grid,
        int((~reached).sum()),
        int((~visible).sum()),
    )


def _tip_at(points: FloatArray, turn: FloatArray, tool: FloatArray) -> FloatArray:
    """(Q, 4, 4) `T_base_flange` with the tip at points (Q, 3), the flange turned by (3, 3)."""
    poses = np.tile(np.eye(4), (len(points), 1, 1))
    poses[:, :3, :3] = turn
    poses[:, :3, 3] = points - turn @ tool
    return poses


def _pointing_down(turn: FloatArray, tool: FloatArray) -> FloatArray:
    """(3, 3) a turn of the flange by the least angle that lets a tool, (3,) in the flange, point down."""
    length = float(np.linalg.norm(tool))
    along = turn @ (tool / length if length > 0 else np.array([0.0, 0.0, 1.0]))
    axis = np.cross(along, [0.0, 0.0, -1.0])
    sine = float(np.linalg.norm(axis))
    # Straight up: about any level axis.
    axis = axis / sine if sine > _PARALLEL else np.array([1.0, 0.0, 0.0])
    angle = float(np.arctan2(sine, -along[2]))
    return Pose.exp([0.0, 0.0, 0.0, *(angle * axis)]).rotation @ turn


def usual_box(estimate: Estimate, measurements: Measurements) -> WorkBox:
    """Return a box around where the board was, in the base."""
    points = estimate.Y.act(estimate.target.points)
    if estimate.mounting is Mounting.EYE_TO_HAND:
        points = np.concatenate([view.T_base_flange.act(points) for view in measurements.views])
    low, high = points.min(axis=0), points.max(axis=0)
    more = np.maximum(LEAST_SIDE_M - (high - low), 0.0) / 2
    lower, upper = (low - more).tolist(), (high + more).tolist()
    return WorkBox((lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2]))


def _visible(estimate: Estimate, touches: Touches) -> BoolArray:
    """(Q,) whether the camera sees the points within its image."""
    in_hand = estimate.mounting is Mounting.EYE_IN_HAND
    from_base = inverses(touches.seen_from) if in_hand else np.eye(4)
    points = np.einsum(
        "qij,qj->qi",
        np.broadcast_to(estimate.X.matrix @ from_base, (len(touches), 4, 4)),
        np.column_stack([touches.points_m, np.ones(len(touches))]),
    )[:, :3]
    pixels, seen = estimate.camera.project(points)
    inside = (pixels >= 0) & (pixels <= np.array(estimate.camera.size_px) - 1)
    return seen & inside.all(axis=1)
