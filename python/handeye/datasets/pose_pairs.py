"""Poses of the robot and of the target, without pictures: what somebody else's detector has measured."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handeye.codes import Code
from handeye.datasets.bags.tracks import Track
from handeye.datasets.plausibility import DataWarning
from handeye.errors import InputError
from handeye.types import Mounting, Pose
from handeye.types.arrays import FloatArray


@dataclass(frozen=True)
class PosePair:
    """What robot and camera say of one station.

    Parameters
    ----------
    name
        Name of the view.
    T_base_flange
        Pose of the flange in the robot base.
    T_camera_target
        Pose of the target in the camera.

    Examples
    --------
    >>> PosePair("station_1", Pose.identity(), Pose.identity()).name
    'station_1'
    """

    name: str
    T_base_flange: Pose
    T_camera_target: Pose


@dataclass(frozen=True, eq=False)
class PosePairs:
    """Stations of one target and one camera, measured as poses.

    Attributes
    ----------
    name
        Name of the set.
    layout
        Name of the layout it was read from.
    mounting
        Where the camera sits.
    pairs
        The stations, in the order of the file.
    source
        Where the data came from, in words.
    warnings
        Values that are possible but hardly meant, and choices that the file left open.

    Raises
    ------
    InputError
        No station at all, or two of one name.

    Examples
    --------
    >>> pair = PosePair("station_1", Pose.identity(), Pose.identity())
    >>> PosePairs("mine", "text", recording.mounting, (pair,)).motions.shape
    (1, 4, 4)
    """

    name: str
    layout: str
    mounting: Mounting
    pairs: tuple[PosePair, ...]
    source: str = ""
    warnings: tuple[DataWarning, ...] = ()

    def __post_init__(self) -> None:
        if not self.pairs:
            raise InputError(f"{self.name}: no samples", code=Code.NO_POSES)
        if len({pair.name for pair in self.pairs}) < len(self.pairs):
            raise InputError(f"{self.name}: two samples of one name", code=Code.DUPLICATE_VIEW)

    def __len__(self) -> int:
        return len(self.pairs)

    @property
    def motions(self) -> FloatArray:
        """(N, 4, 4) A of the chain of each station."""
        return np.array([self.mounting.chain(pair.T_base_flange).matrix for pair in self.pairs])

    @property
    def camera_poses(self) -> FloatArray:
        """(N, 4, 4) `T_camera_target` of each station."""
        return np.array([pair.T_camera_target.matrix for pair in self.pairs])


def numbered(poses: Sequence[tuple[Pose, Pose]]) -> tuple[PosePair, ...]:
    """Return stations named by their place, counted from one."""
    width = max(2, len(str(len(poses))))
    return tuple(PosePair(f"sample_{k:0{width}d}", *pair) for k, pair in enumerate(poses, start=1))


@dataclass(frozen=True, eq=False)
class PoseStreams:
    """Robot and target over time.

    Attributes
    ----------
    name, layout, source
        As those of `PosePairs`.
    mounting
        Where the camera sits; None if nothing says so.
    robot
        `T_base_flange` over time, with joints where they are known.
    seen
        The other stream: `T_camera_target`, or its inverse.
    may_be_inverse
        Whether the files leave open which of the two.
    """

    name: str
    layout: str
    source: str
    mounting: Mounting | None
    robot: Track
    seen: Track
    may_be_inverse: bool = False
