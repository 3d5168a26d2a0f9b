"""Cameras that OpenCV can open: USB cameras, network streams."""

import time

import cv2
import numpy as np

from handeye.cameras.protocol import Frame
from handeye.codes import Code
from handeye.errors import DeviceError

# Drivers keep old pictures in a queue; so many are thrown away before one is believed to be of now.
STALE_FRAMES = 5


class Capture:
    """A camera that OpenCV opens.

    Parameters
    ----------
    source
        Number of the device, or the address of a stream.
    size_px
        Width and height to ask for; None to take what comes.

    Raises
    ------
    DeviceError
        It cannot be opened.
    """

    def __init__(self, source: int | str, *, size_px: tuple[int, int] | None = None) -> None:
        self._source, self._size_px = source, size_px
        self._capture: cv2.VideoCapture | None = None
        self._open()

    def grab(self, label: str) -> Frame:
        """Return a picture of now.

        Raises
        ------
        DeviceError
            The camera gives none; one that was lost is opened again at the next call.
        """
        capture = self._open()
        for _ in range(STALE_FRAMES):
            capture.grab()
        good, picture = capture.read()
        if not good:
            self.close()
            raise DeviceError(f"camera {self._source}: no picture for {label}", code=Code.NO_IMAGE)
        grey = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
        if grey.dtype != np.uint8:
            raise DeviceError(
                f"camera {self._source}: pixels of {grey.dtype}, expected 8 bits", code=Code.BAD_IMAGE
            )
        return Frame(np.ascontiguousarray(grey, dtype=np.uint8), timestamp_s=time.time())

    def close(self) -> None:
        """Let go of the camera."""
        if self._capture is not None:
            self._capture.release()
            self._capture = None

    def _open(self) -> cv2.VideoCapture:
        if self._capture is None:
            capture = cv2.VideoCapture(self._source)
            if not capture.isOpened():
                raise DeviceError(
                    f"camera {self._source}: cannot be opened",
                    code=Code.NO_CAMERA,
                    hint="is another program using it?",
                )
            if self._size_px is not None:
                capture.set(cv2.CAP_PROP_FRAME_WIDTH, self._size_px[0])
                capture.set(cv2.CAP_PROP_FRAME_HEIGHT, self._size_px[1])
            self._capture = capture
        return self._capture
