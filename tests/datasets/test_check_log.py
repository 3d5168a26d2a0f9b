"""The log of checks: what is written is read back, and it names the night."""

from pathlib import Path

import numpy as np
import pytest

from handeye.datasets.check_log import LoggedCheck, append_check, change_of, read_check_log
from handeye.errors import InputError, OutputError


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    log = tmp_path / "nights.jsonl"
    assert read_check_log(log) == []
    one = LoggedCheck("2026-01-02T03:04:05+00:00", 0.4, "nothing", -3.5, "nothing \u2028 has moved")
    other = LoggedCheck("2026-01-03T03:04:05+00:00", 1e-9, "camera", 12.0, "the camera")
    append_check(log, one)
    append_check(log, other)
    assert read_check_log(log) == [one, other]


@pytest.mark.parametrize(
    "line", ["{", "[]", "nothing", '{"time": "x"}', '{"time": 1, "p_value": 0.1}', "\ud800"]
)
def test_a_line_that_is_no_check_is_named(tmp_path: Path, line: str) -> None:
    log = tmp_path / "nights.jsonl"
    append_check(log, LoggedCheck("a", 0.4, "nothing", -3.5, "b"))
    with log.open("a", errors="surrogatepass") as file:
        file.write(line + "\n")
    with pytest.raises(InputError):
        read_check_log(log)


def test_a_place_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError):
        append_check(tmp_path / "no" / "log", LoggedCheck("a", 0.4, "nothing", -3.5, "b"))


def test_it_names_the_night() -> None:
    """Scores of a likelihood ratio with a penalty: chi-square of six numbers over two, less 7.5."""
    random = np.random.default_rng(0)
    right, early = 0, 0
    for _ in range(200):
        night = int(random.integers(10, 95))
        quiet = 0.5 * random.chisquare(6, night) - 7.5
        moved = 0.5 * random.noncentral_chisquare(6, 27, 100 - night) - 7.5
        found = change_of([*quiet.tolist(), *moved.tolist()]).first
        right += found is not None and abs(found - night) <= 1
        early += change_of(quiet.tolist()).first is not None
    assert right >= 190
    assert early <= 2
