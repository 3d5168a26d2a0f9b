"""Pictures that are written come back bit for bit."""

import cv2
import numpy as np
import pytest

from handeye.datasets.png_writing import png_bytes


@pytest.mark.parametrize("size", [(1, 1), (3, 70000), (480, 641), (1024, 1280)])
def test_a_picture_comes_back_bit_for_bit(size: tuple[int, int]) -> None:
    grey = np.random.default_rng(0).integers(0, 256, size, dtype=np.uint8)
    read = cv2.imdecode(np.frombuffer(png_bytes(grey), np.uint8), cv2.IMREAD_UNCHANGED)
    assert read is not None
    assert read.dtype == np.uint8
    assert np.array_equal(read, grey)


def test_lines_may_lie_anywhere_in_memory() -> None:
    grey = np.random.default_rng(1).integers(0, 256, (40, 60), dtype=np.uint8)
    assert png_bytes(grey[::-2, ::3]) == png_bytes(np.ascontiguousarray(grey[::-2, ::3]))
    assert png_bytes(grey.T) == png_bytes(np.ascontiguousarray(grey.T))


def test_nothing_is_no_picture() -> None:
    with pytest.raises(ValueError, match="0 x 3"):
        png_bytes(np.zeros((3, 0), np.uint8))
