"""A session on disk: a recording that grows, and the journal of everything that was tried.

::

    recording.toml, corners/, images/   the views so far, as any recording
    session.json                        what was asked for, written once
    journal.jsonl                       one line per attempt, good or bad

The journal is the truth. A line is appended and brought to the disk before the arm moves again; the recording
is brought up to date from it, also on the next opening if the process died in between, or a file of it was
lost. What the recording holds and the journal lacks is never deleted: such a session is refused.
"""

import os
import stat
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

from handeye.datasets import write_recording
from handeye.datasets.reading import existing_folder, is_file, reason
from handeye.datasets.recording_format import ViewsApart, read_views_apart
from handeye.datasets.recording_writing import RecordingFolder, write_empty_recording
from handeye.datasets.writing import new_folder, remove_partials, replace_file, write_file
from handeye.errors import InputError, OutputError
from handeye.session.entry import Entry, views_of
from handeye.session.journal import (
    JOURNAL_FILE,
    SETTINGS_FILE,
    Journal,
    Settings,
    read_journal,
    read_settings,
)
from handeye.session.self_calibration import SelfCalibration, same_camera
from handeye.types import Recording, Truth, View

RECORDING_FILE = "recording.toml"


class SessionStore:
    """The folder of one session, open for one process at a time.

    Use `create_session` or `open_session`; close it at the end. `begun_with` is the recording before its
    first view, and `self_calibration` finds the camera where none was given.
    """

    def __init__(
        self,
        folder: Path,
        settings: Mapping[str, Any],
        recording: Recording,
        journal: Journal,
        lock: IO[bytes],
        begun_with: Recording,
        self_calibration: SelfCalibration | None = None,
    ) -> None:
        self.folder = folder
        self.settings = settings
        self.begun_with = begun_with
        self.self_calibration = self_calibration
        self._recording = recording
        self._on_disk = RecordingFolder(folder)
        self._journal = journal
        self._lock = lock

    @property
    def entries(self) -> tuple[Entry, ...]:
        """All attempts so far, in order."""
        return self._journal.entries

    @property
    def notice(self) -> str | None:
        """What is to be said of how the journal was found; None for nothing."""
        if not self._journal.torn:
            return None
        return (
            f"{self.folder / JOURNAL_FILE}: the last line was not written to its end ({self._journal.torn} "
            f"bytes) and is left out; {len(self.entries)} attempts are whole, and the session goes on there"
        )

    @property
    def recording(self) -> Recording:
        """The recording of the views so far."""
        return self._recording

    def keep_image(self, name: str, png: bytes) -> str:
        """Write the image of a view; return its path in the folder. Writing it again replaces it.

        Raises
        ------
        OutputError
            The system refuses to write.
        """
        try:
            (self.folder / "images").mkdir(exist_ok=True)
        except OSError as error:
            raise OutputError(f"{self.folder}: cannot be written: {reason(error)}") from error
        path = f"images/{name}.png"
        replace_file(self.folder / path, png)
        return path

    def append(self, entry: Entry) -> None:
        """Add an attempt; on return it is on the disk, and the recording holds its view.

        Raises
        ------
        OutputError
            The system refuses to write. The journal is then as it was, or the entry is kept and only the
            recording lags behind, to be brought up to date with the next view or the next opening.
        """
        self._journal.append(entry)
        if entry.view is not None or entry.withdraws is not None:
            self.bring_up_to_date()

    def reveal(self, truth: Truth) -> None:
        """Write what is true into the recording, once a simulated session has ended.

        Raises
        ------
        OutputError
            The system refuses to write.
        """
        self._recording = replace(self._recording, truth=truth)
        self._on_disk.update(self._recording)

    def close(self) -> None:
        """Let another process open the session."""
        self._lock.close()

    def bring_up_to_date(self) -> None:
        """Write the recording that follows from the journal.

        Raises
        ------
        OutputError
            The system refuses to write.
        """
        grown = self._recording.with_views(views_of(self.entries))
        self._recording = grown if self.self_calibration is None else self.self_calibration.put_into(grown)
        self._on_disk.update(self._recording)


def create_session(folder: Path, recording: Recording, settings: Mapping[str, Any]) -> SessionStore:
    """Make the folder of a new session: all of it or nothing.

    Raises
    ------
    OutputError
        The folder is not empty, or the system refuses to write.
    """
    empty = recording.with_views(())
    asked = Settings(settings, replace(empty, truth=None).to_dict()).to_bytes()
    with new_folder(folder) as partial:
        write_recording(empty, partial)
        write_file(partial / SETTINGS_FILE, asked)
        write_file(partial / JOURNAL_FILE, b"")
    return open_session(folder)


def open_session(folder: Path) -> SessionStore:
    """Open a session to go on with it.

    Raises
    ------
    InputError
        No session, one of a newer version, a file that was damaged or edited, or another process works on it.
    OutputError
        The recording lags behind the journal and cannot be written.
    """
    root = existing_folder(folder)
    settings = read_settings(root)
    lock = _locked(root / JOURNAL_FILE)
    try:
        # Everything is compared before anything is written.
        journal = read_journal(root, settings)
        begun_with, recording, current, learning = _recording_of(root, settings, journal)
        journal.mend()
        for part in (root, root / "corners", root / "images"):
            remove_partials(part)
        store = SessionStore(root, settings.asked, recording, journal, lock, begun_with, learning)
        if not current:
            store.bring_up_to_date()
    except BaseException:
        lock.close()
        raise
    return store


def is_session(folder: Path) -> bool:
    """Tell whether a folder holds a session."""
    return is_file(folder / SETTINGS_FILE) and is_file(folder / JOURNAL_FILE)


def _recording_of(
    root: Path, settings: Settings, journal: Journal
) -> tuple[Recording, Recording, bool, SelfCalibration | None]:
    """Return the recording as it began, as it follows from the journal, and whether that lies on the disk.

    Last what finds the camera, where none was given.

    Raises
    ------
    InputError
        The recording holds what the journal lacks, or was edited.
    """
    views = views_of(journal.entries)
    taken = [entry.view for entry in journal.entries if entry.view is not None]
    base = None if settings.recording is None else Recording.from_dict(settings.recording)
    path = root / RECORDING_FILE
    learning = None if base is None else SelfCalibration.of_session(settings.asked, base)

    def grown(begun_with: Recording) -> Recording:
        recording = begun_with.with_views(views)
        return recording if learning is None else learning.put_into(recording)

    if base is not None and not path.exists() and not path.is_symlink():
        write_empty_recording(base, root)
        return base, grown(base), False, learning
    found = read_views_apart(root)
    if base is None:
        base = found.recording
    _check_same(path, base, found, taken, learning)
    current = list(found.views) == [view.name for view in views] and not any(
        isinstance(view, InputError) for view in found.views.values()
    )
    return base, grown(base), current, learning


def _check_same(
    path: Path, base: Recording, found: ViewsApart, views: list[View], learning: SelfCalibration | None
) -> None:
    """Refuse a recording that holds what the journal lacks.

    Raises
    ------
    InputError
        It does.
    """
    known = {view.name: view for view in views}
    more = [name for name in found.views if name not in known]
    if more:
        raise InputError(
            f"{path}: holds {', '.join(more[:10])}, which no attempt in the journal took: it was cut "
            f"after {len(views)} views",
            code="journal_cut",
            hint=f"restore {JOURNAL_FILE} from a copy; handeye solve uses the recording as it is",
        )
    kept = found.recording
    if learning is not None:
        then = learning.put_into(base.with_views(known[name] for name in found.views)).camera
        if same_camera(kept.camera, then):
            kept = replace(kept, camera=base.camera)
    if kept.to_dict() != base.to_dict():
        raise InputError(
            f"{path}: name, source, mounting, camera or target are not those that the session began with",
            code="edited",
            hint="undo the change, or begin a new session",
        )
    for name, view in found.views.items():
        if isinstance(view, InputError):
            if view.code != "missing_file":
                raise view
        elif not _same(view, known[name]):
            raise InputError(
                f"{path}: view {name} is not as in the journal: its row or its corners were edited",
                code="edited",
                hint="undo it, or delete the file of its corners: it is written again from the journal",
            )


def _same(view: View, known: View) -> bool:
    one, other = view.to_dict(), known.to_dict()
    if one.get("image") is None:  # lost, and not kept in the journal
        other.pop("image", None)
    return one == other


def _locked(path: Path) -> IO[bytes]:
    """Keep other processes out until the file is closed, where the system can."""
    try:
        # Opening a pipe must not wait for a writer.
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0))
        file = os.fdopen(descriptor, "rb")
    except OSError as error:
        raise InputError(f"{path}: {reason(error)}", code="missing_file") from error
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        file.close()
        raise InputError(f"{path}: not a regular file", code="unreadable")
    try:
        import fcntl  # noqa: PLC0415 - there is none on Windows
    except ImportError:
        return file
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        file.close()
        raise InputError(
            f"{path.parent}: another process works on this session",
            code="in_use",
            hint="wait for it, or end it",
        ) from error
    return file
