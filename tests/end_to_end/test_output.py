"""Places that cannot be written to: a clear error, exit code 7, and whatever was there is as it was."""

import resource
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from commands import Handeye
from folders import made_recording, written

BINARY = Path(sys.executable).parent / "handeye"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(made_recording(6), tmp_path_factory.mktemp("made") / "made")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("command", ["solve", "plan", "validate"])
def test_output_that_is_a_folder_or_has_none(
    handeye: Handeye, folder: Path, tmp_path: Path, command: str
) -> None:
    for output in (tmp_path, tmp_path / "nowhere" / "answer.json"):
        error = handeye.fails(command, folder, "--output", output)
        assert error["exit_code"] == 7
    assert names(tmp_path) == []


def test_import_over_something(handeye: Handeye, folder: Path, tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "mine.txt").write_text("mine")
    error = handeye.fails("import", folder, tmp_path / "there")
    assert (error["exit_code"], error["code"]) == (7, "exists")
    assert names(tmp_path / "there") == ["mine.txt"]
    assert handeye.fails("import", folder, tmp_path / "a" / "b")["exit_code"] == 7
    assert names(tmp_path) == ["there"]


def test_picture_of_unknown_kind(handeye: Handeye, tmp_path: Path) -> None:
    error = handeye.fails("demo", "--picture", tmp_path / "picture.doc")
    assert (error["exit_code"], error["code"]) == (7, "unknown_format")
    assert names(tmp_path) == []


@pytest.mark.skipif(
    not Path("/sys/kernel").is_dir(), reason="there is no file system here that refuses everyone"
)
def test_place_that_refuses_everyone(handeye: Handeye, folder: Path) -> None:
    error = handeye.fails("solve", folder, "--output", "/sys/kernel/answer.json")
    assert error["exit_code"] == 7
    assert "cannot be written" in error["message"]
    assert handeye.fails("import", folder, "/sys/kernel/recording")["exit_code"] == 7


def limited(size: int, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run with files limited in size: to a program, that is a disk that becomes full."""
    return subprocess.run(
        [BINARY, *arguments],
        check=False,
        capture_output=True,
        text=True,
        timeout=120,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size)),
    )


def test_disk_becomes_full(folder: Path, tmp_path: Path) -> None:
    outcome = limited(1000, "import", folder, tmp_path / "new")
    assert outcome.returncode == 7, outcome.stderr
    assert "cannot be written" in outcome.stderr
    assert names(tmp_path) == []

    (tmp_path / "answer.json").write_text("old")
    outcome = limited(1000, "solve", folder, "--output", tmp_path / "answer.json")
    assert outcome.returncode == 7, outcome.stderr
    assert names(tmp_path) == ["answer.json"]
    assert (tmp_path / "answer.json").read_text() == "old"


def mounted(place: Path, *options: str) -> bool:
    if shutil.which("mount") is None:
        return False
    command = ["mount", "-t", "tmpfs", *options, "tmpfs", str(place)]
    return subprocess.run(command, check=False, capture_output=True).returncode == 0


@pytest.fixture
def tiny_disk(tmp_path: Path) -> Iterator[Path]:
    place = tmp_path / "disk"
    place.mkdir()
    if not mounted(place, "-o", "size=16k"):
        pytest.skip("a tiny disk cannot be mounted here")
    yield place
    subprocess.run(["umount", str(place)], check=True)


def test_full_disk(handeye: Handeye, folder: Path, tiny_disk: Path) -> None:
    error = handeye.fails("import", folder, tiny_disk / "new")
    assert error["exit_code"] == 7
    assert "no space left" in error["message"]
    assert names(tiny_disk) == []


def test_read_only_disk(handeye: Handeye, folder: Path, tiny_disk: Path) -> None:
    subprocess.run(["mount", "-o", "remount,ro", str(tiny_disk)], check=True)
    for arguments in (
        ("solve", folder, "--output", tiny_disk / "a.json"),
        ("import", folder, tiny_disk / "new"),
    ):
        error = handeye.fails(*arguments)
        assert error["exit_code"] == 7
        assert "read-only" in error["message"]
    assert names(tiny_disk) == []
