"""The layout of industrial_calibration as it is today."""

from collections.abc import Callable
from pathlib import Path

import pytest

from datasets.layouts import RCT_FILES, write_rct
from handeye.datasets import ImageSet, load
from handeye.errors import InputError
from handeye.types import Charuco, CircleGrid, Mounting

FINDERS = {
    "charuco": (
        """  type: CharucoGridTargetFinder
  rows: 7
  cols: 5
  chessboard_dim: 0.036
  aruco_marker_dim: 0.027
  dictionary: 10
""",
        Charuco(7, 5, 0.036, 0.027, "DICT_6X6_250"),
    ),
    "circles": (
        "  type: ModifiedCircleGridTargetFinder\n  rows: 5\n  cols: 7\n  spacing: 0.0254\n",
        CircleGrid(5, 7, 0.0254, 0.0127, marked=28),
    ),
}


def one_file(finder: str, static: str = "false") -> str:
    return (
        "data:\n- pose: poses/0.yaml\n  image: images/0.png\n- pose: poses/1.yaml\n  image: images/1.png\n"
        f"target_finder:\n{finder}homography_threshold: 2.0\n"
        "intrinsics:\n  fx: 60.\n  fy: 61.0\n  cx: 32.\n  cy: 24.\n"
        f"camera_mount_to_camera_guess: {{x: 0., y: 0., z: 0., qx: 0., qy: 0., qz: 0., qw: 1.}}\nstatic_camera: {static}\n"
    )


def written(folder: Path, text: str) -> Path:
    write_rct(folder)
    for name in RCT_FILES:
        if "/" not in name and (folder / name).is_file():
            (folder / name).unlink()
    (folder / "cal_data.yaml").write_text(text)
    return folder


@pytest.mark.parametrize("kind", FINDERS)
@pytest.mark.parametrize("static", ["false", "true"])
def test_one_file_with_everything(kind: str, static: str, tmp_path: Path) -> None:
    finder, target = FINDERS[kind]
    folder = written(tmp_path / "set", one_file(finder, static))
    for path in (folder, folder / "cal_data.yaml"):
        found = load(path)
        assert isinstance(found, ImageSet)
        assert found.layout == "industrial_calibration"
        assert found.target == target
        assert found.mounting is (Mounting.EYE_TO_HAND if static == "true" else Mounting.EYE_IN_HAND)
        assert found.camera is not None
        assert found.camera.parameters.tolist() == [60, 61, 32, 24]
        assert found.shots[0].T_base_flange.translation.tolist() == [0.7, 1e-3, 0.85]
        assert [shot.image for shot in found.shots] == ["images/0.png", "images/1.png"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.replace("Charuco", "Aruco"), "ArucoGridTargetFinder"),
        (lambda t: t.replace("poses/1", "../poses/1"), "path"),
        (lambda t: t.replace("images/1", "images/9"), "missing"),
        (lambda t: t.replace("rows: 7", "rows: seven"), "rows"),
        (lambda t: t.replace("fx: 60.", "fx: 0."), "focal"),
    ],
)
def test_faults_are_named(change: Callable[[str], str], words: str, tmp_path: Path) -> None:
    folder = written(tmp_path / "set", change(one_file(FINDERS["charuco"][0])))
    with pytest.raises(InputError, match=words):
        load(folder)
