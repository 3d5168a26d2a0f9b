"""The log of checks: one line of JSON for each, and the night from which on something had moved."""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from handeye.codes import Code
from handeye.datasets.reading import read_text
from handeye.errors import InputError, OutputError

MAX_BYTES = 16 * 1024 * 1024
# Sum of log-likelihood ratios that names a night (Page 1954): a thousand to one.
NAMED = math.log(1000.0)


class LoggedCheck(msgspec.Struct, frozen=True):
    """One check, as it stands in the log.

    Parameters
    ----------
    time
        When it was made, ISO 8601.
    p_value, moved
        As the check said.
    score
        Logarithm of the likelihood ratio of the likeliest shift over none, less the penalty for what it may
        choose: below zero on average while nothing has moved, above it afterwards.
    sentence
        In words.
    """

    time: str
    p_value: float
    moved: str
    score: float
    sentence: str


@dataclass(frozen=True)
class Change:
    """From which check on something had moved, if anything: its number from 0 on, and the sum of scores."""

    first: int | None
    score: float


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


def change_of(scores: list[float]) -> Change:
    """Return from which check on something had moved (Page, Biometrika 41, 1954).

    The start of the sum of scores up to the last check that is largest; None where it is not large enough, or
    the last checks speak against it.
    """
    best, total, first = -math.inf, 0.0, None
    for number in range(len(scores) - 1, -1, -1):
        total += scores[number]
        if total > best:
            best, first = total, number
    return Change(first if best > NAMED else None, max(best, 0.0))
