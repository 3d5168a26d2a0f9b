"""The layout of Ali et al., on made-up folders and on the published sets."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from datasets.layouts import SIZE, png, pose_line, some_pose, write_rwhe
from handeye.datasets import ImageSet, ImportOptions, load
from handeye.datasets.image_set import Shot
from handeye.datasets.rwhe_calib import PUBLISHED_PATTERNS, read, read_square_size
from handeye.errors import InputError
from handeye.types import Camera, Chessboard, CircleGrid, Mounting, Pose


def images_of(path: Path, **options: object) -> ImageSet:
    loaded = load(path, **options)  # type: ignore[arg-type]
    assert isinstance(loaded, ImageSet)
    return loaded


def test_images_and_poses_are_paired_in_the_order_of_counting(tmp_path: Path) -> None:
    found = images_of(write_rwhe(tmp_path / "own"), pattern=(3, 4))
    assert found.layout == "rwhe-calib"
    assert [shot.image for shot in found.shots] == ["im_8.png", "im_9.png", "im_10.png"]
    for k, shot in enumerate(found.shots):
        np.testing.assert_allclose(shot.T_base_flange.matrix, some_pose(k).matrix, atol=1e-8)
        assert (found.folder / str(shot.image)).is_file()
    assert found.target == Chessboard(3, 4, 0.2)
    assert found.image_size_px == SIZE
    assert found.mounting is Mounting.EYE_IN_HAND
    assert found.camera is None
    assert found.truth is not None
    assert Pose([[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0.05], [0, 0, 0, 1]]) == found.truth.X
    assert found.truth.Y is None
    assert found.warnings == ()
    assert "Ali" not in found.source  # not everyone who uses the layout


def test_detected_points_make_a_recording(tmp_path: Path) -> None:
    found = images_of(write_rwhe(tmp_path / "own"), pattern=(3, 4))
    pixels = np.random.default_rng(1).uniform(0, 40, (12, 2))
    views = [shot.with_points(np.arange(12), pixels) for shot in found.shots[1:]]
    recording = found.recording(Camera("pinhole", [60, 60, 32, 24], *SIZE), views)
    assert [view.image for view in recording.views] == ["im_9.png", "im_10.png"]
    assert recording.truth == found.truth


@pytest.mark.parametrize(
    ("text", "metres"),
    [
        ("15mm", 0.015),
        ("20mm\n", 0.02),
        ("200mm or 20cm", 0.2),
        ("1.5 cm", 0.015),
        ("0.02m", 0.02),
        ("Square size: 25 MM", 0.025),
    ],
)
def test_square_sizes(tmp_path: Path, text: str, metres: float) -> None:
    (tmp_path / "size.txt").write_text(text)
    assert read_square_size(tmp_path / "size.txt") == pytest.approx(metres)


@pytest.mark.parametrize(
    "text", ["", "15", "fifteen mm", "20mm or 3cm", "0mm", "1.2.3mm", "5 miles", "15 mmm"]
)
def test_unclear_square_sizes_are_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "size.txt").write_text(text)
    with pytest.raises(InputError, match=r"size\.txt"):
        read_square_size(tmp_path / "size.txt")


@pytest.mark.parametrize("name", ["squaresize.txt", "square size.txt", "Square_Size.txt", "SQUARE-SIZE.TXT"])
def test_spellings_of_the_file(tmp_path: Path, name: str) -> None:
    folder = write_rwhe(tmp_path / "own")
    (folder / "square size.txt").rename(folder / name)
    assert images_of(folder, pattern=(3, 4)).target == Chessboard(3, 4, 0.2)


def test_a_given_target_is_used_and_a_contradiction_told(tmp_path: Path) -> None:
    folder = write_rwhe(tmp_path / "own")
    assert images_of(folder, target=Chessboard(3, 4, 0.2)).warnings == ()
    assert images_of(folder, target=CircleGrid(3, 4, 0.1, 0.05)).warnings == ()
    other = images_of(folder, target=Chessboard(3, 4, 0.02))
    assert other.target == Chessboard(3, 4, 0.02)
    assert [warning.code for warning in other.warnings] == ["target_differs"]


def test_millimetres_are_a_warning(tmp_path: Path) -> None:
    folder = write_rwhe(tmp_path / "own")
    far = [Pose.from_quaternion([1200 + k, 300, 500], [0, 0, 0, 1]) for k in range(3)]
    (folder / "RobotPosesVec.txt").write_text("\n".join(map(pose_line, far)))
    (warning,) = images_of(folder, pattern=(3, 4)).warnings
    assert warning.code == "poses_not_metres"
    assert "millimetres" in str(warning)


def lines(change: Callable[[list[str]], list[str]]) -> Callable[[Path], None]:
    def apply(folder: Path) -> None:
        path = folder / "RobotPosesVec.txt"
        path.write_text("\n".join(change(path.read_text().split("\n"))))

    return apply


def text(name: str, content: str) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_text(content)


def cut(name: str) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_bytes((folder / name).read_bytes()[:-9])


def word(old: str, new: str) -> Callable[[Path], None]:
    return lines(lambda ls: [ls[0], re.sub(old, new, ls[1], count=1), *ls[2:]])


FAULTS: dict[str, tuple[Callable[[Path], object], str, str]] = {
    "a pose too few": (lines(lambda ls: ls[1:]), "counts_differ", "2 poses in RobotPosesVec.txt but 3"),
    "a pose too many": (lines(lambda ls: [*ls, ls[0]]), "counts_differ", "4 poses in RobotPosesVec.txt but 3"),
    "an image too few": (lambda f: (f / "im_9.png").unlink(), "counts_differ", "2 images"),
    "NaN": (word(r"[\d.]+", "nan"), "not_finite", "line 2"),
    "a word": (word(r"[\d.]+", "one"), "not_numbers", "line 2"),
    "a number too few": (word(r"[\d.]+\t", ""), "wrong_shape", "line 2: 15 numbers"),
    "not rigid": (word(r"[\d.]+", "7"), "not_rigid", "line 2"),
    "the pattern is not known": (lambda _: None, "pattern_unknown", "own"),
    "a truncated image": (cut("im_9.png"), "truncated_image", "im_9"),
    "another size": (lambda f: png(f / "im_9.png", (48, 64)), "image_size", "im_9.png has 48 x 64"),
    "a name twice": (lambda f: (f / "im_10.png").rename(f / "im_9.jpg"), "duplicate_view", "im_9"),
    "no square size": (lambda f: (f / "square size.txt").unlink(), "missing_file", "squaresize.txt"),
    "two square sizes": (text("squaresize.txt", "15mm"), "invalid_field", "contradict"),
    "another truth": (text("GroundTruth.txt", "hand2eye = 1 2 3"), "invalid_field", "GroundTruth"),
    "a truth that is not rigid": (text("GroundTruth.txt", "hand2eye = " + "2 " * 16), "not_rigid", "hand2eye"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_has_its_error_that_names_the_place(tmp_path: Path, fault: str) -> None:
    folder = write_rwhe(tmp_path / "own")
    damage, code, place = FAULTS[fault]
    damage(folder)
    with pytest.raises(InputError) as caught:
        read(folder, ImportOptions(pattern=None if code == "pattern_unknown" else (3, 4)))
    assert caught.value.code == code
    assert place in caught.value.message


def test_shots_stay_in_their_folder() -> None:
    for name, image in (("../a", "a.png"), ("a", "../a.png"), ("a", "/a.png")):
        with pytest.raises(InputError):
            Shot(name, image, Pose.identity())


@pytest.mark.parametrize(
    ("name", "views", "size", "target"),
    [
        ("CS_synthetic_1", 15, (1920, 1080), Chessboard(6, 9, 0.2)),
        ("CS_synthetic_2", 19, (1920, 1080), Chessboard(6, 9, 0.2)),
        ("CS_synthetic_3", 30, (1920, 1080), Chessboard(6, 9, 0.2)),
        ("kuka_1", 30, (1928, 1208), Chessboard(17, 28, 0.02)),
        ("kuka_2", 28, (1920, 1200), Chessboard(17, 24, 0.015)),
    ],
)
def test_the_published_sets(
    rwhe_calib: Path, name: str, views: int, size: tuple[int, int], target: Chessboard
) -> None:
    found = images_of(rwhe_calib / name)
    assert name in PUBLISHED_PATTERNS
    assert (len(found.shots), found.image_size_px, found.target) == (views, size, target)
    assert found.warnings == ()
    assert "2837" in found.source
    if name.startswith("CS"):
        assert found.truth is not None
        assert found.truth.X is not None
        np.testing.assert_array_equal(found.truth.X.matrix, np.diag([1, -1, -1, 1]))
    else:
        assert found.truth is None
