"""`handeye study public`: cells and data that others made, against what others use."""

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from handeye.cli.answer import Answer
from handeye.cli.options import Common
from handeye.cli.output import check_folder
from handeye.cli.progress import progress
from handeye.cli.study_options import Data, Trials, versions, write_results
from handeye.codes import Code
from handeye.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.figure import Figure
    from rich.console import Console

    from handeye.types import Recording


class PublicPart(StrEnum):
    """What the comparison has."""

    SETS = "sets"
    KINHEC = "kinhec"
    CELL = "cell"
    FOLDER = "folder"


def public(
    *,
    parts: Annotated[tuple[PublicPart, ...], Parameter(consume_multiple=True)] = (PublicPart.SETS,),
    kinhec: Path | None = None,
    tracks: Annotated[tuple[str, ...], Parameter(consume_multiple=True)] = (
        "pnp",
        "robot_error",
        "temporal",
    ),
    most: int | None = None,
    folder: Path | None = None,
    data: Data = Data(),  # noqa: B008
    trials: Trials = Trials(),  # noqa: B008
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Compare on cells and data that others made.

    sets: the paper's table I taken apart, on the sets of Ali et al., and the same rows on their real ones.
    kinhec: tracks of poses through KinHEC's
    own benchmark, beside its solvers. cell: MoveIt Pro's cell rebuilt and rendered by MuJoCo, exact arm
    and realistic one. folder: every method on a folder of your own, by how well halves of its views agree.

    Parameters
    ----------
    parts
        Which of sets, kinhec, cell and folder.
    kinhec
        Folder that `kinhec generate` wrote, or the published set; needs the extra `public`.
    tracks
        Tracks of KinHEC.
    most
        Most sequences of each track; all by default.
    folder
        Any folder with views that `handeye solve` reads.
    """
    check_folder(trials.output)
    document: dict[str, Any] = {
        "study": "public",
        "seed": trials.seed,
        "versions": versions(),
        "parts": {part.value: _part(part, kinhec, tracks, most, folder, data, trials) for part in parts},
    }
    name = "_".join(["public", *(part.value for part in parts)])
    written = write_results(trials.output, name, document, lambda: _pictures(document["parts"]))
    return Answer(document, lambda console: _show(console, document, written))


def _part(
    part: PublicPart,
    kinhec: Path | None,
    tracks: tuple[str, ...],
    most: int | None,
    folder: Path | None,
    data: Data,
    trials: Trials,
) -> dict[str, Any]:
    if part is PublicPart.SETS:
        return _sets(data, trials)
    if part is PublicPart.CELL:
        from handeye.studies.rendered_cell import study_rendered_cell  # noqa: PLC0415

        found: dict[str, Any] = {}
        for arm in ("exact", "realistic"):
            with progress(f"Calibrating on rendered pictures, arm {arm}") as advance:
                result = study_rendered_cell(
                    arm=arm, trials=trials.count(20), seed=trials.seed, progress=advance
                )
            found[arm] = result.to_dict()["cameras"]
        return found
    if part is PublicPart.KINHEC:
        from handeye.studies.kinhec import study_kinhec  # noqa: PLC0415

        if kinhec is None:
            raise InputError(
                "no folder of KinHEC",
                code=Code.NO_DATA,
                hint="kinhec generate --tier small --out FOLDER, then --kinhec FOLDER",
            )
        with progress("Running KinHEC's benchmark") as advance:
            return study_kinhec(kinhec, tracks=tracks, most=most, progress=advance).to_dict()
    if folder is None:
        raise InputError("no folder of your own", code=Code.NO_DATA, hint="name one with --folder")
    from handeye.importing import open_folder  # noqa: PLC0415
    from handeye.studies.halves import study_halves  # noqa: PLC0415

    return study_halves(open_folder(folder).recording)


def _sets(data: Data, trials: Trials) -> dict[str, Any]:
    from handeye.studies.data import REAL_SETS, SIMULATED_SETS, data_folder  # noqa: PLC0415
    from handeye.studies.table1_parts import study_real_parts, study_table1_parts  # noqa: PLC0415

    folder = data_folder(data.data)
    recordings = data.load([*SIMULATED_SETS, *REAL_SETS], trials.processes)
    count, seed, crew = trials.count(20), trials.seed, trials.crew
    found: dict[str, Any] = {"seed": seed, "trials_per_set": count, "real": {}}
    known, real = ([one for one in recordings if _has_truth(one) is truth] for truth in (True, False))
    if known:
        with progress("Calibrating from random starts") as advance:
            result = study_table1_parts(
                folder, known, trials=count, seed=seed, workers=crew, progress=advance
            )
        found |= result.to_dict()
    if real:
        with progress("Calibrating with views held out") as advance:
            parts = study_real_parts(folder, real, trials=count, seed=seed, workers=crew, progress=advance)
        found["real"] = parts
    return found


def _has_truth(recording: "Recording") -> bool:
    return recording.truth is not None and recording.truth.X is not None


def _pictures(parts: Mapping[str, Mapping[str, Any]]) -> "Iterator[tuple[str, Figure]]":
    from handeye.studies.public_picture import draw_errors, groups_of  # noqa: PLC0415 - only where asked for

    for part, found in parts.items():
        yield f"public_{part}", draw_errors(groups_of(part, found))


def _show(console: "Console", document: dict[str, Any], written: list[Path]) -> None:
    from handeye.cli import study_tables as tables  # noqa: PLC0415 - JSON need not wait for it
    from handeye.cli.wording import heading  # noqa: PLC0415

    for part, found in document["parts"].items():
        if part == PublicPart.SETS:
            _show_sets(console, found)
        elif part == PublicPart.CELL:
            for arm, cameras in found.items():
                heading(console, f"MoveIt Pro's cell, rendered, arm {arm}", "median of the starts, 8 views")
                _table(console, "camera", cameras, ("stated_mm", "region_holds"))
        elif part == PublicPart.KINHEC:
            for track, one in found["tracks"].items():
                held = one["region_holds"]
                stated = "" if held is None else f", stated region holds {held:.1%}"
                evidence = f"{one['sequences']} sequences{stated}"
                heading(console, f"KinHEC {found['version']}, {track}", evidence)
                _table(console, "solver", one["solvers"], ("answered",))
                if one["clock_error_ms"] is not None:
                    ours, theirs = one["clock_error_ms"], one["their_clock_error_ms"]
                    console.print(f"clock: median error {ours:.2f} ms, KinHEC's own estimate {theirs:.2f} ms")
        else:
            evidence = f"{found['views']} views, difference of disjoint halves"
            heading(console, found["name"], evidence)
            _table(console, "method", found["methods"])
    tables.show_written(console, written)


def _show_sets(console: "Console", found: Mapping[str, Any]) -> None:
    from handeye.cli.wording import heading  # noqa: PLC0415 - JSON need not wait for it

    if "rows" in found:
        heading(console, "Table I taken apart", "next best view, mean error after 3 + 5 views")
        _table(console, "row", {row: one["next_best_view"] for row, one in found["rows"].items()})
        corners, camera = found["factor_of_corners"], found["factor_of_camera"]
        console.print(f"factor of our corners {corners:.1f}, of a camera that may move {camera:.1f}")
    for name, rows in found["real"].items():
        heading(console, name, "next best view, mean error on the views held out after 3 + 5")
        _table(console, "row", {row: one["next_best_view"] for row, one in rows.items()})
        heading(console, name, "mean difference of the answers from disjoint halves")
        _table(console, "row", {row: one["halves"] for row, one in rows.items()})


def _table(
    console: "Console", first: str, rows: Mapping[str, Mapping[str, Any]], more: tuple[str, ...] = ()
) -> None:
    """Print a row per name: translation, rotation, and what else is asked for."""
    from handeye.cli import study_tables as tables  # noqa: PLC0415
    from handeye.cli.wording import figures  # noqa: PLC0415

    keys = ("translation_mm", "rotation_deg", *more)
    table = tables.plain_table(first)
    for column in ("mm", "deg", *(key.replace("_", " ") for key in more)):
        table.add_column(column, justify="right")
    for name, found in rows.items():
        cells = [found[key] for key in keys]
        texts = ["-" if c is None else str(c) if isinstance(c, int) else figures(c) for c in cells]
        table.add_row(name.replace("_", " "), *texts)
    console.print(table)
