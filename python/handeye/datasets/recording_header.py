"""How a `recording.toml` begins: its format and version."""

from pathlib import Path
from typing import Any

from handeye.codes import Code
from handeye.datasets.reading import MIB, read_text
from handeye.datasets.toml_reading import parse_toml
from handeye.errors import InputError

FORMAT = "handeye-recording"
VERSION = 1
# Several cameras or targets: see `rig_format`.
RIG_VERSION = 2
FILE_NAME = "recording.toml"
MAX_BYTES = 2 * MIB


def read_versioned(file: Path) -> dict[str, Any]:
    """Return what a `recording.toml` holds, of a version that this program reads.

    Raises
    ------
    InputError
        No TOML, another format, or a newer version.
    """
    data = parse_toml(read_text(file, MAX_BYTES), file)
    if data.get("format") != FORMAT:
        raise InputError(
            f"{file}: format {str(data.get('format'))[:60]!r}, expected {FORMAT!r}", code=Code.UNKNOWN_FORMAT
        )
    version = data.get("version")
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise InputError(
            f"{file}: version {str(version)[:60]!r}, expected {VERSION} or {RIG_VERSION}",
            code=Code.INVALID_FIELD,
        )
    if version > RIG_VERSION:
        raise InputError(
            f"{file}: version {version}, this program reads up to {RIG_VERSION}",
            code=Code.NEWER_VERSION,
            hint="update handeye, or write the recording with the older version",
        )
    return data


def holds_several(folder: Path) -> bool:
    """Tell whether a recording is one of several cameras or targets.

    Raises
    ------
    InputError
        No recording of a version that this program reads.

    Examples
    --------
    >>> holds_several(folder)
    False
    """
    return read_versioned(folder / FILE_NAME)["version"] == RIG_VERSION
