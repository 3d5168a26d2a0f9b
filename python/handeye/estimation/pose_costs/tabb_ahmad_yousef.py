"""Tabb and Ahmad Yousef: the matrix equation itself as a cost, in its two forms."""

from handeye.estimation.pose_costs.base import PoseCost, PoseViews, flat, inverse
from handeye.types.arrays import FloatArray

PAPER = (
    'A. Tabb and K. M. Ahmad Yousef, "Solving the robot-world hand-eye(s) calibration problem with iterative '
    'methods", Machine Vision and Applications 28, 2017'
)


def _first(X: FloatArray, Y: FloatArray, views: PoseViews) -> FloatArray:
    """``sum |C inv(Y) - X A|^2`` (Frobenius): their cost c1, ``|A X - Z B|``."""
    return flat(views.C @ inverse(Y) - X @ views.A)


def _second(X: FloatArray, Y: FloatArray, views: PoseViews) -> FloatArray:
    """``sum |C - X A Y|^2``: their cost c2, ``|A - Z B inv(X)|``."""
    return flat(views.C - X @ views.A @ Y)


# Their other family measures in the image; with the poses of the arm exact it is the plain reprojection least
# squares of `--model paper`.
TABB_AHMAD_YOUSEF_1 = PoseCost("tabb_ahmad_yousef_1", PAPER, _first)
TABB_AHMAD_YOUSEF_2 = PoseCost("tabb_ahmad_yousef_2", PAPER, _second)
