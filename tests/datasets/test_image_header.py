"""Sizes from headers, and files that break off."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from datasets.layouts import png
from handeye.datasets.image_header import image_size
from handeye.errors import InputError
from strategies import mutated

PICTURE = np.random.default_rng(5).integers(0, 255, (48, 64, 3), dtype=np.uint8)
GREY = PICTURE[:, :, 0]
KINDS = (".png", ".jpg", ".bmp", ".tiff", ".webp", ".ppm", ".jp2", ".ras")
ENCODED = {suffix: cv2.imencode(suffix, PICTURE)[1].tobytes() for suffix in KINDS}
ENCODED[".pgm"] = cv2.imencode(".pgm", GREY)[1].tobytes()


@pytest.mark.parametrize(
    "suffix",
    [".png", ".jpg", ".jpeg", ".JPG", ".jpe", ".bmp", ".dib", ".webp", ".pnm", ".jp2", ".ras", ".sr"],
)
@pytest.mark.parametrize("picture", [PICTURE, GREY], ids=["colour", "grey"])
def test_sizes(tmp_path: Path, suffix: str, picture: np.ndarray) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(cv2.imencode(suffix.lower(), picture)[1].tobytes())
    assert image_size(path) == (64, 48)


def test_progressive_jpeg(tmp_path: Path) -> None:
    path = tmp_path / "a.jpg"
    path.write_bytes(cv2.imencode(".jpg", PICTURE, [cv2.IMWRITE_JPEG_PROGRESSIVE, 1])[1].tobytes())
    assert image_size(path) == (64, 48)


def test_unknown_formats_are_left_to_the_decoder(tmp_path: Path) -> None:
    path = tmp_path / "a.tiff"
    path.write_bytes(ENCODED[".tiff"])
    assert image_size(path) is None


@pytest.mark.parametrize("lossless", [False, True])
def test_webp_of_both_kinds(tmp_path: Path, lossless: bool) -> None:
    path = tmp_path / "a.webp"
    quality = 101 if lossless else 80
    path.write_bytes(cv2.imencode(".webp", PICTURE, [cv2.IMWRITE_WEBP_QUALITY, quality])[1].tobytes())
    assert image_size(path) == (64, 48)


@pytest.mark.parametrize(
    ("content", "size"),
    [
        (b"P5\n# a comment\n3 2\n# another\n255\n" + bytes(6), (3, 2)),
        (b"P5 3 2 1023\n" + bytes(12), (3, 2)),
        (b"P2\n2 2\n9\n1 2 3 4\n", (2, 2)),
        (b"P4 9 2\n" + bytes(4), (9, 2)),
        (b"P5 3 2 1023\n" + bytes(6), None),
        (b"P5 3 2 70000\n" + bytes(12), None),
        (b"P5 -3 2 255\n" + bytes(12), None),
        (b"P7 3 2 255\n" + bytes(12), None),
        (b"P5 " + b"9" * 5000 + b" 2 255\n", None),
    ],
)
def test_pgm(tmp_path: Path, content: bytes, size: tuple[int, int] | None) -> None:
    path = tmp_path / "a.pgm"
    path.write_bytes(content)
    if size is not None:
        assert image_size(path) == size
        return
    with pytest.raises(InputError):
        image_size(path)


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".bmp", ".webp", ".ppm", ".pgm", ".ras"])
def test_every_truncation_is_noticed(tmp_path: Path, suffix: str) -> None:
    content = ENCODED[suffix]
    for length in {*range(0, len(content) - 4, 97), 1, 2, 7, 8, 20, 33, len(content) // 2, len(content) - 9}:
        path = tmp_path / f"a{suffix}"
        path.write_bytes(content[:length])
        with pytest.raises(InputError) as caught:
            image_size(path)
        assert caught.value.code in {"truncated_image", "not_an_image"}


@given(st.sampled_from(sorted(set(ENCODED) - {".tiff"})), st.data())
def test_hostile_files_raise_only_our_error(tmp_path: Path, suffix: str, data: st.DataObject) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(data.draw(mutated(ENCODED[suffix]) | st.binary(max_size=200)))
    try:
        size = image_size(path)
    except InputError:
        return
    assert size is not None
    assert min(size) > 0


def test_a_renamed_image_and_no_image(tmp_path: Path) -> None:
    png(tmp_path / "a.png").rename(tmp_path / "a.jpg")
    with pytest.raises(InputError, match="not a JPEG"):
        image_size(tmp_path / "a.jpg")
    for missing in ("b.png", "."):
        with pytest.raises(InputError):
            image_size(tmp_path / "folder.png" / missing)
