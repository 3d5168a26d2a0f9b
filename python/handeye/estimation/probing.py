"""Touches as measurements of the model, and as a test of a calibration that knows nothing of them.

The arm stops where a tip meets a point: ``r = b - T f`` vanishes, with T the flange where it truly stands, f
the point in the flange and b the one in the base. Solved together with the pictures these are three more rows
of the same linear mixed model for each touch (`handeye-core`, `estimation::touched`). As a test, r is
predicted from what the pictures alone have left open: with J its derivative in their parameters and S their
covariance it has the covariance ``J S J' + noise``, and ``r' V^-1 r`` over its size is F distributed.
"""

from dataclasses import dataclass

import numpy as np

from handeye.estimation.arm import ArmModel
from handeye.estimation.estimate import Estimate
from handeye.estimation.f_distribution import f_cumulative
from handeye.estimation.rig_measurements import RigMeasurements
from handeye.estimation.touch import carried
from handeye.types.arrays import FloatArray
from handeye.types.mounting import Mounting
from handeye.types.pose import through_twist
from handeye.types.probing import Probing
from handeye.types.rig import Body

# A tip that is exact is known a thousand times better than anything touches.
_EXACT_M = 1e-7


@dataclass(frozen=True, eq=False)
class ProbingRows:
    """Touches as the core takes them: stations (Q, 4, 4), joints (Q, n), tips and touches."""

    probing: Probing
    poses: FloatArray
    joints: FloatArray
    tips: list[tuple[bool, FloatArray, FloatArray]]
    touches: list[tuple[int, list[int], tuple[int, FloatArray] | None, FloatArray]]


def probing_rows(measurements: RigMeasurements, probing: Probing, arm: ArmModel | None) -> ProbingRows:
    """Return touches of the first target as the core takes them.

    Raises
    ------
    InputError
        Touches of points that the board does not have, or without the joints that the arm needs.
    """
    board = next(iter(measurements.targets.values()))
    probing.check_board(board.body, board.target.point_count)
    names = list(probing.tips)
    first = len(measurements.stations)
    covariance = probing.sigma_m**2 * np.eye(3)
    touches: list[tuple[int, list[int], tuple[int, FloatArray] | None, FloatArray]] = []
    for number, touch in enumerate(probing.touches):
        tips = [names.index(touch.tip)]
        of_board = None
        if isinstance(touch.point, str):
            tips.append(names.index(touch.point))
        else:
            of_board = (0, board.target.points[touch.point])
        touches.append((first + number, tips, of_board, covariance))
    return ProbingRows(
        probing,
        np.array([touch.T_base_flange.matrix for touch in probing.touches]),
        np.zeros((len(touches), 0)) if arm is None else probing.joints(len(arm.scales)),
        [
            (tip.body is Body.FLANGE, np.array(tip.at_m), np.eye(3) / max(tip.sigma_m, _EXACT_M) ** 2)
            for tip in probing.tips.values()
        ],
        touches,
    )


@dataclass(frozen=True)
class Verification:
    """What touches say of a calibration that knows nothing of them.

    Parameters
    ----------
    misses_mm
        Of each touch: how far the point is from where the calibration has it.
    expected_mm
        Of each touch: the deviation that was expected of that, root of the summed variances.
    p_value
        Chance that touches disagree so much where everything is as stated.
    board_scale, board_sigma, board_p_value
        By how much the board is larger than stated as pictures and touches together have it, the standard
        deviation, and the chance, by the ratio of likelihoods, of that where it is as stated; None where no
        point of it was touched.
    alarm
        Whether touches or board are too unlikely.
    """

    misses_mm: tuple[float, ...]
    expected_mm: tuple[float, ...]
    p_value: float
    board_scale: float | None
    board_sigma: float | None
    board_p_value: float | None
    alarm: bool

    @property
    def verdict(self) -> str:
        """Stable word: `agrees`, `board_size` or `disagrees`."""
        if not self.alarm:
            return "agrees"
        return "board_size" if self.board_is_wrong else "disagrees"

    @property
    def board_is_wrong(self) -> bool:
        """Whether the size of the board explains it."""
        return self.board_p_value is not None and self.board_p_value < ALARM / 2

    @property
    def sentence(self) -> str:
        """Say it in words."""
        typical = float(np.sqrt(np.mean(np.square(self.misses_mm))))
        expected = float(np.sqrt(np.mean(np.square(self.expected_mm))))
        miss = f"{typical:.2g} mm root mean square, {expected:.2g} mm were expected"
        if not self.alarm:
            return f"{len(self.misses_mm)} touches agree with the calibration: they miss by {miss}"
        if self.board_is_wrong and self.board_scale is not None and self.board_sigma is not None:
            size = "larger" if self.board_scale > 0 else "smaller"
            return (
                f"the board is {100 * abs(self.board_scale):.2g} % {size} than stated, to within "
                f"{200 * self.board_sigma:.2g} %: measure its squares, and state what they are"
            )
        return f"{len(self.misses_mm)} touches disagree with the calibration: they miss by {miss}"

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON."""
        return {
            "verdict": self.verdict,
            "sentence": self.sentence,
            "alarm": self.alarm,
            "p_value": self.p_value,
            "misses_mm": list(self.misses_mm),
            "expected_mm": list(self.expected_mm),
            "board_scale": self.board_scale,
            "board_sigma": self.board_sigma,
            "board_p_value": self.board_p_value,
        }


# An alarm is what is less likely than this where everything is as stated: half of it for the touches as they
# are predicted, half for the size of the board.
ALARM = 0.02


def verify(estimate: Estimate, together: Estimate, probing: Probing) -> Verification:
    """Compare touches with what an estimate from pictures alone predicts.

    Parameters
    ----------
    estimate
        Of the pictures alone.
    together
        Of pictures and touches.
    probing
        The touches.

    Raises
    ------
    InputError
        Touches that do not fit the board or the arm.
    """
    r, covariance = predicted(estimate, probing)
    squared = float(r @ np.linalg.solve(covariance, r))
    p_value = 1.0 - f_cumulative(squared / len(r), len(r), estimate.degrees_of_freedom)
    scale = sigma = of_board = None
    if together.board_scale is not None and any(isinstance(t.point, int) for t in probing.touches):
        at = 12 + len(together.free_camera)
        scale = together.board_scale
        sigma = float(np.sqrt(together.covariance[at, at]))
        # Twice the fall of the likelihood with a board as stated: chi-square of one degree of freedom.
        fall = 0.0 if together.attribution is None else together.attribution.evidence.get("board_scale", 0.0)
        of_board = 1.0 - f_cumulative(max(2 * fall, 0.0), 1, float("inf"))
    return Verification(
        misses_mm=tuple((1e3 * np.linalg.norm(r.reshape(-1, 3), axis=1)).tolist()),
        expected_mm=tuple((1e3 * np.sqrt(np.diag(covariance).reshape(-1, 3).sum(axis=1))).tolist()),
        p_value=p_value,
        board_scale=scale,
        board_sigma=sigma,
        board_p_value=of_board,
        alarm=min(p_value, 1.0 if of_board is None else of_board) < ALARM / 2,
    )


def predicted(estimate: Estimate, probing: Probing) -> tuple[FloatArray, FloatArray]:
    """Return misses (3 Q,) of touches in the base and their covariance (3 Q, 3 Q), by an estimate.

    Raises
    ------
    InputError
        Touches that do not fit the board or the arm.
    """
    in_hand = estimate.mounting is Mounting.EYE_IN_HAND
    probing.check_board(Body.BASE if in_hand else Body.FLANGE, estimate.target.point_count)
    count, parameters = len(probing.touches), len(estimate.covariance)
    joints = None if estimate.arm is None else probing.joints(len(estimate.arm.scales))
    reported = np.array([touch.T_base_flange.matrix for touch in probing.touches])
    poses = reported if joints is None else estimate.poses_as_built(reported, joints)
    names = list(probing.tips)
    rows = np.zeros((count, 3, parameters + 3 * len(names)))
    r = np.zeros((count, 3))
    where = np.zeros((count, 3))
    board_size = 1 + (estimate.board_scale or 0.0)
    for k, touch in enumerate(probing.touches):
        rotation = poses[k, :3, :3]
        points = [touch.tip, touch.point]
        for point in points:
            slope = np.zeros((3, rows.shape[2]))
            if isinstance(point, str):
                tip = probing.tips[point]
                place, on_flange = np.array(tip.at_m), tip.body is Body.FLANGE
                at = parameters + 3 * names.index(point)
                slope[:, at : at + 3] = np.eye(3)
            else:
                stated = estimate.target.points[point]
                place, on_flange = estimate.Y.act([board_size * stated])[0], not in_hand
                slope[:, 6:12] = through_twist(place[np.newaxis], np.eye(3)[np.newaxis])[0]
                if estimate.board_scale is not None:
                    slope[:, 12 + len(estimate.free_camera)] = estimate.Y.matrix[:3, :3] @ stated
            if on_flange:
                where[k] = rotation @ place + poses[k, :3, 3]
                r[k] -= where[k]
                rows[k] -= rotation @ slope
            else:
                r[k] += place
                rows[k] += slope
    constants, noise = carried(estimate, poses, joints, where)
    if constants.shape[2]:
        rows[:, :, parameters - constants.shape[2] : parameters] -= constants
    stacked = rows.reshape(3 * count, -1)
    known = np.zeros((rows.shape[2], rows.shape[2]))
    known[:parameters, :parameters] = estimate.covariance
    for i, tip in enumerate(probing.tips.values()):
        at = slice(parameters + 3 * i, parameters + 3 * i + 3)
        known[at, at] = np.eye(3) * max(tip.sigma_m, _EXACT_M) ** 2
    covariance = stacked @ known @ stacked.T
    for k in range(count):
        at = slice(3 * k, 3 * k + 3)
        covariance[at, at] += noise[k] + np.eye(3) * probing.sigma_m**2
    return r.ravel(), covariance
