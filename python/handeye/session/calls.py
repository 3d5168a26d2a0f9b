"""Calls into drivers that may hang, die, or raise anything: one at a time to each device.

A call that is given up goes on in its thread, and the device with it. Until it has come back nothing else is
asked of the device, but to stop.
"""

import math
import queue
import threading
from collections.abc import Callable
from typing import Any, TypeVar

from handeye.codes import Code
from handeye.errors import DeviceError, HandeyeError, printable

T = TypeVar("T")

MAX_MESSAGE = 300


class Calls:
    """The calls into one device.

    Parameters
    ----------
    what
        What messages call it, such as `robot`.
    """

    def __init__(self, what: str) -> None:
        self._what = what
        self._idle = threading.Event()
        self._idle.set()

    @property
    def pending(self) -> bool:
        """Whether a call that was given up has not come back yet."""
        return not self._idle.is_set()

    def wait(self, seconds: float) -> None:
        """Wait until the last call has come back.

        Raises
        ------
        DeviceError
            It has not in that time; `code` is `busy`.
        """
        if not self._idle.wait(None if math.isinf(seconds) else seconds):
            raise DeviceError(
                f"{self._what}: the last call has not come back",
                code=Code.BUSY,
                hint="check cable, power and network, and end the program that hangs",
            )

    def run(self, seconds: float, call: Callable[..., T], *arguments: Any) -> T:  # noqa: ANN401 - passed on
        """Return what a call returns, if the last one has come back and it does in time.

        Without a limit (infinite seconds) it is called in this thread, and no clock is looked at.

        Raises
        ------
        DeviceError
            The call raised anything, or took longer (`code` is `timeout`), or the last one is not back
            (`busy`).
        """
        self.wait(seconds)
        return self._called(seconds, call, arguments, self._idle)

    def beside(self, seconds: float, call: Callable[..., T], *arguments: Any) -> T:  # noqa: ANN401
        """As `run`, but also while another call runs: for stopping."""
        return self._called(seconds, call, arguments, threading.Event())

    def _called(
        self, seconds: float, call: Callable[..., T], arguments: tuple[Any, ...], idle: threading.Event
    ) -> T:
        answers: queue.Queue[tuple[bool, Any]] = queue.Queue()

        def work() -> None:
            try:
                answer = (True, call(*arguments))
            except BaseException as error:  # noqa: BLE001 - whatever a driver raises
                answer = (False, error)
            idle.set()
            answers.put(answer)

        if math.isinf(seconds):
            try:
                return call(*arguments)
            except Exception as error:
                raise self._described(error) from error
        idle.clear()
        threading.Thread(target=work, name=self._what, daemon=True).start()
        try:
            good, answer = answers.get(timeout=seconds)
        except queue.Empty:
            raise DeviceError(
                f"{self._what}: no answer within {seconds:g} s",
                code=Code.TIMEOUT,
                hint="check cable, power and network",
            ) from None
        if good:
            return answer
        raise self._described(answer) from answer

    def _described(self, error: BaseException) -> DeviceError:
        """Return an error of a driver as one of ours."""
        described = in_our_words(error)
        if isinstance(error, DeviceError):
            return described
        return DeviceError(f"{self._what}: {described.message}", code=Code.DRIVER_FAILED, hint=described.hint)


def in_our_words(error: BaseException) -> DeviceError:
    """Return whatever a driver raised as an error of ours: short, and of characters that can be shown."""
    if not isinstance(error, HandeyeError):
        return DeviceError(
            f"{type(error).__name__}: {printable(error, MAX_MESSAGE)}", code=Code.DRIVER_FAILED
        )
    message = printable(error.args[0] if error.args else "", MAX_MESSAGE)
    hint = None if error.hint is None else printable(error.hint, MAX_MESSAGE)
    return DeviceError(message, code=printable(error.code, 60), hint=hint)
