"""Where the camera could go next."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from handeye.codes import Code
from handeye.errors import InputError
from handeye.types.arrays import FloatArray
from handeye.types.mounting import Mounting
from handeye.types.pose import Pose, inverses
from handeye.types.view import View


@dataclass(frozen=True)
class Candidate:
    """A robot pose that could be taken, by name, with the joint positions that reach it if they are known.

    Examples
    --------
    >>> Candidate("left_high", recording.views[0].T_base_flange).joints_rad is None
    True
    """

    name: str
    T_base_flange: Pose
    joints_rad: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Pool:
    """Candidates not yet taken.

    Raises
    ------
    InputError
        Two candidates of one name.

    Examples
    --------
    >>> pool = Pool.of_views(recording.views)
    >>> len(pool), pool.motions(recording.mounting).shape
    (9, (9, 4, 4))
    """

    candidates: tuple[Candidate, ...]

    def __post_init__(self) -> None:
        names = [candidate.name for candidate in self.candidates]
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise InputError(f"candidate {twice}: the name is there twice", code=Code.DUPLICATE_CANDIDATE)

    @classmethod
    def of_views(cls, views: Iterable[View]) -> "Pool":
        """Return the robot poses of recorded views."""
        return cls(tuple(Candidate(view.name, view.T_base_flange, view.joints_rad) for view in views))

    @classmethod
    def of_poses(cls, poses: Sequence[Pose], prefix: str = "candidate") -> "Pool":
        """Return poses named by their place in the list, counted from one."""
        width = len(str(len(poses)))
        return cls(tuple(Candidate(f"{prefix}_{i:0{width}d}", pose) for i, pose in enumerate(poses, 1)))

    def without(self, names: Iterable[str]) -> "Pool":
        """Return the pool without these candidates."""
        gone = set(names)
        return Pool(tuple(c for c in self.candidates if c.name not in gone))

    def __len__(self) -> int:
        return len(self.candidates)

    def motions(self, mounting: Mounting) -> FloatArray:
        """(N, 4, 4) A of the chain of each candidate."""
        poses = np.array([c.T_base_flange.matrix for c in self.candidates]).reshape(-1, 4, 4)
        return poses if mounting is Mounting.EYE_TO_HAND else inverses(poses)

    @property
    def joints(self) -> FloatArray | None:
        """(N, n) joint positions of the candidates; None if those of any are not known."""
        known = [candidate.joints_rad for candidate in self.candidates if candidate.joints_rad is not None]
        if len(known) < len(self) or len({len(joints) for joints in known}) != 1:
            return None
        return np.array(known, dtype=float)

    @property
    def positions(self) -> FloatArray:
        """(N, 3) positions of the flange in the base, metres."""
        return np.array([c.T_base_flange.translation for c in self.candidates]).reshape(-1, 3)
