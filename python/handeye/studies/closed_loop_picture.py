"""The picture of the closed loop: the cell, what was reached, and what the camera saw on the way."""
# matplotlib is typed only in part.
# pyright: reportUnknownMemberType=false

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from handeye.datasets.images import read_image
from handeye.robots import open_arm
from handeye.session.deciding import START_VIEWS
from handeye.session.simulated import LENSES, ORDINARY, SIZE_PX, SimulationOptions
from handeye.studies.cell_picture import (
    Eye,
    draw_arm,
    draw_board,
    draw_camera,
    draw_floor,
    draw_path,
    plain_axis,
)
from handeye.studies.closed_loop import ClosedLoop, camera_poses
from handeye.studies.comparison import POLICIES
from handeye.studies.picture_style import INK, POLICY_LOOKS, QUIET, light_grid, plain_ticks
from handeye.types import Camera, View

_TICKS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10]


def closed_loop_figure(shown: ClosedLoop) -> Figure:
    """Draw the cell with the views of the run that is kept, the errors of all runs, and its pictures."""
    views = [entry.view for entry in shown.shown.entries if entry.view is not None]
    pictures = [view for view in views if view.image is not None]
    # The strip of pictures below takes its share of the height.
    height, strip = (7.4, 0.24) if pictures else (5.6, 0.0)
    figure = Figure(figsize=(13.4, height), dpi=150)
    above = 1 - strip
    lower, upper = strip + 0.11 * above, 0.75 * above
    _cell(figure.add_axes((0.012, strip + 0.02 * above, 0.37, 0.84 * above)), shown)
    _errors(figure.add_axes((0.425, lower, 0.285, upper)), shown)
    _promises(figure.add_axes((0.765, lower, 0.225, upper)), shown)
    width = 0.976 / max(len(pictures), 1)
    for i, view in enumerate(pictures):
        _picture(figure.add_axes((0.012 + i * width, 0.015, 0.95 * width, strip - 0.04)), shown, view, i + 1)
    return figure


def _cell(axis: Axes, shown: ClosedLoop) -> None:
    eye, arm = Eye(), open_arm(shown.options.robot)
    kept = shown.shown
    camera = Camera(*LENSES[ORDINARY], *SIZE_PX)
    target = SimulationOptions().target
    poses = {policy: camera_poses(drives[0]) for policy, drives in shown.drives.items()}
    ground = np.array([pose.translation[:2] for some in poses.values() for pose in some] + [[-0.1, 0.0]])
    draw_floor(axis, eye, ground.min(axis=0), ground.max(axis=0))
    draw_board(axis, eye, target, kept.Y)
    joints = [entry.goal_joints for entry in kept.entries if entry.view is not None]
    draw_arm(axis, eye, arm, joints[0], alpha=0.25)
    draw_arm(axis, eye, arm, joints[-1])
    for policy in reversed(POLICIES):
        strong = policy == POLICIES[0]
        colour = POLICY_LOOKS[policy].colour
        draw_path(axis, eye, poses[policy][START_VIEWS - 1 :], colour, "-" if strong else ":")
        for pose in poses[policy][START_VIEWS:]:
            draw_camera(axis, eye, pose, camera, colour, strong=strong)
    for pose in poses[POLICIES[0]][:START_VIEWS]:
        draw_camera(axis, eye, pose, camera, QUIET, strong=False)
    plain_axis(axis)
    axis.set_anchor("W")
    added = shown.options.added_views
    _title(
        axis,
        "The loop chooses and drives",
        f"cameras at three small turns (grey), and {added} more by each policy",
    )


def _errors(axis: Axes, shown: ClosedLoop) -> None:
    views = np.array(shown.options.views)
    for policy in POLICIES:
        look = POLICY_LOOKS[policy]
        values = shown.values(policy, "translation_mm")
        axis.plot(views, values.T, color=look.colour, linewidth=0.7, alpha=0.22)
        mean = values.mean(axis=0)
        axis.plot(
            views, mean, color=look.colour, marker=look.mark, markersize=6, linewidth=2.2, zorder=3,
            label=f"{look.label}: {mean[-1]:.2g} mm",
        )  # fmt: skip
    axis.set_yscale("log")
    plain_ticks(axis.yaxis, _TICKS)
    axis.set_xticks(views)
    axis.set_xlabel(f"views taken, the first {START_VIEWS} the same for all", loc="left")
    axis.legend(frameon=False, loc="upper right", fontsize=9.5)
    cells = shown.options.cells
    _title(
        axis,
        "What choosing views is worth",
        f"error against the hidden truth in mm, mean of {cells} cells",
    )
    light_grid(axis)


def _promises(axis: Axes, shown: ClosedLoop) -> None:
    every = np.concatenate(
        [
            shown.values(policy, name).ravel()
            for policy in POLICIES
            for name in ("translation_mm", "within_mm")
        ]
    )
    low, high = 0.6 * float(every.min()), 1.7 * float(every.max())
    line = np.array([low, high])
    axis.fill_between(line, 0 * line + low, line, color="0.5", alpha=0.12, linewidth=0)
    axis.plot(line, line, color="0.45", linewidth=1)
    for policy in reversed(POLICIES):
        _, colour, mark, _ = POLICY_LOOKS[policy]
        x, y = shown.values(policy, "within_mm"), shown.values(policy, "translation_mm")
        axis.plot(
            x[:, :-1].ravel(),
            y[:, :-1].ravel(),
            mark,
            color=colour,
            markersize=4,
            alpha=0.35,
            markeredgewidth=0,
        )
        axis.plot(x[:, -1], y[:, -1], mark, color=colour, markersize=7, markeredgecolor="white")
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xlim(low, high)
    axis.set_ylim(low, high)
    plain_ticks(axis.xaxis, _TICKS)
    plain_ticks(axis.yaxis, _TICKS)
    axis.set_xlabel("promised: within so many mm with 95 %", loc="left")
    _title(axis, "Whether it can be trusted", "error made in mm; grey: promise kept")
    light_grid(axis)


def _picture(axis: Axes, shown: ClosedLoop, view: View, number: int) -> None:
    chosen = number > START_VIEWS
    colour = POLICY_LOOKS[POLICIES[0]].colour if chosen else QUIET
    image = read_image(shown.folder / str(view.image))
    height, width = image.shape[:2]
    axis.imshow(
        image[::2, ::2], cmap="gray", vmin=0, vmax=255, extent=(-0.5, width - 0.5, height - 0.5, -0.5)
    )
    axis.plot(*view.pixels.T, ".", color="#E6007E", markersize=1.8)
    axis.set_xticks([])
    axis.set_yticks([])
    for side in axis.spines.values():
        side.set_color(colour)
        side.set_linewidth(2.0 if chosen else 1.0)
    axis.set_title(
        f"{number}  {'chosen' if chosen else 'start'}", fontsize=9, color=colour, loc="left", pad=3
    )


def _title(axis: Axes, title: str, subtitle: str) -> None:
    axis.set_title(title, loc="left", fontsize=13, fontweight="bold", color=INK, pad=22)
    axis.text(0, 1.02, subtitle, transform=axis.transAxes, fontsize=8.8, color=QUIET)
