"""Arms that are described in this package, and arms by name or file."""

import os
from importlib import resources
from pathlib import Path

from handeye.errors import InputError
from handeye.robots.model import Arm
from handeye.robots.urdf import parse_urdf, read_urdf

_SUFFIX = ".urdf"


def shipped_arms() -> tuple[str, ...]:
    """Return the names of the arms that are described in this package."""
    folder = resources.files("handeye.robots") / "arms"
    return tuple(
        sorted(file.name.removesuffix(_SUFFIX) for file in folder.iterdir() if file.name.endswith(_SUFFIX))
    )


def open_arm(name_or_file: str | os.PathLike[str], *, base: str | None = None, tip: str | None = None) -> Arm:
    """Return an arm of this package by its name, or one from a URDF file.

    Parameters
    ----------
    name_or_file
        One of `shipped_arms()`, or a path; anything with a separator or ending in .urdf is a path.
    base, tip
        Links at the ends of the arm, as in `parse_urdf`.

    Raises
    ------
    InputError
        No such arm or file, or the file cannot be used.
    """
    text = os.fspath(name_or_file)
    names = shipped_arms()
    if text in names:
        file = resources.files("handeye.robots") / "arms" / f"{text}{_SUFFIX}"
        return parse_urdf(file.read_bytes(), base=base, tip=tip)
    if Path(text).suffix or os.sep in text or (os.altsep is not None and os.altsep in text):
        return read_urdf(text, base=base, tip=tip)
    raise InputError(
        f"no arm {text[:100]!r}",
        code="unknown_arm",
        hint=f"the arms are {', '.join(names)}; or give a .urdf file",
    )
