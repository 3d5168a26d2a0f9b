"""One command at a time to each device, and whatever a driver raises becomes a short error of ours."""

import threading
import time
from typing import NoReturn

import pytest

from handeye.errors import DeviceError
from handeye.session.calls import MAX_MESSAGE, Calls


class Slow:
    """A device that answers when it is told to, and counts how many calls run at once."""

    def __init__(self) -> None:
        self.answer = threading.Event()
        self.running = self.most = 0

    def move(self) -> str:
        self.running += 1
        self.most = max(self.most, self.running)
        self.answer.wait()
        self.running -= 1
        return "there"

    def stop(self) -> None:
        self.answer.set()


def test_nothing_is_sent_before_the_last_call_is_back() -> None:
    device, calls = Slow(), Calls("robot")
    with pytest.raises(DeviceError) as error:
        calls.run(0.05, device.move)
    assert error.value.code == "timeout"
    assert calls.pending
    for _ in range(3):
        with pytest.raises(DeviceError) as error:
            calls.run(0.05, device.move)
        assert error.value.code == "busy"
    assert device.most == 1
    # Stopping goes beside; then the call comes back, and the next one is sent.
    calls.beside(1.0, device.stop)
    assert calls.run(5.0, device.move) == "there"
    assert not calls.pending
    assert device.most == 1


def test_a_call_that_comes_back_late_is_waited_for() -> None:
    device, calls = Slow(), Calls("robot")
    with pytest.raises(DeviceError):
        calls.run(0.05, device.move)
    threading.Timer(0.1, device.stop).start()
    calls.wait(10.0)
    assert not calls.pending


def test_without_a_limit_no_thread_and_no_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    def forbidden(*_: object, **__: object) -> None:
        raise AssertionError("a clock or a thread in a simulated cell")

    for name in ("monotonic", "time", "sleep", "perf_counter"):
        monkeypatch.setattr(time, name, forbidden)
    monkeypatch.setattr(threading, "Thread", forbidden)
    assert Calls("robot").run(float("inf"), int, "7") == 7


class Unspeakable(Exception):  # noqa: N818
    def __str__(self) -> NoReturn:
        raise ValueError("no text")


@pytest.mark.parametrize("seconds", [5.0, float("inf")])
def test_messages_are_short_and_can_be_shown(seconds: float) -> None:
    assert MAX_MESSAGE <= 500

    def raising(error: BaseException) -> None:
        raise error

    for error in (
        RuntimeError("x" * 10_000_000),
        RuntimeError("\x1b]0;title\x07\ud800\x00"),
        DeviceError("y" * 10_000, code="\x1b" * 1000, hint="z" * 10_000),
        MemoryError(),
        KeyError("plc"),
        Unspeakable(),
        DeviceError(None, code=5, hint=Unspeakable()),  # type: ignore[arg-type]
    ):
        with pytest.raises(DeviceError) as found:
            Calls("robot").run(seconds, raising, error)
        for text in (found.value.message, found.value.code, found.value.hint or ""):
            assert text.isprintable()
            assert len(text) <= MAX_MESSAGE + 50
            text.encode()


def test_what_ends_a_thread_ends_no_session() -> None:
    def leaving(error: BaseException) -> None:
        raise error

    for error in (SystemExit(3), KeyboardInterrupt()):
        with pytest.raises(DeviceError, match=type(error).__name__):
            Calls("robot").run(5.0, leaving, error)
