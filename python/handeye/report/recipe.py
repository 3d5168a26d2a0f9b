"""How to get the same again."""

import hashlib
import json
import platform
from importlib.metadata import PackageNotFoundError, version

from handeye.report.document import Recipe
from handeye.types import Recording

_PACKAGES = ("numpy", "opencv-contrib-python-headless")


def recipe(command: str, recording: Recording | None, made: str | None) -> Recipe:
    """Return the recipe of a report that a command makes, now."""
    return Recipe(
        command=command,
        handeye_version=version("handeye"),
        python=platform.python_version(),
        packages={name: found for name in _PACKAGES if (found := _version(name)) is not None},
        recording_sha256=None if recording is None else recording_hash(recording),
        made=made,
    )


def recording_hash(recording: Recording) -> str:
    """Return the SHA-256 of everything that an answer depends on: its values, not the bytes of its files."""
    values = recording.to_dict()
    values.pop("source", None)
    text = json.dumps(values, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
