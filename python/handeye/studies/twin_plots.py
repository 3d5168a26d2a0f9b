"""The pictures of the twin: the errors of table II, and where the cameras of the three policies stood."""
# matplotlib is typed only in part.
# pyright: reportUnknownMemberType=false

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from handeye.robots import open_arm
from handeye.simulation.twin import ARM, TARGET
from handeye.studies.cell_picture import (
    Eye,
    draw_arm,
    draw_board,
    draw_camera,
    draw_floor,
    draw_path,
    plain_axis,
)
from handeye.studies.comparison import POLICIES
from handeye.studies.picture_style import POLICY_LOOKS
from handeye.studies.twin import Twin, trajectories
from handeye.types import Pose

_MODELS = {"paper": "paper's model", "auto": "default", "auto_with_arm": "default,\narm described"}
_PANELS = (
    ("relative_translation_mm", "relative translation (mm)"),
    ("relative_rotation_deg", "relative rotation (deg)"),
    ("rmse_px", "RMSE on validation (px)"),
    ("translation_mm", "error of T_ce against the truth (mm)"),
)
_GREY = "#6b6b6b"


def table_figure(twin: Twin) -> Figure:
    """Draw table II: means with their standard errors, by model and policy."""
    figure = Figure(figsize=(12, 3.9), layout="constrained", dpi=150)
    for i, (metric, label) in enumerate(_PANELS):
        axis = figure.add_subplot(1, len(_PANELS), i + 1)
        for j, policy in enumerate(POLICIES):
            name, colour, *_ = POLICY_LOOKS[policy]
            values = [twin.values(model, policy, metric) for model in twin.models]
            places = np.arange(len(values)) + 0.26 * (j - 1)
            means = [float(v.mean()) for v in values]
            errors = [float(v.std() / np.sqrt(len(v))) for v in values]
            axis.bar(places, means, 0.24, yerr=errors, color=colour, alpha=0.85, ecolor="#333333", label=name,
                     error_kw={"linewidth": 0.9})  # fmt: skip
            for place, mean, error in zip(places, means, errors, strict=True):
                axis.text(place, mean + error, f"{mean:.2g}", ha="center", va="bottom", fontsize=6)
        axis.set_xticks(range(len(twin.models)), [_MODELS[model] for model in twin.models], fontsize=8.5)
        axis.set_title(label, fontsize=10, loc="left")
        axis.spines[["top", "right"]].set_visible(False)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(POLICIES), frameon=False)
    figure.suptitle(
        f"Twin of the paper's cell: {len(twin.sets)} sets x {twin.trials} random starts, 3 + 5 views; "
        "mean and its standard error",
        fontsize=11,
    )
    return figure


def trajectory_figure(twin: Twin, number: int = 0) -> Figure:
    """Draw where the three policies went from the same start."""
    paths = trajectories(twin, number)
    one = twin.sets[number]
    figure = Figure(figsize=(12, 4.6), dpi=150)
    for i, policy in enumerate(POLICIES):
        axis = figure.add_axes((0.005 + i * 0.333, 0.0, 0.323, 0.84))
        _trajectory(axis, twin, number, policy, paths)
        axis.set_title(
            POLICY_LOOKS[policy].label, color=POLICY_LOOKS[policy].colour, fontsize=12, fontweight="bold"
        )
    figure.text(
        0.01,
        0.945,
        f"{one.recording.name}: from the same three views (grey) five more by each policy, in order; "
        "dots: all views to choose from",
        fontsize=11,
    )
    return figure


def _trajectory(axis: Axes, twin: Twin, number: int, policy: str, paths: dict[str, list[Pose]]) -> None:
    recording = twin.sets[number].recording
    truth = recording.truth
    if truth is None or truth.X is None or truth.Y is None:
        return
    eye, colour = Eye(azimuth_deg=-60.0, elevation_deg=20.0), POLICY_LOOKS[policy].colour
    everywhere = [recording.views[i].T_base_flange @ truth.X.inverse() for i in twin.sets[number].training]
    places = np.array([pose.translation for pose in everywhere])
    ground = np.vstack([places[:, :2], [[-0.1, 0.0]]])
    draw_floor(axis, eye, ground.min(axis=0), ground.max(axis=0))
    draw_board(axis, eye, TARGET, truth.Y)
    last = recording.views[
        [v.T_base_flange @ truth.X.inverse() for v in recording.views].index(paths[policy][-1])
    ]
    draw_arm(axis, eye, open_arm(ARM), last.joints_rad or (), alpha=0.4)
    axis.plot(*eye(places).T, ".", color="0.75", markersize=4, zorder=1.5)
    for pose in paths[policy][:3]:
        draw_camera(axis, eye, pose, recording.camera, _GREY, depth_m=0.05, strong=False)
    draw_path(axis, eye, paths[policy][2:], colour)
    for order, pose in enumerate(paths[policy][3:], start=1):
        draw_camera(axis, eye, pose, recording.camera, colour, depth_m=0.06)
        x, y = eye(pose.translation[np.newaxis])[0]
        axis.annotate(str(order), (x, y), xytext=(5, 5), textcoords="offset points", color=colour, fontsize=9,
                      fontweight="bold")  # fmt: skip
    plain_axis(axis)
