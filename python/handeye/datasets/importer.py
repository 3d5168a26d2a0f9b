"""What an importer is: a name, a look whether it fits, and a reader."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from handeye.datasets.image_set import ImageSet, ImportOptions


@dataclass(frozen=True)
class Importer:
    """A foreign layout.

    Attributes
    ----------
    name
        Name of the layout.
    looks_like
        What tells it, for a person.
    recognises
        Tells whether a folder has this layout, by the names of its files; raises nothing.
    read
        Reads a folder; raises `InputError`.
    """

    name: str
    looks_like: str
    recognises: Callable[[Path], bool]
    read: Callable[[Path, ImportOptions], ImageSet]
