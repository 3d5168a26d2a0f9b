"""Bags among the layouts that are recognised."""

from pathlib import Path

from handeye.codes import Code
from handeye.datasets.bags.contents import Contents, read_contents
from handeye.datasets.bags.folder import SUFFIXES, is_bag
from handeye.datasets.image_set import ImportOptions
from handeye.datasets.importer import Importer
from handeye.datasets.reading import file_names
from handeye.errors import InputError


def recognises(path: Path) -> bool:
    """Tell whether it is a bag, or a folder with one file that is."""
    return _bag(path) is not None


def read(path: Path, options: ImportOptions) -> Contents:  # noqa: ARG001 - what is chosen from it comes later
    """Read a bag; of its pictures only when they were taken.

    Raises
    ------
    InputError
        As `read_contents`.
    """
    bag = _bag(path)
    if bag is None:
        raise InputError(f"{path}: no bag of ROS 1, rosbag2 or MCAP", code=Code.UNKNOWN_FORMAT)
    return read_contents(bag)


def _bag(path: Path) -> Path | None:
    if is_bag(path):
        return path
    try:
        files = [path / name for name in file_names(path) if Path(name).suffix.lower() in SUFFIXES]
    except (InputError, OSError):
        return None
    return files[0] if len(files) == 1 and is_bag(files[0]) else None


IMPORTER = Importer("bag", "a bag of ROS 1, rosbag2 or MCAP", recognises, read)
