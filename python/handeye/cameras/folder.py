"""A folder into which someone or something drops pictures, as a camera."""

import os
import time
from collections.abc import Callable
from pathlib import Path

from handeye.cameras.protocol import Frame, Grey
from handeye.errors import DeviceError, HandeyeError

SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"})
# A file that has not grown for so long is taken as complete.
SETTLED_S = 0.2


class WatchedFolder:
    """Waits for the next new picture in a folder.

    Parameters
    ----------
    folder
        Where pictures arrive. Those that lie there already are never taken.
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
        self._seen = set(self._listed())

    def grab(self, label: str) -> Frame:
        """Return the next picture that arrives.

        Raises
        ------
        DeviceError
            None arrives in time, the folder is gone, or the file is no picture.
        """
        if self._announce is not None:
            self._announce(f"{label}: save a picture into {self._folder}")
        deadline = time.monotonic() + self._patience_s
        while time.monotonic() < deadline:
            listed = self._listed()
            for name in sorted(set(listed) - self._seen):
                path = self._folder / name
                if not self._is_settled(path):
                    continue
                self._seen.add(name)
                try:
                    return Frame(self._read(path), timestamp_s=listed[name])
                except HandeyeError as error:
                    raise DeviceError(error.message, code="bad_image", hint=error.hint) from error
            time.sleep(0.05)
        raise DeviceError(
            f"{self._folder}: no new picture within {self._patience_s:g} s",
            code="timeout",
            hint=f"save pictures there as {', '.join(sorted(SUFFIXES))}",
        )

    def _listed(self) -> dict[str, float]:
        """Return the pictures in the folder, with the time of their last change."""
        try:
            with os.scandir(self._folder) as entries:
                return {
                    entry.name: entry.stat().st_mtime
                    for entry in entries
                    if Path(entry.name).suffix.lower() in SUFFIXES
                    and not entry.name.startswith(".")
                    and entry.is_file()
                }
        except OSError as error:
            raise DeviceError(f"{self._folder}: {error.strerror or error}", code="folder_gone") from error

    def _is_settled(self, path: Path) -> bool:
        try:
            before = path.stat().st_size
            time.sleep(SETTLED_S)
            return before > 0 and path.stat().st_size == before
        except OSError:
            return False
