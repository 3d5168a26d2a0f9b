"""The picture of the demonstration: what choosing views is worth, and whether the answer can be trusted."""
# matplotlib is typed only in part.
# pyright: reportUnknownMemberType=false

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from handeye.studies.demonstration import Curve, Demonstration, Way
from handeye.studies.picture_style import INK, POLICY_LOOKS, QUIET, Look, light_grid, plain_ticks
from handeye.types.arrays import FloatArray
from handeye.types.calibration import ModelName

_GREY = "#6b6b6b"
_LOOKS = {
    **{Way(policy): look for policy, look in POLICY_LOOKS.items()},
    Way("next_best_view", ModelName.PAPER): Look("next best, paper's model", _GREY, "D", "--"),
}
# Policies whose single starts are drawn too: all of them would hide each other.
_SINGLY = (Way("next_best_view"), Way("random"))
_TICKS = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50]
_FEW_TICKS = [0.001, 0.01, 0.1, 1, 10, 100]
# Of a line of text, in heights of the axis.
_LABEL_HEIGHT = 0.05


def demonstration_figure(shown: Demonstration) -> Figure:
    """Draw the error of the camera's position against the number of views, and against what was predicted."""
    layout = ConstrainedLayoutEngine(w_pad=0.12, h_pad=0.08)
    figure = Figure(figsize=(11, 4.7), dpi=160, layout=layout)
    left, right = figure.subplots(1, 2, width_ratios=[1.3, 1])
    _errors(left, shown)
    _honesty(right, shown)
    return figure


def _errors(axis: Axes, shown: Demonstration) -> None:
    views = np.array(shown.views)
    ends: list[tuple[float, Look]] = []
    for way, look in _LOOKS.items():
        values = shown.curves[way].translation_mm
        mean = values.mean(axis=0)
        if way in _SINGLY:
            axis.plot(views, values.T, color=look.colour, linewidth=0.8, alpha=0.22)
        axis.plot(
            views, mean, look.line, color=look.colour, marker=look.mark, markersize=6, linewidth=2.2, zorder=3
        )
        ends.append((float(mean[-1]), look))
    axis.set_yscale("log")
    plain_ticks(axis.yaxis, _TICKS)
    low, high = axis.get_ylim()
    gap = _LABEL_HEIGHT * float(np.log(high / low))
    for (value, look), height in zip(ends, _spread([value for value, _ in ends], gap), strict=True):
        axis.annotate(
            f"{value:.2g}  {look.label}",
            (views[-1], value),
            xytext=(views[-1] + 0.22, height),
            color=look.colour,
            va="center",
            fontsize=10,
            annotation_clip=False,
        )
    axis.set_xlim(views[0] - 0.15, views[-1] + 0.12)
    axis.set_xticks(views)
    axis.set_xlabel(f"views taken, {shown.protocol.start_views} of them at random", loc="left")
    _title(
        axis,
        "What choosing views is worth",
        f"error of the camera's position in mm, mean of {shown.protocol.trials} starts (thin: single ones)",
    )


def _honesty(axis: Axes, shown: Demonstration) -> None:
    chosen = Way("next_best_view")
    exact = Way("next_best_view", ModelName.PAPER)
    everything = np.concatenate([_both(shown.curves[way]) for way in (chosen, exact)])
    low, high = 0.6 * everything.min(), 1.7 * everything.max()
    line = np.array([low, high])
    axis.fill_between(line, 0 * line + low, 3 * line, color="0.5", alpha=0.12, linewidth=0)
    axis.plot(line, line, color="0.45", linewidth=1)
    for way in (exact, chosen):
        look, curve = _LOOKS[way], shown.curves[way]
        axis.plot(
            curve.sigma_translation_mm.ravel(), curve.translation_mm.ravel(), look.mark,
            color=look.colour, markersize=4.5, alpha=0.55, markeredgewidth=0,
        )  # fmt: skip
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xlim(low, high)
    axis.set_ylim(low, high)
    plain_ticks(axis.xaxis, _FEW_TICKS)
    plain_ticks(axis.yaxis, _FEW_TICKS)
    axis.set_xlabel("error predicted (one standard deviation, mm)", loc="left")
    _title(axis, "Whether it can be trusted", "error made in mm; grey: within 3 times that predicted")
    axis.text(0.97, 0.05, "noise from the data (default)", color=_LOOKS[chosen].colour, ha="right",
              transform=axis.transAxes, fontsize=10)  # fmt: skip
    axis.text(0.03, 0.95, "robot and camera\ntaken as exact", color=_GREY, ha="left", va="top",
              transform=axis.transAxes, fontsize=10)  # fmt: skip


def _both(curve: Curve) -> FloatArray:
    return np.concatenate([curve.translation_mm.ravel(), curve.sigma_translation_mm.ravel()])


def _title(axis: Axes, title: str, subtitle: str) -> None:
    axis.set_title(title, loc="left", fontsize=13, fontweight="bold", color=INK, pad=24)
    axis.text(0, 1.025, subtitle, transform=axis.transAxes, fontsize=9.5, color=QUIET)
    light_grid(axis)


def _spread(values: list[float], gap: float) -> list[float]:
    """Return heights for labels on a logarithmic axis, moved apart where they would be closer than `gap`."""
    order = np.argsort(values)
    heights = np.log(np.array(values)[order])
    for _ in range(100):
        close = np.flatnonzero(np.diff(heights) < gap - 1e-9)
        if len(close) == 0:
            break
        for i in close:
            push = (gap - (heights[i + 1] - heights[i])) / 2
            heights[i] -= push
            heights[i + 1] += push
    spread = np.empty(len(values))
    spread[order] = np.exp(heights)
    return [float(height) for height in spread]
