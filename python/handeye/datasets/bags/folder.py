"""Folders of rosbag2: `metadata.yaml` and the files that it lists (rosbag2_storage, `metadata_io.cpp`)."""

from collections.abc import Iterator, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import replace
from pathlib import Path, PurePath
from typing import cast

from handeye.codes import Code
from handeye.datasets.bags.base import MAX_RECORD_BYTES, BagReader, Record, Topic
from handeye.datasets.bags.mcap import MAGIC as MCAP_MAGIC
from handeye.datasets.bags.mcap import Mcap
from handeye.datasets.bags.rosbag1 import MAGIC as ROSBAG1_MAGIC
from handeye.datasets.bags.rosbag1 import Rosbag1
from handeye.datasets.bags.sqlite3_storage import MAGIC as SQLITE_MAGIC
from handeye.datasets.bags.sqlite3_storage import Sqlite3
from handeye.datasets.bags.unpacking import unpacked
from handeye.datasets.reading import file_names, inside, is_file
from handeye.datasets.yaml_reading import read_yaml
from handeye.errors import InputError

METADATA = "metadata.yaml"
SUFFIXES = frozenset({".bag", ".mcap", ".db3"})
_INFORMATION = "rosbag2_bagfile_information"
_KINDS = ((ROSBAG1_MAGIC, Rosbag1), (MCAP_MAGIC, Mcap), (SQLITE_MAGIC, Sqlite3))


class Folder:
    """The files of a bag one after the other."""

    def __init__(self, path: Path) -> None:
        self._path = path
        names, self._is_packed = _listed(path)
        self._parts = [_of_file(inside(path, name, "metadata.yaml")) for name in names]

    def records(self, kinds: AbstractSet[str]) -> Iterator[Record]:
        """Return the messages of these types; raises `InputError`."""
        for part in self._parts:
            for record in part.records(kinds):
                yield self._plain(record) if self._is_packed else record

    def _plain(self, record: Record) -> Record:
        where = f"{self._path}: a message on {record.topic.name[:100]}"
        return replace(record, data=unpacked(record.data, "zstd", MAX_RECORD_BYTES, where))

    @property
    def topics(self) -> dict[str, Topic]:
        """All topics that were met so far, by name."""
        return {name: topic for part in self._parts for name, topic in part.topics.items()}

    @property
    def is_cut(self) -> bool:
        """Whether a file broke off before its end."""
        return any(part.is_cut for part in self._parts)


def is_bag(path: Path) -> bool:
    """Tell whether a path is a bag: a file that begins like one, or a folder of rosbag2."""
    try:
        if is_file(path):
            return path.suffix.lower() in SUFFIXES and _kind(path) is not None
        return _is_folder(path)
    except (InputError, OSError, ValueError):
        return False


def reader_of(path: Path) -> BagReader:
    """Return the reader of a bag.

    Raises
    ------
    InputError
        It is none, or its metadata cannot be used.
    """
    return _of_file(path) if is_file(path) else Folder(path)


def _is_folder(path: Path) -> bool:
    if is_file(path / METADATA):
        with (path / METADATA).open("rb") as file:
            return _INFORMATION.encode() in file.read(1000)
    return bool(_bare(path))


def _bare(path: Path) -> list[str]:
    """Return the files of a bag whose metadata is missing; no bag lies between other files."""
    names = file_names(path) if path.is_dir() else []
    return names if names and all(PurePath(name).suffix in {".mcap", ".db3"} for name in names) else []


def _of_file(path: Path) -> BagReader:
    kind = _kind(path)
    if kind is None:
        raise InputError(
            f"{path}: does not begin like a bag of ROS 1, MCAP or a database of rosbag2",
            code=Code.UNKNOWN_FORMAT,
            hint="a bag that is compressed as a whole has to be unpacked first",
        )
    return kind(path)


def _kind(path: Path) -> type[Rosbag1 | Mcap | Sqlite3] | None:
    with path.open("rb") as file:
        head = file.read(16)
    return next((kind for magic, kind in _KINDS if head.startswith(magic)), None)


def _listed(path: Path) -> tuple[list[str], bool]:
    """Return the names of the files in the folder, and whether each message is compressed."""
    if not is_file(path / METADATA):
        return _bare(path), False
    where = path / METADATA
    document = read_yaml(where)
    told = cast("Mapping[str, object]", document).get(_INFORMATION) if isinstance(document, Mapping) else None
    table: Mapping[str, object] = cast("Mapping[str, object]", told) if isinstance(told, Mapping) else {}
    files = table.get("relative_file_paths")
    if not isinstance(files, list) or not files:
        raise InputError(f"{where}: relative_file_paths lists no file", code=Code.INVALID_FIELD)
    mode = str(table.get("compression_mode", "")).lower()
    if mode == "file":
        raise InputError(
            f"{path}: a bag that is compressed file by file",
            code=Code.UNKNOWN_FORMAT,
            hint="unpack it first: ros2 bag convert, or zstd -d and a metadata.yaml without compression",
        )
    return [
        PurePath(str(name).replace("\\", "/")).name for name in cast("list[object]", files)
    ], mode == "message"
