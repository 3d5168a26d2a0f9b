"""Unpacking what a bag has compressed, never more than it may be.

bz2 comes with Python; lz4 and zstd are asked for when a bag needs them (`pip install 'handeye[bags]'`).
"""

import bz2
from importlib import import_module
from typing import Any, Protocol, cast

from handeye.codes import Code
from handeye.errors import InputError

# No messages get smaller than by this factor; a few lines of bytes may claim to.
MOST_TIMES, ALWAYS_BYTES = 1000, 1 << 24


class _Unpacker(Protocol):
    def decompress(self, data: bytes, /, max_length: int = -1) -> bytes: ...


def unpacked(data: bytes, method: str, limit: int, where: str) -> bytes:
    """Return what compressed bytes hold.

    Parameters
    ----------
    data
        The compressed bytes.
    method
        `bz2`, `lz4`, `zstd`; nothing or `none` for bytes as they are.
    limit
        How many bytes may come out.
    where
        What to call them in a message.

    Raises
    ------
    InputError
        Another method, one whose library is missing, damaged bytes, or more of them than may be.
    """
    if method in {"", "none"}:
        return data
    most = min(limit, max(ALWAYS_BYTES, MOST_TIMES * len(data)))
    unpacker, failures = _unpacker(method, where)
    try:
        # One byte more than allowed tells that there is more.
        content = unpacker.decompress(data, max_length=most + 1)
    except failures as error:
        raise InputError(f"{where}: damaged: {str(error)[:100]}", code=Code.DAMAGED_BAG) from error
    if len(content) > most:
        raise InputError(
            f"{where}: {len(data)} bytes that unpack to more than {most}",
            code=Code.TOO_LARGE,
            hint="wrong file?",
        )
    return content


def _unpacker(method: str, where: str) -> tuple[_Unpacker, tuple[type[Exception], ...]]:
    if method == "bz2":
        return bz2.BZ2Decompressor(), (OSError, EOFError, ValueError)
    if method == "lz4":
        frame = _library(("lz4.frame",), method, where)
        return cast("_Unpacker", frame.LZ4FrameDecompressor()), (RuntimeError, EOFError, ValueError)
    if method == "zstd":
        zstd = _library(("compression.zstd", "backports.zstd"), method, where)
        return cast("_Unpacker", zstd.ZstdDecompressor()), (zstd.ZstdError, EOFError, ValueError)
    raise InputError(
        f"{where}: compressed with {method[:40]!r}, expected bz2, lz4 or zstd", code=Code.UNKNOWN_FORMAT
    )


def _library(names: tuple[str, ...], method: str, where: str) -> Any:  # noqa: ANN401 - no types in it
    for name in names:
        try:
            return import_module(name)
        except ImportError:
            continue
    raise InputError(
        f"{where}: compressed with {method}",
        code=Code.MISSING_LIBRARY,
        hint="pip install 'handeye[bags]' brings what unpacks it",
    )
