"""The options of the page in the browser, and how commands show it."""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from cyclopts import Parameter, validators

from handeye.codes import Code
from handeye.datasets.writing import write_file
from handeye.errors import InputError
from handeye.estimation import Estimate, Measurements, RigCalibration
from handeye.importing import Opened, OpenedRig
from handeye.robots import Arm
from handeye.session.drivers import MANUAL, Person
from handeye.session.prepared import Prepared
from handeye.session.rig_prepared import RigPrepared
from handeye.session.settings import Configuration
from handeye.session.stepping import Stepping
from handeye.session.store import Store

if TYPE_CHECKING:
    from handeye.session.deciding import Considered
    from handeye.ui import Server

E = TypeVar("E")
# Numbers of views, and the radii in mm and deg that were stated after so many.
Curve = tuple[tuple[int, float, float], ...]
# How the formats that a folder is watched for begin.
_BEGINNINGS = {b"\x89PNG": "png", b"\xff\xd8\xff": "jpg", b"BM": "bmp", b"II*\x00": "tif", b"MM\x00*": "tif"}


@Parameter(name="*", group="Page in the browser")
@dataclass(frozen=True)
class Page:
    """A page that shows everything and from which a session is driven."""

    ui: bool = False
    """Show it in the browser, at the address that is printed."""
    ui_host: str = "127.0.0.1"
    """Address to listen on. Beyond this machine (such as 0.0.0.0) the printed address holds a token, without
    which nobody sees anything; the traffic is not encrypted."""
    ui_port: Annotated[int, Parameter(validator=validators.Number(gte=0, lte=65535))] = 0
    """Port to listen on; any that is free without it."""


class Live:
    """The page of a session: what the session is told to do comes from there.

    Parameters
    ----------
    page
        Where it listens.
    configuration
        Of the session; a picture that is brought to the page goes into a watched folder.
    """

    def __init__(self, page: Page, configuration: Configuration) -> None:
        from handeye.ui import Dashboard, Hub, Pace, RigDashboard, Server  # noqa: PLC0415 - others need no server

        self.hub = Hub()
        self.observer: Dashboard | RigDashboard = (
            Dashboard(self.hub) if configuration.rig is None else RigDashboard(self.hub)
        )
        self._pace = Pace(waits=configuration.driver.partition(":")[0] != MANUAL)
        kind, _, folder = configuration.images.partition(":")
        upload = _Upload(Path(folder)) if kind == "folder" else None
        self._server = Server(self.hub, page.ui_host, page.ui_port, pictures=self.observer, upload=upload)
        self.person = Person(self.hub.ask, self.hub.say)
        self.confirm = self._pace.confirm
        announce(self._server)

    def run(self, session: Stepping[Any, E], store: Store, prepared: Prepared | RigPrepared) -> E:
        """Run a session, of one camera or of several, as people at the page ask for it."""
        from handeye.ui import More, drive  # noqa: PLC0415

        known: Any = prepared  # goes with the store
        observer: Any = self.observer

        def again(asked: More) -> Stepping[Any, E]:
            configuration = replace(
                prepared.configuration,
                accuracy_mm=asked.accuracy_mm,
                accuracy_deg=asked.accuracy_deg,
                most_views=asked.most_views,
            )
            return replace(known, configuration=configuration).session(store)

        try:
            observer.prepare(prepared, store)
            return drive(session, prepared.cell, self.observer, self._pace, again)
        finally:
            self._server.close()


class _Upload:
    """Puts pictures that are brought into the folder that a session watches."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._count = folder, 0

    def __call__(self, content: bytes) -> str:
        ending = next((e for start, e in _BEGINNINGS.items() if content.startswith(start)), None)
        if ending is None:
            raise InputError("not a picture: expected PNG, JPEG, BMP or TIFF", code=Code.BAD_IMAGE)
        while True:
            self._count += 1
            path = self._folder / f"brought_{self._count:03d}.{ending}"
            if not path.exists():
                break
        write_file(path, content)
        return f"The picture was written as {path.name}."


def show_views(
    page: Page,
    opened: Opened,
    measurements: Measurements,
    estimate: Estimate,
    *,
    arm: Arm | None = None,
    description: str | None = None,
    considered: "Considered | None" = None,
    chosen: str | None = None,
    known: Curve = (),
    planned: Curve = (),
) -> "Server":
    """Serve a page about views that are there already, and return its server."""
    from handeye.ui import Hub, Server, Still  # noqa: PLC0415 - other commands need no server
    from handeye.ui.documents import Shown  # noqa: PLC0415

    hub: Hub = Hub()
    joints = [view.joints_rad for view in measurements.views]
    shown = Shown(
        measurements.mounting,
        measurements.camera,
        measurements.target,
        arm if all(q is not None for q in joints) else None,
        measurements.views,
        estimate,
        considered=considered,
        chosen=chosen,
        known=known,
        planned=planned,
        rejected={**measurements.rejected, **dict(opened.missed)},
    )
    still = Still(hub, shown, opened.folder, opened.recording.name, description)
    return Server(hub, page.ui_host, page.ui_port, pictures=still)


def show_rig(
    page: Page, opened: OpenedRig, rig: RigCalibration, *, arm: Arm | None, description: str | None
) -> "Server":
    """Serve a page about all cameras of a rig, and return its server."""
    from handeye.ui import Hub, Server, Still  # noqa: PLC0415 - other commands need no server
    from handeye.ui.rigs import shown_rig  # noqa: PLC0415

    def rejected(camera: str, target: str) -> dict[str, str]:
        measured = rig.estimate.fit.measurements.pairs[camera, target]
        return {**measured.rejected, **dict(opened.missed.get(camera, {}))}

    hub = Hub()
    joints = [station.joints_rad for station in opened.recording.stations]
    known = arm if all(q is not None for q in joints) else None
    shown = shown_rig(rig.estimate.fit.measurements, rig.estimate, known, rejected)
    still = Still(hub, shown, opened.folder, opened.recording.name, description)
    return Server(hub, page.ui_host, page.ui_port, pictures=still)


def announce(server: "Server") -> None:
    """Say on stderr where the page is."""
    print(f"page: {server.address}", file=sys.stderr, flush=True)


def serve(server: "Server") -> None:
    """Keep a page open until Ctrl-C."""
    announce(server)
    print("Ctrl-C ends it", file=sys.stderr, flush=True)
    try:
        Event().wait()
    except KeyboardInterrupt:
        print(file=sys.stderr)
    finally:
        server.close()
