"""The report that every run leaves in the folder of its session."""

import shlex
from datetime import UTC, datetime
from pathlib import Path

from handeye.cli.work import work_words
from handeye.datasets.writing import replace_file
from handeye.estimation.work import Work
from handeye.types.calibration import ModelName

REPORT_FILE = "report.html"


def report_of_session(folder: Path, model: ModelName, work: Work | None = None) -> tuple[Path | None, str]:
    """Write the report of a session into its folder; return its path, or None and what went wrong.

    A calibration that is there is worth more than the page about it: whatever goes wrong here is only said.
    """
    output = folder / REPORT_FILE
    try:
        from handeye.importing import open_folder  # noqa: PLC0415 - other commands need no pictures
        from handeye.report import gather_recording, html_page  # noqa: PLC0415

        words = ["handeye", "report", str(folder), "--output", str(output)]
        if model is not ModelName.AUTO:
            words += ["--model", model.value]
        if work is not None:
            words += work_words(work)
        made = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
        gathered = gather_recording(
            open_folder(folder), model, command=shlex.join(words), made=made, work=work
        )
        replace_file(output, html_page(gathered).encode())
    except Exception as error:  # noqa: BLE001
        return None, f"the report could not be written: {error}"
    return output, ""
