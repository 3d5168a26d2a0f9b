"""Cameras as others write them: every format gives the camera it means."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from handeye.datasets import read_camera
from handeye.errors import InputError
from handeye.types import Camera

K = [900.0, 0.0, 320.0, 0.0, 905.0, 240.0, 0.0, 0.0, 1.0]
D = [-0.1, 0.01, 0.001, 0.002, 0.0]
CAMERA = Camera("brown_conrady_5", [900, 905, 320, 240, *D], 640, 480)
PLAIN = Camera("brown_conrady_5", [900, 905, 320, 240, 0, 0, 0, 0, 0], 640, 480)


def dotted(values: list[float]) -> str:
    """Numbers as NumPy prints them: 0. and 900."""
    return np.array2string(np.array(values), separator=", ", max_line_width=1000).replace("0. ", "0.")


def listed(values: list[float]) -> str:
    return "".join(f"\n- {value}" for value in values)


PARSERS = f"""image_width: 640
image_height: 480
camera_name: wrist
camera_matrix:
  rows: 3
  cols: 3
  data: {dotted(K)}
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: {dotted(D)}
rectification_matrix: {{rows: 3, cols: 3, data: [1., 0., 0., 0., 1., 0., 0., 0., 1.]}}
"""
ROS1 = f"""header:
  seq: 47
  stamp:
    secs: 1
    nsecs: 8
  frame_id: "camera"
height: 480
width: 640
distortion_model: "plumb_bob"
D: {D}
K: {K}
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
binning_x: 0
binning_y: 0
---
header:
  seq: 48
---
"""
ROS2 = f"""header:
  frame_id: camera
height: 480
width: 640
distortion_model: plumb_bob
d:{listed(D)}
k:{listed(K)}
binning_x: 1
---
"""
OST = """# oST version 5.0 parameters


[image]

width
640

height
480

[narrow_stereo]

camera matrix
900.000000 0.000000 320.000000
0.000000 905.000000 240.000000
0.000000 0.000000 1.000000

distortion
-0.100000 0.010000 0.001000 0.002000 0.000000

rectification
1.000000 0.000000 0.000000
0.000000 1.000000 0.000000
0.000000 0.000000 1.000000
"""
KALIBR = f"""cam0:
  cam_overlaps: []
  camera_model: pinhole
  distortion_coeffs: {D[:4]}
  distortion_model: radtan
  intrinsics: [900.0, 905.0, 320.0, 240.0]
  resolution: [640, 480]
  rostopic: /camera/image_raw
"""
VISP = """<?xml version="1.0"?>
<root>
  <camera>
    <name>Camera</name>
    <image_width>640</image_width>
    <image_height>480</image_height>
    <!-- a remark -->
    <model><type>perspectiveProjWithoutDistortion</type><px>900</px><py>905</py><u0>320</u0><v0>240</v0></model>
    <model><type>perspectiveProjWithDistortion</type><px>900</px><py>905</py><u0>320</u0><v0>240</v0>
      <kud>-0.1</kud><kdu>0.1</kdu></model>
  </camera>
</root>
"""
FOUR = Camera("brown_conrady_4", [900, 905, 320, 240, *D[:4]], 640, 480)
ONE = Camera("brown_conrady_4", [900, 905, 320, 240, -0.1, 0, 0, 0], 640, 480)
REALSENSE = {"width": 640, "height": 480, "fx": 900.0, "fy": 905.0, "ppx": 320.0, "ppy": 240.0}
FORMATS = [
    ("camera_info.yaml", PARSERS, CAMERA),
    ("echo1.yaml", ROS1, CAMERA),
    ("echo2.yaml", ROS2, CAMERA),
    ("ost.txt", OST, CAMERA),
    ("camchain.yaml", KALIBR, FOUR),
    ("camera.xml", VISP, ONE),
    ("rs.json", json.dumps({**REALSENSE, "model": "brown_conrady", "coeffs": D}), CAMERA),
    ("rs0.json", json.dumps({**REALSENSE, "model": "inverse_brown_conrady", "coeffs": [0.0] * 5}), PLAIN),
    ("o3d.json", json.dumps({"width": 640, "height": 480, "intrinsic_matrix": np.reshape(K, (3, 3)).T.ravel().tolist()}), PLAIN),
    ("flat.json", json.dumps({"camera_matrix": np.reshape(K, (3, 3)).tolist(), "dist_coeffs": [D], "image_size": [640, 480]}), CAMERA),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text", "camera"), FORMATS, ids=[name for name, _, _ in FORMATS])
def test_every_format_gives_its_camera(name: str, text: str, camera: Camera, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    assert read_camera(tmp_path / name) == camera


@pytest.mark.parametrize("suffix", [".yml", ".yaml", ".xml", ".json"])
@pytest.mark.parametrize("names", [("camera_matrix", "distortion_coefficients"), ("K", "D"), ("cameraMatrix", "distCoeffs")])  # fmt: skip
def test_what_opencv_writes_is_read(suffix: str, names: tuple[str, str], tmp_path: Path) -> None:
    path = tmp_path / f"camera{suffix}"
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", 640)
    storage.write("image_height", 480)
    storage.write(names[0], np.reshape(K, (3, 3)))
    storage.write(names[1], np.array([D]).T)
    storage.release()
    assert read_camera(path) == CAMERA


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.yaml", PARSERS.replace("900.", "0.").replace("905.", "0.").replace("320.", "0.").replace("240.", "0.").replace("1.", "0.", 1), "never calibrated"),
        ("a.yaml", PARSERS.replace("plumb_bob", "mirror"), "mirror"),
        ("a.yaml", PARSERS.replace("image_width: 640", "image_width: 640.5"), "640.5"),
        ("a.yaml", ROS2.replace("binning_x: 1", "binning_x: 2"), "binning"),
        ("a.yaml", KALIBR + KALIBR.replace("cam0", "cam1"), "2 cameras"),
        ("a.yaml", KALIBR.replace("pinhole", "omni"), "omni"),
        ("a.yaml", KALIBR.replace("[640, 480]", "[640]"), "resolution"),
        ("a.json", json.dumps({**REALSENSE, "model": "inverse_brown_conrady", "coeffs": D}), "from pixels to rays"),
        ("a.json", json.dumps({**REALSENSE, "coeffs": [1e400] * 5}), "coeffs"),
        ("a.json", json.dumps({"camera_matrix": K}), "size of the image"),
        ("a.json", json.dumps({"camera_matrix": K[:8], "width": 640, "height": 480}), "8 numbers"),
        ("a.json", json.dumps({"camera_matrix": [K] * 50, "width": 640, "height": 480}), "more than"),
        ("a.xml", VISP.replace("</root>", ""), "cut off"),
        ("a.xml", VISP.replace("</camera>", "</kamera>"), "closes nothing"),
        ("ost.txt", OST.replace("900.000000", "zero"), "camera_matrix"),
        ("a.yaml", "intrinsics: {fx: 1, fy: 1, cx: 1, cy: 1}", "no camera in it"),
    ],
)  # fmt: skip
def test_what_is_no_camera_is_named(name: str, text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        read_camera(tmp_path / name)
    assert str(tmp_path / name) in caught.value.message


@pytest.mark.parametrize("seed", range(20))
def test_cameras_of_all_kinds_read_back(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    width, height = (int(v) for v in rng.integers(100, 5000, 2))
    fx, fy, cx, cy = rng.uniform(0.5, 2, 4).round(3) * [width, width, width / 2, height / 2]
    fisheye = bool(seed % 4 == 3)
    count = 4 if fisheye else (4, 5, 8)[seed % 3]
    distortion = rng.normal(0, 0.05, count)
    matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    expected = Camera.from_opencv(matrix, distortion, (width, height), fisheye=fisheye)
    model = "equidistant" if fisheye else "rational_polynomial" if count == 8 else "plumb_bob"
    rows = ", ".join(map(repr, matrix.ravel().tolist()))
    numbers = ", ".join(map(repr, distortion.tolist()))
    (tmp_path / "info.yaml").write_text(
        f"image_width: {width}\nimage_height: {height}\ncamera_matrix: {{data: [{rows}]}}\n"
        f"distortion_model: {model}\ndistortion_coefficients: {{data: [{numbers}]}}\n"
    )
    (tmp_path / "echo.yaml").write_text(
        f"height: {height}\nwidth: {width}\ndistortion_model: {model}\nd: [{numbers}]\nk: [{rows}]\n---\n"
    )
    storage = cv2.FileStorage(str(tmp_path / "storage.yml"), cv2.FILE_STORAGE_WRITE)
    for key, value in (("image_width", width), ("image_height", height), ("fisheye", int(fisheye))):
        storage.write(key, value)
    storage.write("camera_matrix", matrix)
    storage.write("distortion_coefficients", distortion)
    storage.release()
    for name in ("info.yaml", "echo.yaml", "storage.yml"):
        found = read_camera(tmp_path / name)
        assert (found.lens, found.size_px) == (expected.lens, expected.size_px), name
        np.testing.assert_allclose(found.parameters, expected.parameters, rtol=1e-12)
