"""What an importer is: a name, a look whether it fits, and a reader."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from handeye.datasets.bags.contents import Contents
from handeye.datasets.image_set import ImageSet, ImportOptions, UnreadPoses
from handeye.datasets.pose_pairs import PosePairs, PoseStreams

Imported = ImageSet | UnreadPoses | PosePairs | PoseStreams | Contents


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
        Tells whether a folder or a file has this layout; raises nothing.
    read
        Reads it; raises `InputError`.
    is_general
        Whether it reads whatever looks like pictures and poses; asked only where no other knows the folder.

    Examples
    --------
    >>> IMPORTERS["tum"].recognises(folder)
    False
    """

    name: str
    looks_like: str
    recognises: Callable[[Path], bool]
    read: Callable[[Path, ImportOptions], Imported]
    is_general: bool = False
