"""What a bag is: topics, and their messages in the order in which they were written."""

from collections.abc import Iterator
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from handeye.codes import Code
from handeye.datasets.reading import MIB
from handeye.errors import InputError

# Bounds on what a stranger's bag makes us do: a record, and all of them together once unpacked.
MAX_RECORD_BYTES = 512 * MIB
MAX_TOTAL_BYTES = 1 << 36
MAX_MESSAGES = 20_000_000
MAX_TOPICS = 10_000
MAX_NAME = 1000


@dataclass(frozen=True)
class Topic:
    """A stream of messages.

    Attributes
    ----------
    name
        Such as `/camera/image_raw`.
    kind
        Type of its messages without the part that ROS 2 adds: `sensor_msgs/Image`.
    is_cdr
        Whether the messages are CDR (ROS 2) or in the serialization of ROS 1.
    """

    name: str
    kind: str
    is_cdr: bool


@dataclass(frozen=True)
class Record:
    """One message as it stands in the file, and when it was received, in nanoseconds."""

    topic: Topic
    received_ns: int
    data: bytes


class BagReader(Protocol):
    """A kind of bag: reads a file from its beginning to its end, or to where it was cut off."""

    def records(self, kinds: AbstractSet[str]) -> Iterator[Record]:
        """Return the messages of these types.

        Raises
        ------
        InputError
            The file is not what it claims to be.
        """
        ...

    @property
    def topics(self) -> dict[str, Topic]:
        """All topics that were met so far, by name."""
        ...

    @property
    def is_cut(self) -> bool:
        """Whether the file broke off before its end, once it was read."""
        ...


class Budget:
    """Counts what a bag has made us do, and ends it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._bytes = self._messages = 0

    def spend(self, size: int, messages: int = 0) -> None:
        """Count bytes that were unpacked, and messages.

        Raises
        ------
        InputError
            More than any recording of a calibration has.
        """
        self._bytes += size
        self._messages += messages
        if self._bytes > MAX_TOTAL_BYTES or self._messages > MAX_MESSAGES:
            raise InputError(
                f"{self._path}: more than {MAX_TOTAL_BYTES >> 30} GiB or {MAX_MESSAGES} messages",
                code=Code.TOO_LARGE,
                hint="cut out the calibration first",
            )


def plain_kind(name: str) -> str:
    """Return the type of a message as ROS 1 writes it."""
    return name.replace("/msg/", "/")


def checked_size(size: int, path: Path, what: str = "record") -> int:
    """Return the size of a record if a calibration may need one so large.

    Raises
    ------
    InputError
        It may not.
    """
    if not 0 <= size <= MAX_RECORD_BYTES:
        raise InputError(
            f"{path}: a {what} of {size} bytes, expected at most {MAX_RECORD_BYTES}", code=Code.TOO_LARGE
        )
    return size
