"""The log of checks: one line of JSON for each."""

import json
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np

from handeye.codes import Code
from handeye.datasets.reading import read_text
from handeye.errors import InputError, OutputError

MAX_BYTES = 16 * 1024 * 1024
# An arm that was sent to the same pose again is no farther from it.
SAME_M, SAME_RAD = 0.005, 0.02
Row = Annotated[tuple[float, ...], msgspec.Meta(min_length=12, max_length=12)]


class LoggedCheck(msgspec.Struct, frozen=True):
    """One check, as it stands in the log.

    Parameters
    ----------
    time
        When it was made, ISO 8601.
    p_value, moved
        As the check said.
    sentence
        In words.
    misfit
        What the views miss by: `handeye.estimation.shift.Check`.
    flanges
        Upper three rows of the reported pose of each view, row by row, metres.
    """

    time: str
    p_value: float
    moved: str
    sentence: str
    misfit: tuple[float, ...] = ()
    flanges: tuple[Row, ...] = ()


def read_check_log(path: Path) -> list[LoggedCheck]:
    """Return the checks of a log, none if there is no file yet.

    Raises
    ------
    InputError
        A line that is no check; the message names it.
    """
    if not path.exists():
        return []
    checks: list[LoggedCheck] = []
    for number, line in enumerate(read_text(path, MAX_BYTES).split("\n"), start=1):
        if not line.strip():
            continue
        try:
            check = msgspec.json.decode(line, type=LoggedCheck)
        except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
            raise InputError(
                f"{path}: line {number}: {error}",
                code=Code.INVALID_FIELD,
                hint="name another file for the log",
            ) from error
        checks.append(check)
    return checks


def append_check(path: Path, check: LoggedCheck) -> None:
    """Add a check to a log.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    line: dict[str, Any] = msgspec.to_builtins(check)
    try:
        with path.open("a", encoding="utf-8") as log:
            log.write(json.dumps(line, ensure_ascii=False, allow_nan=False) + "\n")
    except (OSError, ValueError) as error:
        raise OutputError(f"{path}: {error}") from error


def alike(checks: list[LoggedCheck]) -> list[int]:
    """Return the numbers, from 0 on, of the checks that were made where the last one was.

    From other places the same error of a calibration looks another way: such checks cannot be compared.

    Parameters
    ----------
    checks
        In their time order.

    Returns
    -------
    list of int
        The last always among them.

    Examples
    --------
    >>> alike(read_check_log(Path("nights.jsonl")))
    [0, 1, 2]
    """
    if not checks:
        return []
    last = np.array(checks[-1].flanges)

    def same(check: LoggedCheck) -> bool:
        if len(check.flanges) != len(last) or len(check.misfit) != len(checks[-1].misfit):
            return False
        off = np.abs(np.array(check.flanges) - last).reshape(-1, 3, 4)
        return bool((off[:, :, 3] < SAME_M).all() and (off[:, :, :3] < SAME_RAD).all())

    return [number for number, check in enumerate(checks) if same(check)]
