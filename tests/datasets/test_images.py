"""Images that claim more than they hold are refused before they fill the memory."""

import struct
import tracemalloc
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from handeye.datasets.images import MAX_BYTES, read_image
from handeye.errors import InputError


def claimed_png(path: Path, width: int, height: int) -> Path:
    """A PNG of few bytes whose header says it is large."""
    header = struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"IDAT", zlib.compress(bytes(1000))), (b"IEND", b"")]
    content = b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + content)
    return path


def test_a_small_file_of_very_many_pixels_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"16000 x 16000 pixels in \d+ bytes") as caught:
        read_image(claimed_png(tmp_path / "large.png", 16000, 16000))
    assert caught.value.code == "too_large"


def test_a_blank_picture_of_an_ordinary_camera_is_read(tmp_path: Path) -> None:
    for suffix in (".png", ".jpg"):
        path = tmp_path / f"dark{suffix}"
        assert cv2.imwrite(str(path), np.zeros((3000, 4000), dtype=np.uint8))
        assert read_image(path).shape == (3000, 4000)


def test_a_jpeg_of_very_many_scans_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "scans.jpg"
    assert cv2.imwrite(str(path), np.zeros((64, 64), dtype=np.uint8))
    content = path.read_bytes()
    path.write_bytes(content[:-2] + 101 * b"\xff\xda\x00\x08\x01\x01\x00\x00\x3f\x00\x00" + content[-2:])
    with pytest.raises(InputError, match="102 scans") as caught:
        read_image(path)
    assert caught.value.code == "too_large"


def test_sixteen_bits_become_eight_by_a_power_of_two(tmp_path: Path) -> None:
    grey = np.arange(4096, dtype=np.uint16).reshape(64, 64)
    assert cv2.imwrite(str(tmp_path / "deep.png"), grey)
    np.testing.assert_array_equal(read_image(tmp_path / "deep.png"), (grey >> 4).astype(np.uint8))


def test_reading_reserves_no_more_than_the_file_has(tmp_path: Path) -> None:
    path = tmp_path / "small.png"
    assert cv2.imwrite(str(path), np.zeros((8, 8), dtype=np.uint8))
    tracemalloc.start()
    try:
        read_image(path)
        assert tracemalloc.get_traced_memory()[1] < MAX_BYTES / 100
    finally:
        tracemalloc.stop()
