"""Running the command line inside the tests, as a script would."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from handeye.cli.boundary import run


@dataclass(frozen=True)
class Outcome:
    """What a command left behind."""

    code: int
    out: str
    err: str

    @property
    def data(self) -> dict[str, Any]:
        """The one JSON object on stdout; NaN and infinity are refused."""
        return json.loads(self.out, parse_constant=_refuse)

    @property
    def error(self) -> dict[str, Any]:
        """The error object of a failed command."""
        assert list(self.data) == ["error", "warnings"]
        return self.data["error"]


def _refuse(word: str) -> None:
    raise AssertionError(f"{word} is no JSON")


class Handeye:
    """The command line, called with its arguments."""

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self._capsys = capsys

    def __call__(self, *arguments: str | Path) -> Outcome:
        self._capsys.readouterr()
        code = run([str(argument) for argument in arguments])
        captured = self._capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    def json(self, *arguments: str | Path) -> dict[str, Any]:
        """Return the answer of a command that succeeds."""
        outcome = self(*arguments, "--json")
        assert outcome.code == 0, outcome.err
        return outcome.data

    def fails(self, *arguments: str | Path) -> dict[str, Any]:
        """Return the error of a command that fails, the same in words on stderr."""
        outcome = self(*arguments, "--json")
        error = outcome.error
        assert outcome.code == error["exit_code"] != 0
        assert f"error: {error['message']}" in outcome.err
        return error
