"""A session on disk: a recording that grows, and the journal of everything that was tried.

::

    recording.toml, corners/, images/   the views so far, as any recording
    session.json                        what was asked for, written once
    journal.jsonl                       one line per attempt, good or bad

The journal is the truth. A line is appended and brought to the disk before the arm moves again; the recording
is brought up to date from it, also on the next opening if the process died in between. A last line that was
cut off is as if it had never been written. So nothing is lost and nothing is doubled, whenever the process
ends.
"""

import contextlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

from handeye.datasets import read_recording, write_recording
from handeye.datasets.reading import MIB, existing_folder, is_file, reason
from handeye.datasets.writing import new_folder, replace_file, write_file
from handeye.errors import InputError, OutputError
from handeye.session.entry import Entry
from handeye.types import Recording, Truth

SETTINGS_FILE, JOURNAL_FILE, RECORDING_FILE = "session.json", "journal.jsonl", "recording.toml"
FORMAT, VERSION = "handeye-session", 1
MAX_SETTINGS_BYTES, MAX_JOURNAL_BYTES = 4 * MIB, 256 * MIB


class SessionStore:
    """The folder of one session, open for one process at a time.

    Use `create` or `open_session`; close it at the end.
    """

    def __init__(
        self, folder: Path, settings: Mapping[str, Any], recording: Recording, lock: IO[bytes] | None
    ) -> None:
        self.folder = folder
        self.settings = settings
        self._recording = recording
        self._lock = lock
        self._entries: list[Entry] = []
        self._size = 0

    @property
    def entries(self) -> tuple[Entry, ...]:
        """All attempts so far, in order."""
        return tuple(self._entries)

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
        line = json.dumps(entry.to_dict(), separators=(",", ":"), allow_nan=False).encode() + b"\n"
        path = self.folder / JOURNAL_FILE
        try:
            with path.open("r+b") as file:
                file.seek(self._size)
                try:
                    file.write(line)
                    file.flush()
                    os.fsync(file.fileno())
                except BaseException:
                    with contextlib.suppress(OSError):
                        file.truncate(self._size)
                    raise
        except OSError as error:
            raise OutputError(
                f"{path}: cannot be written: {reason(error)}",
                hint="make room, then go on with --resume; nothing is lost",
            ) from error
        self._size += len(line)
        self._entries.append(entry)
        if entry.view is not None:
            self._bring_up_to_date()

    def reveal(self, truth: Truth) -> None:
        """Write what is true into the recording, once a simulated session has ended.

        Raises
        ------
        OutputError
            The system refuses to write.
        """
        recording = self._recording
        self._recording = Recording(
            recording.name,
            recording.mounting,
            recording.camera,
            recording.target,
            recording.views,
            truth,
            recording.source,
        )
        write_recording(self._recording, self.folder, replace=True)

    def close(self) -> None:
        """Let another process open the session."""
        if self._lock is not None:
            self._lock.close()
            self._lock = None

    def load(self) -> None:
        """Read the journal and bring the recording up to date with it.

        Raises
        ------
        InputError
            A line in the middle that cannot be read.
        OutputError
            The recording lags behind and cannot be written.
        """
        path = self.folder / JOURNAL_FILE
        self._entries, self._size = read_journal(path)
        if path.stat().st_size > self._size:
            with path.open("r+b") as file:
                file.truncate(self._size)
                os.fsync(file.fileno())
        names = [entry.view.name for entry in self._entries if entry.view is not None]
        if names != [view.name for view in self._recording.views]:
            self._bring_up_to_date()

    def _bring_up_to_date(self) -> None:
        views = [entry.view for entry in self._entries if entry.view is not None]
        self._recording = self._recording.with_views(views)
        write_recording(self._recording, self.folder, replace=True)


def create_session(folder: Path, recording: Recording, settings: Mapping[str, Any]) -> SessionStore:
    """Make the folder of a new session: all of it or nothing.

    Raises
    ------
    OutputError
        The folder is not empty, or the system refuses to write.
    """
    document = {"format": FORMAT, "version": VERSION, "settings": settings}
    with new_folder(folder) as partial:
        write_recording(recording.with_views(()), partial)
        write_file(partial / SETTINGS_FILE, (json.dumps(document, indent=1, allow_nan=False) + "\n").encode())
        write_file(partial / JOURNAL_FILE, b"")
    return open_session(folder)


def open_session(folder: Path) -> SessionStore:
    """Open a session to go on with it.

    Raises
    ------
    InputError
        No session, one of a newer version, a damaged file, or another process works on it.
    OutputError
        The recording lags behind the journal and cannot be written.
    """
    root = existing_folder(folder)
    settings = read_settings(root)
    recording = read_recording(root).recording
    if recording.truth is not None:
        recording = Recording(
            recording.name,
            recording.mounting,
            recording.camera,
            recording.target,
            recording.views,
            None,
            recording.source,
        )
    store = SessionStore(root, settings, recording, _locked(root / JOURNAL_FILE))
    try:
        store.load()
    except BaseException:
        store.close()
        raise
    return store


def is_session(folder: Path) -> bool:
    """Tell whether a folder holds a session."""
    return is_file(folder / SETTINGS_FILE) and is_file(folder / JOURNAL_FILE)


def read_settings(folder: Path) -> Mapping[str, Any]:
    """Return what a session was asked for.

    Raises
    ------
    InputError
        No session, or a file that is not what it should be.
    """
    from handeye.datasets.reading import read_text  # noqa: PLC0415

    path = folder / SETTINGS_FILE
    try:
        document = json.loads(read_text(path, MAX_SETTINGS_BYTES))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not JSON: {error}", code="not_json") from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:  # pyright: ignore[reportUnknownMemberType]
        raise InputError(f"{path}: no session of ours", code="unknown_format")
    version = document.get("version")  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    if version != VERSION:
        raise InputError(
            f"{path}: version {str(version)[:60]}, this program reads {VERSION}",  # pyright: ignore[reportUnknownArgumentType]
            code="newer_version",
            hint="update handeye",
        )
    settings = document.get("settings")  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    if not isinstance(settings, dict):
        raise InputError(f"{path}: no settings", code="invalid_field")
    return settings  # pyright: ignore[reportUnknownVariableType]


def read_journal(path: Path) -> tuple[list[Entry], int]:
    """Return the attempts of a journal and the number of bytes they take; a line cut off at the end is left.

    Raises
    ------
    InputError
        No such file, or a line that was edited.
    """
    from handeye.datasets.reading import read_bytes  # noqa: PLC0415

    content = read_bytes(path, MAX_JOURNAL_BYTES)
    whole = content[: content.rfind(b"\n") + 1]
    entries: list[Entry] = []
    for number, line in enumerate(whole.splitlines(), start=1):
        try:
            data = json.loads(line)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{path}: line {number}: not JSON: {error}", code="not_json") from error
        entry = Entry.from_dict(data, f"{path}: line {number}")
        if entry.number != number:
            raise InputError(
                f"{path}: line {number}: attempt {entry.number}, expected {number}",
                code="edited",
                hint="restore the journal",
            )
        entries.append(entry)
    return entries, len(whole)


def _locked(path: Path) -> IO[bytes] | None:
    """Keep other processes out until the file is closed, where the system can."""
    try:
        import fcntl  # noqa: PLC0415 - there is none on Windows
    except ImportError:
        return None
    try:
        file = path.open("rb")
    except OSError as error:
        raise InputError(f"{path}: {reason(error)}", code="missing_file") from error
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
