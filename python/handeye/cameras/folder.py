"""A folder into which someone or something drops pictures, as a camera."""

import hashlib
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from handeye.cameras.protocol import Frame, Grey
from handeye.codes import Code
from handeye.errors import DeviceError, HandeyeError

SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"})
# A file that has not changed for so long is taken as complete.
SETTLED_S = 0.2
# No picture has more bytes.
MAX_BYTES = 512 << 20
_POLL_S = 0.05
# Clocks of file systems count in steps of up to two seconds.
CLOCK_STEP_S = 2.0


@dataclass(frozen=True)
class _State:
    """What a file system says of a file; it changes with every writing."""

    modified_ns: int
    changed_ns: int
    size: int
    number: int


class WatchedFolder:
    """Waits for the next new picture in a folder.

    A picture is new if its file came or was written again after it was asked for, is not older than the
    question by its own time, and holds what no picture before it held. A second file of the same picture
    (`a.png` beside `a.jpg`) is passed over.

    Parameters
    ----------
    folder
        Where pictures arrive.
    read
        Reads one file as grey values.
    patience_s
        How long to wait.
    announce
        Told what is waited for.

    Raises
    ------
    DeviceError
        The folder cannot be read.
    """

    def __init__(
        self,
        folder: Path,
        read: Callable[[Path], Grey],
        *,
        patience_s: float = 600.0,
        announce: Callable[[str], None] | None = None,
    ) -> None:
        self._folder = folder
        self._read = read
        self._patience_s = patience_s
        self._announce = announce
        self._digests: set[bytes] = set()
        self._stems: dict[str, str] = {}
        self._listed()

    def grab(self, label: str) -> Frame:
        """Return the next picture that arrives.

        Raises
        ------
        DeviceError
            None arrives in time, the folder is gone, or the file is no picture.
        """
        old, asked_s, began = self._listed(), time.time(), time.monotonic()
        # What is being written as it is asked for was exposed before.
        growing = {name for name, state in old.items() if asked_s - state.modified_ns / 1e9 < SETTLED_S}
        if self._announce is not None:
            self._announce(f"{label}: save a picture into {self._folder}")
        watched, since = old, dict.fromkeys(old, began)
        passed: dict[str, str] = {}
        while (now := time.monotonic()) < began + self._patience_s:
            listed = self._listed()
            since = {
                name: since[name] if watched.get(name) == state else now for name, state in listed.items()
            }
            watched = listed
            settled = [name for name in sorted(listed) if now - since[name] >= SETTLED_S]
            for name in settled:
                state = listed[name]
                if old.get(name) == state:
                    growing.discard(name)
                    continue
                old[name] = state
                if name in growing:
                    growing.discard(name)
                    passed[name] = "was being written when it was asked for"
                    continue
                frame, why = self._taken(name, state, asked_s)
                if frame is not None:
                    return frame
                passed[name] = why
            time.sleep(_POLL_S)
        also = "".join(f"; {name} {why}" for name, why in list(passed.items())[-3:])
        raise DeviceError(
            f"{self._folder}: no new picture within {self._patience_s:g} s{also}",
            code=Code.TIMEOUT,
            hint=f"save pictures there as {', '.join(sorted(SUFFIXES))}, once they are asked for",
        )

    def _taken(self, name: str, state: _State, asked_s: float) -> tuple[Frame | None, str]:
        """Return the picture of a file, or why it is no picture of now."""
        modified_s = state.modified_ns / 1e9
        if modified_s < asked_s - CLOCK_STEP_S:
            return None, f"is {asked_s - modified_s:.0f} s older than the question; is the clock right?"
        path = self._folder / name
        if self._stems.get(path.stem, name) != name:
            return None, f"is {self._stems[path.stem]} in another format"
        if state.size > MAX_BYTES:
            return None, f"has {state.size} bytes, and no picture has more than {MAX_BYTES}"
        try:
            with path.open("rb") as file:
                digest = hashlib.file_digest(file, "blake2b").digest()
        except OSError:
            return None, "is gone again"
        if digest in self._digests:
            return None, "holds a picture that was taken already"
        self._digests.add(digest)
        self._stems[path.stem] = name
        try:
            return Frame(self._read(path), timestamp_s=modified_s), ""
        except HandeyeError as error:
            raise DeviceError(error.message, code=Code.BAD_IMAGE, hint=error.hint) from error

    def _listed(self) -> dict[str, _State]:
        """Return the pictures in the folder that hold something, with their states."""
        found: dict[str, _State] = {}
        try:
            with os.scandir(self._folder) as entries:
                for entry in entries:
                    if Path(entry.name).suffix.lower() not in SUFFIXES or entry.name.startswith("."):
                        continue
                    try:
                        status = entry.stat() if entry.is_file() else None
                    except OSError:  # gone again
                        continue
                    if status is not None and status.st_size > 0:
                        found[entry.name] = _State(
                            status.st_mtime_ns, status.st_ctime_ns, status.st_size, status.st_ino
                        )
        except OSError as error:
            raise DeviceError(f"{self._folder}: {error.strerror or error}", code=Code.FOLDER_GONE) from error
        return found
