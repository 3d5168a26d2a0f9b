"""`handeye solve` from the folder to the answer."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from commands import Handeye
from folders import made_recording, photographed, written
from handeye.estimation.calibrate import WHAT_NO_VIEW_SHOWS
from handeye.types import Mounting, Pose
from handeye.types.calibration import ModelName


def error_of(data: dict[str, Any], X: Pose, name: str = "T_flange_camera") -> Pose:
    return Pose(data[name]) @ X


@pytest.mark.parametrize("mounting", list(Mounting))
@pytest.mark.parametrize("model", list(ModelName))
def test_recording(handeye: Handeye, tmp_path: Path, mounting: Mounting, model: ModelName) -> None:
    recording = made_recording(10, mounting=mounting)
    assert recording.truth is not None
    assert recording.truth.X is not None
    assert recording.truth.Y is not None
    data = handeye.json("solve", written(recording, tmp_path / "made"), "--model", model)
    camera, target = mounting.result_names
    error = error_of(data, recording.truth.X, camera)
    assert np.linalg.norm(error.translation) < 2e-3
    np.testing.assert_allclose(data[target], recording.truth.Y.matrix, atol=5e-3)
    assert data["mounting"] == mounting
    assert data["model"] == model
    assert data["rmse_px"] < 1
    assert np.array(data["covariance"]).shape == (6, 6)
    assert data["covariance_frame"] == "camera"
    assert data["covariance_order"] == ["tx_m", "ty_m", "tz_m", "rx_rad", "ry_rad", "rz_rad"]
    sigma = 1e3 * np.sqrt(np.trace(np.array(data["covariance"])[:3, :3]))
    assert data["sigma_translation_mm"] == pytest.approx(sigma)
    assert data["views"]["used"] == [view.name for view in recording.views]
    assert data["views"]["rejected"] == []
    # Beside an arm that is not described something is believed that no view shows.
    believed = [] if model is ModelName.PAPER or mounting is Mounting.EYE_IN_HAND else [WHAT_NO_VIEW_SHOWS]
    assert data["warnings"] == believed
    assert data["ending"].startswith("converged")


def test_pictures(handeye: Handeye, tmp_path: Path) -> None:
    folder, X = photographed(tmp_path / "set", 6)
    data = handeye.json("solve", folder, "--rows", "5", "--columns", "7")
    assert np.linalg.norm(error_of(data, X).translation) < 5e-3
    assert (data["layout"], data["camera_origin"]) == ("rwhe-calib", "calibrated")


def test_text_says_the_same(handeye: Handeye, tmp_path: Path) -> None:
    folder = written(made_recording(6), tmp_path / "made")
    outcome = handeye("solve", folder)
    data = handeye.json("solve", folder)
    assert outcome.code == 0
    x = 1e3 * data["T_flange_camera"][0][3]
    for words in ("T_flange_camera", "T_base_target", f"{x:.3f}", "mm", "deg", "6 views used"):
        assert words in outcome.out
    assert "nan" not in outcome.out


def test_output_holds_the_json(handeye: Handeye, tmp_path: Path) -> None:
    folder = written(made_recording(5), tmp_path / "made")
    data = handeye.json("solve", folder, "--output", tmp_path / "answer.json")
    assert json.loads((tmp_path / "answer.json").read_text()) == data


def test_answer_serves_as_a_camera(handeye: Handeye, tmp_path: Path) -> None:
    folder = written(made_recording(5), tmp_path / "made")
    handeye.json("solve", folder, "--model", "paper", "--output", tmp_path / "answer.json")
    data = handeye.json("solve", folder, "--camera", tmp_path / "answer.json")
    assert data["camera_origin"] == "given"


def test_rejected_views_have_a_reason(handeye: Handeye, tmp_path: Path) -> None:
    recording = made_recording(6)
    folder = written(recording, tmp_path / "made")
    corners = folder / "corners" / "view_02.csv"
    corners.write_text("\n".join(corners.read_text().splitlines()[:4]) + "\n")
    data = handeye.json("solve", folder)
    assert [view["name"] for view in data["views"]["rejected"]] == ["view_02"]
    assert "3 points" in data["views"]["rejected"][0]["reason"]
    assert len(data["views"]["used"]) == 5
    assert "view_02" in handeye("solve", folder).out


def test_same_input_same_bytes(handeye: Handeye, tmp_path: Path) -> None:
    folder = written(made_recording(5), tmp_path / "made")
    assert handeye("solve", folder, "--json").out == handeye("solve", folder, "--json").out
