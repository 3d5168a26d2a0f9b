"""Size of an image from its first bytes, and whether the file is complete. Nothing is decoded.

PNG: W3C PNG specification, 3rd edition, sections 5 and 11. JPEG: ITU-T T.81, annex B. BMP: BITMAPINFOHEADER.
"""

import os
import struct
from pathlib import Path
from typing import BinaryIO

from handeye.datasets.reading import reason
from handeye.errors import InputError

# What importers take for an image; of TIFF only the name is looked at.
IMAGE_SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"})
MAX_SIDE = 100_000
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_MAX_CHUNKS = 1_000_000
# Start-of-frame markers of JPEG; C4, C8 and CC are something else.
_JPEG_FRAMES = frozenset({*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC})
_JPEG_TAIL = 1 << 16


def image_size(path: Path) -> tuple[int, int] | None:
    """Return width and height in pixels of a complete image file; None where the format is not known here.

    Raises
    ------
    InputError
        The file cannot be read, is truncated, or is not the image that its name says.
    """
    read = {".png": _png_size, ".jpg": _jpeg_size, ".jpeg": _jpeg_size, ".bmp": _bmp_size}.get(
        path.suffix.lower()
    )
    if read is None:
        return None
    if not path.is_file():
        raise InputError(f"{path}: not a regular file", code="unreadable")
    try:
        with path.open("rb") as file:
            width, height = read(file)
    except OSError as error:
        raise InputError(f"{path}: {reason(error)}", code="unreadable") from error
    except (EOFError, struct.error) as error:
        raise InputError(
            f"{path}: the image is truncated", code="truncated_image", hint="copy the file again"
        ) from error
    except ValueError as error:
        raise InputError(f"{path}: {error}", code="not_an_image", hint="check what this file is") from error
    if not (0 < width <= MAX_SIDE and 0 < height <= MAX_SIDE):
        raise InputError(f"{path}: an image of {width} x {height} pixels", code="not_an_image")
    return width, height


def _exactly(file: BinaryIO, count: int) -> bytes:
    content = file.read(count)
    if len(content) < count:
        raise EOFError
    return content


def _png_size(file: BinaryIO) -> tuple[int, int]:
    """Walk over all chunks to the end mark."""
    if file.read(8) != _PNG_SIGNATURE:
        raise ValueError("not a PNG image")
    length, kind = struct.unpack(">I4s", _exactly(file, 8))
    if kind != b"IHDR" or length != 13:
        raise ValueError("a PNG image without header")
    width, height = struct.unpack(">II", _exactly(file, 8))
    file.seek(5 + 4, os.SEEK_CUR)
    for _ in range(_MAX_CHUNKS):
        length, kind = struct.unpack(">I4s", _exactly(file, 8))
        if kind == b"IEND":
            return width, height
        file.seek(length + 4, os.SEEK_CUR)
    raise ValueError("a PNG image without end")


def _jpeg_size(file: BinaryIO) -> tuple[int, int]:
    """Walk over the segments to the frame header, then look for the end mark."""
    if file.read(2) != b"\xff\xd8":
        raise ValueError("not a JPEG image")
    for _ in range(_MAX_CHUNKS):
        if _exactly(file, 1) != b"\xff":
            raise ValueError("a JPEG image with a broken segment")
        marker = 0xFF
        while marker == 0xFF:  # fill bytes
            marker = _exactly(file, 1)[0]
        (length,) = struct.unpack(">H", _exactly(file, 2))
        if marker in _JPEG_FRAMES:
            _, height, width = struct.unpack(">BHH", _exactly(file, 5))
            break
        if marker == 0xDA or length < 2:
            raise ValueError("a JPEG image without frame header")
        file.seek(length - 2, os.SEEK_CUR)
    else:
        raise ValueError("a JPEG image without frame header")
    start = file.tell()
    end = file.seek(0, os.SEEK_END)
    file.seek(max(start, end - _JPEG_TAIL))
    if b"\xff\xd9" not in file.read(_JPEG_TAIL):
        raise EOFError
    return width, height


def _bmp_size(file: BinaryIO) -> tuple[int, int]:
    signature, size = struct.unpack("<2sI", _exactly(file, 6))
    if signature != b"BM":
        raise ValueError("not a BMP image")
    file.seek(18)
    width, height = struct.unpack("<ii", _exactly(file, 8))
    if file.seek(0, os.SEEK_END) < size:
        raise EOFError
    return width, abs(height)  # a negative height means rows from the top
