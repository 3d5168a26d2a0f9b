"""Reading back what a solve wrote."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from answers import CAMERA, COVARIANCE, GENERIC, TARGET
from handeye.errors import HandeyeError, InputError
from handeye.export import Result, read_result
from handeye.types import Mounting
from handeye.types.calibration import Calibration, ModelName, Noise, Unobservable, ViewResult
from strategies import plain_values


def calibration(mounting: Mounting = Mounting.EYE_IN_HAND) -> Calibration:
    return Calibration(
        mounting=mounting,
        X=GENERIC.inverse(),
        Y=TARGET,
        camera=CAMERA,
        covariance=COVARIANCE,
        information=np.eye(12),
        rmse_px=0.1,
        ending="converged",
        iterations=3,
        noise=Noise((0.1, 0.1, 0.1)),
        model=ModelName.PAPER,
        start="shah",
        views=(ViewResult("a", 0.1), ViewResult("b", 0.1), ViewResult("c", float("nan"), used=False)),
        warnings=("a warning",),
        unobservable=(
            Unobservable("one way is open", "turn", (1.0,)),
            Unobservable("one way is open", "t", (1.0,)),
        ),
    )


def written(tmp_path: Path, data: object) -> Path:
    path = tmp_path / "result.json"
    path.write_text(json.dumps(data))
    return path


@pytest.mark.parametrize("mounting", Mounting)
def test_a_result_reads_back(tmp_path: Path, mounting: Mounting) -> None:
    solved = calibration(mounting)
    found = read_result(written(tmp_path, {"recording": "cell 7", "new_key": [1], **solved.to_dict()}))
    direct = Result.of(solved, "cell 7")
    for result in (found, direct):
        assert result.mounting is mounting
        np.testing.assert_allclose(result.T_parent_camera.matrix, GENERIC.matrix, atol=1e-15)
        assert result.T_fixed_target == TARGET
        assert result.view_count == 2
        assert result.recording == "cell 7"
        assert result.camera == CAMERA
        assert result.warnings == ("one way is open", "a warning")
        np.testing.assert_array_equal(result.covariance, COVARIANCE)
    assert found.sigma_translation_m == solved.sigma_translation_m
    assert found.sigma_rotation_rad == solved.sigma_rotation_rad


def changed(**values: Any) -> dict[str, Any]:
    return calibration().to_dict() | values


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ({"error": {"code": "degenerate"}}, "no result"),
        ([], "JSON object"),
        ({}, "mounting"),
        (changed(mounting="upside_down"), "mounting"),
        (changed(mounting="eye_to_hand"), "T_base_camera is missing"),
        (changed(T_flange_camera=[[1.0]]), "T_flange_camera"),
        (changed(T_flange_camera=(np.eye(4) * 1000).tolist()), "T_flange_camera"),
        (changed(covariance=None), "covariance"),
        (changed(covariance=np.eye(5).tolist()), "covariance"),
        (changed(covariance=(-np.eye(6)).tolist()), "covariance"),
        (changed(covariance=np.triu(np.ones((6, 6))).tolist()), "covariance"),
        (changed(covariance=np.full((6, 6), np.nan).tolist()), "covariance"),
        (changed(camera={"lens": "none"}), "camera"),
    ],
)
def test_what_is_no_result_is_refused(tmp_path: Path, data: object, said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        read_result(written(tmp_path, data))
    assert "result.json" in caught.value.message


@pytest.mark.parametrize("text", ["", "{", "nonsense", "[" * 100_000, '{"a": 1} x', "\x00"])
def test_what_is_no_json_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "result.json"
    path.write_text(text)
    with pytest.raises(InputError, match=r"result\.json"):
        read_result(path)


@given(st.dictionaries(st.sampled_from(list(calibration().to_dict())), plain_values()))
def test_hostile_values_raise_only_our_errors(tmp_path: Path, values: dict[str, Any]) -> None:
    try:
        text = json.dumps(changed(**values))
    except (TypeError, ValueError):
        return
    path = tmp_path / "result.json"
    path.write_text(text)
    try:
        read_result(path)
    except HandeyeError:
        return
