"""Arms that are described in this package, and arms by name or file."""

import os
from importlib import resources
from pathlib import Path

from handeye.codes import Code
from handeye.errors import InputError
from handeye.robots.mjcf import parse_mjcf
from handeye.robots.model import Arm
from handeye.robots.urdf import parse_urdf, read_file, read_urdf
from handeye.robots.xml_tree import read_xml

_SUFFIX = ".urdf"


def shipped_arms() -> tuple[str, ...]:
    """Return the names of the arms that are described in this package.

    Examples
    --------
    >>> "ur5e" in shipped_arms()
    True
    """
    folder = resources.files("handeye.robots") / "arms"
    return tuple(
        sorted(file.name.removesuffix(_SUFFIX) for file in folder.iterdir() if file.name.endswith(_SUFFIX))
    )


def open_arm(name_or_file: str | os.PathLike[str], *, base: str | None = None, tip: str | None = None) -> Arm:
    """Return an arm of this package by its name, or one from a URDF or MJCF file.

    Parameters
    ----------
    name_or_file
        One of `shipped_arms()`, or a path; anything with a separator or ending in .urdf or .xml is a path.
    base, tip
        Links at the ends of the arm, as in `parse_urdf`; MJCF has no other base than the world.

    Raises
    ------
    InputError
        No such arm or file, or the file cannot be used.

    Examples
    --------
    >>> open_arm("ur5e").joint_names[0]
    'shoulder_pan_joint'
    """
    text = os.fspath(name_or_file)
    names = shipped_arms()
    if text in names:
        file = resources.files("handeye.robots") / "arms" / f"{text}{_SUFFIX}"
        return parse_urdf(file.read_bytes(), base=base, tip=tip)
    if Path(text).suffix or os.sep in text or (os.altsep is not None and os.altsep in text):
        return _read(text, base, tip)
    raise InputError(
        f"no arm {text[:100]!r}",
        code=Code.UNKNOWN_ARM,
        hint=f"the arms are {', '.join(names)}; or give a .urdf file",
    )


def _read(path: str, base: str | None, tip: str | None) -> Arm:
    """Read a description by what its file holds."""
    if Path(path).suffix != ".xml":
        return read_urdf(path, base=base, tip=tip)
    content = read_file(path)
    try:
        if read_xml(content).tag != "mujoco":
            return parse_urdf(content, base=base, tip=tip)
        if base is not None:
            raise InputError("the base of an arm in MJCF is the world", code=Code.UNKNOWN_LINK)
        return parse_mjcf(content, tip=tip)
    except InputError as error:
        raise InputError(f"{path}: {error.message}", code=error.code, hint=error.hint) from error
