"""Whether points lie as those of a flat board can be seen at all.

Few markers, one of them misread or one corner taken from something else, can still be joined by a homography:
one that folds the board over, or shows it from its edge. No view of a board is like that.
"""

import numpy as np

from handeye import _core
from handeye.detection.base import Detection, NotFound, Reason
from handeye.types import Target

# A board is seen from its edge where it is this much narrower along one direction than along another: 86 deg.
FLATTEST = 15.0
# Points may be off a flat board by this share of the way to the next, all but a few of them.
OFF_SHARE, MOST_OFF = 0.25, 0.1
# Derivatives are taken over this share of the way to the next point.
STEP_SHARE = 0.05


def implausible(target: Target, found: Detection) -> NotFound | None:
    """Return what speaks against points as those of a flat board seen from its front; None for nothing."""
    plane = target.points[found.point_ids, :2]
    lens = _core.PlaneMap.fitted(plane, found.pixels)
    if lens is None:
        return None
    steps = lens.steps(plane, STEP_SHARE * target.spacing_m)
    determinants = np.linalg.det(steps)
    if not (determinants > 0).all():
        return NotFound(Reason.INCONSISTENT, "the points lie as on a board that is folded over")
    long, short = np.linalg.svd(steps, compute_uv=False).T
    if (long > FLATTEST * short).any():
        return NotFound(Reason.INCONSISTENT, "the points lie as on a board that is seen from its edge")
    off = np.linalg.norm(lens.pixels(plane) - found.pixels, axis=1)
    if (off > OFF_SHARE * target.spacing_m * short).mean() > MOST_OFF:
        return NotFound(Reason.INCONSISTENT, "the points do not lie as on a flat board")
    return None
