"""Files of rosbag2's storage plugin sqlite3 (rosbag2, `sqlite_storage.cpp`): tables topics and messages."""

import sqlite3
from collections.abc import Iterator
from collections.abc import Set as AbstractSet
from contextlib import closing
from pathlib import Path
from urllib.parse import quote

from handeye.codes import Code
from handeye.datasets.bags.base import MAX_RECORD_BYTES, MAX_TOPICS, Budget, Record, Topic, plain_kind
from handeye.errors import InputError

MAGIC = b"SQLite format 3\0"
# Steps of SQLite's machine between two looks at what a database makes us do, and how many looks.
_STEPS, _LOOKS = 1_000_000, 20_000


class Sqlite3:
    """A database of rosbag2."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.topics: dict[str, Topic] = {}
        self.is_cut = False

    def records(self, kinds: AbstractSet[str]) -> Iterator[Record]:
        """Return the messages of these types; raises `InputError`."""
        budget = Budget(self._path)
        try:
            with closing(self._opened()) as database:
                topics = self._topics(database)
                wanted = {key: topic for key, topic in topics.items() if topic.kind in kinds}
                if not wanted:
                    return
                marks = ",".join("?" * len(wanted))
                found = database.execute(
                    f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({marks}) ORDER BY id",  # noqa: S608
                    tuple(wanted),
                )
                for key, received_ns, data in found:
                    if not (isinstance(received_ns, int) and isinstance(data, bytes)):
                        raise InputError(f"{self._path}: a message that is none", code=Code.DAMAGED_BAG)
                    budget.spend(len(data), messages=1)
                    yield Record(wanted[key], received_ns, data)
        except sqlite3.Error as error:
            raise InputError(
                f"{self._path}: no database that can be read: {str(error)[:100]}",
                code=Code.DAMAGED_BAG,
                hint="copy the whole bag; `ros2 bag reindex` repairs one that was not closed",
            ) from error

    def _opened(self) -> sqlite3.Connection:
        """Open the file so that nothing in it is run, written or followed."""
        address = f"file:{quote(str(self._path.resolve()))}?mode=ro&immutable=1"
        database = sqlite3.connect(address, uri=True)
        database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_RECORD_BYTES)
        database.setlimit(sqlite3.SQLITE_LIMIT_ATTACHED, 0)
        for pragma in ("trusted_schema=OFF", "query_only=ON", "cell_size_check=ON", "mmap_size=0"):
            database.execute(f"PRAGMA {pragma}")
        looks = 0

        def look() -> int:
            nonlocal looks
            looks += 1
            return int(looks > _LOOKS)

        database.set_progress_handler(look, _STEPS)
        return database

    def _topics(self, database: sqlite3.Connection) -> dict[int, Topic]:
        # A view in place of a table could run whatever its author has thought of.
        plain = dict(
            database.execute("SELECT name, type FROM sqlite_master WHERE name IN ('topics', 'messages')")
        )
        if plain != {"topics": "table", "messages": "table"}:
            raise InputError(
                f"{self._path}: no tables topics and messages of rosbag2", code=Code.UNKNOWN_FORMAT
            )
        found: dict[int, Topic] = {}
        for key, name, kind, form in database.execute(
            "SELECT id, name, type, serialization_format FROM topics LIMIT ?", (MAX_TOPICS,)
        ):
            if form == "cdr":
                found[key] = Topic(str(name), plain_kind(str(kind)), is_cdr=True)
        self.topics.update({topic.name: topic for topic in found.values()})
        return found
