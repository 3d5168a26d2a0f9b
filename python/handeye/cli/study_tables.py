"""The words of `handeye study`: its documents as tables for a person."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from handeye.cli.wording import figures, heading, pairs


def show_written(console: Console, files: Sequence[Path]) -> None:
    """Print which files were written."""
    for file in files:
        console.print(f"written: {file}")


def show_title(console: Console, text: str, document: Mapping[str, Any]) -> None:
    """Print what a table is about."""
    trials = document.get("trials_per_set")
    starts = "" if trials is None else f", {trials} random starts per set"
    heading(console, text, f"model {document['model']}{starts}, seed {document['seed']}")


def show_policies(
    console: Console, parts: Mapping[str, Mapping[str, Any]], metrics: Sequence[tuple[str, str]]
) -> None:
    """Print mean and median of each metric: a block per set, a row per policy."""
    table = plain_table("")
    for _, unit in metrics:
        table.add_column(f"mean ({unit})", justify="right")
        table.add_column("median", justify="right")
    for name, part in parts.items():
        table.add_row(Text(name, style="bold"))
        for policy, found in part["policies"].items():
            cells = [figures(found[metric][what]) for metric, _ in metrics for what in ("mean", "median")]
            table.add_row(_indented(policy), *cells)
        table.add_section()
    console.print(table)


def plain_table(first: str) -> Table:
    """Return a table without lines but under its head, and its first column."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column(first, no_wrap=True)
    return table


def _indented(name: str) -> str:
    return "  " + name.replace("_", " ")


def show_halves(console: Console, parts: Mapping[str, Mapping[str, Any]]) -> None:
    """Print by how much disjoint halves disagree."""
    console.print("disagreement of disjoint halves of all views")
    lines: list[tuple[str, str]] = []
    for name, part in parts.items():
        mm, deg = part["split_half_translation_mm"]["mean"], part["split_half_rotation_deg"]["mean"]
        lines.append((name, f"random {figures(mm)} mm, {figures(deg)} deg (mean)"))
        blocks = part["contiguous_halves"]
        mm, deg = blocks["split_half_translation_mm"], blocks["split_half_rotation_deg"]
        lines.append(("", f"first against second {figures(mm)} mm, {figures(deg)} deg"))
    pairs(console, lines, indent=2)


def show_curves(console: Console, name: str, part: Mapping[str, Any]) -> None:
    """Print the means after each added view."""
    heading(console, name)
    table = plain_table("")
    policies = part["policies"]
    first = next(iter(policies.values()))
    for i in range(len(first["entropy_nats"])):
        table.add_column(f"+{i}", justify="right")
    for metric in first:
        quantity, _, unit = metric.rpartition("_")
        title = f"{quantity.replace('_', ' ')} ({unit})" if quantity else metric
        table.add_row(Text(title, style="bold"))
        for policy, found in policies.items():
            table.add_row(_indented(policy), *(figures(value) for value in found[metric]))
        table.add_section()
    console.print(table)


def show_kinds(console: Console, kinds: Mapping[str, Mapping[str, Any]]) -> None:
    """Print coverage and NEES of each kind of error."""
    table = plain_table("kind of error")
    for title in ("in 95 % region", "NEES / 6", "error (mm)", "claimed", "trials"):
        table.add_column(title, justify="right")
    for kind, found in kinds.items():
        table.add_row(
            kind.replace("_", " "),
            f"{100 * found['coverage_95']:.1f} ± {100 * found['coverage_95_standard_error']:.1f} %",
            f"{found['nees_per_dof']:.2f} ± {found['nees_per_dof_standard_error']:.2f}",
            f"{found['translation_mm']:.3f}",
            f"{found['sigma_translation_mm']:.3f}",
            str(found["trials"]),
        )
    console.print(table)


def show_mistakes(console: Console, document: Mapping[str, Any]) -> None:
    """Print how many of each mistake were named and repaired, and the wrong answers."""
    table = plain_table("mistake")
    for title in ("named", "answered", "wrong answers", "repaired", "trials"):
        table.add_column(title, justify="right")
    for kind, found in [*document["kinds"].items(), ("all", document["planted"])]:
        repaired = found["repaired"]
        table.add_row(
            kind.replace("_", " "),
            f"{100 * found['named']:.1f} %",
            f"{100 * found['answered']:.1f} %",
            str(found["wrong_answers"]),
            "-" if repaired is None else f"{100 * repaired:.1f} %",
            str(found["trials"]),
        )
    console.print(table)
    clean = document["clean"]
    console.print(
        f"false alarms: {100 * clean['false_alarms']:.1f} % of {clean['trials']} recordings without a mistake"
    )
