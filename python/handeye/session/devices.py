"""Which drivers there are, whether they can be loaded, and which devices each of them sees."""

from dataclasses import dataclass
from enum import StrEnum
from importlib.metadata import EntryPoint
from pathlib import Path

from handeye.codes import Code
from handeye.errors import DeviceError, printable
from handeye.extension import CAMERAS as CAMERA_GROUP
from handeye.extension import ROBOTS as ROBOT_GROUP
from handeye.extension import announced
from handeye.session.calls import MAX_MESSAGE, Calls
from handeye.session.drivers import CAMERAS, ROBOTS

# A library that looks for devices may hang.
SECONDS = 20.0
# What the built-in drivers are opened with.
_BUILT_IN = {
    "simulated": "a cell in the computer; the default",
    "manual": "a person who moves the arm: manual, manual:kuka, manual:ur/mm",
    "replay": "the views of a recording: replay:FOLDER",
    "folder": "pictures that somebody saves: folder:PATH",
    "opencv": "what OpenCV opens: opencv:0, opencv:ADDRESS",
}


class DriverState(StrEnum):
    """Whether a driver can be used."""

    FOUND = "found"
    """It sees devices."""
    READY = "ready"
    """It can be used; it sees no device, or cannot tell."""
    MISSING = "missing"
    """Its library, or something else that it needs, is not installed."""
    BROKEN = "broken"
    """It cannot be loaded, or fails as it looks for devices."""


@dataclass(frozen=True)
class DriverReport:
    """A driver by name, what it sees (address and description of each device), and what it would need."""

    kind: str
    name: str
    package: str
    state: DriverState
    detail: str
    hint: str | None = None
    devices: tuple[tuple[str, str], ...] = ()


def driver_reports() -> list[DriverReport]:
    """Return every driver, robots first; nothing moves, and no network is searched."""
    reports: list[DriverReport] = []
    for kind, group, built_in in (("robot", ROBOT_GROUP, ROBOTS), ("camera", CAMERA_GROUP, CAMERAS)):
        reports += [_of_our_own(kind, name) for name in built_in]
        reports += [_of_a_package(kind, point) for point in announced(group).values()]
    return reports


def _of_our_own(kind: str, name: str) -> DriverReport:
    devices = _video_devices() if name == "opencv" else ()
    state = DriverState.FOUND if devices else DriverState.READY
    return DriverReport(kind, name, "handeye", state, _BUILT_IN[name], devices=devices)


def _video_devices() -> tuple[tuple[str, str], ...]:
    """Return the cameras that Linux knows, by the numbers that OpenCV takes."""
    found: list[tuple[str, str]] = []
    for place in sorted(Path("/sys/class/video4linux").glob("video[0-9]*")):
        try:
            name = (place / "name").read_text(errors="replace").strip()
        except OSError:
            name = ""
        found.append((place.name.removeprefix("video"), printable(name, 80)))
    return tuple(found)


def _of_a_package(kind: str, point: EntryPoint) -> DriverReport:
    package = "unknown" if point.dist is None else point.dist.name
    try:
        look = getattr(Calls("driver").run(SECONDS, point.load), "found", None)
        if look is None:
            return DriverReport(
                kind, point.name, package, DriverState.READY, f"name its address: {point.name}:ADDRESS"
            )
        answer = Calls("driver").run(SECONDS, look)
        devices = tuple((printable(a, 80), printable(text, 120)) for a, text in answer)
    except DeviceError as error:
        missing = error.code in {Code.LIBRARY_MISSING, Code.NO_CAMERA}
        state = DriverState.MISSING if missing else DriverState.BROKEN
        return DriverReport(kind, point.name, package, state, error.message, error.hint)
    except (TypeError, ValueError) as error:
        why = printable(f"found() returns no pairs of text: {error}", MAX_MESSAGE)
        return DriverReport(kind, point.name, package, DriverState.BROKEN, why)
    if devices:
        return DriverReport(
            kind, point.name, package, DriverState.FOUND, f"{len(devices)} found", devices=devices
        )
    detail = f"sees none by itself; name its address: {point.name}:ADDRESS"
    return DriverReport(kind, point.name, package, DriverState.READY, detail)
