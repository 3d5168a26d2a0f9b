"""Reading an image as grey values, without trusting the file."""

import struct
from io import BytesIO
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye.codes import Code
from handeye.datasets.image_header import IMAGE_SUFFIXES, image_size, size_in
from handeye.datasets.reading import MIB, read_bytes
from handeye.errors import InputError
from handeye.types.camera import MAX_PIXELS

MAX_BYTES = 512 * MIB
# A camera's picture has no more pixels than this for each byte of its file. Smaller ones than `ALWAYS_PIXELS`
# may: they cannot fill the memory.
PIXELS_PER_BYTE, ALWAYS_PIXELS = 100, 1 << 24
# A progressive JPEG has about ten scans; each costs as much as decoding the whole picture.
MAX_SCANS = 100
_TIFF_WIDTH, _TIFF_HEIGHT = 256, 257
_FLAGS = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION


def read_image(path: Path) -> NDArray[np.uint8]:
    """Return the grey values (H, W) of an image: PNG, JPEG, BMP, TIFF, PGM, WebP and what else OpenCV reads.

    Colour becomes grey. 10, 12 and 14 bits kept in 16 are told by the brightest pixel and scaled to 8 by the
    same power of two. An orientation noted in the file is ignored: pixels are those of the sensor.

    Raises
    ------
    InputError
        No such file, not an image, truncated or damaged, or too large; the message names the file.
    """
    if path.suffix.lower() not in IMAGE_SUFFIXES:
        raise InputError(
            f"{path}: expected an image ({', '.join(sorted(IMAGE_SUFFIXES))})", code=Code.NOT_AN_IMAGE
        )
    content = read_bytes(path, MAX_BYTES)
    return decoded(content, path.suffix.lower(), str(path), image_size(path) or _tiff_size(content, path))


def decoded(
    content: bytes, suffix: str, where: str, size: tuple[int, int] | None = None
) -> NDArray[np.uint8]:
    """Return the grey values (H, W) of a picture as a camera or a person saved it.

    Parameters
    ----------
    content
        The bytes of its file.
    suffix
        What kind of file it is, such as `.png`.
    where
        What to call it in a message.
    size
        Width and height that its header says, if they are known.

    Raises
    ------
    InputError
        As `read_image`.
    """
    # Sizes are looked at before anything is decoded: a small file can claim to be a very large image.
    width, height = size or size_in(BytesIO(content), suffix, where)
    if width * height > MAX_PIXELS:
        raise InputError(
            f"{where}: {width} x {height} pixels, expected at most {MAX_PIXELS}", code=Code.TOO_LARGE
        )
    if width * height > max(ALWAYS_PIXELS, PIXELS_PER_BYTE * len(content)):
        raise InputError(
            f"{where}: {width} x {height} pixels in {len(content)} bytes, which no camera's picture has",
            code=Code.TOO_LARGE,
            hint="check what this file is",
        )
    scans = content.count(b"\xff\xda") if suffix in {".jpg", ".jpeg"} else 1
    if scans > MAX_SCANS:
        raise InputError(
            f"{where}: a JPEG image of {scans} scans, expected at most {MAX_SCANS}",
            code=Code.TOO_LARGE,
            hint="save the image again without progressive encoding",
        )
    try:
        image = cv2.imdecode(np.frombuffer(content, dtype=np.uint8), _FLAGS)
    except cv2.error as error:
        raise _damaged(where, str(error).strip()[:200]) from error
    if image is None:
        raise _damaged(where, "it cannot be decoded")
    if image.shape != (height, width):
        found = f"{image.shape[1]} x {image.shape[0]} pixels where its header says {width} x {height}"
        raise _damaged(where, found)
    return eight_bits(image, where)


def eight_bits(image: NDArray[np.integer[Any] | np.floating[Any]], where: str) -> NDArray[np.uint8]:
    """Return grey values (H, W) of 8 bits; those of 16 bits are shifted in place.

    Raises
    ------
    InputError
        Values of another kind.
    """
    if image.dtype == np.uint8:
        return np.ascontiguousarray(image, dtype=np.uint8)
    if image.dtype != np.uint16:
        raise InputError(
            f"{where}: pixels of {image.dtype}, expected 8 or 16 bits",
            code=Code.NOT_AN_IMAGE,
            hint="save the image with whole grey values",
        )
    bits = max(int(image.max()).bit_length(), 8)
    # In place: a large picture is in the memory once more, as bytes, and not three times.
    np.right_shift(image, bits - 8, out=image)
    return image.astype(np.uint8)


def _damaged(where: str, found: str) -> InputError:
    return InputError(
        f"{where}: a damaged image: {found}", code=Code.DAMAGED_IMAGE, hint="copy the file again"
    )


def _tiff_size(content: bytes, path: Path) -> tuple[int, int]:
    """Return width and height of the first picture of a TIFF file (TIFF 6.0, sections 2 and 8).

    Raises
    ------
    InputError
        Not a TIFF file, or it breaks off.
    """
    order = {b"II*\0": "<", b"MM\0*": ">"}.get(content[:4])
    if order is None:
        raise InputError(f"{path}: not a TIFF image", code=Code.NOT_AN_IMAGE, hint="check what this file is")
    sizes: dict[int, int] = {}
    try:
        (start,) = struct.unpack_from(f"{order}I", content, 4)
        (entries,) = struct.unpack_from(f"{order}H", content, start)
        for index in range(entries):
            at = start + 2 + 12 * index
            tag, kind, _ = struct.unpack_from(f"{order}HHI", content, at)
            if tag in {_TIFF_WIDTH, _TIFF_HEIGHT}:
                (sizes[tag],) = struct.unpack_from(order + ("H" if kind == 3 else "I"), content, at + 8)
    except struct.error as error:
        raise InputError(
            f"{path}: the image is truncated", code=Code.TRUNCATED_IMAGE, hint="copy the file again"
        ) from error
    if len(sizes) < 2:
        raise InputError(f"{path}: a TIFF image without size", code=Code.NOT_AN_IMAGE)
    return sizes[_TIFF_WIDTH], sizes[_TIFF_HEIGHT]
