"""Basler cameras, by pylon's own library (extra `basler`). Not tried on a real camera."""

import threading
from contextlib import suppress
from typing import Any

import numpy as np

from handeye.cameras.protocol import Frame
from handeye.codes import Code
from handeye.errors import DeviceError
from handeye.extension import library

GRAB_MS = 5000


class BaslerCamera:
    """One camera, exposed when it is asked and not before.

    Parameters
    ----------
    address
        Serial number, or nothing for the only camera; after a comma a file of settings (.pfs) that the pylon
        Viewer saved, such as exposure and pixel format.

    Raises
    ------
    DeviceError
        The library, the camera or the settings are not there.
    """

    def __init__(self, address: str) -> None:
        self._pylon = library("pypylon.pylon", "basler")
        self._errors = library("pypylon.genicam", "basler").GenericException
        self._serial, _, self._settings = address.partition(",")
        self._one_at_a_time = threading.Lock()
        self._camera: Any = self._opened()
        self._grey = self._pylon.ImageFormatConverter()
        self._grey.OutputPixelFormat = self._pylon.PixelType_Mono8

    @staticmethod
    def found() -> list[tuple[str, str]]:
        """Return the address and the model of each camera that is there.

        Raises
        ------
        DeviceError
            The library is not there.
        """
        factory = library("pypylon.pylon", "basler").TlFactory.GetInstance()
        return [
            (each.GetSerialNumber(), f"{each.GetModelName()} ({each.GetDeviceClass()})")
            for each in factory.EnumerateDevices()
        ]

    def grab(self, label: str) -> Frame:
        """Expose once; 8 bits of grey, whatever the camera sends.

        Raises
        ------
        DeviceError
            No picture, or a broken one; a camera that was lost is opened again at the next call.
        """
        with self._one_at_a_time:
            try:
                if self._camera is None or self._camera.IsCameraDeviceRemoved():
                    self._forget()
                    self._camera = self._opened()
                # Begins to acquire, takes one picture, ends: nothing waits in a queue.
                result = self._camera.GrabOne(GRAB_MS)
                try:
                    if not result.GrabSucceeded():
                        raise DeviceError(
                            f"{label}: broken picture: {result.GetErrorDescription()}", code=Code.NO_IMAGE
                        )
                    pixels = np.array(self._grey.Convert(result).GetArray(), dtype=np.uint8)
                    stamp = int(result.GetTimeStamp())
                finally:
                    result.Release()
            except self._errors as error:
                self._forget()
                raise DeviceError(
                    f"{label}: camera {self._serial or '(the only one)'}: {str(error).strip()}",
                    code=Code.NO_IMAGE,
                    hint="check cable and power; a trigger that is switched on waits for ever",
                ) from error
        return Frame(pixels, timestamp_s=stamp / 1e9 if stamp else None)

    def close(self) -> None:
        """Let go of the camera."""
        with self._one_at_a_time:
            self._forget()

    def _forget(self) -> None:
        if self._camera is not None:
            with suppress(self._errors):  # it may be gone already
                self._camera.Close()
            self._camera = None

    def _opened(self) -> Any:  # noqa: ANN401 - a camera of pylon
        pylon = self._pylon
        there = self.found()
        serials = [serial for serial, _ in there]
        listed = ", ".join(f"{serial} {model}" for serial, model in there) or "none"
        if (self._serial and self._serial not in serials) or (not self._serial and len(there) != 1):
            raise DeviceError(
                f"camera {self._serial or '(the only one)'}: not found; there are: {listed}",
                code=Code.NO_CAMERA,
                hint="name one by its serial number, such as basler:40012345",
            )
        try:
            wanted = pylon.DeviceInfo()
            wanted.SetSerialNumber(self._serial or serials[0])
            camera = pylon.InstantCamera(pylon.TlFactory.GetInstance().CreateFirstDevice(wanted))
            camera.Open()
            if self._settings:
                pylon.FeaturePersistence.Load(self._settings, camera.GetNodeMap(), True)
        except self._errors as error:
            raise DeviceError(
                f"camera {self._serial or '(the only one)'}: {str(error).strip()}",
                code=Code.NO_CAMERA,
                hint="is another program using it?",
            ) from error
        return camera
