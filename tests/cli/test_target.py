"""`handeye target`: a page, the file beside it, and nothing that destroys another."""

import json
from pathlib import Path
from typing import Any

import pytest

from handeye.cli.boundary import run
from handeye.datasets import read_target
from handeye.errors import ExitCode
from handeye.types import AprilGrid, ArucoGrid, ArucoMarker, Charuco, Chessboard, CircleGrid, Target


def answered(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    capsys.readouterr()
    assert run(["target", *arguments, "--json"]) == ExitCode.SUCCESS
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("family", Target.members)
@pytest.mark.parametrize("suffix", [".pdf", ".svg"])
def test_page_and_target_file(
    family: str, suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / f"board{suffix}"
    data = answered(capsys, family, "--output", str(page))
    assert page.read_bytes().startswith(b"%PDF" if suffix == ".pdf" else b"<?xml")
    target = read_target(data["config"])
    assert target.family == family
    assert target.to_dict() == data["target"]
    assert data["paper"] == "A4"
    assert {entry.name for entry in tmp_path.iterdir()} == {f"board{suffix}", "board.toml"}


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ("chessboard --rows 6 --columns 9 --pitch-mm 25", Chessboard(6, 9, 0.025)),
        (
            "circle-grid --rows 4 --columns 5 --pitch-mm 30 --diameter-mm 12 --marked 3 --marked-diameter-mm 20",
            CircleGrid(4, 5, 0.03, 0.012, False, 3, 0.02),
        ),
        ("circle_grid --asymmetric --pitch-mm 10", CircleGrid(11, 4, 0.01, 0.005, True)),
        (
            "charuco --rows 5 --columns 6 --square-mm 30 --marker-mm 20 --dictionary DICT_4X4_50",
            Charuco(5, 6, 0.03, 0.02, "DICT_4X4_50"),
        ),
        (
            "aprilgrid --rows 3 --columns 4 --tag-mm 40 --spacing-ratio 0.25 --border-bits 1",
            AprilGrid(3, 4, 0.04, 0.25, border_bits=1),
        ),
        (
            "aruco-grid --rows 4 --columns 3 --marker-mm 40 --separation-mm 4 --first-id 12 --inverted",
            ArucoGrid(4, 3, 0.04, 0.004, "DICT_5X5_250", first_id=12, inverted=True),
        ),
        (
            "aruco_grid --rows 1 --columns 3 --marker-mm 40 --separation-mm 4 --ids 3,9,1",
            ArucoGrid(1, 3, 0.04, 0.004, "DICT_5X5_250", ids=(3, 9, 1)),
        ),
        ("aruco-marker --marker-mm 100 --id 582", ArucoMarker(0.1, "DICT_ARUCO_ORIGINAL", 582)),
        (
            "charuco --rows 6 --columns 5 --square-mm 30 --marker-mm 20 --legacy-pattern",
            Charuco(6, 5, 0.03, 0.02, "DICT_5X5_100", True),
        ),
    ],
)
def test_measures_are_those_asked_for(
    arguments: str, expected: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = answered(capsys, *arguments.split(), "--output", str(tmp_path / "b.svg"))
    assert read_target(data["config"]) == expected


def test_file_of_a_target_is_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first = answered(capsys, "charuco", "--output", str(tmp_path / "a.svg"))
    again = answered(capsys, str(tmp_path / "a.toml"), "--output", str(tmp_path / "b.svg"))
    assert again["target"] == first["target"]
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    assert (
        run(["target", str(tmp_path / "a.toml"), "--rows", "3", "--output", str(tmp_path / "c.svg")])
        == ExitCode.USAGE
    )


def test_measures_of_a_print_are_not_lost(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page, config = tmp_path / "a.svg", tmp_path / "a.toml"
    answered(capsys, "chessboard", "--pitch-mm", "20", "--output", str(page))
    measured = config.read_text().replace("pitch_m = 0.02", "pitch_m = 0.0199")
    config.write_text(measured)
    before = page.read_bytes()
    assert run(["target", "chessboard", "--pitch-mm", "21", "--output", str(page)]) == ExitCode.OUTPUT
    assert "describes another target" in capsys.readouterr().err
    assert (config.read_text(), page.read_bytes()) == (measured, before)
    answered(
        capsys, "chessboard", "--pitch-mm", "21", "--output", str(page), "--config", str(tmp_path / "b.toml")
    )
    # The same target again changes nothing but the page.
    config.write_text("# mine\n" + measured)
    answered(capsys, "chessboard", "--pitch-mm", "19.9", "--output", str(page))
    assert config.read_text() == "# mine\n" + measured


def test_a_board_that_looks_the_same_twice_is_a_warning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    same = answered(
        capsys, "chessboard", "--rows", "5", "--columns", "7", "--output", str(tmp_path / "a.svg")
    )
    assert "2 positions" in same["warnings"][0]
    assert not answered(capsys, "chessboard", "--output", str(tmp_path / "b.svg"))["warnings"]


def test_a_person_is_told_what_to_do(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["target", "chessboard", "--output", str(tmp_path / "a.pdf")]) == ExitCode.SUCCESS
    printed = " ".join(capsys.readouterr().out.split())
    assert "landscape" in printed
    assert "measure both rulers" in printed
    assert str(tmp_path / "a.toml") in printed


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ("chessboard", ExitCode.USAGE),  # nowhere to write
        ("chessboard --output b.png", ExitCode.OUTPUT),
        ("chessboard --output no/b.pdf", ExitCode.OUTPUT),
        ("chessboard --output b.pdf --paper a99", ExitCode.UNUSABLE_INPUT),
        ("chessboard --output b.pdf --rows 0", ExitCode.UNUSABLE_INPUT),
        ("chessboard --output b.pdf --rows 0 --pitch-mm -1", ExitCode.UNUSABLE_INPUT),
        ("chessboard --output b.pdf --pitch-mm nan", ExitCode.USAGE),
        ("chessboard --output b.pdf --tag-mm 3", ExitCode.USAGE),
        ("chessboard --output b.pdf --border-bits 1", ExitCode.USAGE),
        ("aruco_grid --output b.pdf --ids 1,x", ExitCode.USAGE),
        ("aruco_grid --output b.pdf --ids 1,2,3", ExitCode.UNUSABLE_INPUT),
        ("charuco --output b.pdf --dictionary DICT_5X5_50 --first-id 30", ExitCode.UNUSABLE_INPUT),
        ("aprilgrid --output b.pdf --dictionary DICT_4X4_50", ExitCode.UNUSABLE_INPUT),
        ("chessboard --output b.pdf --pitch-mm 500", ExitCode.UNUSABLE_INPUT),
        ("checkers --output b.pdf", ExitCode.UNUSABLE_INPUT),
        ("missing.toml --output b.pdf", ExitCode.UNUSABLE_INPUT),
    ],
)
def test_what_cannot_be_is_refused(
    arguments: str, code: ExitCode, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["target", *arguments.split()]) == code
    assert not list(tmp_path.iterdir())
