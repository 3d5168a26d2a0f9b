"""Finished pieces kept on disk, so that work goes on where it was when the process was killed.

One file, `finished.log`: after a header, a record for each piece, appended when it is done and forced to the
disk at least once a second. A record is its length, the digest of program, work and piece, the result, and a
checksum: one that was cut off counts as never written. Results are bound to what they are of, so a folder may
hold the pieces of several studies, and none is taken for another's.
"""

import functools
import hashlib
import os
import struct
import time
import zlib
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, TypeVar, get_type_hints

import msgspec

from handeye.codes import Code
from handeye.compute.digest import Digester, program_digest
from handeye.compute.parallel import Workers, run_each
from handeye.errors import InputError, OutputError

T = TypeVar("T")
R = TypeVar("R")

FILE = "finished.log"
HEADER = b"handeye finished pieces 1\n"
_DIGEST = 16
_LENGTH = struct.Struct("<I")
SYNC_S = 1.0


@dataclass(frozen=True)
class Checkpoint:
    """Work done by others, its results kept in a folder; pieces that are there already are not done again.

    Parameters
    ----------
    folder
        Made if it does not exist. Only one process may use it at a time.
    workers
        Who does the work.
    """

    folder: Path
    workers: Workers = 1

    def run(self, work: Callable[[T], R], pieces: Sequence[T]) -> Generator[tuple[int, R]]:
        """Yield the index and the result of each piece: first those kept, then the others as they finish.

        Raises
        ------
        InputError
            The folder is in use, or its file is something else.
        OutputError
            The system refuses to write.
        """
        kind = get_type_hints(_function(work))["return"]
        decoder: Any = msgspec.msgpack.Decoder(kind)
        digester = Digester()
        start = bytes.fromhex(program_digest()) + digester.of(work)
        names = [_named(start, digester.of(piece)) for piece in pieces]
        with _open(self.folder) as file:
            kept = _read(file, set(names))
            left: list[int] = []
            for index, name in enumerate(names):
                if name in kept:
                    yield index, decoder.decode(kept[name])
                else:
                    left.append(index)
            kept.clear()
            yield from self._others(work, pieces, names, left, file)

    def _others(
        self,
        work: Callable[[T], R],
        pieces: Sequence[T],
        names: Sequence[bytes],
        left: Sequence[int],
        file: IO[bytes],
    ) -> Generator[tuple[int, R]]:
        encoder = msgspec.msgpack.Encoder()
        synced = time.monotonic()
        finished = run_each(work, [pieces[index] for index in left], self.workers)
        try:
            for order, result in finished:
                _append(file, names[left[order]], encoder.encode(result))
                if time.monotonic() - synced > SYNC_S:
                    _sync(file)
                    synced = time.monotonic()
                yield left[order], result
        finally:
            finished.close()
            _sync(file)


def _function(work: Callable[[T], R]) -> Callable[..., object]:
    return work.func if isinstance(work, functools.partial) else work


def _named(start: bytes, piece: bytes) -> bytes:
    return hashlib.blake2b(start + piece, digest_size=_DIGEST).digest()


def _open(folder: Path) -> IO[bytes]:
    """Open the file of a folder for this process alone."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = (folder / FILE).open("a+b")
    except OSError as error:
        raise OutputError(f"{folder}: {(error.strerror or str(error)).lower()}") from error
    try:
        import fcntl  # noqa: PLC0415 - there is none on Windows

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except ImportError:
        pass
    except OSError:
        file.close()
        raise InputError(f"{folder}: another process works with it", code=Code.IN_USE) from None
    return file


def _read(file: IO[bytes], wanted: set[bytes]) -> dict[bytes, bytes]:
    """Return the wanted results of a file, and cut off what was not written whole."""
    file.seek(0)
    header = file.read(len(HEADER))
    if header != HEADER:
        if not HEADER.startswith(header):
            file.close()
            raise InputError(f"{file.name}: holds something else", code=Code.UNKNOWN_FORMAT)
        file.truncate(0)
        file.write(HEADER)
        _sync(file)
        return {}
    found: dict[bytes, bytes] = {}
    end = file.tell()
    while len(length := file.read(_LENGTH.size)) == _LENGTH.size:
        (size,) = _LENGTH.unpack(length)
        record = file.read(size + _LENGTH.size)
        if len(record) < size + _LENGTH.size or _LENGTH.pack(zlib.crc32(record[:size])) != record[size:]:
            break
        if record[:_DIGEST] in wanted:
            found[record[:_DIGEST]] = record[_DIGEST:size]
        end = file.tell()
    file.truncate(end)
    file.seek(end)
    return found


def _append(file: IO[bytes], name: bytes, result: bytes) -> None:
    record = name + result
    try:
        file.write(_LENGTH.pack(len(record)) + record + _LENGTH.pack(zlib.crc32(record)))
        # To the system with every piece: a killed process loses none; a killed machine a second's worth.
        file.flush()
    except OSError as error:
        raise OutputError(f"{file.name}: {(error.strerror or str(error)).lower()}") from error


def _sync(file: IO[bytes]) -> None:
    file.flush()
    os.fsync(file.fileno())
