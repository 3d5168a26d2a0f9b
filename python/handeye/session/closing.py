"""Letting go of the devices when a session is over, however it ends."""

from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress

from handeye.errors import DeviceError
from handeye.session.attempt import Cell
from handeye.session.calls import Calls

# How long a device may take to close; and where somebody waits for the program to end.
SECONDS, HURRIED_S = 5.0, 0.1


@contextmanager
def closing(cell: Cell) -> Generator[None]:
    """Close the drivers of a cell when a block is left, however it is left, see `close_all`.

    Parameters
    ----------
    cell
        What was opened.

    Examples
    --------
    >>> with closing(cell):
    ...     reading = cell.read()
    """
    seconds = SECONDS
    try:
        yield
    except KeyboardInterrupt:
        seconds = HURRIED_S
        raise
    finally:
        close_all(cell, seconds)


def close_all(cell: Cell, seconds: float = HURRIED_S) -> None:
    """Close the drivers of a cell that have a method `close`, each once: the robot after a confirmed stop.

    A robot that does not confirm the stop, and a device whose last call has not come back, are left as they
    are. Whatever a driver raises here is of no consequence for what was taken.

    Parameters
    ----------
    cell
        What was opened.
    seconds
        How long each stop, last call and closing may take.
    """
    with suppress(DeviceError):
        if _close_of(cell.robot) is not None:
            cell.robot_calls.beside(seconds, cell.robot.stop)
            close(cell.robot_calls, cell.robot, seconds)
    for source in {id(eye.source): eye.source for eye in cell.eyes}.values():
        close(cell.camera_calls, source, seconds)


def close(calls: Calls, device: object, seconds: float = HURRIED_S) -> None:
    """Close a device that can be closed, if its last call comes back in time.

    Parameters
    ----------
    calls
        The calls into it.
    device
        Any driver.
    seconds
        How long its last call, and then closing, may take.
    """
    call = _close_of(device)
    if call is not None:
        with suppress(DeviceError):
            calls.run(seconds, call)


def _close_of(device: object) -> Callable[[], object] | None:
    try:
        call = getattr(device, "close", None)
    except Exception:  # noqa: BLE001 - whatever a driver raises
        return None
    return call if callable(call) else None
