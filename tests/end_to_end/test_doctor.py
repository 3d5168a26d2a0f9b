"""`handeye doctor` names what is wrong, first what matters most, and writes a repaired copy."""

from pathlib import Path

import numpy as np

from commands import Handeye
from folders import made_recording, written
from handeye.studies.planted import Mistake, plant


def test_a_healthy_folder_is_said_to_be_so(handeye: Handeye, tmp_path: Path) -> None:
    folder = written(made_recording(9), tmp_path / "made")
    data = handeye.json("doctor", folder)
    assert (data["healthy"], data["refused"], data["findings"]) == (True, False, [])
    assert "nothing wrong was found" in handeye("doctor", folder).out


def test_a_refused_folder_is_named_and_repaired(handeye: Handeye, tmp_path: Path) -> None:
    clean = made_recording(9)
    recording, _ = plant(clean, Mistake.WRONG_DIRECTION, np.random.default_rng(1))
    folder, fixed = written(recording, tmp_path / "made"), tmp_path / "fixed"
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    data = handeye.json("doctor", folder, "--fix", fixed)
    assert data["findings"][0]["code"] == "wrong_direction"
    assert data["refused"]
    assert data["repaired"] == str(fixed)
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
    expected = handeye.json("solve", written(clean, tmp_path / "clean"))
    answer = handeye.json("solve", fixed)
    assert answer["mounting"] == expected["mounting"]
    np.testing.assert_allclose(answer["T_flange_camera"], expected["T_flange_camera"], atol=1e-6)
    first = handeye("doctor", folder).out.splitlines()[0]
    assert first.startswith("wrong_direction: ")


def test_nothing_is_written_over(handeye: Handeye, tmp_path: Path) -> None:
    folder = written(made_recording(9), tmp_path / "made")
    error = handeye.fails("doctor", folder, "--fix", folder)
    assert error["exit_code"] == 7
    assert error["code"] == "exists"


def test_views_that_determine_nothing_are_said_to(handeye: Handeye, tmp_path: Path) -> None:
    recording, _ = plant(made_recording(9), Mistake.FEW_ROTATIONS, np.random.default_rng(1))
    data = handeye.json("doctor", written(recording, tmp_path / "made"))
    assert data["refused"]
    assert data["findings"][0]["code"] == "degenerate"
    assert (
        "rotations share" in data["findings"][0]["sentence"]
        or "not determined" in data["findings"][0]["sentence"]
    )
