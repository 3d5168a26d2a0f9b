"""`handeye validate` from the folder to the findings."""

from pathlib import Path

import pytest

from commands import Handeye
from folders import made_recording, written


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(made_recording(10), tmp_path_factory.mktemp("made") / "made")


def test_both_models_are_measured(handeye: Handeye, folder: Path) -> None:
    data = handeye.json("validate", folder, "--splits", "3", "--model", "paper")
    assert (data["model"], list(data["models"])) == ("paper", ["paper", "auto"])
    for model in data["models"].values():
        assert model["split_half"]["random"]["translation_mm"]["trials"] <= 3
        assert model["truth"]["translation_mm"] < 5
    assert data["findings"][0]["code"] == "split_half"


def test_same_seed_same_bytes(handeye: Handeye, folder: Path) -> None:
    arguments = ("validate", folder, "--splits", "2", "--json", "--seed")
    assert handeye(*arguments, "5").out == handeye(*arguments, "5").out
    assert handeye(*arguments, "5").out != handeye(*arguments, "6").out


def test_text(handeye: Handeye, folder: Path) -> None:
    outcome = handeye("validate", folder, "--splits", "2")
    assert outcome.code == 0
    for words in ("model auto", "model paper", "random halves differ", "NEES/6", "What this says"):
        assert words in outcome.out


@pytest.mark.parametrize("options", [("--splits", "0"), ("--seed", "-1")])
def test_usage(handeye: Handeye, folder: Path, options: tuple[str, ...]) -> None:
    assert handeye.fails("validate", folder, *options)["exit_code"] == 2


def test_too_few_views(handeye: Handeye, tmp_path: Path) -> None:
    error = handeye.fails("validate", written(made_recording(5), tmp_path / "few"))
    assert (error["exit_code"], error["code"]) == (3, "too_few_views")
