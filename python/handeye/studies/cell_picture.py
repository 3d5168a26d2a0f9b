"""A cell as seen from a corner: the arm, its cameras, the board. Orthographic, drawn with matplotlib."""
# matplotlib is typed only in part.
# pyright: reportUnknownMemberType=false

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon
from numpy.typing import ArrayLike

from handeye.robots import Arm
from handeye.types import Camera, Pose, Target
from handeye.types.arrays import FloatArray

_LINK, _JOINT, _FLOOR = "#7d8a95", "#4d5a65", "#dfe3e6"


@dataclass(frozen=True)
class Eye:
    """Where the onlooker stands: turned about the vertical and above the horizon, in degrees."""

    azimuth_deg: float = -52.0
    elevation_deg: float = 24.0

    def __call__(self, points: ArrayLike) -> FloatArray:
        """(N, 2) places in the picture of points (N, 3), in metres."""
        a, e = np.deg2rad([self.azimuth_deg, self.elevation_deg])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        towards = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
        return np.asarray(points, dtype=np.float64) @ np.column_stack([right, np.cross(towards, right)])


def draw_floor(axis: Axes, eye: Eye, low: FloatArray, high: FloatArray, step_m: float = 0.1) -> None:
    """Draw a grid on the floor between two corners (2,)."""
    first, last = np.floor(low / step_m).astype(int), np.ceil(high / step_m).astype(int)
    xs, ys = ([step_m * k for k in range(int(first[i]), int(last[i]) + 1)] for i in (0, 1))
    for x in xs:
        _line(axis, eye([[x, ys[0], 0], [x, ys[-1], 0]]), color=_FLOOR, linewidth=0.8, zorder=0)
    for y in ys:
        _line(axis, eye([[xs[0], y, 0], [xs[-1], y, 0]]), color=_FLOOR, linewidth=0.8, zorder=0)


def draw_arm(axis: Axes, eye: Eye, arm: Arm, joints: Sequence[float], *, alpha: float = 1.0) -> None:
    """Draw an arm as thick lines between its joints."""
    frames = arm.frames(np.array(joints))
    places = eye(frames[:, :3, 3])
    width = 11.0 if alpha == 1 else 7.0
    _line(axis, places, color=_LINK, linewidth=width, alpha=alpha, solid_capstyle="round",
          solid_joinstyle="round", zorder=2)  # fmt: skip
    if alpha == 1:
        axis.plot(*places[1:-1].T, "o", color=_JOINT, markersize=6, zorder=2.1)


def draw_board(axis: Axes, eye: Eye, target: Target, T_base_target: Pose) -> None:
    """Draw the board with its points."""
    low, high = target.points[:, :2].min(axis=0), target.points[:, :2].max(axis=0)
    rim = 0.12 * float((high - low).max())
    x0, y0, x1, y1 = *(low - rim), *(high + rim)
    corners = np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]])
    axis.add_patch(Polygon(eye(T_base_target.act(corners)), facecolor="white", edgecolor="#333333", zorder=1))
    axis.plot(*eye(T_base_target.act(target.points)).T, "s", color="#333333", markersize=1.4, zorder=1.1)


def draw_camera(
    axis: Axes,
    eye: Eye,
    pose: Pose,
    camera: Camera,
    colour: str,
    *,
    depth_m: float = 0.075,
    strong: bool = True,
) -> None:
    """Draw what a camera sees as a small pyramid."""
    width, height = camera.size_px
    rays, _ = camera.unproject(np.array([[0, 0], [width, 0], [width, height], [0, height]], dtype=np.float64))
    corners = eye(pose.act(np.vstack([np.zeros(3), depth_m * rays / rays[:, 2:]])))
    alpha = 0.95 if strong else 0.6
    axis.add_patch(
        Polygon(corners[1:], facecolor=colour, alpha=0.25 if strong else 0.12, linewidth=0, zorder=3)
    )
    for corner in corners[1:]:
        _line(axis, np.array([corners[0], corner]), color=colour, linewidth=1.0, alpha=alpha, zorder=3)
    _line(axis, corners[[1, 2, 3, 4, 1]], color=colour, linewidth=1.0, alpha=alpha, zorder=3)


def draw_path(axis: Axes, eye: Eye, poses: Sequence[Pose], colour: str, style: str = "-") -> None:
    """Draw the order in which cameras were taken."""
    places = eye(np.array([pose.translation for pose in poses]))
    _line(axis, places, color=colour, linewidth=1.1, linestyle=style, alpha=0.75, zorder=2.8)


def plain_axis(axis: Axes) -> None:
    """Leave nothing of the axis but what is drawn on it, at one scale."""
    axis.set_aspect("equal")
    axis.axis("off")


def _line(axis: Axes, places: FloatArray, **style: object) -> None:
    axis.plot(places[:, 0], places[:, 1], **style)  # pyright: ignore[reportArgumentType]
