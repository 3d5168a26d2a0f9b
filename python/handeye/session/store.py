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
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import IO, Any, Self, TypeVar

from handeye.codes import Code
from handeye.datasets import write_recording
from handeye.datasets.reading import existing_folder, is_file, reason
from handeye.datasets.recording_format import ViewsApart, read_views_apart
from handeye.datasets.recording_writing import RecordingFolder, write_empty_recording
from handeye.datasets.writing import new_folder, remove_partials, replace_file, write_file
from handeye.errors import InputError, OutputError
from handeye.session.comparing import check_same, is_current, same_view
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
S = TypeVar("S", bound="Store")


class Store(ABC):
    """The folder of one session, open for one process at a time; of one camera or of several.

    Close it at the end. `self_calibration` finds the camera where none was given.
    """

    def __init__(self, folder: Path, settings: Mapping[str, Any], journal: Journal, lock: IO[bytes]) -> None:
        self.folder = folder
        self.settings = settings
        self.self_calibration: SelfCalibration | None = None
        self._journal = journal
        self._lock = lock

    @classmethod
    @abstractmethod
    def of(cls, root: Path, settings: Settings, journal: Journal, lock: IO[bytes]) -> tuple[Self, bool]:
        """Return the store of a folder, and whether its recording is as the journal has it.

        Nothing is written but a recording that is lost altogether.

        Raises
        ------
        InputError
            The recording holds what the journal lacks, or was edited.
        """

    @abstractmethod
    def bring_up_to_date(self) -> None:
        """Write the recording that follows from the journal.

        Raises
        ------
        OutputError
            The system refuses to write.
        """

    @abstractmethod
    def views_through(self, camera: str, target: str) -> list[View]:
        """Return the views of one target through one camera."""

    @abstractmethod
    def check(self, pair: tuple[str, str], view: View) -> None:
        """Check that a view of a pair may be added.

        Raises
        ------
        InputError
            It may not.
        """

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
        """Add an attempt; on return it is on the disk, and the recording holds what it brought.

        Raises
        ------
        OutputError
            The system refuses to write. The journal is then as it was, or the entry is kept and only the
            recording lags behind, to be brought up to date with the next view or the next opening.
        """
        self._journal.append(entry)
        if entry.brought is not None or entry.withdraws is not None:
            self.bring_up_to_date()

    def close(self) -> None:
        """Let another process open the session."""
        self._lock.close()


class SessionStore(Store):
    """The session of one camera; `begun_with` is the recording before its first view.

    Use `create_session` or `open_session`.

    Examples
    --------
    >>> store = create_session(Path("session"), recording, {})
    >>> len(store.recording), store.close()
    (0, None)
    """

    begun_with: Recording
    _recording: Recording
    _on_disk: RecordingFolder

    @property
    def recording(self) -> Recording:
        """The recording of the views so far."""
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
        base = None if settings.recording is None else Recording.from_dict(settings.recording)
        store.self_calibration = None if base is None else SelfCalibration.of_session(settings.asked, base)
        views = views_of(journal.entries)
        path = root / RECORDING_FILE
        if base is not None and not path.exists() and not path.is_symlink():
            write_empty_recording(base, root)
            current = False
        else:
            found = read_views_apart(root)
            base = found.recording if base is None else base
            kept = _with_camera_of(base, found, journal, store.self_calibration)
            taken = [entry.view for entry in journal.entries if entry.view is not None]
            check_same(path, kept.to_dict() == base.to_dict(), found.views, taken, same_view)
            current = is_current(found.views, views)
        store.begun_with, store._recording = base, store._grown(base)
        store._on_disk = RecordingFolder(root)
        return store, current

    def _grown(self, recording: Recording) -> Recording:
        grown = recording.with_views(views_of(self.entries))
        return grown if self.self_calibration is None else self.self_calibration.put_into(grown)

    def views_through(self, camera: str, target: str) -> list[View]:
        """Return the views of the one target through the one camera."""
        del camera, target
        return list(self._recording.views)

    def check(self, pair: tuple[str, str], view: View) -> None:
        """Check that a view may be added.

        Raises
        ------
        InputError
            It may not.
        """
        del pair
        self._recording.with_views((*self._recording.views, view))

    def reveal(self, truth: Truth) -> None:
        """Write what is true into the recording, once a simulated session has ended.

        Raises
        ------
        OutputError
            The system refuses to write.
        """
        self._recording = replace(self._recording, truth=truth)
        self._on_disk.update(self._recording)

    def bring_up_to_date(self) -> None:
        """Write the recording that follows from the journal.

        Raises
        ------
        OutputError
            The system refuses to write.
        """
        self._recording = self._grown(self._recording)
        self._on_disk.update(self._recording)


def create_session(folder: Path, recording: Recording, settings: Mapping[str, Any]) -> SessionStore:
    """Make the folder of a new session: all of it or nothing.

    Parameters
    ----------
    folder
        A new folder.
    recording
        What its views will be written into; its own views are left out.
    settings
        Plain values for the program that goes on with it.

    Raises
    ------
    OutputError
        The folder is not empty, or the system refuses to write.

    Examples
    --------
    >>> store = create_session(Path("session"), recording, {})
    >>> is_session(store.folder), store.close()
    (True, None)
    """
    empty = recording.with_views(())
    asked = Settings(settings, replace(empty, truth=None).to_dict())
    create(folder, asked, lambda partial: write_recording(empty, partial))
    return open_session(folder)


def create(folder: Path, asked: Settings, write: Callable[[Path], None]) -> None:
    """Make the folder of a new session, its empty recording written by `write`: all of it or nothing.

    Raises
    ------
    OutputError
        The folder is not empty, or the system refuses to write.
    """
    content = asked.to_bytes()
    with new_folder(folder) as partial:
        write(partial)
        write_file(partial / SETTINGS_FILE, content)
        write_file(partial / JOURNAL_FILE, b"")


def open_session(folder: Path) -> SessionStore:
    """Open a session of one camera to go on with it.

    Raises
    ------
    InputError
        No session, one of a newer version, a file that was damaged or edited, or another process works on it.
    OutputError
        The recording lags behind the journal and cannot be written.

    Examples
    --------
    >>> create_session(Path("session"), recording, {}).close()
    >>> store = open_session(Path("session"))
    >>> store.entries, store.close()
    ((), None)
    """
    return opened(folder, SessionStore)


def opened(folder: Path, kind: type[S]) -> S:
    """Open a session of a kind, see `open_session`."""
    root = existing_folder(folder)
    settings = read_settings(root)
    lock = _locked(root / JOURNAL_FILE)
    try:
        # Everything is compared before anything is written.
        journal = read_journal(root, settings)
        store, current = kind.of(root, settings, journal, lock)
        journal.mend()
        for part in (root, root / "corners", root / "images"):
            remove_partials(part)
        if not current:
            store.bring_up_to_date()
    except BaseException:
        lock.close()
        raise
    return store


def is_session(folder: Path) -> bool:
    """Tell whether a folder holds a session.

    Examples
    --------
    >>> is_session(folder)
    False
    """
    return is_file(folder / SETTINGS_FILE) and is_file(folder / JOURNAL_FILE)


def _with_camera_of(
    base: Recording, found: ViewsApart, journal: Journal, learning: SelfCalibration | None
) -> Recording:
    """Return a recording without views, with its first camera where its own follows from views."""
    if learning is None:
        return found.recording
    known = {entry.view.name: entry.view for entry in journal.entries if entry.view is not None}
    views = [known[name] for name in found.views if name in known]
    then = learning.put_into(base.with_views(views)).camera
    if not same_camera(found.recording.camera, then):
        return found.recording
    return replace(found.recording, camera=base.camera)


def _locked(path: Path) -> IO[bytes]:
    """Keep other processes out until the file is closed, where the system can."""
    try:
        # Opening a pipe must not wait for a writer.
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0))
        file = os.fdopen(descriptor, "rb")
    except OSError as error:
        raise InputError(f"{path}: {reason(error)}", code=Code.MISSING_FILE) from error
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        file.close()
        raise InputError(f"{path}: not a regular file", code=Code.UNREADABLE)
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
            code=Code.IN_USE,
            hint="wait for it, or end it",
        ) from error
    return file
