"""What is in a bag, read once from its beginning to its end; pictures are fetched when they are wanted."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from handeye.codes import Code
from handeye.datasets.bags import messages
from handeye.datasets.bags.base import Record, Topic
from handeye.datasets.bags.folder import reader_of
from handeye.datasets.bags.messages import (
    CameraInfo,
    Compressed,
    JointPositions,
    Raw,
    Stamped,
    message_of,
)
from handeye.datasets.reading import located
from handeye.errors import InputError
from handeye.notations import NOTATIONS, Unit
from handeye.types.arrays import FloatArray

_PICTURES = frozenset({messages.IMAGE, messages.COMPRESSED})
_DESCRIPTION = "robot_description"
# A description beyond this is no arm's.
_MAX_DESCRIPTION = 1 << 22


@dataclass
class Stamps:
    """When messages were made and received, in nanoseconds."""

    made_ns: list[int] = field(default_factory=list[int])
    received_ns: list[int] = field(default_factory=list[int])

    def add(self, made_ns: int, received_ns: int) -> None:
        """Append one."""
        self.made_ns.append(made_ns)
        self.received_ns.append(received_ns)

    @property
    def offset_s(self) -> float | None:
        """How much earlier they were made than received, in the middle; None where it is not said when."""
        if not self.made_ns or not all(self.made_ns):
            return None
        return float(np.median(np.array(self.received_ns, float) - np.array(self.made_ns, float))) * 1e-9


@dataclass
class Poses(Stamps):
    """Positions and quaternions (N, 7) of one frame in another."""

    values: list[tuple[float, ...]] = field(default_factory=list[tuple[float, ...]])


@dataclass
class Joints(Stamps):
    """Positions of joints by name, one dictionary a message."""

    positions: list[dict[str, float]] = field(default_factory=list[dict[str, float]])


@dataclass(eq=False)
class Contents:
    """What a bag holds.

    Attributes
    ----------
    path
        Where it was read from.
    topics
        All topics that were met, by name.
    pictures
        Stamps of the pictures of each topic, in the order of the file.
    transforms
        What tf says of each child in each parent, and whether that is for all times.
    poses
        Poses of each topic.
    joints
        Joint positions of each topic.
    cameras
        The first CameraInfo of each topic.
    description
        URDF of the robot; empty if there is none.
    is_cut
        Whether the file broke off before its end.
    """

    path: Path
    topics: Mapping[str, Topic] = field(default_factory=dict[str, Topic])
    pictures: dict[str, Stamps] = field(default_factory=dict[str, Stamps])
    transforms: dict[tuple[str, str], Poses] = field(default_factory=dict[tuple[str, str], Poses])
    static: dict[tuple[str, str], tuple[float, ...]] = field(
        default_factory=dict[tuple[str, str], tuple[float, ...]]
    )
    poses: dict[str, Poses] = field(default_factory=dict[str, Poses])
    joints: dict[str, Joints] = field(default_factory=dict[str, Joints])
    cameras: dict[str, CameraInfo] = field(default_factory=dict[str, CameraInfo])
    description: str = ""
    is_cut: bool = False

    def take(self, record: Record) -> None:
        """Add what one message says; raises `InputError`."""
        name, message = record.topic.name, message_of(record)
        if isinstance(message, (Raw, Compressed)):
            self.pictures.setdefault(name, Stamps()).add(message.stamp_ns, record.received_ns)
        elif isinstance(message, CameraInfo):
            self.cameras.setdefault(name, message)
        elif isinstance(message, JointPositions):
            joints = self.joints.setdefault(name, Joints())
            joints.add(message.stamp_ns, record.received_ns)
            joints.positions.append(message.positions)
        elif isinstance(message, str):
            if name.endswith(_DESCRIPTION) and len(message) <= _MAX_DESCRIPTION:
                self.description = message
        else:
            self._transforms(record, message)

    def _transforms(self, record: Record, message: object) -> None:
        for stamped in message if isinstance(message, list) else ():  # pyright: ignore[reportUnknownVariableType]
            assert isinstance(stamped, Stamped)  # noqa: S101 - what the other readers return
            if not stamped.child:
                track = self.poses.setdefault(record.topic.name, Poses())
            elif record.topic.name.endswith("tf_static"):
                self.static[stamped.parent, stamped.child] = stamped.values
                continue
            else:
                track = self.transforms.setdefault((stamped.parent, stamped.child), Poses())
            track.add(stamped.stamp_ns, record.received_ns)
            track.values.append(stamped.values)


def read_contents(path: Path) -> Contents:
    """Read a bag; of its pictures only when they were taken.

    Raises
    ------
    InputError
        No bag, a damaged one, or one that is larger than any recording of a calibration.
    """
    contents = Contents(path)
    reader = reader_of(path)
    try:
        for record in reader.records(messages.READERS.keys()):
            with located(str(path)):
                contents.take(record)
    except OSError as error:
        raise InputError(f"{path}: {error}", code=Code.UNREADABLE) from error
    contents.topics, contents.is_cut = reader.topics, reader.is_cut
    return contents


def fetch_pictures(path: Path, topic: str, wanted: Iterable[int]) -> dict[int, Raw | Compressed]:
    """Return pictures of a topic by their place among those of the topic, counted from zero.

    Raises
    ------
    InputError
        As `read_contents`.
    """
    places, found = set(wanted), dict[int, Raw | Compressed]()
    place = -1
    for record in reader_of(path).records(_PICTURES):
        if record.topic.name != topic:
            continue
        place += 1
        if place in places:
            with located(str(path)):
                message = message_of(record)
            if isinstance(message, (Raw, Compressed)):
                found[place] = message
            if len(found) == len(places):
                break
    return found


def matrices(values: Iterable[tuple[float, ...]]) -> FloatArray:
    """Return transforms (N, 4, 4) of positions and quaternions (N, 7); NaN where the quaternion is none."""
    return NOTATIONS["quaternion_xyzw"].matrices(
        np.array(list(values), dtype=np.float64).reshape(-1, 7), Unit.M
    )
