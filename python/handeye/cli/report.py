"""`handeye report`: one page about a calibration, and its numbers."""

import shlex
from dataclasses import fields
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from handeye.cli.answer import Answer
from handeye.cli.failures import UsageError
from handeye.cli.options import Common
from handeye.cli.output import check_output
from handeye.cli.source import Source
from handeye.cli.work import WorkOptions, work_words
from handeye.codes import Code
from handeye.datasets.writing import replace_file
from handeye.errors import OutputError
from handeye.importing import is_rig
from handeye.session.rig_prepared import arm_of_rig
from handeye.types.calibration import ModelName

if TYPE_CHECKING:
    from rich.console import Console

    from handeye.report import Gathered, Report


def report(
    result: Path,
    /,
    *,
    output: Path = Path("report.html"),
    model: ModelName | None = None,
    reduced: bool = False,
    pictures: bool = False,
    source: Source = Source(),  # noqa: B008 - frozen
    work: WorkOptions = WorkOptions(),  # noqa: B008 - frozen
    common: Common = Common(),  # noqa: ARG001, B008 - obeyed by the boundary
) -> Answer:
    """Write one page about a calibration: how good it is, how it came about, what limits it.

    The page is one HTML file that loads nothing from anywhere and prints well on paper. With --json its
    numbers are printed; their schema is published with the documentation.

    Parameters
    ----------
    result
        Folder with the views, which is solved (a session too); or the JSON that solve wrote, which has
        neither the robot's poses nor the points, so that some pictures are missing.
    output
        The page, .html.
    model
        For a folder: auto (the data say how noisy robot and camera are) or paper (both are exact).
    reduced
        For a folder: answer even where the views leave directions open.
    pictures
        For a folder: show the camera's pictures, too, with what was found drawn over them.
    """
    check_output(output)
    if output.suffix.lower() not in {".html", ".htm"}:
        raise OutputError(f"{output}: expected .html", code=Code.UNKNOWN_FORMAT)
    from handeye.report import html_page, to_dict  # noqa: PLC0415 - other commands need no pictures

    if source.only is None and result.is_dir() and is_rig(result):
        if pictures:
            raise UsageError("pictures are shown of one camera", hint="give --only with --pictures")
        if work != WorkOptions():
            raise UsageError("the touch error is that of one camera", hint="give --only with the box of work")
        return _of_rig(result, output, model, source, reduced=reduced)
    gathered = _gathered(result, output, model, source, work, reduced=reduced, is_drawn=pictures)
    page = html_page(gathered).encode()
    replace_file(output, page)
    return Answer(
        to_dict(gathered.numbers), lambda console: _show(console, gathered.numbers, output, len(page))
    )


def _of_rig(folder: Path, output: Path, model: ModelName | None, source: Source, *, reduced: bool) -> Answer:
    from handeye.report import RigReport  # noqa: PLC0415

    if model is ModelName.PAPER:
        raise UsageError("the paper's model has one camera", hint="leave --model out, or give --only")
    words = ["handeye", "report", str(folder), *_source_words(source), *(["--reduced"] if reduced else [])]
    made = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    command = shlex.join([*words, "--output", str(output)])
    about = RigReport.of(
        source.open_rig(folder), command=command, made=made, reduced=reduced, kinematics=arm_of_rig(folder)
    )
    page = about.html().encode()
    replace_file(output, page)

    def show(console: "Console") -> None:
        from handeye.cli.wording import heading, notices  # noqa: PLC0415

        recording = about.opened.recording
        heading(console, recording.name, f"{len(recording.cameras)} cameras, {len(recording)} stations")
        notices(console, "Warnings", about.warnings)
        console.print(f"written: {output} ({len(page) / 1000:.0f} kB)", markup=False, soft_wrap=True)

    return Answer(about.to_dict(), show)


def _gathered(
    result: Path,
    output: Path,
    model: ModelName | None,
    source: Source,
    work: WorkOptions,
    *,
    reduced: bool,
    is_drawn: bool,
) -> "Gathered":
    from handeye.report import gather_recording, gather_result  # noqa: PLC0415

    made = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    words = ["handeye", "report", str(result)]
    if result.suffix.lower() == ".json" and not result.is_dir():
        if (source, work) != (Source(), WorkOptions()) or model is not None or reduced or is_drawn:
            raise UsageError(
                "a result is solved already", hint="leave out the options for folders, or give the folder"
            )
        return gather_result(result, command=shlex.join([*words, "--output", str(output)]), made=made)
    words += [*_source_words(source), *work_words(work.work())]
    if model is not None:
        words += ["--model", model.value]
    if reduced:
        words.append("--reduced")
    if is_drawn:
        words.append("--pictures")
    command = shlex.join([*words, "--output", str(output)])
    return gather_recording(
        source.open(result),
        model or ModelName.AUTO,
        command=command,
        reduced=reduced,
        made=made,
        is_drawn=is_drawn,
        work=work.work(),
    )


def _source_words(source: Source) -> list[str]:
    """Return the options of a source as they were given."""
    given = ((field.name.replace("_", "-"), getattr(source, field.name)) for field in fields(source))
    return [word for name, value in given if value is not None for word in (f"--{name}", str(value))]


def _show(console: "Console", numbers: "Report", output: Path, size: int) -> None:
    from handeye.cli.wording import figures, heading, notices, pairs  # noqa: PLC0415 - as in all commands

    known = numbers.answer.within_95
    used = sum(view.used for view in numbers.views)
    heading(console, numbers.recording, f"{used} of {len(numbers.views)} views used, model {numbers.model}")
    pairs(
        console,
        [
            (
                "95 %",
                f"within {figures(known.translation_mm, 2)} mm and {figures(known.rotation_deg, 2)} deg",
            ),
        ],
    )
    notices(console, "Diagnosis", (said.sentence for said in numbers.diagnosis), "cyan")
    notices(console, "Warnings", numbers.warnings)
    console.print(f"written: {output} ({size / 1000:.0f} kB)", markup=False, soft_wrap=True)
