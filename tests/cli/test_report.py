"""`handeye report`: from a folder, a session or a result, to one page."""

import json
import shlex
from pathlib import Path

import pytest

from commands import Handeye
from folders import made_recording, written
from handeye.errors import ExitCode
from handeye.report import from_dict


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return written(made_recording(7), tmp_path / "made")


def test_folder_becomes_a_page_and_numbers(handeye: Handeye, folder: Path, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    numbers = from_dict(handeye.json("report", folder, "--output", page))
    assert numbers.recording == "made"
    assert numbers.true_error is not None
    assert page.read_text().startswith("<!DOCTYPE html>")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["made", "page.html"]


def test_its_own_command_makes_it_again(handeye: Handeye, folder: Path, tmp_path: Path) -> None:
    page = tmp_path / "a page's name.html"
    first = from_dict(handeye.json("report", folder, "--model", "paper", "--output", page))
    words = shlex.split(first.recipe.command)
    assert words[0] == "handeye"
    page.unlink()
    again = from_dict(handeye.json(*words[1:]))
    assert page.exists()
    assert again.answer == first.answer
    assert again.model == "paper"
    assert again.recipe.recording_sha256 == first.recipe.recording_sha256


def test_result_becomes_a_page(handeye: Handeye, folder: Path, tmp_path: Path) -> None:
    result = tmp_path / "result.json"
    handeye.json("solve", folder, "--output", result)
    numbers = from_dict(handeye.json("report", result, "--output", tmp_path / "page.html"))
    solved = json.loads(result.read_text())
    assert numbers.answer.T_parent_camera == solved["T_flange_camera"]
    assert numbers.camera_origin == "files"


def test_a_person_is_told_how_good_it_is(handeye: Handeye, folder: Path, tmp_path: Path) -> None:
    outcome = handeye("report", folder, "--output", tmp_path / "page.html")
    assert outcome.code == ExitCode.SUCCESS
    assert "within" in outcome.out
    assert "page.html" in " ".join(outcome.out.split())


def test_what_cannot_be_is_refused(handeye: Handeye, folder: Path, tmp_path: Path) -> None:
    result = tmp_path / "result.json"
    handeye.json("solve", folder, "--output", result)
    for arguments, code in (
        ((folder, "--output", tmp_path / "page.pdf"), ExitCode.OUTPUT),
        ((folder, "--output", tmp_path / "no" / "page.html"), ExitCode.OUTPUT),
        ((result, "--model", "paper"), ExitCode.USAGE),
        ((tmp_path / "none.json",), ExitCode.UNUSABLE_INPUT),
        ((tmp_path / "none",), ExitCode.UNUSABLE_INPUT),
    ):
        rest = () if "--output" in arguments else ("--output", tmp_path / "page.html")
        assert handeye.fails("report", *arguments, *rest)["exit_code"] == code
    assert not (tmp_path / "page.html").exists()
