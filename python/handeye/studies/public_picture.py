"""Pictures of the public comparison: a panel per group of rows and quantity, ours told apart by colour."""
# matplotlib is typed only in part.
# pyright: reportUnknownMemberType=false

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from handeye.studies.picture_style import INK, light_grid, plain_ticks
from handeye.studies.table1_parts import PRINTED

QUANTITIES = {"translation_mm": "mm", "rotation_deg": "deg"}
OURS = ("default", "handeye", "exact arm", "realistic arm")
OURS_COLOUR, OTHERS_COLOUR = "#0072B2", "#D98200"

# Ticks in every decade, where the scale spans less than one of them and where it spans more.
FEW_DECADES, NEAR, FAR = 1.0, (1, 1.5, 2, 3, 4, 5, 7), (1, 3)
ALIKE_DECADES, ALIKE = 0.4, tuple(1 + k / 20 for k in range(180))
MOST_TICKS = 6

Rows = Mapping[str, Mapping[str, Any]]


def groups_of(part: str, found: Mapping[str, Any]) -> dict[str, Rows]:
    """Return the rows that a part of the study compares, by what they have in common."""
    if part == "sets":
        table = found.get("rows", {})
        by_policy: dict[str, Rows] = {
            f"Table I, {policy.replace('_', ' ')}": {row: one[policy] for row, one in table.items()}
            for policy in (PRINTED if table else ())
        }
        real: dict[str, Rows] = {
            f"{name}, views held out": {row: one["next_best_view"] for row, one in rows.items()}
            for name, rows in found["real"].items()
        }
        return {**by_policy, **real}
    if part == "kinhec":
        return {f"KinHEC {track}": one["solvers"] for track, one in found["tracks"].items()}
    if part == "cell":
        first = next(iter(found.values()))
        return {
            f"{camera} camera": {f"{arm} arm": cameras[camera] for arm, cameras in found.items()}
            for camera in first
        }
    return {found["name"]: found["methods"]}


def draw_errors(groups: Mapping[str, Rows]) -> Figure:
    """Draw the errors of all rows, one line of panels per quantity, scales logarithmic."""
    longest = max(len(rows) for rows in groups.values())
    size = (2.6 * len(groups) + 1.6, 2 * (0.2 * longest + 0.9))
    figure = Figure(figsize=size, dpi=110)
    axes = figure.subplots(len(QUANTITIES), len(groups), squeeze=False)
    for line, (quantity, unit) in enumerate(QUANTITIES.items()):
        for column, (title, rows) in enumerate(groups.items()):
            axis = axes[line][column]
            names = list(rows)
            for place, name in enumerate(names):
                value = rows[name][quantity]
                if value is not None:
                    colour = OURS_COLOUR if name in OURS else OTHERS_COLOUR
                    axis.plot(value, place, "o", color=colour, markersize=4)
            axis.set_xscale("log")
            low, high = axis.get_xlim()
            decades = np.log10(high / low)
            steps = ALIKE if decades < ALIKE_DECADES else NEAR if decades < FEW_DECADES else FAR
            ticks = [step * 10.0**decade for decade in range(-7, 5) for step in steps]
            ticks = [tick for tick in ticks if low <= tick <= high]
            plain_ticks(axis.xaxis, ticks[:: 1 + len(ticks) // MOST_TICKS])
            labels = [name.replace("_", " ") for name in names] if column == 0 else [""] * len(names)
            axis.set_yticks(range(len(names)), labels, fontsize=7)
            axis.invert_yaxis()
            light_grid(axis)
            axis.tick_params(axis="x", labelsize=7)
            axis.set_title(title, fontsize=8, color=INK)
            axis.set_xlabel(unit, fontsize=8)
    figure.tight_layout()
    return figure
