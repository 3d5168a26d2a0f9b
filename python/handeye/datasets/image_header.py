"""Size of an image from its first bytes, and whether the file is complete. Nothing is decoded.

PNG: W3C PNG specification, 3rd edition, sections 5 and 11. JPEG: ITU-T T.81, annex B. BMP: BITMAPINFOHEADER.
PGM, PPM, PBM: the Netpbm formats P1 to P6. WebP: RFC 9649, section 2. JPEG 2000: ITU-T T.800, annex I.
Sun raster: the header of eight words in `rasterfile.h`.
"""

import os
import struct
from pathlib import Path
from typing import BinaryIO

from handeye.codes import Code
from handeye.datasets.reading import reason
from handeye.errors import InputError

# What importers take for an image; of TIFF only the name is looked at.
IMAGE_SUFFIXES = frozenset({
    ".png", ".jpg", ".jpeg", ".jpe", ".bmp", ".dib", ".tif", ".tiff", ".pgm", ".ppm", ".pbm", ".pnm", ".webp",
    ".jp2", ".ras", ".sr",
})  # fmt: skip
MAX_SIDE = 100_000
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_MAX_CHUNKS = 1_000_000
# Start-of-frame markers of JPEG; C4, C8 and CC are something else.
_JPEG_FRAMES = frozenset({*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC})
_JPEG_TAIL = 1 << 16
# Values of a pixel by the kind of a Netpbm file; length of a header, and digits of a number in it.
_PNM_CHANNELS = {b"P1": 1, b"P2": 1, b"P3": 3, b"P4": 1, b"P5": 1, b"P6": 3}
_MOST_HEADER, _MOST_DIGITS = 100_000, 6
_JP2_SIGNATURE = b"\0\0\0\x0cjP  \r\n\x87\n"


def image_size(path: Path) -> tuple[int, int] | None:
    """Return width and height in pixels of a complete image file; None where the format is not known here.

    Raises
    ------
    InputError
        The file cannot be read, is truncated, or is not the image that its name says.
    """
    if path.suffix.lower() not in _READERS:
        return None
    if not path.is_file():
        raise InputError(f"{path}: not a regular file", code=Code.UNREADABLE)
    try:
        with path.open("rb") as file:
            return size_in(file, path.suffix.lower(), str(path))
    except OSError as error:
        raise InputError(f"{path}: {reason(error)}", code=Code.UNREADABLE) from error


def size_in(file: BinaryIO, suffix: str, where: str) -> tuple[int, int]:
    """Return width and height in pixels of a complete image of the kind that a suffix names.

    Raises
    ------
    InputError
        It is truncated, or no such image.
    """
    try:
        width, height = _READERS[suffix](file)
    except (EOFError, struct.error) as error:
        raise InputError(
            f"{where}: the image is truncated", code=Code.TRUNCATED_IMAGE, hint="copy the file again"
        ) from error
    except ValueError as error:
        raise InputError(
            f"{where}: {error}", code=Code.NOT_AN_IMAGE, hint="check what this file is"
        ) from error
    if not (0 < width <= MAX_SIDE and 0 < height <= MAX_SIDE):
        raise InputError(f"{where}: an image of {width} x {height} pixels", code=Code.NOT_AN_IMAGE)
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


def _pnm_size(file: BinaryIO) -> tuple[int, int]:
    """Read numbers after the magic, with comments between them, then see whether the raster can be there."""
    magic = file.read(2)
    if magic not in _PNM_CHANNELS:
        raise ValueError("not a PGM, PPM or PBM image")
    wanted = 2 if magic in {b"P1", b"P4"} else 3
    numbers = [_pnm_number(file) for _ in range(wanted)]
    width, height = numbers[:2]
    most = numbers[2] if wanted == 3 else 1
    if not 1 <= most <= 65535:
        raise ValueError(f"grey values up to {most}, expected 1 to 65535")
    start = file.tell()
    left = file.seek(0, os.SEEK_END) - start
    row = width * _PNM_CHANNELS[magic] * (1 if most < 256 else 2)
    if magic == b"P4":
        row = (width + 7) // 8
    # In the kinds written as text a value has at least one digit.
    if left < row * height:
        raise EOFError
    return width, height


def _pnm_number(file: BinaryIO) -> int:
    """Return the next number of a header; the one character after it is taken too."""
    digits = b""
    for _ in range(_MOST_HEADER):
        character = _exactly(file, 1)
        if character == b"#" and not digits:
            while _exactly(file, 1) not in b"\r\n":
                pass
        elif character.isdigit() and len(digits) < _MOST_DIGITS:
            digits += character
        elif character.isspace() and digits:
            return int(digits)
        elif not character.isspace():
            break
    raise ValueError("a PGM, PPM or PBM image with a broken header")


def _webp_size(file: BinaryIO) -> tuple[int, int]:
    """Read the canvas of the extended format, else the size in the first frame."""
    riff, length, webp = struct.unpack("<4sI4s", _exactly(file, 12))
    if riff != b"RIFF" or webp != b"WEBP":
        raise ValueError("not a WebP image")
    kind, _ = struct.unpack("<4sI", _exactly(file, 8))
    head = _exactly(file, 10)
    if file.seek(0, os.SEEK_END) < length + 8:
        raise EOFError
    if kind == b"VP8X":
        return int.from_bytes(head[4:7], "little") + 1, int.from_bytes(head[7:10], "little") + 1
    if kind == b"VP8L" and head[0] == 0x2F:
        bits = int.from_bytes(head[1:5], "little")
        return (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    if kind == b"VP8 " and head[3:6] == b"\x9d\x01\x2a":
        width, height = struct.unpack("<HH", head[6:10])
        return width & 0x3FFF, height & 0x3FFF
    raise ValueError("a WebP image without frame")


def _jp2_size(file: BinaryIO) -> tuple[int, int]:
    """Walk over boxes to the image header inside the header box."""
    if file.read(12) != _JP2_SIGNATURE:
        raise ValueError("not a JPEG 2000 image")
    for _ in range(_MAX_CHUNKS):
        length, kind = struct.unpack(">I4s", _exactly(file, 8))
        if kind == b"jp2h":
            continue  # its boxes follow
        if kind == b"ihdr":
            height, width = struct.unpack(">II", _exactly(file, 8))
            return width, height
        if length < 8:
            break
        file.seek(length - 8, os.SEEK_CUR)
    raise ValueError("a JPEG 2000 image without header")


def _sun_size(file: BinaryIO) -> tuple[int, int]:
    magic, width, height, _, length = struct.unpack(">5I", _exactly(file, 20))
    if magic != 0x59A66A95:
        raise ValueError("not a Sun raster image")
    start = 32
    if file.seek(0, os.SEEK_END) < start + length:
        raise EOFError
    return width, height


_READERS = {
    ".png": _png_size,
    **dict.fromkeys((".jpg", ".jpeg", ".jpe"), _jpeg_size),
    **dict.fromkeys((".bmp", ".dib"), _bmp_size),
    **dict.fromkeys((".pgm", ".ppm", ".pbm", ".pnm"), _pnm_size),
    ".webp": _webp_size,
    ".jp2": _jp2_size,
    **dict.fromkeys((".ras", ".sr"), _sun_size),
}
