"""Calls into drivers that may hang, die, or raise anything."""

import queue
import threading
from collections.abc import Callable
from typing import Any, TypeVar

from handeye.errors import DeviceError, HandeyeError

T = TypeVar("T")


def within(seconds: float, what: str, call: Callable[..., T], *arguments: Any) -> T:  # noqa: ANN401 - passed on
    """Return what a call into a driver returns, if it does in time.

    The call runs in a thread of its own, which is left behind where it hangs.

    Raises
    ------
    DeviceError
        The call raised anything, or took longer; then `code` is `timeout`.
    """
    answers: queue.Queue[tuple[bool, Any]] = queue.Queue()

    def work() -> None:
        try:
            answers.put((True, call(*arguments)))
        except BaseException as error:  # noqa: BLE001 - whatever a driver raises
            answers.put((False, error))

    threading.Thread(target=work, name=what, daemon=True).start()
    try:
        good, answer = answers.get(timeout=seconds)
    except queue.Empty:
        raise DeviceError(
            f"{what}: no answer within {seconds:g} s", code="timeout", hint="check cable, power and network"
        ) from None
    if good:
        return answer
    if isinstance(answer, DeviceError):
        raise answer
    message = answer.message if isinstance(answer, HandeyeError) else f"{type(answer).__name__}: {answer}"
    raise DeviceError(f"{what}: {message}", code="driver_failed") from answer
