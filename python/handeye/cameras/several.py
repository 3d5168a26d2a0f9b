"""Several cameras at one stop: all are told to expose before any of them is waited for."""

import threading
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor

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
        # As many threads as cameras: none waits for another.
        self._threads = ThreadPoolExecutor(max(len(sources), 1), thread_name_prefix="camera")

    def grab(self, label: str) -> dict[str, Frame]:
        """Return the picture of every camera, exposed at this stop.

        Raises
        ------
        DeviceError
            A camera fails; it is named, with its own code and hint. The others have been waited for.
        """
        waiting = {name: self._threads.submit(one.grab, label) for name, one in self._sources.items()}
        errors = {name: each.exception() for name, each in waiting.items()}
        for name, error in errors.items():
            if error is not None:
                code, hint = Code.DRIVER_FAILED, None
                if isinstance(error, DeviceError):
                    code, hint = error.code, error.hint
                raise DeviceError(f"camera {name}: {error}", code=code, hint=hint) from error
        return {name: each.result() for name, each in waiting.items()}

    def eyes(self) -> dict[str, ImageSource]:
        """Return every camera by itself: the first asked at a stop exposes all, each frame is given once."""
        shared = _Shared(self)
        return {name: _Eye(name, shared) for name in self._sources}

    def close(self) -> None:
        """End the threads; the drivers stay open."""
        self._threads.shutdown(wait=False)


class _Shared:
    """The frames of one stop, until each camera's has been taken or the next stop begins."""

    def __init__(self, cameras: SeveralCameras) -> None:
        self._cameras = cameras
        self._one_at_a_time = threading.Lock()
        self._label: str | None = None
        self._frames: dict[str, Frame] = {}

    def take(self, name: str, label: str) -> Frame:
        with self._one_at_a_time:
            if label != self._label or name not in self._frames:
                self._label, self._frames = None, {}
                self._frames = self._cameras.grab(label)
                self._label = label
            return self._frames.pop(name)


class _Eye:
    """One of the cameras."""

    def __init__(self, name: str, shared: _Shared) -> None:
        self._name, self._shared = name, shared

    def grab(self, label: str) -> Frame:
        """Return its picture of the stop with this label."""
        return self._shared.take(self._name, label)
