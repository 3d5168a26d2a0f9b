"""What all threads share: the documents that pages show, what people asked for, and who drives."""

import queue
import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import msgspec

from handeye.codes import Code
from handeye.errors import HandeyeError, InputError

# Everything that a page can ask for. The session obeys all but `stop`, which is obeyed at once.
ACTIONS = ("go", "run_on", "pause", "skip", "here", "withdraw", "more", "finish", "answer", "stop")
# A driver whose page is gone this long has left.
ABSENT_S = 5.0
# Pages that may look on at a time.
MOST_WATCHERS = 32
_MOST_MESSAGES = 60
# While a session computes, making and sending a document may take this part of the program's processor time:
# a loop that runs on by itself is hardly slowed by pages that look on. Words are free, and nothing is held
# back while the session waits for a person, or the program has used less than this part of the time.
SHARE, IDLE = 0.002, 0.01
_FREE = {"talk", "people"}
# In seconds: what telling all pages costs at least, how often it is seen whether they may be told, and how
# long the program must have been idle.
_LEAST_S, _POLL_S, _IDLE_S = 5e-4, 0.25, 1.0


@dataclass(frozen=True)
class Command:
    """What a person pressed, with what was typed or chosen for it."""

    action: str
    values: dict[str, Any] = field(default_factory=dict[str, Any])


@dataclass
class _Section:
    version: int
    build: Callable[[], Any]
    # The version that pages know of, and the processor time at which they may be told of another one.
    told: int = 0
    free_at_s: float = 0.0
    built: bytes | None = None
    making: threading.Lock = field(default_factory=threading.Lock)


class Hub:
    """Documents by name, each with a version that grows; commands; and the one page that drives.

    A document is made when a page asks for it, not when it changes: nobody looking costs nothing. While the
    session computes, pages are told of a change once the last telling was paid for; see `SHARE`.
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._sections: dict[str, _Section] = {}
        self._commands: queue.Queue[Command] = queue.Queue()
        self._stop: Callable[[], str | None] | None = None
        self._messages: list[str] = []
        self._watchers: dict[str, int] = {}
        self._driver: str | None = None
        self._driver_left = 0.0
        self._resting, self._idle = True, False
        self._seen_idle = time.monotonic(), time.process_time()
        self._question: dict[str, str] | None = None
        self._answers: queue.Queue[str | None] = queue.Queue()
        self.closed = False
        self.publish("people", self._people)
        self.publish("talk", self._talk)

    # Documents

    def publish(self, name: str, build: Callable[[], Any]) -> None:
        """Put a document in place of the last one of its name; `build` makes it when it is asked for."""
        with self._changed:
            before = self._sections.get(name)
            if before is None:
                self._sections[name] = _Section(1, build)
            else:
                version = before.version + 1
                self._sections[name] = _Section(version, build, before.told, before.free_at_s)
            if self._tell():
                self._changed.notify_all()

    def rests(self, *, resting: bool) -> bool:
        """Say whether the session waits for a person; return what was said before."""
        with self._changed:
            before, self._resting = self._resting, resting
        return before

    def charge(self, name: str, seconds: float) -> None:
        """Say how much processor time it took to make and to send a document."""
        with self._changed:
            section = self._sections.get(name)
            if section is not None and name not in _FREE and not self._resting:
                section.free_at_s = (
                    max(section.free_at_s, time.process_time()) + max(seconds, _LEAST_S) / SHARE
                )

    def versions(self) -> dict[str, int]:
        """Return the version of every document."""
        with self._changed:
            return {name: section.version for name, section in self._sections.items()}

    def wait(self, seen: dict[str, int], seconds: float) -> dict[str, int]:
        """Return the versions to tell once they differ from those seen, or after so many seconds."""
        deadline = time.monotonic() + seconds
        with self._changed:
            while not self.closed:
                self._tell()
                told = {name: section.told for name, section in self._sections.items() if section.told}
                left = deadline - time.monotonic()
                if seen | told != seen or left <= 0:
                    return seen | told
                self._changed.wait(left if self._resting else min(_POLL_S, left))
        return seen

    def _tell(self) -> bool:
        """Let pages know of what has changed and is paid for; return whether there is anything."""
        now, spent = time.monotonic(), time.process_time()
        before, spent_before = self._seen_idle
        if now - before >= _IDLE_S:
            self._idle = spent - spent_before < IDLE * (now - before)
            self._seen_idle = now, spent
        free = self._resting or self._idle
        due = [
            section
            for section in self._sections.values()
            if section.told != section.version and (free or section.free_at_s <= spent)
        ]
        for section in due:
            section.told = section.version
        return bool(due)

    def document(self, name: str) -> bytes:
        """Return a document as JSON.

        Raises
        ------
        InputError
            No such document.
        """
        with self._changed:
            section = self._sections.get(name)
        if section is None:
            raise InputError(f"no document {name[:40]!r}", code=Code.UNKNOWN_DOCUMENT)
        with section.making:
            if section.built is None:
                body = {"version": section.version, "data": section.build()}
                section.built = msgspec.json.encode(body)
            return section.built

    # Commands

    def on_stop(self, stop: Callable[[], str | None]) -> None:
        """Say how the arm is stopped at once; it returns why that is not confirmed, None if it is."""
        self._stop = stop

    def command(self, page: str, command: Command) -> None:
        """Take a command from a page; everybody may stop, the driver everything.

        Raises
        ------
        InputError
            An unknown action, or a page that does not drive.
        """
        if command.action not in ACTIONS:
            raise InputError(f"no action {command.action[:40]!r}", code=Code.UNKNOWN_ACTION)
        if command.action == "stop":
            self._stopped()
            return
        if page != self._driver:
            raise InputError("this page looks on; another one drives", code=Code.NOT_DRIVING)
        if command.action == "answer":
            self._answered(command)
        else:
            self._commands.put(command)

    def next_command(self, seconds: float | None) -> Command | None:
        """Return the next command, None if there is none within so many seconds; None waits for ever."""
        self.rests(resting=seconds != 0)
        try:
            return self._commands.get(timeout=seconds) if seconds != 0 else self._commands.get_nowait()
        except queue.Empty:
            return None
        finally:
            self.rests(resting=False)

    def _stopped(self) -> None:
        trouble = None if self._stop is None else self._stop()
        self.say("Stop was pressed." if trouble is None else f"Stop was pressed, NOT confirmed: {trouble}")
        self._commands.put(Command("pause"))
        if self._question is not None:
            self._answers.put(None)

    # Talking with the person who drives

    def say(self, text: str) -> None:
        """Show a line to everybody."""
        with self._changed:
            self._messages = [*self._messages, text][-_MOST_MESSAGES:]
        self.publish("talk", self._talk)

    def ask(self, question: str) -> str:
        """Show a question and return what is typed.

        Raises
        ------
        EOFError
            Stop was pressed instead.
        """
        while not self._answers.empty():
            self._answers.get_nowait()
        self._question = {"id": secrets.token_hex(4), "text": question}
        self.publish("talk", self._talk)
        before = self.rests(resting=True)
        try:
            answer = self._answers.get()
        finally:
            self.rests(resting=before)
        self._question = None
        self.publish("talk", self._talk)
        if answer is None:
            raise EOFError
        self.say(f"> {answer}")
        return answer

    def _answered(self, command: Command) -> None:
        question = self._question
        if question is None or command.values.get("id") != question["id"]:
            raise InputError("the question is not open any more", code=Code.LATE_ANSWER)
        text = command.values.get("text")
        if not isinstance(text, str) or len(text) > 20_000:
            raise InputError("an answer is a text of at most 20000 characters", code=Code.WRONG_TYPE)
        self._answers.put(text)

    def _talk(self) -> dict[str, Any]:
        return {"messages": list(self._messages), "question": self._question}

    # Who looks on, and who drives

    def enter(self, page: str) -> None:
        """Let a page look on; the first one drives.

        Raises
        ------
        InputError
            Too many look on.
        """
        with self._changed:
            if sum(self._watchers.values()) >= MOST_WATCHERS:
                raise InputError(f"{MOST_WATCHERS} pages look on already", code=Code.TOO_MANY)
            self._watchers[page] = self._watchers.get(page, 0) + 1
            absent = self._driver not in self._watchers and time.monotonic() - self._driver_left > ABSENT_S
            if self._driver is None or absent:
                self._driver = page
        self.publish("people", self._people)

    def leave(self, page: str) -> None:
        """Let a page go; it still drives if it comes back soon."""
        with self._changed:
            left = self._watchers.get(page, 1) - 1
            if left > 0:
                self._watchers[page] = left
            else:
                self._watchers.pop(page, None)
                if page == self._driver:
                    self._driver_left = time.monotonic()
        self.publish("people", self._people)

    def take_over(self, page: str) -> None:
        """Make a page that looks on the one that drives.

        Raises
        ------
        InputError
            It does not look on.
        """
        with self._changed:
            if page not in self._watchers:
                raise InputError("this page does not look on", code=Code.NOT_WATCHING)
            self._driver = page
        self.say("Another page drives now.")
        self.publish("people", self._people)

    def _people(self) -> dict[str, Any]:
        # A page is named by the start of its secret, which is enough to know oneself by.
        driver = None if self._driver is None else self._driver[:8]
        return {"watchers": len(self._watchers), "driver": driver}

    def close(self) -> None:
        """Let every waiting page go."""
        with self._changed:
            self.closed = True
            self._changed.notify_all()


def described(error: HandeyeError) -> dict[str, str | None]:
    """Return an error as a page shows it."""
    return {"code": error.code, "message": error.message, "hint": error.hint}
