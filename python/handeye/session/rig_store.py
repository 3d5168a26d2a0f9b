"""The session of several cameras on disk: the same journal, and a recording of stations."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import IO, Any, Self

from handeye.datasets.rig_format import read_stations_apart, recording_of
from handeye.datasets.rig_writing import header_of, update_rig
from handeye.session.comparing import check_same, is_current, same_view
from handeye.session.entry import stations_of
from handeye.session.journal import Journal, Settings
from handeye.session.store import RECORDING_FILE, Store, create, opened
from handeye.types import CameraView, RigRecording, RigTruth, Station, View


class RigStore(Store):
    """The session of several cameras; `begun_with` is the recording before its first station.

    Use `create_rig_session` or `open_rig_session`.
    """

    begun_with: RigRecording
    _recording: RigRecording

    @property
    def recording(self) -> RigRecording:
        """The recording of the stations so far."""
        return self._recording

    @classmethod
    def of(cls, root: Path, settings: Settings, journal: Journal, lock: IO[bytes]) -> tuple[Self, bool]:
        """Return the store of a folder, and whether its recording is as the journal has it.

        Raises
        ------
        InputError
            The recording holds what the journal lacks, or was edited.
        """
        store = cls(root, settings.asked, journal, lock)
        base = recording_of(settings.recording)
        path = root / RECORDING_FILE
        if not path.exists() and not path.is_symlink():
            update_rig(base, root)
            current = False
        else:
            found = read_stations_apart(root)
            taken = [entry.station for entry in journal.entries if entry.station is not None]
            same_header = header_of(found.recording) == header_of(base)
            check_same(path, same_header, found.stations, taken, _same)
            current = is_current(found.stations, stations_of(journal.entries))
        store.begun_with = base
        store._recording = base.with_stations(stations_of(journal.entries))
        return store, current

    def views_through(self, camera: str, target: str) -> list[View]:
        """Return the views of one target through one camera."""
        return [
            one.view
            for station in self._recording.stations
            for one in station.views
            if (one.camera, one.target) == (camera, target)
        ]

    def check(self, pair: tuple[str, str], view: View) -> None:
        """Check that a view of a pair may be added.

        Raises
        ------
        InputError
            It may not.
        """
        self.begun_with.with_stations((Station((CameraView(*pair, view),)),))

    def reveal(self, truth: RigTruth) -> None:
        """Write what is true into the recording, once a simulated session has ended.

        Raises
        ------
        OutputError
            The system refuses to write.
        """
        seen = {one.target for station in self._recording.stations for one in station.views}
        targets = {name: pose for name, pose in truth.targets.items() if name in seen}
        self._recording = replace(self._recording, truth=RigTruth(truth.cameras, targets))
        update_rig(self._recording, self.folder)

    def bring_up_to_date(self) -> None:
        """Write the recording that follows from the journal.

        Raises
        ------
        OutputError
            The system refuses to write.
        """
        self._recording = self._recording.with_stations(stations_of(self.entries))
        update_rig(self._recording, self.folder)


def create_rig_session(folder: Path, recording: RigRecording, settings: Mapping[str, Any]) -> RigStore:
    """Make the folder of a new session: all of it or nothing.

    Raises
    ------
    OutputError
        The folder is not empty, or the system refuses to write.
    """
    empty = replace(recording, stations=(), truth=None)
    create(folder, Settings(settings, header_of(empty)), lambda partial: update_rig(empty, partial))
    return open_rig_session(folder)


def open_rig_session(folder: Path) -> RigStore:
    """Open a session of several cameras to go on with it; see `handeye.session.store.open_session`."""
    return opened(folder, RigStore)


def _same(station: Station, known: Station) -> bool:
    return len(station.views) == len(known.views) and all(
        (one.camera, one.target) == (other.camera, other.target) and same_view(one.view, other.view)
        for one, other in zip(station.views, known.views, strict=True)
    )
