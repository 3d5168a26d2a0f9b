"""Messages of a topic by the time at which they were made: what is taken was made after it was asked for."""

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from handeye.codes import Code
from handeye.errors import DeviceError

# A clock that runs ahead of the one here by more, or a message that is on its way for longer, is refused.
AHEAD_S, LATE_S = 0.05, 1.0
BAD_STAMP = Code.BAD_STAMP
Value = TypeVar("Value")


@dataclass(frozen=True, eq=False)
class Stamped(Generic[Value]):
    """A message: when it was made, by the clock of its sender, and what it says."""

    stamp_s: float
    value: Value


class Stream(Generic[Value]):
    """The messages of one topic, the youngest few; filled by one thread, asked by another.

    Parameters
    ----------
    what
        Name of the topic, for errors.
    now_s
        The clock that stamps are compared with, in seconds.
    keep
        So many messages are kept.
    code
        Of the error where nothing comes.
    """

    def __init__(
        self, what: str, now_s: Callable[[], float], *, keep: int = 200, code: str = "no_message"
    ) -> None:
        self._what, self._now_s, self._code = what, now_s, code
        self._kept: deque[Stamped[Value]] = deque(maxlen=keep)
        self._fault: str | None = None
        self._news = threading.Condition()

    def put(self, stamp_s: float, value: Value) -> None:
        """Take a message that has just come; one whose stamp cannot be true is not kept, and said later."""
        with self._news:
            late_s = self._now_s() - stamp_s
            newest = self._kept[-1].stamp_s if self._kept else -float("inf")
            if stamp_s <= 0:
                self._fault = "a message without a stamp"
            elif late_s < -AHEAD_S:
                self._fault = f"a message stamped {-late_s:.3f} s ahead of the clock here"
            elif late_s > LATE_S:
                self._fault = (
                    f"a message stamped {late_s:.3f} s before it came, at most {LATE_S} s are allowed"
                )
            elif stamp_s < newest:
                self._fault = f"a message stamped {newest - stamp_s:.3f} s before the one that came before it"
            else:
                self._kept.append(Stamped(stamp_s, value))
            self._news.notify_all()

    def after(self, asked_s: float, timeout_s: float) -> Stamped[Value]:
        """Return the first message made at or after a time.

        Raises
        ------
        DeviceError
            None comes in time; `bad_stamp` where some came whose stamps cannot be true.
        """
        return self._first(lambda kept: kept.stamp_s >= asked_s, timeout_s, "made after it was asked for")

    def at(self, stamp_s: float, timeout_s: float) -> Stamped[Value]:
        """Return the message with exactly this stamp.

        Raises
        ------
        DeviceError
            As `after`.
        """
        return self._first(lambda kept: kept.stamp_s == stamp_s, timeout_s, f"with the stamp {stamp_s:.6f}")

    def around(self, stamp_s: float, timeout_s: float) -> tuple[Stamped[Value], Stamped[Value]]:
        """Return the neighbours of a time: the last message made before it or then, the first not before it.

        Raises
        ------
        DeviceError
            As `after`; or the messages kept begin later.
        """
        second = self.after(stamp_s, timeout_s)
        with self._news:
            before = [kept for kept in self._kept if kept.stamp_s <= stamp_s]
        if not before:
            raise DeviceError(
                f"{self._what}: nothing from before {stamp_s:.3f}, only from after it", code=self._code
            )
        return before[-1], second

    def _first(self, fits: Callable[[Stamped[Value]], bool], timeout_s: float, which: str) -> Stamped[Value]:
        end = time.monotonic() + timeout_s
        with self._news:
            self._fault = None
            while True:
                found = next((kept for kept in self._kept if fits(kept)), None)
                if found is not None:
                    return found
                left_s = end - time.monotonic()
                if left_s <= 0:
                    raise self._nothing(which, timeout_s)
                self._news.wait(left_s)

    def _nothing(self, which: str, timeout_s: float) -> DeviceError:
        if self._fault is not None:
            return DeviceError(
                f"{self._what}: {self._fault}",
                code=BAD_STAMP,
                hint="set the clocks of all machines by one (chrony); a simulation: use_sim_time everywhere",
            )
        newest = f"the newest is stamped {self._kept[-1].stamp_s:.3f}" if self._kept else "none has come yet"
        return DeviceError(
            f"{self._what}: no message {which} within {timeout_s:.1f} s; {newest}", code=self._code
        )
