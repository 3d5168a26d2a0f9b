"""A picture of the log of checks: how likely each is where nothing has moved, and since when it has."""

from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

# Below this there is no difference to see.
_LEAST_P = 1e-12


def check_figure(checks: Sequence[tuple[str, float]], first: int | None) -> Figure:
    """Draw times and p-values of checks, and the first after which something had moved."""
    figure = Figure(figsize=(7, 3), layout="constrained")
    axis: Any = figure.subplots()
    axis.semilogy(
        range(1, len(checks) + 1), [max(p, _LEAST_P) for _, p in checks], "o", markersize=3, color="0.2"
    )
    axis.axhline(0.05, color="0.6", linewidth=0.8)
    if first is not None:
        axis.axvline(first + 1, color="C3", linewidth=1)
        axis.set_title(f"moved since {checks[first][0]}", fontsize=9)
    axis.set_xlabel("check")
    axis.set_ylabel("p")
    return figure
