"""`handeye study` end to end: keys, seeds, pictures, and what it refuses."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import handeye
from handeye.cli.boundary import run
from handeye.datasets import write_recording
from handeye.simulation.cells import CellOptions, ErrorKind, simulate

POLICIES = ["next_best_view", "random", "max_distance"]


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one set of 12 simulated views, with truth."""
    folder = tmp_path_factory.mktemp("data")
    write_recording(simulate(ErrorKind.WHITE_FLANGE, 0, CellOptions(views=(12, 12))), folder / "cell")
    return folder


def study(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> tuple[int, dict[str, Any]]:
    """Run a study with --json; exit code and document."""
    code = run(["study", *map(str, arguments), "--json", "--workers", "1"])
    return code, json.loads(capsys.readouterr().out)


def written(path: Path) -> dict[str, Any]:
    """Return what a study has written, which also says by what it was made."""
    document = json.loads(path.read_text())
    assert document.pop("versions")["handeye"] == handeye.__version__
    return document


def test_table1_has_the_promised_keys(data: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    arguments = (
        "table1",
        "--data",
        data,
        "--sets",
        "cell",
        "--trials",
        "3",
        "--model",
        "paper",
        "--no-cache",
    )
    code, document = study(capsys, *arguments, "--output", tmp_path / "new")
    assert code == 0
    for part in (document, document["sets"]["cell"]):
        assert list(part["policies"]) == POLICIES
        for policy in POLICIES:
            for metric in ("translation_mm", "rotation_deg"):
                assert part["policies"][policy][metric].keys() >= {"mean", "median", "trials"}
                assert part["policies"][policy][metric]["mean"] > 0
            assert part["policies"][policy]["trials"] == 3
    assert written(tmp_path / "new" / "table1.json") == document
    assert (tmp_path / "new" / "table1.png").read_bytes().startswith(b"\x89PNG")
    assert study(capsys, *arguments)[1] == document
    assert study(capsys, *arguments, "--seed", "1")[1]["policies"] != document["policies"]


def test_holdout_has_the_promised_keys(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, document = study(
        capsys, "holdout", "--data", data, "--sets", "cell", "--trials", "2", "--model", "paper", "--no-cache"
    )
    assert code == 0
    for policy in POLICIES:
        found = document["sets"]["cell"]["policies"][policy]
        for metric in (
            "relative_translation_mm",
            "relative_rotation_deg",
            "rmse_px",
            "split_half_translation_mm",
            "split_half_rotation_deg",
        ):
            assert found[metric]["mean"] > 0
            assert found[metric]["median"] > 0
    assert document["sets"]["cell"]["contiguous_halves"]["split_half_translation_mm"] > 0


def test_curves_have_the_promised_keys(
    data: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    arguments = ("--data", data, "--sets", "cell", "--trials", "2", "--model", "paper", "--no-cache")
    code, document = study(capsys, "curves", *arguments, "--output", tmp_path)
    assert code == 0
    assert document["added_views"] == [0, 1, 2, 3, 4, 5]
    assert -1 <= document["correlation"]["median"] <= 1
    found = document["sets"]["cell"]
    for policy in POLICIES:
        for metric in ("entropy_nats", "rmse_px", "relative_translation_mm", "translation_mm"):
            assert len(found["policies"][policy][metric]) == 6
            assert len(found["quartiles"][policy][metric]) == 2
    assert sorted(file.name for file in tmp_path.iterdir()) == [
        "curves.json",
        "curves_cell.png",
        "scatter.png",
    ]


def test_injected_has_both_sides(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("--data", data, "--sets", "cell", "--trials", "1", "--model", "paper", "--no-cache")
    code, document = study(capsys, "injected", *arguments)
    assert code == 0
    assert list(document["sides"]) == ["base", "flange"]
    for side in document["sides"].values():
        assert side["sets"]["cell"]["policies"]["random"]["translation_mm"]["mean"] > 0


@pytest.mark.parametrize("mounting", ["eye_in_hand", "eye_to_hand"])
def test_coverage_has_the_promised_keys(
    mounting: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    code, document = study(capsys, "coverage", "--trials", "2", "--mounting", mounting, "--output", tmp_path)
    assert code == 0
    assert document["mounting"] == mounting
    assert set(document["kinds"]) >= {kind.value for kind in ErrorKind}
    for found in document["kinds"].values():
        assert found["trials"] == 2
        assert 0 <= found["coverage_95"] <= 1
        assert found["nees_per_dof"] > 0
    assert (tmp_path / "coverage.png").is_file()


@pytest.mark.parametrize(
    "command",
    [
        ["table1", "--sets", "cell", "--trials", "1", "--model", "paper", "--no-cache"],
        ["holdout", "--sets", "cell", "--trials", "1", "--model", "paper", "--no-cache"],
        ["injected", "--sets", "cell", "--trials", "1", "--model", "paper", "--no-cache"],
        ["curves", "--sets", "cell", "--trials", "1", "--model", "paper", "--no-cache"],
    ],
)
def test_people_get_tables(command: list[str], data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["study", *command, "--data", str(data), "--workers", "1"]) == 0
    captured = capsys.readouterr()
    assert "next best view" in captured.out
    assert "Calibrating" in captured.err
    assert max(map(len, captured.out.splitlines())) <= 80


@pytest.mark.parametrize(
    ("arguments", "code", "what"),
    [
        (["--data", "/nowhere"], 3, "no such folder"),
        (["--sets", "missing"], 3, "no set missing"),
        (["--trials", "0"], 3, "trials"),
        (["--workers", "0"], 3, "workers"),
        (["--seed", "-1"], 2, "seed"),
        (["--trials", "many"], 2, "trials"),
        (["--model", "best"], 2, "model"),
        (["--output", "/proc/nowhere"], 7, "folder"),
    ],
)
def test_what_cannot_be_done_is_refused(
    arguments: list[str], code: int, what: str, data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    usual = ["study", "table1", "--workers", "1", "--no-cache", "--model", "paper", "--trials", "1"]
    given = ["--data", str(data), "--sets", "cell"]
    line = [*usual, *given, *arguments] if arguments[0] not in {"--data", "--sets"} else [*usual, *arguments]
    if arguments[0] == "--sets":
        line += ["--data", str(data)]
    for option in ("--workers", "--trials", "--model"):
        if option in arguments:
            at = line.index(option)
            del line[at : at + 2]
    assert run(line) == code
    assert what in capsys.readouterr().err


def test_sets_without_truth_make_no_table1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_recording(replace(simulate(ErrorKind.PIXEL_ONLY, 0), truth=None), tmp_path / "real")
    code, document = study(capsys, "table1", "--data", tmp_path, "--sets", "real", "--no-cache")
    assert code == 3
    assert document["error"]["code"] == "no_truth"


def test_mistakes_have_the_promised_keys(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    arguments = ("mistakes", "--trials", "1", "--kinds", "flip", "moving", "--output", tmp_path)
    code, document = study(capsys, *arguments)
    assert code == 0
    assert list(document["kinds"]) == ["flip", "moving"]
    assert document["planted"]["trials"] == 2
    assert document["clean"] == {"trials": 2, "false_alarms": 0.0, "said": []}
    for found in document["kinds"].values():
        assert (found["named"], found["answered"], found["repaired"]) == (1.0, 1.0, 1.0)
        assert found["wrong_answers"] == 0
        assert found["translation_mm"] < 2 * found["clean_translation_mm"]
    assert written(tmp_path / "mistakes.json") == document
    assert run(["study", "mistakes", "--trials", "1", "--kinds", "flip", "--workers", "1"]) == 0
    assert "false alarms: 0.0 % of 1 recordings" in capsys.readouterr().out


def test_an_unknown_mistake_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    code, document = study(capsys, "mistakes", "--kinds", "upside_down")
    assert code == 3
    assert document["error"]["code"] == "unknown_kind"
    assert "gross_pose" in document["error"]["hint"]
