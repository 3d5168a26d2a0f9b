"""What the pictures of studies and demonstrations have in common: looks of the policies, axes, ticks."""
# matplotlib is typed only in part.
# pyright: reportUnknownMemberType=false

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter, NullLocator


class Look(NamedTuple):
    """How a curve is drawn, and what it is called."""

    label: str
    colour: str
    mark: str
    line: str = "-"


# Colours that colour-blind readers tell apart (after Okabe and Ito), marks for print without colour.
POLICY_LOOKS = {
    "next_best_view": Look("next best view", "#0072B2", "o"),
    "random": Look("random", "#D98200", "s"),
    "max_distance": Look("max distance", "#009E73", "^"),
}
INK, QUIET = "#222222", "#555555"


def light_grid(axis: Axes) -> None:
    """Draw a light grid and as little of a frame as will do."""
    axis.grid(visible=True, which="major", color="0.88", linewidth=0.8)
    axis.set_axisbelow(True)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axis.spines[side].set_color("0.6")
    axis.tick_params(colors="#444444", length=0)


def plain_ticks(scale: Axis, ticks: Sequence[float]) -> None:
    """Write these values, as people write them, and no others."""
    scale.set_major_locator(FixedLocator(ticks))
    scale.set_major_formatter(FuncFormatter(_plain))
    scale.set_minor_locator(NullLocator())
    scale.set_minor_formatter(NullFormatter())


def _plain(value: float, _: int | None = None) -> str:
    return f"{value:g}"
