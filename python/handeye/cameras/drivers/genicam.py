"""Cameras of any maker with a GenTL producer, by harvesters (extra `genicam`). Not tried on a real camera."""

import os
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from handeye.cameras.protocol import Frame, Grey
from handeye.codes import Code
from handeye.errors import DeviceError
from handeye.extension import library

GRAB_S = 5.0
PRODUCERS = "GENICAM_GENTL64_PATH"
# Formats of pixels, by the Pixel Format Naming Convention of GenICam, and how they become grey.
COLOURS = {
    "RGB8": cv2.COLOR_RGB2GRAY,
    "BGR8": cv2.COLOR_BGR2GRAY,
    "RGBa8": cv2.COLOR_RGBA2GRAY,
    "BGRa8": cv2.COLOR_BGRA2GRAY,
    "BayerRG8": cv2.COLOR_BayerRGGB2GRAY,
    "BayerGR8": cv2.COLOR_BayerGRBG2GRAY,
    "BayerGB8": cv2.COLOR_BayerGBRG2GRAY,
    "BayerBG8": cv2.COLOR_BayerBGGR2GRAY,
}
BITS = {"Mono8": 8, "Mono10": 10, "Mono12": 12, "Mono14": 14, "Mono16": 16}
_HARVESTERS: dict[tuple[Path, ...], Any] = {}


class GenicamCamera:
    """One camera, exposed when it is asked and not before.

    Parameters
    ----------
    address
        Serial number or identifier, or nothing for the only camera; after a comma the producer's file (.cti).
        Without it the folders of GENICAM_GENTL64_PATH are searched, where makers' software puts them.

    Raises
    ------
    DeviceError
        The library, a producer or the camera is not there.
    """

    def __init__(self, address: str) -> None:
        self._name, _, producer = address.partition(",")
        self._one_at_a_time = threading.Lock()
        self._producers = _producers(producer)
        self._source: Any = None
        self._open()

    @staticmethod
    def found() -> list[tuple[str, str]]:
        """Return the address and the model of each camera that is there.

        Raises
        ------
        DeviceError
            The library or every producer is not there.
        """
        there = _harvester(_producers("")).device_info_list
        return [(_identity(info), f"{info.vendor} {info.model}") for info in there]

    def grab(self, label: str) -> Frame:
        """Expose once; 8 bits of grey.

        Raises
        ------
        DeviceError
            No picture in time, or in a format that is not known; a camera that was lost is opened again at
            the next call.
        """
        with self._one_at_a_time:
            if self._source is None:
                self._open()
            source: Any = self._source
            try:
                source.start()
                try:
                    with source.fetch(timeout=GRAB_S) as buffer:
                        grey = _grey(label, buffer.payload.components[0])
                        stamp = _stamp(buffer)
                finally:
                    source.stop()
            except DeviceError:
                raise
            except Exception as error:
                self._forget()
                raise DeviceError(
                    f"{label}: camera {self._name or '(the only one)'}: {type(error).__name__}: {error}",
                    code=Code.NO_IMAGE,
                    hint="check cable and power; a trigger that is switched on waits for ever",
                ) from error
        return Frame(grey, timestamp_s=stamp / 1e9 if stamp else None)

    def close(self) -> None:
        """Let go of the camera."""
        with self._one_at_a_time:
            self._forget()

    def _forget(self) -> None:
        source, self._source = self._source, None
        if source is not None:
            with suppress(Exception):  # it may be gone already; producers raise what they like
                source.destroy()

    def _open(self) -> None:
        harvester = _harvester(self._producers)
        there = harvester.device_info_list
        fitting = [i for i, info in enumerate(there) if self._name in {"", info.id_, _identity(info)}]
        if len(fitting) != 1:
            listed = ", ".join(f"{_identity(info)} {info.model}" for info in there) or "none"
            raise DeviceError(
                f"camera {self._name or '(the only one)'}: not found; there are: {listed}",
                code=Code.NO_CAMERA,
                hint="name one by its serial number, such as genicam:40012345",
            )
        try:
            self._source = harvester.create(fitting[0])
        except Exception as error:
            raise DeviceError(
                f"camera {self._name}: {type(error).__name__}: {error}",
                code=Code.NO_CAMERA,
                hint="is another program using it?",
            ) from error


def _producers(given: str) -> list[Path]:
    if given:
        return [Path(given)]
    folders = [Path(place) for place in os.environ.get(PRODUCERS, "").split(os.pathsep) if place]
    return sorted(file for folder in folders for file in folder.glob("*.cti"))


def _harvester(producers: list[Path]) -> Any:  # noqa: ANN401 - a harvester
    """Return what knows the cameras of these producers; a process may open each producer only once."""
    module = library("harvesters.core", "genicam")
    if not producers:
        raise DeviceError(
            "no GenTL producer is known",
            code=Code.NO_CAMERA,
            hint=f"install the maker's software, which sets {PRODUCERS}, or name it: genicam:,maker.cti",
        )
    missing = [file for file in producers if not file.is_file()]
    if missing:
        raise DeviceError(f"{missing[0]}: no such producer", code=Code.NO_CAMERA)
    key = tuple(file.resolve() for file in producers)
    if key not in _HARVESTERS:
        _HARVESTERS[key] = module.Harvester()
        for file in key:
            _HARVESTERS[key].add_file(str(file))
        # Looking again later would take open cameras away.
        _HARVESTERS[key].update()
    return _HARVESTERS[key]


def _identity(info: Any) -> str:  # noqa: ANN401 - what a harvester knows of a device
    try:
        return str(info.serial_number or info.id_)
    except Exception:  # noqa: BLE001 - producers raise what they like where it is not known
        return str(info.id_)


def _stamp(buffer: Any) -> int:  # noqa: ANN401 - of a harvester
    """Return the time of the exposure in ns on the camera's clock, 0 where it does not tell."""
    try:
        return int(buffer.timestamp_ns or 0)
    except Exception:  # noqa: BLE001 - producers raise what they like where it is not known
        return 0


def _grey(label: str, component: Any) -> Grey:  # noqa: ANN401 - of a buffer
    """Return a component of a buffer as 8 bits of grey (H, W), copied out of the buffer."""
    form, height, width = component.data_format, component.height, component.width
    if form in BITS:
        pixels = component.data.reshape(height, width)
        return np.array(pixels if BITS[form] == 8 else pixels >> (BITS[form] - 8), dtype=np.uint8)
    if form in COLOURS:
        channels = {"R": 3, "B": 3}[form[0]] + ("a" in form) if "Bayer" not in form else 1
        shape = (height, width) if channels == 1 else (height, width, channels)
        return np.array(cv2.cvtColor(component.data.reshape(shape), COLOURS[form]), dtype=np.uint8)
    raise DeviceError(
        f"{label}: pixels in {form}, expected one of {', '.join([*BITS, *COLOURS])}",
        code=Code.BAD_IMAGE,
        hint="choose Mono8 in the maker's viewer",
    )
