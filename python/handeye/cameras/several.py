"""Several cameras at one stop: all are told to expose before any of them is waited for."""

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future

from handeye.cameras.protocol import Frame, ImageSource
from handeye.codes import Code
from handeye.errors import DeviceError


class SeveralCameras:
    """Cameras by name, grabbed at once.

    Parameters
    ----------
    sources
        The driver of each camera, by its name.

    Examples
    --------
    >>> rig = SeveralCameras({"left": left, "right": right})   # doctest: +SKIP
    >>> frames = rig.grab("station_01.1")                      # doctest: +SKIP
    >>> left_eye = rig.eyes()["left"]                          # doctest: +SKIP
    """

    def __init__(self, sources: Mapping[str, ImageSource]) -> None:
        self._sources = dict(sources)

    def grab(self, label: str) -> dict[str, Frame]:
        """Return the picture of every camera, exposed at this stop.

        Raises
        ------
        DeviceError
            A camera fails; it is named, with its own code and hint. The others have been waited for.
        """
        return {name: _frame(one) for name, one in self._exposed(label).items()}

    def eyes(self, looks: Mapping[str, int] | None = None) -> dict[str, ImageSource]:
        """Return every camera by itself: the first asked at a stop exposes all.

        A camera that fails says so for itself, and the frames of the others are kept.

        Parameters
        ----------
        looks
            How often the frame of each camera is given, such as once for each target that is looked for in
            it; None for once.
        """
        once = dict.fromkeys(self._sources, 1)
        shared = _Shared(self._exposed, looks or once)
        return {name: _Eye(name, one, shared) for name, one in self._sources.items()}

    def _exposed(self, label: str) -> dict[str, Frame | DeviceError]:
        waiting = {name: _begun(one, label) for name, one in self._sources.items()}
        return {name: _answer(name, each) for name, each in waiting.items()}


def _begun(source: ImageSource, label: str) -> Future[Frame]:
    """Tell a camera to expose; none waits for another, and the end of the program for none that hangs."""
    future: Future[Frame] = Future()

    def work() -> None:
        try:
            future.set_result(source.grab(label))
        except BaseException as error:  # noqa: BLE001 - whatever a driver raises
            future.set_exception(error)

    threading.Thread(target=work, name="camera", daemon=True).start()
    return future


def _answer(name: str, waiting: Future[Frame]) -> Frame | DeviceError:
    """Return the frame that is waited for, or why there is none, with the name of the camera."""
    error = waiting.exception()
    if error is None:
        return waiting.result()
    told = DeviceError(f"camera {name}: {error}", code=Code.DRIVER_FAILED)
    if isinstance(error, DeviceError):
        told = DeviceError(f"camera {name}: {error.message}", code=error.code, hint=error.hint)
    told.__cause__ = error
    return told


def _frame(answer: Frame | DeviceError) -> Frame:
    if isinstance(answer, DeviceError):
        raise answer
    return answer


class _Shared:
    """The frames of one stop, until each camera's has been looked at or the next stop begins."""

    def __init__(
        self, expose: Callable[[str], dict[str, Frame | DeviceError]], looks: Mapping[str, int]
    ) -> None:
        self._expose, self._looks = expose, looks
        self._one_at_a_time = threading.Lock()
        self._label: str | None = None
        self._answers: dict[str, Frame | DeviceError] = {}
        self._left: dict[str, int] = {}

    def take(self, name: str, label: str) -> Frame:
        with self._one_at_a_time:
            if label != self._label or not self._left[name]:
                self._label = None
                self._answers = self._expose(label)
                self._label, self._left = label, dict(self._looks)
            self._left[name] -= 1
            return _frame(self._answers[name])


class _Eye:
    """One of the cameras."""

    def __init__(self, name: str, source: ImageSource, shared: _Shared) -> None:
        self._name, self._source, self._shared = name, source, shared

    def grab(self, label: str) -> Frame:
        """Return its picture of the stop with this label."""
        return self._shared.take(self._name, label)

    def close(self) -> None:
        """Close its driver, where that can be closed."""
        close = getattr(self._source, "close", None)
        if callable(close):
            close()
