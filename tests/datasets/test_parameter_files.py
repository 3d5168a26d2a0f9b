"""Cameras and targets in files of their own."""

import json
from pathlib import Path

import numpy as np
import pytest

from handeye.datasets import read_camera, read_target
from handeye.errors import InputError
from handeye.types import AprilGrid, Camera, Charuco, Chessboard, CircleGrid, Target

CAMERA = Camera("brown_conrady_4", [900, 905, 320, 240, -0.1, 0.01, 1e-3, 2e-3], 640, 480, np.eye(8) * 0.01)
TARGET = Charuco(5, 7, 0.03, 0.02, "DICT_4X4_50")
CAMERA_INFO = """
image_width: 640
image_height: 480
camera_name: wrist
camera_matrix: {rows: 3, cols: 3, data: [900.0, 0.0, 320.0, 0.0, 905.0, 240.0, 0.0, 0.0, 1.0]}
distortion_model: MODEL
distortion_coefficients: {rows: 1, cols: 5, data: [COEFFICIENTS]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
"""


def written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def toml_of(camera: Camera, table: str = "") -> str:
    data = camera.to_dict()
    head = f"[{table}]\n" if table else ""
    return head + "\n".join(f"{key} = {json.dumps(value)}" for key, value in data.items())


@pytest.mark.parametrize("table", ["", "camera"])
def test_camera_in_toml(tmp_path: Path, table: str) -> None:
    assert read_camera(written(tmp_path / "camera.toml", toml_of(CAMERA, table))) == CAMERA


@pytest.mark.parametrize("wrap", [False, True])
def test_camera_in_json(tmp_path: Path, wrap: bool) -> None:
    data = {"camera": CAMERA.to_dict(), "rmse_px": 0.1} if wrap else CAMERA.to_dict()
    assert read_camera(written(tmp_path / "camera.json", json.dumps(data))) == CAMERA


@pytest.mark.parametrize(
    ("model", "coefficients", "lens"),
    [
        ("plumb_bob", [-0.1, 0.01, 0.001, 0.002, 0.0], "brown_conrady_5"),
        ("rational_polynomial", [0.1] * 8, "brown_conrady_8"),
        ("equidistant", [0.01, 0.02, 0.03, 0.04], "kannala_brandt"),
    ],
)
def test_camera_of_ros(tmp_path: Path, model: str, coefficients: list[float], lens: str) -> None:
    text = CAMERA_INFO.replace("MODEL", model).replace("COEFFICIENTS", str(coefficients)[1:-1])
    camera = read_camera(written(tmp_path / "camera_info.yaml", text))
    assert camera.lens == lens
    assert camera.size_px == (640, 480)
    assert camera.parameters.tolist() == [900, 905, 320, 240, *coefficients]


def test_target(tmp_path: Path) -> None:
    fields = "\n".join(f"{key} = {json.dumps(value)}" for key, value in TARGET.to_dict().items())
    assert read_target(written(tmp_path / "a.toml", fields)) == TARGET
    assert read_target(written(tmp_path / "b.toml", f"[target]\n{fields}")) == TARGET
    assert read_target(written(tmp_path / "c.json", json.dumps(TARGET.to_dict()))) == TARGET


# The examples of Kalibr's wiki, "Calibration targets".
APRILGRID = "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 6\ntagSize: 0.088\ntagSpacing: 0.3\n"
CHECKERBOARD = "target_type: 'checkerboard'\ntargetCols: 6\ntargetRows: 7\nrowSpacingMeters: 0.06\ncolSpacingMeters: 0.06\n"
CIRCLES = (
    "target_type: 'circlegrid'\ntargetCols: 6\ntargetRows: 7\nspacingMeters: 0.02\nasymmetricGrid: False\n"
)


def test_targets_of_kalibr(tmp_path: Path) -> None:
    assert read_target(written(tmp_path / "april_6x6.yaml", APRILGRID)) == AprilGrid(6, 6, 0.088, 0.3)
    assert read_target(written(tmp_path / "b.yaml", CHECKERBOARD)) == Chessboard(7, 6, 0.06)
    assert read_target(written(tmp_path / "c.yml", CIRCLES)) == CircleGrid(7, 6, 0.02, 0.008)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("a: [", "not YAML"),
        ("target_type: wall", "expected aprilgrid"),
        (APRILGRID.replace("tagSize: 0.088", "tagSize: big"), "tagSize"),
        (APRILGRID.replace("tagSize: 0.088\n", ""), "tagSize is missing"),
        (CHECKERBOARD.replace("colSpacingMeters: 0.06", "colSpacingMeters: 0.05"), "equal sides"),
        (APRILGRID.replace("tagCols: 6", "tagCols: 99999999999"), "columns"),
    ],
)
def test_damaged_targets_of_kalibr(text: str, match: str, tmp_path: Path) -> None:
    path = written(tmp_path / "a.yaml", text)
    with pytest.raises(InputError, match=match) as caught:
        read_target(path)
    assert str(path) in caught.value.message


@pytest.mark.parametrize(
    ("name", "text", "code"),
    [
        ("a.toml", "lens = ", "not_toml"),
        ("a.toml", "a" + ".a" * 400 + " = 1", "not_toml"),
        ("a.toml", "lens = 'pinhole'", "invalid_field"),
        ("a.toml", "camera = 3", "invalid_field"),
        ("a.json", "{", "not_json"),
        ("a.json", "[" * 100_000, "not_json"),
        ("a.json", "[1]", "invalid_field"),
        ("a.json", '{"camera": {"lens": "pinhole", "parameters": [NaN, 1, 2, 3], "width_px": 4, "height_px": 5}}', "not_finite"),
        ("a.yaml", "a: [", "not_yaml"),
        ("a.yaml", "image_width: 3", "unknown_format"),
        ("a.yaml", CAMERA_INFO.replace("MODEL", "mirror").replace("COEFFICIENTS", "0"), "unknown_lens"),
        ("a.yaml", CAMERA_INFO.replace("MODEL", "plumb_bob").replace("COEFFICIENTS", "0"), "unknown_lens"),
        ("a.yaml", CAMERA_INFO.replace("COEFFICIENTS", "0, zero"), "not_numbers"),
        ("a.yaml", CAMERA_INFO.replace("240.0, 0.0, 0.0, 1.0]", "240.0]").replace("MODEL", "plumb_bob").replace("COEFFICIENTS", "0"), "wrong_shape"),
        ("a.ini", "", "invalid_field"),
        ("a.png", "", "unknown_format"),
    ],
)  # fmt: skip
def test_hostile_cameras(tmp_path: Path, name: str, text: str, code: str) -> None:
    path = written(tmp_path / name, text)
    with pytest.raises(InputError) as caught:
        read_camera(path)
    assert caught.value.code == code
    assert str(path) in caught.value.message


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_target(tmp_path / "none.toml")
    assert caught.value.code == "missing_file"


def test_target_of_unknown_family(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_target(written(tmp_path / "a.toml", "family = 'wall'"))
    assert caught.value.code == "unknown_target"
    assert issubclass(Charuco, Target)
