"""Values out of a message: the serialization of ROS 1, and CDR as ROS 2 has it.

ROS 1 (http://wiki.ros.org/msg): little endian, nothing between the values. CDR (OMG DDSI-RTPS 2.3, section
10): four bytes that say the byte order, then every value at a multiple of its size; texts end with a zero.
"""

import struct

from handeye.codes import Code
from handeye.errors import InputError

_MAX_TEXT = 4096


class Wire:
    """The values of one message, one after the other.

    Parameters
    ----------
    data
        The message.
    is_cdr
        Whether it is CDR.
    where
        What to call it in a message.

    Raises
    ------
    InputError
        A value beyond the end, or a kind of CDR that no ROS writes; from every method.
    """

    def __init__(self, data: bytes, *, is_cdr: bool, where: str) -> None:
        self._data, self._is_cdr, self._where = memoryview(data), is_cdr, where
        self._at = self._origin = 4 if is_cdr else 0
        self._order = "<"
        if is_cdr:
            if len(data) < 4 or data[0] != 0 or data[1] > 1:
                raise self._damaged("a serialization that is not plain CDR")
            self._order = "<" if data[1] == 1 else ">"

    def number(self, form: str) -> float:
        """Return one number of a form of `struct`, such as `I`."""
        return self.numbers(form, 1)[0]

    def whole(self, form: str) -> int:
        """Return one whole number."""
        return int(self.number(form))

    def numbers(self, form: str, count: int) -> tuple[float, ...]:
        """Return numbers one after the other."""
        size = struct.calcsize(f"<{form}")
        if self._is_cdr and count:
            self._at += -(self._at - self._origin) % size
        taken = self._take(size * count)
        return struct.unpack(f"{self._order}{count}{form}", taken)

    def length(self, *, least_bytes: int = 1) -> int:
        """Return the number of entries of a list, each of at least so many bytes."""
        count = self.whole("I")
        if count * least_bytes > len(self._data) - self._at:
            raise self._damaged(f"a list of {count} entries")
        return count

    def text(self) -> str:
        """Return a text."""
        size = self.length()
        if size > _MAX_TEXT:
            raise self._damaged(f"a name of {size} bytes")
        return bytes(self._take(size)).rstrip(b"\0").decode("utf-8", "replace")

    def long_text(self) -> str:
        """Return a text of any length, such as the description of a robot."""
        return bytes(self._take(self.length())).rstrip(b"\0").decode("utf-8", "replace")

    def block(self) -> memoryview:
        """Return a list of bytes."""
        return self._take(self.length())

    def stamp_ns(self) -> int:
        """Return a time in nanoseconds."""
        seconds, nanoseconds = self.whole("i" if self._is_cdr else "I"), self.whole("I")
        return seconds * 10**9 + nanoseconds

    def header(self) -> tuple[int, str]:
        """Return the time (ns) and the frame of a std_msgs/Header; ROS 1 counts in front of them."""
        if not self._is_cdr:
            self.whole("I")
        return self.stamp_ns(), self.text()

    def _take(self, size: int) -> memoryview:
        if self._at + size > len(self._data):
            raise self._damaged("cut off")
        taken = self._data[self._at : self._at + size]
        self._at += size
        return taken

    def _damaged(self, found: str) -> InputError:
        return InputError(f"{self._where}: {found}", code=Code.DAMAGED_BAG)
