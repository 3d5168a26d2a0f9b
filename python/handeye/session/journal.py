"""The journal: one line of JSON per attempt, each with a checksum over itself and everything before it.

A line ends in ``,"chain":"..."}``: BLAKE2b (RFC 7693, 16 bytes) over the checksum of the line before and the
line without its own; the first follows the checksum of the settings. So a line that was changed, left out,
put in or moved is noticed, and so are settings that were changed half-way. Lines of sessions of version 1
have no checksum; those that are added to them have.
"""

import contextlib
import hashlib
import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handeye.codes import Code
from handeye.datasets.reading import MIB, read_bytes, read_text, reason
from handeye.errors import InputError, OutputError
from handeye.session.entry import Entry

SETTINGS_FILE, JOURNAL_FILE = "session.json", "journal.jsonl"
FORMAT, VERSION, UNCHAINED_VERSION = "handeye-session", 2, 1
MAX_SETTINGS_BYTES, MAX_JOURNAL_BYTES = 4 * MIB, 256 * MIB

_CHAINED = re.compile(rb'(?P<body>\{.*),"chain":"(?P<chain>[0-9a-f]{32})"\}', re.DOTALL)


@dataclass(frozen=True)
class Settings:
    """What a session was asked for, and the recording that it began with.

    Parameters
    ----------
    asked
        Plain values.
    recording
        Plain values of the recording without views; None in sessions of version 1.
    version
        Of the format.
    """

    asked: Mapping[str, Any]
    recording: Mapping[str, Any] | None = None
    version: int = VERSION

    @property
    def digest(self) -> bytes:
        """Checksum that the journal begins with."""
        values = {"settings": self.asked, "recording": self.recording}
        text = json.dumps(values, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return _digest(text.encode())

    def to_bytes(self) -> bytes:
        """Return the file."""
        document = {
            "format": FORMAT,
            "version": VERSION,
            "digest": self.digest.hex(),
            "settings": self.asked,
            "recording": self.recording,
        }
        return (json.dumps(document, indent=1, allow_nan=False) + "\n").encode()


class Journal:
    """The attempts of a session, in memory and on the disk.

    `torn` is how many bytes of a last line were found that was not written to its end.
    """

    def __init__(
        self, path: Path, entries: list[Entry], size: int, chain: bytes, ending: bytes = b"", torn: int = 0
    ) -> None:
        self._path = path
        self._entries = entries
        self._size = size
        self._chain = chain
        self._ending = ending
        self.torn = torn

    @property
    def entries(self) -> tuple[Entry, ...]:
        """All attempts so far, in order."""
        return tuple(self._entries)

    def mend(self) -> None:
        """Cut off a last line that was not written to its end, or end it where only the line feed is missing.

        Raises
        ------
        OutputError
            The system refuses to write.
        """
        try:
            if self._path.stat().st_size == self._size and not self._ending:
                return
            with self._path.open("r+b") as file:
                file.truncate(self._size)
                file.seek(self._size)
                file.write(self._ending)
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise OutputError(f"{self._path}: cannot be written: {reason(error)}") from error
        self._size += len(self._ending)
        self._ending = b""

    def append(self, entry: Entry) -> None:
        """Add an attempt; on return it is on the disk.

        Raises
        ------
        OutputError
            The system refuses to write; the journal is then as it was.
        """
        body = json.dumps(entry.to_dict(), separators=(",", ":"), allow_nan=False).encode()
        chain = _digest(self._chain + body)
        line = body[:-1] + b',"chain":"' + chain.hex().encode() + b'"}\n'
        try:
            with self._path.open("r+b") as file:
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
                f"{self._path}: cannot be written: {reason(error)}",
                hint="make room, then go on with --resume; nothing is lost",
            ) from error
        self._size += len(line)
        self._chain = chain
        self._entries.append(entry)


def read_settings(folder: Path) -> Settings:
    """Return what a session was asked for.

    Raises
    ------
    InputError
        No session, a file that is not what it should be, or one that was changed.
    """
    path = folder / SETTINGS_FILE
    try:
        document: Any = json.loads(read_text(path, MAX_SETTINGS_BYTES))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not JSON: {str(error)[:200]}", code=Code.NOT_JSON) from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:  # pyright: ignore[reportUnknownMemberType]
        raise InputError(f"{path}: no session of ours", code=Code.UNKNOWN_FORMAT)
    fields: dict[str, Any] = document  # pyright: ignore[reportUnknownVariableType]
    version = fields.get("version")
    if version not in {UNCHAINED_VERSION, VERSION} or isinstance(version, bool):
        raise InputError(
            f"{path}: version {str(version)[:60]}, this program reads up to {VERSION}",
            code=Code.NEWER_VERSION,
            hint="update handeye",
        )
    asked, recording = fields.get("settings"), fields.get("recording")
    if not isinstance(asked, dict) or (version == VERSION and not isinstance(recording, dict)):
        raise InputError(f"{path}: no settings", code=Code.INVALID_FIELD)
    settings = Settings(asked, recording if version == VERSION else None, version)  # pyright: ignore[reportUnknownArgumentType]
    try:
        changed = version == VERSION and fields.get("digest") != settings.digest.hex()
    except (ValueError, RecursionError, TypeError) as error:
        raise InputError(f"{path}: no settings: {str(error)[:200]}", code=Code.INVALID_FIELD) from error
    if changed:
        raise InputError(
            f"{path}: the settings were changed after the session began",
            code=Code.EDITED,
            hint="undo the change, or begin a new session with other settings",
        )
    return settings


def read_journal(folder: Path, settings: Settings | None = None) -> Journal:
    """Return the journal of a session; a last line that was not written to its end is left out, and counted.

    It was cut off, or the system had made room for it and not yet filled it: then it holds zeros. Where only
    the line feed is missing, the line is kept.

    Raises
    ------
    InputError
        No such file, or lines that were changed, lost, put in or moved.
    """
    known = settings or read_settings(folder)
    path = folder / JOURNAL_FILE
    content = read_bytes(path, MAX_JOURNAL_BYTES)
    *whole, rest = content.split(b"\n")
    torn = 0
    if whole and not rest.strip(b"\0") and b"\0" in whole[-1]:
        torn = len(whole.pop()) + 1
    chain, size, ending = known.digest, 0, b""
    entries: list[Entry] = []
    chained = known.version >= VERSION
    for number, line in enumerate(whole, start=1):
        body, found = _parts(line)
        chained = chained or found is not None
        chain = _digest(chain + body)
        entry = _entry(body, f"{path}: line {number}", number) if not chained or chain == found else None
        if entry is None:
            before = f"lines 1 to {number - 1} are as they were written" if number > 1 else "no line fits"
            raise InputError(
                f"{path}: line {number} does not fit its checksum: it was changed, or lines before it were "
                f"lost, put in or moved; {before}",
                code=Code.EDITED,
                hint="restore the file from a copy; handeye solve uses the recording without it",
            )
        entries.append(entry)
        size += len(line) + 1
    if rest and not torn:
        body, found = _parts(rest)
        following = _digest(chain + body)
        if found == following:
            # Whole but for the line feed.
            entries.append(_entry(body, f"{path}: line {len(entries) + 1}", len(entries) + 1))
            chain, size, ending, rest = following, size + len(rest), b"\n", b""
    return Journal(path, entries, size, chain, ending, torn + len(rest))


def _parts(line: bytes) -> tuple[bytes, bytes | None]:
    """Return a line without its checksum, and the checksum; None if it has none."""
    match = _CHAINED.fullmatch(line)
    if match is None:
        return line, None
    return match["body"] + b"}", bytes.fromhex(match["chain"].decode())


def _entry(body: bytes, where: str, number: int) -> Entry:
    try:
        data = json.loads(body)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{where}: not JSON: {str(error)[:200]}", code=Code.NOT_JSON) from error
    entry = Entry.from_dict(data, where)
    if entry.number != number:
        raise InputError(
            f"{where}: attempt {entry.number}, expected {number}",
            code=Code.EDITED,
            hint="restore the file from a copy; handeye solve uses the recording without it",
        )
    return entry


def _digest(content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=16).digest()
