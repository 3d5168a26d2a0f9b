"""The picture of the gains: predicted against what candidates bring in expectation, and in a single draw."""
# matplotlib is typed only in part.
# pyright: reportUnknownMemberType=false

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from handeye.studies.picture_style import INK, light_grid

PANELS = {"expected": "mean over all draws", "single": "a single draw"}
MARKS = "os^Dv<>P"


def draw_gains(document: Mapping[str, Any]) -> Figure:
    """Draw what `Gains.to_dict` returns: a point per candidate, a mark per start."""
    figure = Figure(figsize=(8.0, 3.8), dpi=110)
    axes = figure.subplots(1, len(PANELS), sharex=True)
    correlation = document["correlation"]["entropy_handeye"]["log_error"]
    for axis, (name, title) in zip(axes, PANELS.items(), strict=True):
        for number, start in enumerate(document["points"]):
            axis.plot(start["gain"], start[name], MARKS[number % len(MARKS)], markersize=3, alpha=0.8)
        light_grid(axis)
        middle = correlation[f"{name}_median"]
        axis.set_title(f"{title}: correlation {middle:.2f} (median over the starts)", fontsize=8, color=INK)
        axis.set_ylabel("reduction of the logarithm of the error", fontsize=8)
    figure.supxlabel("predicted gain, entropy of the hand-eye (nat)", fontsize=8)
    figure.tight_layout()
    return figure
