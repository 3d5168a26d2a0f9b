"""The picture of a question: the mean error to expect of each choice, for the position and the rotation."""
# matplotlib is typed only in part.
# pyright: reportUnknownMemberType=false

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from handeye.studies.picture_style import INK, light_grid, plain_ticks

PANELS = {"mean_mm": "mean error of the camera's centre (mm)", "mean_deg": "mean error of its rotation (deg)"}
COLOURS, MARKS = ("#D98200", "#0072B2"), "so"
TICKS = [digit * 10.0**power for power in range(-4, 3) for digit in (1, 2, 5)]


def draw_question(choices: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw one list of `study_questions`: choices beside each other, or one choice against its views."""
    figure = Figure(figsize=(8.4, 3.4), dpi=110)
    for axis, (key, title) in zip(figure.subplots(1, len(PANELS)), PANELS.items(), strict=True):
        if len(choices) == 1:
            _against_views(axis, choices[0]["levels"], key)
        else:
            _beside_each_other(axis, choices, key)
        axis.set_yscale("log")
        low, high = axis.get_ylim()
        plain_ticks(axis.yaxis, [tick for tick in TICKS if low <= tick <= high])
        axis.set_title(title, fontsize=9, color=INK)
        axis.tick_params(labelsize=8)
        light_grid(axis)
    figure.tight_layout()
    return figure


def _against_views(axis: Axes, levels: Sequence[Mapping[str, float]], key: str) -> None:
    views = [level["views"] for level in levels]
    axis.plot(views, [level[key] for level in levels], "-" + MARKS[1], color=COLOURS[1], markersize=5)
    axis.set_xscale("log")
    plain_ticks(axis.xaxis, views)
    axis.set_xlabel("views", fontsize=8)


def _beside_each_other(axis: Axes, choices: Sequence[Mapping[str, Any]], key: str) -> None:
    names = [choice["choice"] for choice in choices]
    for number, (colour, mark) in enumerate(zip(COLOURS, MARKS, strict=True)):
        levels = [choice["levels"][number] for choice in choices if len(choice["levels"]) > number]
        at = [i for i, choice in enumerate(choices) if len(choice["levels"]) > number]
        label = f"{levels[0]['views']} views" if levels else None
        axis.plot(at, [level[key] for level in levels], mark, color=colour, markersize=6, label=label)
    axis.set_xticks(range(len(names)), names, rotation=25, ha="right")
    axis.set_xlim(-0.5, len(names) - 0.5)
    axis.legend(fontsize=8, edgecolor="0.8")
