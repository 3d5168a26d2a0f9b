"""The sets that studies run on: found below a folder, detected and calibrated, remembered on disk."""

import hashlib
import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

import cv2

import handeye
from handeye import _core
from handeye.codes import Code
from handeye.compute.parallel import Progress, run_all
from handeye.datasets import read_recording, write_recording
from handeye.errors import HandeyeError, InputError
from handeye.importing import open_folder
from handeye.types import Recording

DATA_VARIABLE = "HANDEYE_DATA"
CACHE_VARIABLE = "HANDEYE_CACHE"
# Where the published sets are, below the folder of all data.
PUBLISHED = "rwhe-calib"
SIMULATED_SETS = ("CS_synthetic_1", "CS_synthetic_2", "CS_synthetic_3")
REAL_SETS = ("kuka_1", "kuka_2")
# What decides what is read from a folder: after a change in one of these all is read again.
_READERS = ("datasets", "detection", "importing")


def data_folder(given: Path | None = None) -> Path:
    """Return the folder of public data: the one given, or the one that HANDEYE_DATA names.

    Raises
    ------
    InputError
        Neither, or not a folder.
    """
    named = os.environ.get(DATA_VARIABLE, "")
    folder = given or (Path(named) if named else None)
    hint = f"name the folder that holds {PUBLISHED}/{SIMULATED_SETS[0]} and so on, here or in {DATA_VARIABLE}"
    if folder is None:
        raise InputError("no folder with data", code=Code.NO_DATA, hint=hint)
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder", code=Code.NO_DATA, hint=hint)
    return folder


def find_set(folder: Path, name: str) -> Path:
    """Return the folder of a set, below `folder` or below its `rwhe-calib`.

    Raises
    ------
    InputError
        There is none.
    """
    for place in (folder / PUBLISHED / name, folder / name):
        if place.is_dir():
            return place
    raise InputError(
        f"{folder}: no set {name}, neither there nor in {PUBLISHED}",
        code=Code.NO_DATA,
        hint="give the folder that holds the sets, or the one above it",
    )


def cache_folder() -> Path:
    """Return the folder in which sets are remembered; HANDEYE_CACHE names another."""
    named = os.environ.get(CACHE_VARIABLE, "")
    if named:
        return Path(named)
    base = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(base) if base else Path.home() / ".cache") / "handeye"


def load_sets(
    folder: Path,
    names: Sequence[str],
    *,
    workers: int = 1,
    cache: Path | None = None,
    progress: Progress | None = None,
) -> list[Recording]:
    """Return the recordings of sets under these names, cameras calibrated from the views if no file says.

    Parameters
    ----------
    folder
        Folder that holds the sets, or holds `rwhe-calib`.
    names
        Names of the sets.
    cache
        Folder in which recordings are remembered by the content of the set; None remembers nothing.

    Raises
    ------
    InputError
        A set is missing or cannot be read.
    DetectionError, DegenerateError, SolveError
        The target is in none of its images, or they do not determine the camera.
    """
    places = [find_set(folder, name) for name in names]
    recordings = run_all(partial(_load, cache=cache), places, workers=workers, progress=progress)
    return [replace(recording, name=name) for recording, name in zip(recordings, names, strict=True)]


def _load(place: Path, cache: Path | None) -> Recording:
    if cache is None:
        return open_folder(place).recording
    remembered = cache / f"{place.name}-{_fingerprint(place)}"
    # A memory that is missing, damaged or of another version is none.
    with suppress(HandeyeError):
        return read_recording(remembered).recording
    recording = open_folder(place).recording
    # Nor does it matter if nothing can be remembered.
    with suppress(HandeyeError, OSError):
        cache.mkdir(parents=True, exist_ok=True)
        write_recording(recording, remembered)  # without the images
    return recording


def _fingerprint(place: Path) -> str:
    """Digest of all files of a set, and of everything that decides what is made of them."""
    digest = hashlib.blake2b(cv2.__version__.encode(), digest_size=16)
    package = Path(handeye.__file__).parent
    sources = sorted(file for room in _READERS for file in (package / room).rglob("*.py"))
    for file in [*sources, Path(_core.__file__), *sorted(f for f in place.rglob("*") if f.is_file())]:
        digest.update(file.name.encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()
