"""MCAP files (https://mcap.dev/spec), as rosbag2 and others write them.

Records are an opcode, a length and content; chunks hold records, perhaps compressed. The file is read from
its beginning and the summary at its end is not used, so that a file that was not closed is read up to where
it ends.
"""

import struct
from collections.abc import Iterator
from collections.abc import Set as AbstractSet
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from handeye.codes import Code
from handeye.datasets.bags.base import MAX_NAME, MAX_TOPICS, Budget, Record, Topic, checked_size, plain_kind
from handeye.datasets.bags.unpacking import unpacked
from handeye.errors import InputError

MAGIC = b"\x89MCAP0\r\n"
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 0x02, 0x03, 0x04, 0x05, 0x06, 0x0F
_NEEDED = frozenset({_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK})
_ENCODINGS = {"cdr": True, "ros1": False}


class Mcap:
    """A file of MCAP."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.topics: dict[str, Topic] = {}
        self.is_cut = False
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, Topic | None] = {}

    def records(self, kinds: AbstractSet[str]) -> Iterator[Record]:
        """Return the messages of these types; raises `InputError`."""
        with self._path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise InputError(f"{self._path}: no MCAP file", code=Code.UNKNOWN_FORMAT)
            yield from self._walk(file, kinds, Budget(self._path), in_chunk=False)

    def _walk(
        self, file: BinaryIO, kinds: AbstractSet[str], budget: Budget, *, in_chunk: bool
    ) -> Iterator[Record]:
        while True:
            head = file.read(9)
            if in_chunk and not head:
                return
            if len(head) < 9:
                self.is_cut = True
                return
            opcode, size = struct.unpack("<BQ", head)
            if opcode in {_FOOTER, _DATA_END}:
                return
            content = self._content(file, opcode, size)
            if content is None:
                self.is_cut = True
                return
            budget.spend(len(content), messages=1)
            try:
                if opcode == _CHUNK and not in_chunk:
                    yield from self._walk(BytesIO(self._chunk(content)), kinds, budget, in_chunk=True)
                elif opcode == _SCHEMA:
                    (key,) = struct.unpack_from("<H", content)
                    self._schemas[key] = plain_kind(_text(content, 2)[0])
                elif opcode == _CHANNEL:
                    self._connect(content)
                elif opcode == _MESSAGE:
                    key, _, received_ns = struct.unpack_from("<HIQ", content)
                    topic = self._channels.get(key)
                    if topic is not None and topic.kind in kinds:
                        yield Record(topic, received_ns, content[22:])
            except (struct.error, UnicodeDecodeError) as error:
                raise InputError(f"{self._path}: a record that is cut off", code=Code.DAMAGED_BAG) from error

    def _content(self, file: BinaryIO, opcode: int, size: int) -> bytes | None:
        """Return the content of a record, nothing of one that is of no use; None if the file ends before."""
        if opcode not in _NEEDED:
            # Attachments and indexes may be long; a length beyond the end leads to a read of nothing.
            file.seek(min(size, 1 << 40), 1)
            return b""
        content = file.read(checked_size(size, self._path))
        return content if len(content) == size else None

    def _chunk(self, content: bytes) -> bytes:
        size, _ = struct.unpack_from("<QI", content, 16)
        method, at = _text(content, 28)
        (length,) = struct.unpack_from("<Q", content, at)
        data = content[at + 8 : at + 8 + length]
        where = f"{self._path}: a chunk"
        return unpacked(data, method, checked_size(size, self._path, "chunk"), where)

    def _connect(self, content: bytes) -> None:
        key, schema = struct.unpack_from("<HH", content)
        name, at = _text(content, 4)
        encoding, _ = _text(content, at)
        if len(self._channels) >= MAX_TOPICS:
            raise InputError(f"{self._path}: more than {MAX_TOPICS} channels", code=Code.TOO_LARGE)
        is_cdr = _ENCODINGS.get(encoding)
        topic = None if is_cdr is None else Topic(name, self._schemas.get(schema, ""), is_cdr)
        self._channels[key] = topic
        if topic is not None:
            self.topics[name] = topic


def _text(content: bytes, at: int) -> tuple[str, int]:
    """Return a text with its length before it, and where it ends."""
    (size,) = struct.unpack_from("<I", content, at)
    if size > MAX_NAME or at + 4 + size > len(content):
        raise struct.error
    return content[at + 4 : at + 4 + size].decode(), at + 4 + size
