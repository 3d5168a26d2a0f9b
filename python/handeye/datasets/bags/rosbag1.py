"""Bags of ROS 1, format 2.0 (http://wiki.ros.org/Bags/Format/2.0).

A file is a line and then records: length, header (fields ``name=value``), length, data. Chunks hold records,
perhaps compressed. The file is read from its beginning and its index is not used, so that a bag that was not
closed is read up to where it ends.
"""

import struct
from collections.abc import Iterator
from collections.abc import Set as AbstractSet
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from handeye.codes import Code
from handeye.datasets.bags.base import MAX_RECORD_BYTES, MAX_TOPICS, Budget, Record, Topic, checked_size
from handeye.datasets.bags.unpacking import unpacked
from handeye.errors import InputError

MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _HEADER, _CHUNK, _CONNECTION = 0x02, 0x03, 0x05, 0x07
_MAX_HEADER = 1 << 16


class _CutOffError(Exception):
    """The file ends within a record."""


class Rosbag1:
    """A bag of ROS 1."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.topics: dict[str, Topic] = {}
        self.is_cut = False

    def records(self, kinds: AbstractSet[str]) -> Iterator[Record]:
        """Return the messages of these types; raises `InputError`."""
        connections: dict[int, Topic] = {}
        budget = Budget(self._path)
        with self._path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise InputError(f"{self._path}: no bag of ROS 1, format 2.0", code=Code.UNKNOWN_FORMAT)
            yield from self._walk(file, connections, kinds, budget, in_chunk=False)

    def _walk(
        self,
        file: BinaryIO,
        connections: dict[int, Topic],
        kinds: AbstractSet[str],
        budget: Budget,
        *,
        in_chunk: bool,
    ) -> Iterator[Record]:
        while True:
            try:
                record = self._record(file)
            except _CutOffError:
                self.is_cut = True
                return
            if record is None:
                return
            fields, data = record
            op = fields.get("op", b"")
            code = op[0] if len(op) == 1 else -1
            budget.spend(len(data), messages=1)
            if code == _CHUNK and not in_chunk:
                yield from self._walk(
                    BytesIO(self._chunk(fields, data)), connections, kinds, budget, in_chunk=True
                )
            elif code == _CONNECTION:
                self._connect(fields, data, connections)
            elif code == _MESSAGE:
                topic = connections.get(self._number(fields, "conn", "<I"))
                if topic is not None and topic.kind in kinds:
                    seconds, nanoseconds = struct.unpack("<II", self._field(fields, "time", 8))
                    yield Record(topic, seconds * 10**9 + nanoseconds, data)
            elif code == _HEADER and fields.get("encryptor"):
                raise InputError(f"{self._path}: an encrypted bag", code=Code.UNKNOWN_FORMAT)

    def _record(self, file: BinaryIO) -> tuple[dict[str, bytes], bytes] | None:
        """Return header and data of the next record; None at the end."""
        start = file.read(4)
        if not start:
            return None
        header = self._sized(file, start, _MAX_HEADER, "header")
        data = self._sized(file, file.read(4), MAX_RECORD_BYTES, "record")
        return self._fields(header), data

    def _sized(self, file: BinaryIO, length: bytes, most: int, what: str) -> bytes:
        if len(length) < 4:
            raise _CutOffError
        (size,) = struct.unpack("<I", length)
        if size > most:
            raise InputError(
                f"{self._path}: a {what} of {size} bytes, expected at most {most}", code=Code.DAMAGED_BAG
            )
        content = file.read(size)
        if len(content) < size:
            raise _CutOffError
        return content

    def _fields(self, header: bytes) -> dict[str, bytes]:
        fields: dict[str, bytes] = {}
        at = 0
        while at + 4 <= len(header):
            (size,) = struct.unpack_from("<I", header, at)
            name, equals, value = header[at + 4 : at + 4 + size].partition(b"=")
            if not equals or at + 4 + size > len(header):
                raise InputError(f"{self._path}: a header that is no list of fields", code=Code.DAMAGED_BAG)
            fields[name.decode("ascii", "replace")] = value
            at += 4 + size
        return fields

    def _chunk(self, fields: dict[str, bytes], data: bytes) -> bytes:
        method = fields.get("compression", b"none").decode("ascii", "replace")
        size = checked_size(self._number(fields, "size", "<I"), self._path, "chunk")
        return unpacked(data, method, size, f"{self._path}: a chunk")

    def _connect(self, fields: dict[str, bytes], data: bytes, connections: dict[int, Topic]) -> None:
        described = self._fields(data)
        name = described.get("topic") or fields.get("topic", b"")
        topic = Topic(
            fields.get("topic", name).decode("utf-8", "replace"),
            described.get("type", b"").decode("utf-8", "replace"),
            is_cdr=False,
        )
        if len(connections) >= MAX_TOPICS:
            raise InputError(f"{self._path}: more than {MAX_TOPICS} connections", code=Code.TOO_LARGE)
        connections[self._number(fields, "conn", "<I")] = topic
        self.topics[topic.name] = topic

    def _field(self, fields: dict[str, bytes], name: str, size: int) -> bytes:
        value = fields.get(name, b"")
        if len(value) != size:
            raise InputError(f"{self._path}: a record without its field {name}", code=Code.DAMAGED_BAG)
        return value

    def _number(self, fields: dict[str, bytes], name: str, form: str) -> int:
        (value,) = struct.unpack(form, self._field(fields, name, struct.calcsize(form)))
        return int(value)
