"""The pictures of the studies, drawn without a display."""
# matplotlib is typed only in part.
# pyright: reportUnknownMemberType=false, reportUnknownLambdaType=false, reportUnknownArgumentType=false

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter

from handeye.studies.comparison import POLICIES, SetResult
from handeye.studies.coverage import Coverage
from handeye.studies.curves import Curves, correlations, scatters
from handeye.studies.picture_style import POLICY_LOOKS

_PANELS = (
    ("entropy_nats", "entropy (nats)", False),
    ("rmse_px", "held-out RMSE (px)", True),
    ("relative_translation_mm", "relative translation error (mm)", True),
    ("relative_rotation_deg", "relative rotation error (deg)", True),
)
_TRUTH_PANELS = (
    ("translation_mm", "translation error against truth (mm)", True),
    ("rotation_deg", "rotation error against truth (deg)", True),
)


def curves_figure(curves: Curves, result: SetResult) -> Figure:
    """Draw the curves of one set: mean over the trials of each policy, and the band of its quartiles."""
    has_truth = not np.isnan(result.final(POLICIES[0], "translation_mm")).all()
    panels = _PANELS + (_TRUTH_PANELS if has_truth else ())
    rows = -(-len(panels) // 2)
    figure = Figure(figsize=(9, 3.1 * rows + 0.7), layout="constrained", dpi=150)
    axes = [figure.add_subplot(rows, 2, i + 1) for i in range(len(panels))]
    for axis, (metric, label, logarithmic) in zip(axes, panels, strict=True):
        for policy in POLICIES:
            _curve(axis, curves, result, policy, metric)
        axis.set_ylabel(label)
        axis.xaxis.set_major_locator(MaxNLocator(integer=True))
        if logarithmic:
            _logarithmic(axis)
        axis.grid(visible=True, which="both", alpha=0.25, linewidth=0.6)
    for axis in axes[-2:]:
        axis.set_xlabel(f"views added to {curves.protocol.start_views}")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(POLICIES), frameon=False)
    figure.suptitle(
        f"{result.name}, model {curves.model}: mean and quartiles of {len(result.trials)} random starts",
        fontsize="medium",
    )
    return figure


def _curve(axis: Axes, curves: Curves, result: SetResult, policy: str, metric: str) -> None:
    name, colour, mark, _ = POLICY_LOOKS[policy]
    mean = curves.mean(result, policy, metric)
    low, high = curves.band(result, policy, metric)
    added = np.arange(len(mean))
    axis.fill_between(added, low, high, color=colour, alpha=0.15, linewidth=0)
    axis.plot(added, mean, color=colour, marker=mark, markersize=4.5, linewidth=1.6, label=name)


def _logarithmic(axis: Axes) -> None:
    low, high = axis.get_ylim()
    # Over less than a factor of four a logarithmic axis has hardly a number to show and nothing to gain.
    if low > 0 and high / low < 4:
        return
    axis.set_yscale("log")
    axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))
    if high / low < 50:
        axis.yaxis.set_minor_formatter(FuncFormatter(lambda value, _: _minor_label(value)))
        axis.tick_params(axis="y", which="minor", labelsize="small")
    else:
        axis.yaxis.set_minor_formatter(NullFormatter())


def _minor_label(value: float) -> str:
    """Label 2, 3 and 5 of each decade only."""
    digit = round(value / 10 ** np.floor(np.log10(value) + 1e-9))
    return f"{value:.3g}" if digit in {2, 3, 5} else ""


def scatter_figure(curves: Curves) -> Figure:
    """Draw predicted gain against reduction of the held-out RMSE: a panel per set, all first candidates."""
    count = len(curves.sets)
    columns = min(count, 3)
    rows = -(-count // columns)
    figure = Figure(figsize=(3.6 * columns, 3.2 * rows + 0.5), layout="constrained", dpi=150)
    for i, result in enumerate(curves.sets):
        axis = figure.add_subplot(rows, columns, i + 1)
        _scatter(axis, result)
        if i % columns == 0:
            axis.set_ylabel("reduction of held-out RMSE (px)")
        if i >= count - columns:
            axis.set_xlabel("predicted gain (nats)")
    figure.suptitle(
        f"every candidate of the first step, model {curves.model.value}; "
        f"Pearson's r within a start, median {curves.median_correlation:.2f}",
        fontsize="medium",
    )
    return figure


def _scatter(axis: Axes, result: SetResult) -> None:
    found = scatters(result)
    gains = np.array([g for s in found for g in s.predicted_gain_nats])
    reductions = np.array([r for s in found for r in s.rmse_reduction_px])
    colour = POLICY_LOOKS["next_best_view"].colour
    axis.scatter(gains, reductions, s=7, color=colour, alpha=0.35, linewidths=0, rasterized=True)
    axis.axhline(0, color="0.4", linewidth=0.8)
    _without_far_values(axis, reductions)
    axis.grid(visible=True, alpha=0.25, linewidth=0.6)
    inside = correlations(result)
    typical = f"{np.median(inside):.2f}" if inside else "none"
    axis.set_title(f"{result.name}: r {typical}", fontsize="medium")


def _without_far_values(axis: Axes, values: Sequence[float] | np.ndarray) -> None:
    """Show the inner 98 percent of the values, and say how many lie outside."""
    low, high = np.percentile(values, [1, 99])
    margin = 0.08 * max(high - low, 1e-12)
    outside = int(np.sum((values < low - margin) | (values > high + margin)))
    axis.set_ylim(low - margin, high + margin)
    if outside:
        axis.text(
            0.98,
            0.03,
            f"{outside} outside",
            transform=axis.transAxes,
            ha="right",
            fontsize="small",
            alpha=0.7,
        )


def errors_figure(sets: Sequence[SetResult], panels: Sequence[tuple[str, str]], title: str) -> Figure:
    """Draw what each policy reached after its last view, a box of quartiles per set and policy.

    Parameters
    ----------
    panels
        Metric and label of each panel.
    """
    figure = Figure(
        figsize=(max(6.0, 2.4 * len(sets) + 2), 3.0 * len(panels) + 0.6), layout="constrained", dpi=150
    )
    for i, (metric, label) in enumerate(panels):
        axis = figure.add_subplot(len(panels), 1, i + 1)
        for j, policy in enumerate(POLICIES):
            _boxes(axis, sets, policy, metric, (j - 1) * 0.26)
        axis.set_xticks(range(len(sets)), [result.name for result in sets])
        axis.set_ylabel(label)
        axis.set_ylim(bottom=0)
        axis.grid(visible=True, axis="y", alpha=0.25, linewidth=0.6)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(POLICIES), frameon=False)
    figure.suptitle(title, fontsize="medium")
    return figure


def _boxes(axis: Axes, sets: Sequence[SetResult], policy: str, metric: str, shift: float) -> None:
    name, colour, *_ = POLICY_LOOKS[policy]
    values = [result.final(policy, metric) for result in sets]
    places = [i + shift for i in range(len(sets))]
    boxes = axis.boxplot(
        values,
        positions=places,
        widths=0.2,
        patch_artist=True,
        showmeans=True,
        manage_ticks=False,
        medianprops={"color": "black", "linewidth": 1.2},
        meanprops={"marker": "D", "markersize": 3.5, "markerfacecolor": "white", "markeredgecolor": "black"},
        flierprops={
            "marker": ".",
            "markersize": 3,
            "alpha": 0.5,
            "markeredgewidth": 0,
            "markerfacecolor": colour,
        },
    )
    for box in boxes["boxes"]:
        box.set(facecolor=colour, alpha=0.55, linewidth=0.8)
    boxes["boxes"][0].set_label(name)


def coverage_figure(coverage: Coverage) -> Figure:
    """Draw coverage and NEES of each kind of error, with two standard errors and where they should lie."""
    kinds = list(coverage.kinds)
    table = coverage.to_dict()["kinds"]
    figure = Figure(figsize=(9, 0.42 * len(kinds) + 1.5), layout="constrained", dpi=150)
    panels = (
        ("coverage_95", "share of 95 % regions that hold the truth", 0.95, (0.93, 0.97)),
        ("nees_per_dof", "NEES / 6", 1.0, (0.9, 1.1)),
    )
    places = np.arange(len(kinds))[::-1]
    for i, (key, label, ideal, window) in enumerate(panels):
        axis = figure.add_subplot(1, 2, i + 1)
        axis.axvspan(*window, color="0.9", linewidth=0)
        axis.axvline(ideal, color="0.4", linewidth=0.8)
        values = [table[kind.name][key] for kind in kinds]
        errors = [2 * table[kind.name][f"{key}_standard_error"] for kind in kinds]
        axis.errorbar(
            values,
            places,
            xerr=errors,
            fmt="o",
            markersize=4.5,
            color=POLICY_LOOKS["next_best_view"].colour,
            capsize=2,
        )
        axis.set_yticks(places, [kind.name.replace("_", " ") for kind in kinds] if i == 0 else [])
        axis.set_ylim(-0.6, len(kinds) - 0.4)
        axis.set_xlabel(label)
        axis.grid(visible=True, axis="x", alpha=0.25, linewidth=0.6)
    trials = max(len(runs) for runs in coverage.kinds.values())
    figure.suptitle(
        f"model {coverage.model}, {trials} simulated calibrations per kind of error", fontsize="medium"
    )
    return figure
