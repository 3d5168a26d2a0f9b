"""The log of checks: what is written is read back, and which of them can be compared."""

from pathlib import Path

import pytest

from handeye.datasets.check_log import LoggedCheck, alike, append_check, read_check_log
from handeye.errors import InputError, OutputError


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    log = tmp_path / "nights.jsonl"
    assert read_check_log(log) == []
    one = LoggedCheck("2026-01-02T03:04:05+00:00", 0.4, "nothing", "nothing \u2028 has moved")
    other = LoggedCheck(
        "2026-01-03T03:04:05+00:00", 1e-9, "camera", "the camera", (0.5,) * 6, ((0.25,) * 12,)
    )
    append_check(log, one)
    append_check(log, other)
    assert read_check_log(log) == [one, other]


@pytest.mark.parametrize(
    "line",
    [
        "{",
        "[]",
        "nothing",
        '{"time": "x"}',
        '{"time":"a","p_value":1,"moved":"b","sentence":"c","misfit":[1],"flanges":[[1]]}',
        '{"time": 1, "p_value": 0.1}',
        "\ud800",
    ],
)
def test_a_line_that_is_no_check_is_named(tmp_path: Path, line: str) -> None:
    log = tmp_path / "nights.jsonl"
    append_check(log, LoggedCheck("a", 0.4, "nothing", "b"))
    with log.open("a", errors="surrogatepass") as file:
        file.write(line + "\n")
    with pytest.raises(InputError):
        read_check_log(log)


def test_a_place_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError):
        append_check(tmp_path / "no" / "log", LoggedCheck("a", 0.4, "nothing", "b"))


def at(time: str, x_m: float = 0.0, misfit: int = 6) -> LoggedCheck:
    """A check of one view, of a flange at a place."""
    return LoggedCheck(time, 0.4, "nothing", "in place", (0.0,) * misfit, ((1.0, 0, 0, x_m) + (0.0,) * 8,))


def test_checks_made_elsewhere_are_not_compared() -> None:
    assert alike([]) == []
    nights = [at("a"), at("b", 0.1), at("c", 0.004), at("d", misfit=12), at("e")]
    assert alike(nights) == [0, 2, 4]
    assert alike([*nights, LoggedCheck("f", 0.4, "nothing", "of before")]) == [5]
