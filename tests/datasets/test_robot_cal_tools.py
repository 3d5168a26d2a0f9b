"""The layout of robot_cal_tools, on made-up folders and on a published set."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from datasets.layouts import SIZE, png, write_rct
from handeye.datasets import ImageSet, load
from handeye.errors import InputError
from handeye.types import Camera, Charuco, CircleGrid, Mounting, Pose

CHARUCO = """target_finder:
  type: CharucoGridTargetFinder
  rows: 7
  cols: 5
  chessboard_dim: 0.036
  aruco_marker_dim: 0.027
  dictionary: 10
"""


def images_of(path: Path, **options: object) -> ImageSet:
    loaded = load(path, **options)  # type: ignore[arg-type]
    assert isinstance(loaded, ImageSet)
    return loaded


def test_what_the_files_say(tmp_path: Path) -> None:
    found = images_of(write_rct(tmp_path / "set"))
    assert found.layout == "robot_cal_tools"
    assert [(shot.name, shot.image) for shot in found.shots] == [("0", "images/0.png"), ("1", "images/1.png")]
    expected = [[-1, 0, 0, 0.7], [0, 1, 0, 1e-3], [0, 0, -1, 0.85], [0, 0, 0, 1]]
    np.testing.assert_allclose(found.shots[0].T_base_flange.matrix, expected, atol=1e-15)
    assert found.shots[1].T_base_flange == Pose.from_quaternion([0.6, 0.1, 0.8], [0, 0.6, 0, -0.8])
    assert found.camera == Camera("pinhole", [60, 61, 32, 24], *SIZE)
    assert found.mounting is Mounting.EYE_IN_HAND
    # The larger dot is at the lower left, where their frame (y up) has its origin.
    assert found.target == CircleGrid(5, 7, 0.0254, 0.0127, marked=28)
    assert [warning.code for warning in found.warnings] == ["diameter_assumed"]


def test_charuco(tmp_path: Path) -> None:
    folder = write_rct(tmp_path / "set")
    (folder / "target.yaml").write_text(CHARUCO)
    assert images_of(folder).target == Charuco(7, 5, 0.036, 0.027, "DICT_6X6_250")


def test_a_camera_beside_the_robot_is_told_by_the_guesses(tmp_path: Path) -> None:
    folder = write_rct(tmp_path / "set")
    (folder / "pose_guesses.yaml").write_text(
        "base_to_camera_guess: {x: 1.0}\nwrist_to_target_guess: {x: 1.0}\n"
    )
    assert images_of(folder).mounting is Mounting.EYE_TO_HAND
    assert images_of(folder, mounting=Mounting.EYE_IN_HAND).mounting is Mounting.EYE_IN_HAND


def test_the_calibrated_camera_is_preferred_and_said(tmp_path: Path) -> None:
    folder = write_rct(tmp_path / "set")
    text = (folder / "camera_intr.yaml").read_text().replace("60.0", "59.0")
    (folder / "camera_intr_calibrated.yaml").write_text(text)
    found = images_of(folder)
    assert found.camera is not None
    assert found.camera.parameters[0] == 59
    assert [warning.code for warning in found.warnings] == ["diameter_assumed", "camera_chosen"]


def test_images_of_one_name_in_two_folders(tmp_path: Path) -> None:
    folder = write_rct(tmp_path / "set")
    png(folder / "more" / "0.png")
    listed = folder / "cal_data.yaml"
    listed.write_text(listed.read_text().replace("images/1.png", "more/0.png"))
    assert [shot.name for shot in images_of(folder).shots] == ["000_0", "001_0"]


def test_the_other_name_of_the_list(tmp_path: Path) -> None:
    folder = write_rct(tmp_path / "set")
    (folder / "cal_data.yaml").rename(folder / "data.yaml")
    assert len(images_of(folder).shots) == 2
    (folder / "target.yaml").unlink()
    with pytest.raises(InputError, match="no file with the robot's poses"):
        load(folder)


def text(name: str, content: str) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_text(content)


def change(name: str, old: str, new: str) -> Callable[[Path], None]:
    def apply(folder: Path) -> None:
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new, 1))

    return apply


BOMB = "a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\nx: *c\n"
FAULTS: dict[str, tuple[Callable[[Path], object], str, str]] = {
    "an absolute path": (change("cal_data.yaml", "poses/1.yaml", "/etc/passwd"), "path_outside", "pose"),
    "a path up": (change("cal_data.yaml", "poses/1.yaml", "../1.yaml"), "path_outside", "pose"),
    "an image outside": (change("cal_data.yaml", "images/1.png", "../1.png"), "path_outside", "image"),
    "no such pose": (change("cal_data.yaml", "poses/1.yaml", "poses/2.yaml"), "missing_file", "poses/2.yaml"),
    "no such image": (change("cal_data.yaml", "images/1.png", "images/2.png"), "missing_file", "images/2.png"),
    "no image": (change("cal_data.yaml", "  image: images/1.png\n", ""), "invalid_field", "image"),
    "not a list": (text("cal_data.yaml", "pose: a\n"), "no_poses", "cal_data.yaml"),
    "not yaml": (text("cal_data.yaml", "- [\n"), "not_yaml", "cal_data.yaml"),
    "aliases": (text("cal_data.yaml", BOMB), "not_yaml", "aliases"),
    "nested": (text("cal_data.yaml", "[" * 5_000), "not_yaml", "cal_data.yaml"),
    "a key twice": (change("poses/1.yaml", "y: 0.1", "x: 0.1"), "not_yaml", "twice"),
    "a python object": (text("poses/1.yaml", "!!python/object/apply:os.system [x]"), "invalid_field", "1.yaml"),
    "two documents": (text("poses/1.yaml", "---\nx: 1\n---\nx: 2\n"), "not_yaml", "1.yaml"),
    "NaN": (change("poses/1.yaml", "0.1", "nan"), "not_finite", "1.yaml"),
    "a word": (change("poses/1.yaml", "0.1", "left"), "invalid_field", "1.yaml: field y"),
    "no unit quaternion": (change("poses/1.yaml", "-0.8", "0.9"), "not_rigid", "1.yaml: quaternion"),
    "an unknown target": (change("target.yaml", "ModifiedCircleGrid", "ArucoGrid"), "unknown_target", "ArucoGrid"),
    "no spacing": (change("target.yaml", "spacing", "space"), "invalid_field", "spacing"),
    "half a row": (change("target.yaml", "rows: 5", "rows: 5.5"), "invalid_field", "rows"),
    "a dictionary that is not there": (text("target.yaml", CHARUCO.replace("10", "99")), "unknown_dictionary", "99"),
    "no camera": (change("camera_intr.yaml", "fx", "f"), "invalid_field", "camera_intr.yaml"),
    "a camera of nothing": (change("camera_intr.yaml", "60.0", "0"), "out_of_range", "camera_intr.yaml"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_has_its_error_that_names_the_place(tmp_path: Path, fault: str) -> None:
    folder = write_rct(tmp_path / "set")
    damage, code, place = FAULTS[fault]
    damage(folder)
    with pytest.raises(InputError) as caught:
        load(folder)
    assert caught.value.code == code
    assert place in caught.value.message


def test_the_published_set(circle_grid_10x10: Path) -> None:
    found = images_of(circle_grid_10x10)
    assert len(found.shots) == 15
    assert found.image_size_px == (640, 480)
    assert found.target == CircleGrid(10, 10, 0.0254, 0.0127, marked=90)
    assert found.camera is not None
    assert found.camera.parameters.tolist() == [542.324, 543.515, 320.474, 226.039]
    assert found.shots[2].image == "images/10.png"  # the order of the list, not of the names
