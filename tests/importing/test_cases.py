"""Inputs that once went wrong, with the right value; see the README beside them."""

import os
import shutil
from pathlib import Path

import pytest

from commands import Handeye
from handeye.datasets import Statement, load, read_camera
from handeye.datasets.images import read_image
from handeye.errors import InputError, UnstatedError
from handeye.estimation import solve
from handeye.estimation.confidence import within
from handeye.importing import SourceOptions, open_folder
from handeye.notations import NOTATIONS, Unit
from handeye.types import Charuco

DATA = os.environ.get("HANDEYE_DATA")
CASES = Path(DATA or ".") / "cases"
pytestmark = pytest.mark.skipif(
    DATA is None or not CASES.is_dir(),
    reason="HANDEYE_DATA is not set: it names the folder with the public recordings and the cases",
)
# The board file in that folder describes another board than its pictures show.
BOARD = Charuco(8, 11, 0.020, 0.015, "DICT_5X5_100")


def position_mm(folder: Path, options: SourceOptions | None = None) -> list[float]:
    calibration = solve(open_folder(folder, options).recording)
    return (1e3 * calibration.results["T_flange_camera"].translation).tolist()


@pytest.mark.parametrize(("file", "notation"), [("poses.csv", "ur"), ("poses_kuka.csv", "kuka")])
def test_folder_with_pose_list(file: str, notation: str) -> None:
    folder = CASES / "folder_with_pose_list"
    options = SourceOptions(target=BOARD, poses=file, stated=Statement(NOTATIONS[notation], Unit.MM))
    assert position_mm(folder, options) == pytest.approx([31, -64, 87], abs=0.3)
    with pytest.raises(UnstatedError) as caught:
        open_folder(folder, SourceOptions(target=BOARD, poses=file))
    assert caught.value.options == ("--poses", file, "--notation", notation, "--unit", "mm")


@pytest.mark.parametrize(
    "name",
    [
        "camera_info_parsers.yaml",
        "empty_model_no_coeffs.yaml",
        "inverse_brown.yaml",
        "kalibr_camchain.yaml",
        "no_coeffs_plumb_bob.yaml",
        "opencv_filestorage.yml",
        "plumb_bob_4.yaml",
        "rational8.yaml",
        "realsense_intrinsics.json",
        "ros1_rostopic_echo.yaml",
        "ros2_topic_echo.yaml",
    ],
)
def test_camera_files_of_others(name: str) -> None:
    folder = CASES / "camera_files_of_others"
    camera = read_camera(folder / "camfiles" / name)
    assert camera.parameters[:4].tolist() == [1200, 1200, 639.5, 511.5]
    assert position_mm(folder / "camfile_base", SourceOptions(camera=camera)) == pytest.approx(
        [-70, 10, 60], abs=0.5
    )


def test_a_camera_that_was_never_calibrated_is_named() -> None:
    with pytest.raises(InputError, match="never calibrated"):
        read_camera(CASES / "camera_files_of_others" / "camfiles" / "all_zero.yaml")
    equidistant = read_camera(CASES / "camera_files_of_others" / "camfiles" / "equidistant.yaml")
    assert equidistant.lens == "kannala_brandt"


def test_camera_info_trailing_dots() -> None:
    folder = CASES / "camera_info_trailing_dots"
    camera = read_camera(folder / "camera_info_parsers.yaml")
    assert position_mm(folder / "camfile_base", SourceOptions(camera=camera)) == pytest.approx(
        [-70, 10, 60], abs=0.5
    )


def test_camera_of_another_size() -> None:
    folder = CASES / "camera_of_another_size"
    options = SourceOptions(pattern=(6, 9), camera=read_camera(folder / "camera_1920x1536.toml"))
    with pytest.raises(InputError, match="1920 x 1536") as caught:
        open_folder(folder / "views", options)
    assert caught.value.code == "image_size"


def test_poses_four_decimals(tmp_path: Path) -> None:
    folder = shutil.copytree(CASES / "poses_four_decimals" / "round_4", tmp_path / "round_4")
    assert position_mm(folder) == pytest.approx([-70, 10, 60], abs=1.0)


@pytest.mark.parametrize(
    ("case", "code", "words"),
    [
        ("angles_negated/neg_in_0_20_1_signs_negated", "wrong_rotation", "have the wrong sign"),
        ("mirrored_camera/mir_in_6_0", "mirrored_pictures", "left to right"),
        ("gimbal_inverted/gimbal2_inv", "wrong_direction", "T_flange_base"),
        ("euler_conventions/conv_in_12_35_signs_negated", "wrong_rotation", "have the wrong sign"),
        ("euler_conventions/conv_in_12_35_ur_rotvec_as_rpy", "wrong_rotation", "are rotation vectors"),
        ("euler_conventions/conv_in_8_14_kuka_abc_as_rpy", "wrong_rotation", "KUKA"),
        ("stale_robot_poses/stale_pairs", "stale_poses", "v00 and v01, v02 and v03"),
        ("stale_robot_poses/stale_all", "stale_poses", "the pose was not read again"),
    ],
)
def test_what_is_wrong_throughout_is_named(case: str, code: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        position_mm(CASES / case)
    assert caught.value.code == code


def test_zero_distortion_as_pinhole() -> None:
    folder = CASES / "zero_distortion_as_pinhole"
    for name in ("zero5_D455_pinhole", "zero5_D455_five"):
        assert position_mm(folder / name) == pytest.approx([-70, 10, 60], abs=0.5)


def test_eye_to_hand_mix() -> None:
    recording = open_folder(CASES / "eye_to_hand_mix").recording
    calibration = solve(recording)
    assert recording.truth is not None
    truth = recording.mounting.results(recording.truth.X, recording.truth.Y)["T_base_camera"]
    off = calibration.results["T_base_camera"].translation - truth.translation
    known = within(calibration.covariance, calibration.degrees_of_freedom)
    assert 1e3 * float((off**2).sum() ** 0.5) < known.translation_mm


def test_a_version_of_thousands_of_digits_is_refused_in_words() -> None:
    with pytest.raises(InputError, match=r"recording\.toml"):
        open_folder(CASES / "hostile" / "hex-version")


def test_sixteen_thousand_digits_of_a_square_size_are_refused(tmp_path: Path) -> None:
    views = CASES / "camera_of_another_size" / "views"
    shutil.copytree(views, tmp_path / "views", copy_function=shutil.copyfile)
    (tmp_path / "views").chmod(0o755)
    (tmp_path / "views" / "squaresize.txt").unlink()
    shutil.copyfile(CASES / "hostile" / "squaresize.txt", tmp_path / "views" / "squaresize.txt")
    with pytest.raises(InputError, match=r"squaresize\.txt"):
        load(tmp_path / "views", pattern=(6, 9))


@pytest.mark.parametrize("name", ["claim.jpg", "scans.jpg"])
def test_pictures_that_cost_more_than_they_show_are_refused(name: str) -> None:
    with pytest.raises(InputError, match=name) as caught:
        read_image(CASES / "hostile" / name)
    assert caught.value.code == "too_large"


def test_markup_in_names_is_printed_as_it_is(tmp_path: Path, handeye: Handeye) -> None:
    recording = CASES / "eye_to_hand_mix"
    done = handeye("plan", recording, "--candidates", CASES / "hostile" / "plan-markup.csv")
    assert done.code in {0, 4}, done.err
    assert "[/b]" in done.out + done.err


# What other tests hold: boards and corners, the loop, and the camera of the same pictures.
ELSEWHERE = {"charuco_boards", "narrow_margin", "same_pictures"}


def test_every_case_has_its_test() -> None:
    text = Path(__file__).read_text(encoding="utf-8")
    given = {entry.name for entry in CASES.iterdir() if entry.is_dir()}
    assert given
    assert not [name for name in given - ELSEWHERE if f'"{name}' not in text]
