"""Wrong input to the command line: each with its own clear error and exit code, and nothing written."""

import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from commands import Handeye
from folders import made_recording, parallel_recording, photographed, written
from handeye.types import Pose, Recording, View

PATTERN = ("--rows", "5", "--columns", "7")


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return photographed(tmp_path_factory.mktemp("pictures") / "set", 4)[0]


@pytest.fixture
def made(tmp_path: Path) -> Path:
    """A good recording, to be spoiled."""
    return written(made_recording(5), tmp_path / "made")


@pytest.fixture
def set_of_pictures(pictures: Path, tmp_path: Path) -> Path:
    """A good folder of pictures, to be spoiled."""
    shutil.copytree(pictures, tmp_path / "set")
    return tmp_path / "set"


def replaced(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text, text
    path.write_text(text.replace(old, new, 1))


def content(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


class Refused:
    """Runs every command on a folder and looks at what it left behind."""

    def __init__(self, handeye: Handeye, tmp_path: Path) -> None:
        self._handeye, self._tmp = handeye, tmp_path

    def __call__(
        self, folder: Path, *options: str, commands: str = "solve plan validate import"
    ) -> dict[str, object]:
        """Return the error, the same in every command."""
        before = content(self._tmp)
        errors: list[dict[str, object]] = []
        for command in commands.split():
            arguments = [command, str(folder)]
            arguments += (
                [str(self._tmp / "new")] if command == "import" else ["--output", str(self._tmp / "new.json")]
            )
            errors.append(self._handeye.fails(*arguments, *options))
            assert content(self._tmp) == before, command
            assert not (self._tmp / "new").exists()
        assert len({str(sorted(error.items(), key=str)) for error in errors}) == 1, errors
        return errors[0]


@pytest.fixture
def refused(handeye: Handeye, tmp_path: Path) -> Refused:
    return Refused(handeye, tmp_path)


def test_no_such_folder(refused: Refused, tmp_path: Path) -> None:
    error = refused(tmp_path / "nowhere")
    assert (error["exit_code"], error["code"]) == (3, "missing_file")


def test_nothing_known_in_the_folder(refused: Refused, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    error = refused(tmp_path / "empty")
    assert (error["exit_code"], error["code"]) == (3, "unknown_format")


@pytest.mark.parametrize("count", [0, 1, 2])
def test_fewer_than_three_views(refused: Refused, tmp_path: Path, count: int) -> None:
    folder = written(made_recording(count), tmp_path / "few")
    error = refused(folder, commands="solve plan")
    assert (error["exit_code"], error["code"]) == (3, "too_few_views")
    assert "at least 3 are needed" in str(error["message"])
    assert "more views" in str(error["hint"])


def test_fewer_than_three_pictures(refused: Refused, set_of_pictures: Path) -> None:
    poses = set_of_pictures / "RobotPosesVec.txt"
    poses.write_text("\n".join(poses.read_text().splitlines()[:2]))
    for name in ("im_03.png", "im_04.png"):
        (set_of_pictures / name).unlink()
    error = refused(set_of_pictures, *PATTERN)
    assert (error["exit_code"], error["code"]) == (3, "too_few_views")


def test_parallel_axes(refused: Refused, tmp_path: Path) -> None:
    folder = written(parallel_recording(), tmp_path / "parallel")
    error = refused(folder, commands="solve validate")
    assert (error["exit_code"], error["code"]) == (4, "degenerate")
    assert "not determined" in str(error["message"])
    assert "across" in str(error["hint"])


def test_reduced_answers_and_says_what_is_open(handeye: Handeye, tmp_path: Path) -> None:
    data = handeye.json("solve", written(parallel_recording(), tmp_path / "parallel"), "--reduced")
    assert data["unobservable"]
    assert "not determined" in data["unobservable"][0]["sentence"]
    assert data["sigma_translation_mm"] > 100


def test_all_views_alike(refused: Refused, tmp_path: Path) -> None:
    recording = made_recording(1)
    view = recording.views[0]
    views = [View(f"v{k}", view.T_base_flange, view.point_ids, view.pixels) for k in range(6)]
    folder = written(recording.with_views(views), tmp_path / "alike")
    error = refused(folder, commands="solve validate")
    assert error["exit_code"] == 4


@pytest.mark.parametrize("spoil", ["image", "pose"])
def test_counts_of_poses_and_images_differ(refused: Refused, set_of_pictures: Path, spoil: str) -> None:
    if spoil == "image":
        (set_of_pictures / "im_02.png").unlink()
    else:
        poses = set_of_pictures / "RobotPosesVec.txt"
        poses.write_text("\n".join(poses.read_text().splitlines()[:-1]))
    error = refused(set_of_pictures, *PATTERN)
    assert (error["exit_code"], error["code"]) == (3, "counts_differ")
    assert "3" in str(error["message"])
    assert "4" in str(error["message"])


ROTATIONS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "scaled": lambda R: 1.01 * R,
    "mirrored": lambda R: R @ np.diag([1, 1, -1]),
    "sheared": lambda R: R @ np.array([[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]),
    "zero": lambda R: 0 * R,
}


@pytest.mark.parametrize("kind", ROTATIONS)
def test_pose_that_is_not_rigid(refused: Refused, set_of_pictures: Path, made: Path, kind: str) -> None:
    poses = set_of_pictures / "RobotPosesVec.txt"
    matrices = np.loadtxt(poses).reshape(-1, 4, 4)
    matrices[2, :3, :3] = ROTATIONS[kind](matrices[2, :3, :3])
    np.savetxt(poses, matrices.reshape(-1, 16))
    error = refused(set_of_pictures, *PATTERN)
    assert (error["exit_code"], error["code"]) == (3, "not_rigid")
    assert "line 3" in str(error["message"])

    toml = made / "recording.toml"
    pose = tomllib.loads(toml.read_text())["view"][1]["T_base_flange"]
    spoiled = np.array(pose)
    spoiled[:3, :3] = ROTATIONS[kind](spoiled[:3, :3])
    for old, new in zip(pose[:3], spoiled[:3].tolist(), strict=True):
        replaced(toml, str(old), str(new))
    error = refused(made)
    assert (error["exit_code"], error["code"]) == (3, "not_rigid")
    assert "view_01" in str(error["message"])


@pytest.mark.parametrize("word", ["nan", "inf", "-inf"])
def test_not_a_number(refused: Refused, set_of_pictures: Path, made: Path, word: str) -> None:
    poses = set_of_pictures / "RobotPosesVec.txt"
    poses.write_text(f"{word} " + poses.read_text().split(maxsplit=1)[1])
    error = refused(set_of_pictures, *PATTERN)
    assert (error["exit_code"], error["code"]) == (3, "not_finite")
    assert "line 1" in str(error["message"])

    good = (made / "recording.toml").read_text()
    first = tomllib.loads(good)["view"][0]["T_base_flange"][0]
    replaced(made / "recording.toml", str(first[3]), word)
    error = refused(made)
    assert (error["exit_code"], error["code"]) == (3, "not_finite")
    assert "view_00" in str(error["message"])

    (made / "recording.toml").write_text(good)
    corners = made / "corners" / "view_03.csv"
    lines = corners.read_text().splitlines()
    lines[5] = f"{lines[5].split(',')[0]},{word},100.0"
    corners.write_text("\n".join(lines) + "\n")
    error = refused(made)
    assert (error["exit_code"], error["code"]) == (3, "not_finite")
    assert "view_03" in str(error["message"])


def test_missing_image(refused: Refused, made: Path) -> None:
    replaced(made / "recording.toml", "[[view]]", '[[view]]\nimage = "images/gone.png"')
    error = refused(made)
    assert (error["exit_code"], error["code"]) == (3, "missing_file")
    assert "images/gone.png" in str(error["message"])


@pytest.mark.parametrize("share", [0.0, 0.001, 0.5, 0.99])
def test_truncated_image(refused: Refused, set_of_pictures: Path, share: float) -> None:
    whole = (set_of_pictures / "im_03.png").read_bytes()
    (set_of_pictures / "im_03.png").write_bytes(whole[: int(len(whole) * share)])
    error = refused(set_of_pictures, *PATTERN, commands="solve import")
    assert error["exit_code"] == 3
    assert "im_03" in str(error["message"])


def test_image_that_is_none(refused: Refused, set_of_pictures: Path) -> None:
    (set_of_pictures / "im_03.png").write_text("a letter")
    error = refused(set_of_pictures, *PATTERN)
    assert error["exit_code"] == 3
    assert "im_03" in str(error["message"])


def test_wrong_pattern_size(refused: Refused, set_of_pictures: Path) -> None:
    error = refused(set_of_pictures, "--rows", "6", "--columns", "9", commands="solve import")
    assert (error["exit_code"], error["code"]) == (5, "not_detected")
    assert "the picture shows another board: Chessboard, 5 x 7 inner corners" in str(error["message"])


def test_pattern_not_given(refused: Refused, set_of_pictures: Path) -> None:
    error = refused(set_of_pictures)
    assert (error["exit_code"], error["code"]) == (3, "pattern_unknown")


def scaled(recording: Recording, factor: float) -> Recording:
    """The recording with the translations of the robot multiplied."""
    views: list[View] = []
    for view in recording.views:
        matrix = view.T_base_flange.matrix.copy()
        matrix[:3, 3] *= factor
        views.append(View(view.name, Pose(matrix), view.point_ids, view.pixels))
    return recording.with_views(views)


def test_millimetres_everywhere_are_warned_of(handeye: Handeye, tmp_path: Path) -> None:
    recording = made_recording(8)
    folder = written(scaled(recording, 1000), tmp_path / "made")
    replaced(folder / "recording.toml", "pitch_m = 0.03", "pitch_m = 30.0")
    replaced(folder / "recording.toml", "[truth]", "[truth_gone]")
    text = (folder / "recording.toml").read_text()
    gone = text.index("[truth_gone]")
    (folder / "recording.toml").write_text(text[:gone] + text[text.index("[[view]]") :])
    outcome = handeye("solve", folder, "--json")
    warnings = outcome.data["warnings"]
    assert any("millimetres" in warning and "robot poses" in warning for warning in warnings)
    assert any("millimetres" in warning and "chessboard" in warning for warning in warnings)


@pytest.mark.parametrize("model", ["auto", "paper"])
def test_millimetres_of_the_robot_alone(handeye: Handeye, tmp_path: Path, model: str) -> None:
    """No answer can be right, and the cause is named."""
    folder = written(scaled(made_recording(8), 1000), tmp_path / "made")
    outcome = handeye("solve", folder, "--model", model, "--json")
    assert outcome.error["code"] == "wrong_unit"
    assert outcome.code == 3
    assert "are these millimetres?" in outcome.data["warnings"][0]
    outcome = handeye("solve", folder, "--model", model)
    assert "are these millimetres?" in " ".join((outcome.out + outcome.err).split())


def test_newer_version(refused: Refused, made: Path) -> None:
    replaced(made / "recording.toml", "version = 1", "version = 3")
    error = refused(made)
    assert (error["exit_code"], error["code"]) == (3, "newer_version")
    assert "update handeye" in str(error["hint"])


def test_recording_cut_off(refused: Refused, made: Path) -> None:
    text = (made / "recording.toml").read_text()
    last = text.rindex("[[view]]")
    (made / "recording.toml").write_text(text[:last])
    error = refused(made)
    assert (error["exit_code"], error["code"]) == (3, "truncated")


def test_path_out_of_the_folder(refused: Refused, made: Path) -> None:
    replaced(made / "recording.toml", "corners/view_00.csv", "../secret.csv")
    error = refused(made)
    assert (error["exit_code"], error["code"]) == (3, "path_outside")


def test_options_that_a_recording_does_not_need(refused: Refused, made: Path) -> None:
    error = refused(made, *PATTERN)
    assert (error["exit_code"], error["code"]) == (3, "options_unused")


@pytest.mark.parametrize(
    "options",
    [("--rows", "5"), ("--pitch-mm", "3"), ("--target", "t.toml", "--rows", "3", "--columns", "4")],
)
def test_half_a_pattern(refused: Refused, made: Path, options: tuple[str, ...]) -> None:
    error = refused(made, *options)
    assert (error["exit_code"], error["code"]) == (2, "usage")
