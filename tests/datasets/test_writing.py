"""Nothing half written, whatever the system refuses and whenever."""

import errno
import io
import os
import resource
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from datasets.layouts import everything_below, names_in, png, some_recording
from handeye.datasets import read_recording, write_recording
from handeye.datasets.writing import replace_file
from handeye.errors import OutputError
from handeye.types import Recording


class Disk:
    """Lets the system refuse the n-th step that changes something."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, fail_at: int, error: BaseException) -> None:
        self.steps = 0
        self.fail_at = fail_at
        self.error = error
        for name in ("fsync", "mkdir", "rename", "replace", "rmdir"):
            monkeypatch.setattr(os, name, self._counted(getattr(os, name)))
        monkeypatch.setattr(io, "open", self._opened(io.open))

    def _step(self) -> None:
        self.steps += 1
        if self.steps == self.fail_at:
            raise self.error

    def _counted(self, system_call: Any) -> Any:
        def call(*args: Any, **kwargs: Any) -> Any:
            if system_call.__name__ != "mkdir" or not Path(args[0]).exists():
                self._step()
            return system_call(*args, **kwargs)

        return call

    def _opened(self, system_open: Any) -> Any:
        def call(file: Any, mode: str = "r", *args: Any, **kwargs: Any) -> Any:
            if "x" in mode or "w" in mode:
                self._step()
            return system_open(file, mode, *args, **kwargs)

        return call


FULL = OSError(errno.ENOSPC, "No space left on device")


def prepare(parent: Path) -> tuple[Recording, Path]:
    for k in range(2):
        png(parent / "camera" / "pictures" / f"{k}.png")
    return some_recording(2, images=True), parent / "camera"


@pytest.mark.parametrize("error", [FULL, KeyboardInterrupt()], ids=["full", "interrupted"])
def test_a_new_recording_is_whole_or_not_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    recording, images = prepare(tmp_path)
    before = everything_below(tmp_path)
    fail_at = 0
    while True:
        fail_at += 1
        with monkeypatch.context() as patch:
            disk = Disk(patch, fail_at, error)
            try:
                write_recording(recording, tmp_path / "rec", images_from=images)
            except (OutputError, KeyboardInterrupt) as caught:
                outcome: BaseException | None = caught
            else:
                outcome = None
        if outcome is None:
            assert fail_at - 1 <= disk.steps <= fail_at  # the last step only hastens what is done
            break
        assert isinstance(outcome, KeyboardInterrupt if isinstance(error, KeyboardInterrupt) else OutputError)
        if (tmp_path / "rec").exists():  # only bringing the name to the disk failed
            assert len(read_recording(tmp_path / "rec").recording) == 2
            assert disk.steps > 10
            for path in sorted((tmp_path / "rec").rglob("*"), reverse=True):
                path.unlink() if path.is_file() else path.rmdir()
            (tmp_path / "rec").rmdir()
        assert everything_below(tmp_path) == before
        assert names_in(tmp_path) == ["camera"]
    assert fail_at > 10
    assert len(read_recording(tmp_path / "rec").recording) == 2


@pytest.mark.parametrize("error", [FULL, KeyboardInterrupt()], ids=["full", "interrupted"])
def test_an_update_leaves_the_old_or_the_new_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    old, images = prepare(tmp_path)
    folder = tmp_path / "rec"
    write_recording(old, folder, images_from=images)
    old = read_recording(folder).recording
    new = some_recording(3).with_views([*some_recording(3).views[1:]])
    outcomes: set[str] = set()
    for fail_at in range(1, 100):
        with monkeypatch.context() as patch:
            Disk(patch, fail_at, error)
            try:
                write_recording(new, folder, replace=True)
            except (OutputError, KeyboardInterrupt):
                done = False
            else:
                done = True
        found = read_recording(folder).recording
        assert found in {old, new}
        outcomes.add("old" if found == old else "new")
        if done:
            assert found == new
            break
        assert not [name for name in everything_below(folder) if "partial" in name]
    assert outcomes == {"old", "new"}


@contextmanager
def largest_file(size: int) -> Iterator[None]:
    """Let the system itself refuse files above a size."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.skipif(sys.platform == "win32", reason="the limit is one of POSIX")
def test_the_system_refuses_in_earnest(tmp_path: Path) -> None:
    with largest_file(500), pytest.raises(OutputError) as caught:
        write_recording(some_recording(), tmp_path / "rec")
    assert caught.value.hint is not None
    assert names_in(tmp_path) == []


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="/proc is where even root may not write")
def test_a_place_where_nobody_may_write(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        write_recording(some_recording(), "/proc/self/rec")


@pytest.mark.skipif(hasattr(os, "geteuid") and os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_folder(tmp_path: Path) -> None:
    (tmp_path / "locked").mkdir(mode=0o500)
    with pytest.raises(OutputError, match="permission denied"):
        write_recording(some_recording(), tmp_path / "locked" / "rec")


def test_unusable_places(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("precious")
    file = tmp_path / "file"
    for place in (tmp_path / "no" / "rec", file, file / "rec", tmp_path / ("x" * 300), "a\0b"):
        for replace in (False, True):
            with pytest.raises(OutputError):
                write_recording(some_recording(), place, replace=replace)
    assert everything_below(tmp_path) == {"file": b"precious"}
    assert names_in(tmp_path) == ["file"]


def test_an_empty_folder_is_taken(tmp_path: Path) -> None:
    (tmp_path / "rec").mkdir()
    write_recording(some_recording(), tmp_path / "rec")
    assert read_recording(tmp_path / "rec").recording == some_recording()


def test_a_new_folder_is_as_open_as_the_user_wants(tmp_path: Path) -> None:
    (tmp_path / "usual").mkdir()
    write_recording(some_recording(), tmp_path / "rec")
    assert (tmp_path / "rec").stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_a_file_is_replaced_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.txt"
    replace_file(path, b"old")
    for fail_at in (1, 2, 3):
        with monkeypatch.context() as patch:
            Disk(patch, fail_at, FULL)
            with pytest.raises(OutputError, match="no space left"):
                replace_file(path, b"new")
        assert everything_below(tmp_path) == {"a.txt": b"old"}
    replace_file(path, b"new")
    assert path.read_bytes() == b"new"
