"""Inputs and surroundings that once ended in a traceback: a word and an exit code instead."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from commands import Handeye
from folders import made_recording, written
from handeye.cli.answer import json_text
from handeye.datasets.toml_text import toml_values
from handeye.errors import InputError
from handeye.robots.mjcf import parse_mjcf

RUN = (sys.executable, "-c", "from handeye.cli import main; main()")


def test_names_that_look_like_markup_are_shown_as_they_are(handeye: Handeye, tmp_path: Path) -> None:
    folder = written(made_recording(9), tmp_path / "views")
    names = ("[/b]", "[bold]", "[red]x[/red]", "[[", "]")
    lines = ["name,x_m,y_m,z_m,qx,qy,qz,qw", *(f"{name},0.3,0.1,0.5,0,1,0,0" for name in names)]
    (tmp_path / "poses.csv").write_text("\n".join(lines) + "\n")
    outcome = handeye("plan", folder, "--candidates", tmp_path / "poses.csv")
    assert outcome.code in {0, 3}
    assert "MarkupError" not in outcome.err


@pytest.mark.parametrize("text", ["a = 0x" + "f" * 9000, "a = [{b = [0b" + "1" * 70 + "]}]"])
def test_whole_numbers_that_python_cannot_print_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="bits"):
        toml_values(text)


def test_keys_of_many_parts_are_refused_and_rows_of_numbers_are_not() -> None:
    for key in (
        "a." * 300 + "b = 1",
        "a . " * 300 + "b = 1",
        '"a".' * 300 + "b = 1",
        "[" + "a." * 300 + "b]",
    ):
        with pytest.raises(ValueError, match="dots"):
            toml_values(key)
    row = ", ".join(["0.5"] * 200)
    assert len(toml_values(f"a = [[{row}], [{row}]]")["a"][1]) == 200


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("run", "--dry-run", "--floor-mm", "nan"), 2),
        (("run", "--dry-run", "--floor-mm", "inf"), 2),
        (("run", "--dry-run", "--seed", "-1"), 2),
        (("run", "--dry-run", "--margin-px", "nan"), 2),
        (("run", "--dry-run", "--speed-deg-s", "nan"), 2),
        (("run", "--dry-run", "--move-timeout-s", "-1"), 3),
        (("run", "--dry-run", "--move-timeout-s", "nan"), 2),
        (("validate", ".", "--seed", "-1"), 2),
    ],
)
def test_numbers_out_of_range_are_said(handeye: Handeye, arguments: tuple[str, ...], code: int) -> None:
    outcome = handeye(*arguments)
    assert outcome.code == code, outcome.err
    assert "free space" not in outcome.err


def test_half_of_a_surrogate_pair_is_written_as_an_escape() -> None:
    assert json_text({"name": "a\udcffb"}) == '{\n  "name": "a\\udcffb"\n}\n'


@pytest.mark.skipif(os.name != "posix", reason="names of bytes")
def test_names_that_are_no_utf8_and_outputs_that_are_closed(tmp_path: Path) -> None:
    folder = os.fsencode(tmp_path) + b"/bad\xff"
    Path(os.fsdecode(folder)).mkdir()
    for options in ((), ("--json",)):
        done = subprocess.run([*RUN, "solve", folder, *options], capture_output=True, check=False)
        assert done.returncode == 3, done.stderr
        assert b"Traceback" not in done.stderr
    for closed in (">&-", ">&- 2>&-", "2>&-"):
        command = (
            f'"{sys.executable}" -c "from handeye.cli import main; main()" run --dry-run --json {closed}'
        )
        shell = subprocess.run(["/bin/sh", "-c", command], capture_output=True, check=False)
        assert shell.returncode == (0 if closed == "2>&-" else 7), shell.stderr
        assert b"Traceback" not in shell.stderr


def test_a_panic_of_the_core_is_said_like_any_mistake(
    handeye: Handeye, monkeypatch: pytest.MonkeyPatch
) -> None:
    class PanicException(BaseException):
        pass

    def panic(*_: object, **__: object) -> None:
        raise PanicException("index out of bounds")

    monkeypatch.setattr("handeye.cli.run.prepare", panic)
    outcome = handeye("run", "--dry-run")
    assert outcome.code == 1
    assert "index out of bounds" in outcome.err


def test_a_body_of_very_many_joints_is_refused() -> None:
    joints = '<joint axis="0 0 1"/>' * 90_000
    text = f'<mujoco><worldbody><body name="a">{joints}</body></worldbody></mujoco>'
    with pytest.raises(InputError, match="one after the other"):
        parse_mjcf(text.encode())
