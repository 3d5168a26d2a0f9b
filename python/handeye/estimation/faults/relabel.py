"""Boards whose points were named wrongly: turned, mirrored, or shifted by rows.

A detector that finds a grid does not always know which end is up. If the label i was given to what is point
p[i], with ``points[p] = S points`` for a rigid S, then the pose found with these labels is ``C S`` instead of
C. For turns S is a rotation about the normal; rows counted backwards are a half turn about an axis in the
board (the board seems to be seen from behind); points labelled a row off are a shift. A relabeling common to
all views moves Y and nothing else, so only those that differ from most are wrong.
"""

from dataclasses import dataclass, replace

import numpy as np

from handeye.estimation.cell_fit import MIRROR_RATIO
from handeye.estimation.faults.stations import centres, inverted, target_centre
from handeye.estimation.measurements import Measurements, ViewPose
from handeye.types.arrays import FloatArray, IndexArray
from handeye.types.pose import Pose
from handeye.types.target import Target
from handeye.types.view import View

# Views that may have been shifted by rows are tried only up to so many points.
MOST_POINTS = 2000
# Cosine and sine of a number of quarter turns.
_QUARTERS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))


@dataclass(frozen=True, eq=False)
class Relabeling:
    """Another reading of the labels.

    Parameters
    ----------
    words
        What the labels were, for a sentence.
    permutation
        (P,) label i is point `permutation[i]`; -1 where no point is.
    factor
        (4, 4) the inverse of S: poses with the new labels are ``C @ factor``.
    looks_the_same
        Whether no picture can tell it from the identity.
    """

    words: str
    permutation: IndexArray
    factor: FloatArray
    looks_the_same: bool

    def fits(self, ids: IndexArray) -> bool:
        """Tell whether all labels of a view have a point under this reading."""
        return bool((self.permutation[ids] >= 0).all())

    def applied(self, view: View) -> View:
        """Return a view with its labels read this way."""
        return replace(view, point_ids=self.permutation[view.point_ids])

    def applied_to_pose(self, pose: ViewPose) -> ViewPose:
        """Return what the pose of such a view is; its error and information stay."""
        factor = Pose(self.factor)
        mirrored = None if pose.mirrored is None else (pose.mirrored[0] @ factor, pose.mirrored[1])
        return replace(pose, T_camera_target=pose.T_camera_target @ factor, mirrored=mirrored)


def turns(target: Target) -> list[Relabeling]:
    """Return the turns that bring points onto points, identity first."""
    centre = target_centre(target)
    same = [tuple(permutation.tolist()) for permutation in target.symmetries]
    found: list[Relabeling] = []
    for turn in target.turns:
        c, s = _QUARTERS[turn.quarters]
        rigid = _about(centre, np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))
        found.append(
            Relabeling(
                f"turned by {90 * turn.quarters} degrees",
                turn.permutation,
                inverted(rigid),
                tuple(turn.permutation.tolist()) in same,
            )
        )
    return found


def reflections(target: Target) -> list[Relabeling]:
    """Return the readings with rows, columns or both diagonals counted backwards."""
    centre = target_centre(target)
    found: list[Relabeling] = []
    for words, a, b in (("rows", 1, 0), ("columns", -1, 0), ("rows and columns swapped", 0, 1), ("", 0, -1)):
        rigid = _about(centre, np.array([[a, b, 0.0], [b, -a, 0.0], [0.0, 0.0, -1.0]]))
        permutation = _permutation(target.points, rigid)
        if (permutation >= 0).all():
            text = words if b else f"{words} counted backwards"
            found.append(Relabeling(text or "mirrored at a diagonal", permutation, inverted(rigid), False))
    return found


def shifts(target: Target, ids: IndexArray, others: list[Relabeling]) -> list[Relabeling]:
    """Return the readings of a view of part of the target as another part of it, turned or not."""
    points = target.points
    if len(ids) == len(points) or len(points) > MOST_POINTS:
        return []
    found: list[Relabeling] = []
    for base in others:
        turned = points @ inverted(base.factor)[:3, :3].T + inverted(base.factor)[:3, 3]
        for goal in points:
            shift = goal - turned[ids[0]]
            if np.abs(shift).max() < 1e-9:
                continue
            moved = np.eye(4)
            moved[:3, 3] = shift
            rigid = moved @ inverted(base.factor)
            permutation = _permutation(points, rigid)
            if (permutation[ids] >= 0).all():
                words = f"{base.words} and shifted" if base is not others[0] else "shifted"
                found.append(
                    Relabeling(
                        f"{words} by ({shift[0] * 1e3:.3g}, {shift[1] * 1e3:.3g}) mm",
                        permutation,
                        inverted(rigid),
                        False,
                    )
                )
    return found


def sees_front(measurements: Measurements) -> list[bool]:
    """Tell of each view whether the board, as labelled, shows its front."""
    poses = measurements.camera_poses
    centre = centres(poses, target_centre(measurements.target))
    return (np.einsum("ki,ki->k", poses[:, :3, 2], centre) > 0).tolist()


@dataclass(frozen=True, eq=False)
class Readings:
    """The poses that each view may show: labels read in every way, mirrored poses where they fit as well.

    Parameters
    ----------
    relabelings
        T of them, identity first.
    poses
        (K, M, 4, 4) candidates, M = T or 2 T; the second half from the mirrored poses.
    """

    relabelings: tuple[Relabeling, ...]
    poses: FloatArray

    @classmethod
    def of(cls, measurements: Measurements) -> "Readings":
        """Collect them; mirrored labels only where some views seem to be seen from behind and some not."""
        relabelings = turns(measurements.target)
        if len(set(sees_front(measurements))) > 1:
            relabelings += reflections(measurements.target)
        factors = np.array([r.factor for r in relabelings])
        best = measurements.camera_poses
        candidates = best[:, np.newaxis] @ factors
        ambiguous = [p.mirrored is not None and p.ambiguity_ratio < MIRROR_RATIO for p in measurements.poses]
        if any(ambiguous):
            other = np.array(
                [
                    p.mirrored[0].matrix if use and p.mirrored is not None else p.T_camera_target.matrix
                    for p, use in zip(measurements.poses, ambiguous, strict=True)
                ]
            )
            candidates = np.concatenate([candidates, other[:, np.newaxis] @ factors], axis=1)
        return cls(tuple(relabelings), candidates)

    def relative_to_most(self, labels: IndexArray) -> tuple[IndexArray, FloatArray]:
        """Turn labels (K,) in common, such that most views keep theirs; also the factor (4, 4) on Y."""
        count = len(self.relabelings)
        kinds, mirrored = labels % count, labels // count
        common = int(np.argmax(np.bincount(kinds, minlength=count)))
        factors = np.array([r.factor for r in self.relabelings])
        back = inverted(factors[common])
        wanted = factors[kinds] @ back
        gap = np.abs(wanted[:, np.newaxis] - factors[np.newaxis]).max(axis=(2, 3))
        return mirrored * count + np.argmin(gap, axis=1), back


def _about(centre: FloatArray, rotation: FloatArray) -> FloatArray:
    rigid = np.eye(4)
    rigid[:3, :3] = rotation
    rigid[:3, 3] = centre - rotation @ centre
    return rigid


def _permutation(points: FloatArray, rigid: FloatArray) -> IndexArray:
    """(P,) which point each moved point lies on, -1 for none."""
    step = float(np.abs(points - points.mean(axis=0)).max()) * 1e-5
    here = {tuple(key): i for i, key in enumerate(np.rint(points[:, :2] / step).astype(np.int64).tolist())}
    moved = points @ rigid[:3, :3].T + rigid[:3, 3]
    permutation = np.full(len(points), -1, dtype=np.int64)
    for i, (x, y) in enumerate(np.rint(moved[:, :2] / step).astype(np.int64).tolist()):
        for key in ((x, y), (x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)):
            if key in here:
                permutation[i] = here[key]
                break
    return permutation
