"""A watched folder gives pictures that came after they were asked for, each once."""

import os
import shutil
import threading
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from datasets.test_images import claimed_png
from handeye.cameras.folder import SETTLED_S, WatchedFolder
from handeye.cameras.protocol import Grey
from handeye.datasets.images import read_image
from handeye.errors import DeviceError

RANDOM = np.random.default_rng(0)


def picture() -> Grey:
    return RANDOM.integers(0, 256, (30, 40), dtype=np.uint8)


def save(path: Path, image: Grey) -> None:
    assert cv2.imwrite(str(path), image)


def taken(camera: WatchedFolder, *later: Callable[[], object]) -> Grey:
    """Ask for a picture; then let things happen, one after the other."""
    asked = threading.Event()
    camera._announce = lambda _: asked.set()  # pyright: ignore[reportPrivateUsage]

    def happen() -> None:
        asked.wait()
        for one in later:
            one()

    thread = threading.Thread(target=happen)
    thread.start()
    try:
        frame = camera.grab("view_01.1")
    finally:
        thread.join()
    assert frame.image is not None
    return frame.image


def nothing(camera: WatchedFolder, *later: Callable[[], object], why: str = "") -> None:
    with pytest.raises(DeviceError) as error:
        taken(camera, *later)
    assert error.value.code == "timeout"
    assert why in error.value.message


def test_what_lay_there_before_the_question_is_never_taken(tmp_path: Path) -> None:
    camera = WatchedFolder(tmp_path, read_image, patience_s=0.6)
    save(tmp_path / "before.png", picture())
    nothing(camera)
    time.sleep(1.1 * SETTLED_S)
    nothing(camera)
    camera = WatchedFolder(tmp_path, read_image, patience_s=20.0)
    new = picture()
    assert np.array_equal(taken(camera, lambda: save(tmp_path / "new.png", new)), new)


def test_a_picture_saved_again_under_its_name_is_seen(tmp_path: Path) -> None:
    camera = WatchedFolder(tmp_path, read_image, patience_s=20.0)
    path = tmp_path / "latest.png"
    for _ in range(3):
        new = picture()
        assert np.array_equal(taken(camera, lambda new=new: save(path, new)), new)
        time.sleep(1.1 * SETTLED_S)


def test_a_picture_renamed_into_place_is_seen(tmp_path: Path) -> None:
    camera = WatchedFolder(tmp_path, read_image, patience_s=20.0)
    new = picture()
    (tmp_path / "sub").mkdir()
    save(tmp_path / "sub" / "part.png", new)
    found = taken(camera, lambda: (tmp_path / "sub" / "part.png").rename(tmp_path / "a.png"))
    assert np.array_equal(found, new)


def test_the_same_picture_is_taken_once(tmp_path: Path) -> None:
    camera = WatchedFolder(tmp_path, read_image, patience_s=1.0)
    one = picture()
    first, again = tmp_path / "a.png", tmp_path / "b.png"
    assert np.array_equal(taken(camera, lambda: save(first, one)), one)
    # A copy, the same file written again, and the same picture in another format.
    nothing(camera, lambda: again.write_bytes(first.read_bytes()), why="b.png holds a picture")
    nothing(camera, lambda: save(first, one), why="a.png holds a picture")
    nothing(camera, lambda: save(tmp_path / "a.jpg", one), why="a.png in another format")


def test_a_picture_of_earlier_that_is_copied_in_is_passed_over(tmp_path: Path) -> None:
    (tmp_path / "store").mkdir()
    old = tmp_path / "store" / "old.png"
    save(old, picture())
    os.utime(old, (time.time() - 60, time.time() - 60))
    camera = WatchedFolder(tmp_path, read_image, patience_s=0.8)
    nothing(camera, lambda: shutil.copy2(old, tmp_path / "old.png"), why="older than the question")


def test_what_is_being_written_when_it_is_asked_for_was_exposed_before(tmp_path: Path) -> None:
    camera = WatchedFolder(tmp_path, read_image, patience_s=1.0)
    save(tmp_path / "whole.png", picture())
    content = (tmp_path / "whole.png").read_bytes()
    part = tmp_path / "part.png"
    part.write_bytes(content[:100])
    nothing(camera, lambda: part.write_bytes(content), why="was being written")


def test_a_picture_that_grows_is_waited_for(tmp_path: Path) -> None:
    new = picture()
    save(tmp_path / "whole.png", new)
    content = (tmp_path / "whole.png").read_bytes()
    (tmp_path / "whole.png").unlink()
    camera = WatchedFolder(tmp_path, read_image, patience_s=20.0)

    def slowly() -> None:
        for i in range(1, 11):
            (tmp_path / "slow.png").write_bytes(content[: len(content) * i // 10])
            time.sleep(0.4 * SETTLED_S)

    assert np.array_equal(taken(camera, slowly), new)


def test_what_is_no_picture_and_a_folder_that_is_gone(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    camera = WatchedFolder(folder, read_image, patience_s=5.0)
    with pytest.raises(DeviceError) as error:
        taken(camera, lambda: (folder / "broken.png").write_bytes(b"no picture"))
    assert error.value.code == "bad_image"
    shutil.rmtree(folder)
    with pytest.raises(DeviceError) as error:
        camera.grab("view_01.1")
    assert error.value.code == "folder_gone"


def test_files_too_large_for_a_picture_are_passed_over_unread(tmp_path: Path) -> None:
    def sparse() -> None:
        with (tmp_path / "huge.png").open("wb") as file:
            file.truncate(1 << 30)

    nothing(WatchedFolder(tmp_path, read_image, patience_s=1.0), sparse, why="has 1073741824 bytes")


def test_a_small_file_that_says_it_is_a_huge_picture_is_refused(tmp_path: Path) -> None:
    camera = WatchedFolder(tmp_path, read_image, patience_s=5.0)
    with pytest.raises(DeviceError, match="which no camera's picture has") as error:
        taken(camera, lambda: claimed_png(tmp_path / "bomb.png", 16000, 16000))
    assert error.value.code == "bad_image"
