"""The picture of the policies: how many times the error of ours each leaves, with its interval."""
# matplotlib is typed only in part.
# pyright: reportUnknownMemberType=false

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from handeye.studies.course import OF_OURS
from handeye.studies.picture_style import INK, light_grid, plain_ticks

QUANTITIES = {"translation_mm": "position", "rotation_deg": "rotation"}
WHERE = {"eye_in_hand": "in the hand", "eye_to_hand": "beside the robot"}
TICKS = (0.8, 1, 1.5, 2, 3, 5)
OURS_COLOUR, OTHERS_COLOUR = "#0072B2", "#D98200"


def draw_policies(document: Mapping[str, Any]) -> Figure:
    """Draw what `Policies.to_dict` returns: a panel per mounting, budget and quantity."""
    panels = [
        (mounting, budget, quantity)
        for mounting, budgets in document["mountings"].items()
        for budget in budgets
        for quantity in QUANTITIES
    ]
    first = next(iter(next(iter(document["mountings"].values())).values()))
    policies = list(first)
    figure = Figure(figsize=(2.6 * max(len(panels) // 2, 1) + 2.4, 0.5 * len(policies) + 1.2), dpi=110)
    axes = figure.subplots(2, (len(panels) + 1) // 2, sharex=True, sharey=True, squeeze=False)
    for axis, (mounting, budget, quantity) in zip(axes.flat, panels, strict=False):
        rows = document["mountings"][mounting][budget]
        for place, policy in enumerate(policies):
            found = rows[policy][quantity]
            colour = OURS_COLOUR if policy in OF_OURS else OTHERS_COLOUR
            axis.plot(found["over_ours_95"], [place, place], color=colour, linewidth=2)
            axis.plot(found["over_ours"], place, "o", color=colour, markersize=4)
        axis.axvline(1.0, color=INK, linewidth=0.8)
        axis.set_xscale("log")
        plain_ticks(axis.xaxis, TICKS)
        light_grid(axis)
        axis.set_title(f"{WHERE[mounting]}, {budget} views: {QUANTITIES[quantity]}", fontsize=8, color=INK)
    for row in axes:
        row[0].set_yticks(range(len(policies)), [policy.replace("_", " ") for policy in policies], fontsize=7)
    axes[0][0].invert_yaxis()
    figure.supxlabel(
        "times the error of handeye run, geometric mean over the cells, 95 % interval", fontsize=8
    )
    figure.tight_layout()
    return figure
