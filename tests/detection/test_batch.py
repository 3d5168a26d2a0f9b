"""Many images: one that fails stops nothing, and nothing is done twice."""

import numpy as np
import pytest

from handeye.detection import Detection, DetectionCache, Image, Reason, detect_all
from handeye.errors import DetectionError, HandeyeError, InputError
from scenes import TARGETS, scene

BOARD = scene(TARGETS["charuco"])
BLANK = np.full((100, 120), 120, dtype=np.uint8)


def missing() -> Image:
    raise InputError("im_3.png: no such file", code="not_found")


def test_each_image_has_its_outcome() -> None:
    picture = BOARD.picture()
    told: list[tuple[str, Detection | HandeyeError]] = []
    batch = detect_all(
        [("im_1", lambda: picture), ("im_2", lambda: BLANK), ("im_3", missing), ("im_4", lambda: picture)],
        BOARD.target,
        progress=lambda name, outcome: told.append((name, outcome)),
    )
    assert list(batch.found) == ["im_1", "im_4"]
    assert [name for name, _ in told] == ["im_1", "im_2", "im_3", "im_4"]
    assert isinstance(batch.failed["im_2"], DetectionError)
    assert batch.failed["im_2"].code == Reason.LOW_CONTRAST
    assert isinstance(batch.failed["im_3"], InputError)
    batch.raise_if_none()


def test_none_at_all_is_an_error_with_an_example() -> None:
    batch = detect_all([("im_1", lambda: BLANK)], BOARD.target)
    with pytest.raises(DetectionError, match=r"none of 1 images; im_1: target not found") as caught:
        batch.raise_if_none()
    assert caught.value.hint
    with pytest.raises(DetectionError, match="none of 0 images"):
        detect_all([], BOARD.target).raise_if_none()


def test_the_cache_knows_content_target_and_size() -> None:
    cache = DetectionCache()
    picture = BOARD.picture()
    first = cache.detect(picture, BOARD.target)
    assert cache.detect(picture.copy(), BOARD.target) is first
    assert len(cache) == 1
    cache.detect(BLANK, BOARD.target)
    cache.detect(BLANK.reshape(120, 100), BOARD.target)
    cache.detect(BLANK, TARGETS["april grid"])
    assert len(cache) == 4


def test_the_number_of_workers_changes_nothing() -> None:
    pictures = {
        f"im_{k}": scene(TARGETS["chessboard"], turn=(0.1 * k, 0.2, 0.1)).picture(k) for k in range(5)
    }
    images = [(name, lambda picture=picture: picture) for name, picture in pictures.items()]
    one, many = (detect_all(images, TARGETS["chessboard"], workers=workers) for workers in (1, 4))
    assert list(one.found) == list(many.found) == list(pictures)
    for name in pictures:
        np.testing.assert_array_equal(one.found[name].pixels, many.found[name].pixels)


def test_what_progress_raises_ends_the_work() -> None:
    asked: list[int] = []

    def load(k: int) -> Image:
        asked.append(k)
        return BLANK

    def stop(name: str, _: object) -> None:
        if name == "im_1":
            raise KeyboardInterrupt

    images = [(f"im_{k}", lambda k=k: load(k)) for k in range(100)]
    with pytest.raises(KeyboardInterrupt):
        detect_all(images, BOARD.target, progress=stop, workers=2)
    assert len(asked) < 50
