"""Does the camera still sit where the calibration says? New views against the posterior of old ones.

The twist between chain and picture of a new view is, as in the default model,

    e_k = -B_k theta + noise_k,   B_k = [ I | Ad(X A_k) | camera | board | Ad(X) arm ]

with theta as far off as the old views leave it, of covariance S, and the noise that they found. Stacked, the
twists have the covariance ``V = B S B' + blockdiag(noise)`` if nothing has moved, and ``e' V^-1 e`` over
their number is F distributed. What moved is one of three: the camera (a twist of X), the board (a twist of
Y), or one joint whose zero shifted. Each is fitted by generalised least squares, and what the misfit falls by
is tested (the generalised likelihood ratio of Gaussian models, e.g. Kay, "Fundamentals of Statistical Signal
Processing: Detection Theory", 1998, section 7.7).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import InputError
from handeye.estimation.estimate import Estimate
from handeye.estimation.f_distribution import f_cumulative
from handeye.estimation.measurements import Measurements
from handeye.types.arrays import FloatArray
from handeye.types.pose import Pose, inverses

# An alarm is what is less likely than this where nothing has moved. Real arms err in ways that the model does
# not have: of made-up ones about twice as many alarm falsely.
ALARM = 0.025
# A pose of the arm off by so much in a picture that the linear model says nothing of it is still a shift.
_LEAST_PIXEL_PX = 0.01


class Moved(StrEnum):
    """What may have moved since the calibration."""

    NOTHING = "nothing"
    CAMERA = "camera"
    BOARD = "board"
    JOINT = "joint"


@dataclass(frozen=True)
class Cause:
    """One thing that may have moved.

    Parameters
    ----------
    moved
        What it is.
    joint
        Name of the joint, where it is one.
    p_value
        Chance that views like these call for such a shift where nothing has moved.
    translation_mm, rotation_deg
        How far it moved by the best fit; of a joint the angle (or millimetres of one that slides).
    log_likelihood
        Logarithm of the likelihood with it, less the usual penalty for what it may choose.
    """

    moved: Moved
    joint: str
    p_value: float
    translation_mm: float
    rotation_deg: float
    log_likelihood: float

    @property
    def words(self) -> str:
        """Say what moved."""
        if self.moved is Moved.JOINT:
            return f"the zero of joint {self.joint}, by {self.rotation_deg:.3g} deg"
        what = "the camera" if self.moved is Moved.CAMERA else "the board"
        return f"{what}, by {self.translation_mm:.3g} mm and {self.rotation_deg:.3g} deg"


@dataclass(frozen=True)
class Check:
    """What new views say of an old calibration.

    Parameters
    ----------
    p_value
        Chance that views like these disagree so much where nothing has moved.
    alarm
        Whether that is too unlikely.
    moved
        The likeliest of the causes, `nothing` without alarm.
    causes
        All that were looked at, the likeliest first.
    views
        Names of the views.
    detectable_mm
        Shift of the camera (root mean square over directions) that such views find in half of all cases.
    misfit
        What the views miss by, six numbers each, uncorrelated and of variance one if nothing has moved.
    """

    p_value: float
    alarm: bool
    moved: Moved
    causes: tuple[Cause, ...]
    views: tuple[str, ...]
    detectable_mm: float
    misfit: tuple[float, ...] = ()

    @property
    def sentence(self) -> str:
        """Say it in words."""
        if not self.alarm:
            return (
                f"nothing has moved as far as {len(self.views)} views tell (p = {self.p_value:.2g}); a shift "
                f"of the camera by {self.detectable_mm:.2g} mm would be found every second time"
            )
        if not self.told_apart:
            return (
                f"something has moved (p = {self.p_value:.2g}): camera, board or arm, one picture does not "
                f"tell which; if the camera, by {self.causes[0].translation_mm:.3g} mm and "
                f"{self.causes[0].rotation_deg:.3g} deg"
            )
        return f"something has moved (p = {self.p_value:.2g}): most likely {self.causes[0].words}"

    @property
    def told_apart(self) -> bool:
        """Whether the views can tell what moved; one alone shows a shift, not of what."""
        return len(self.views) > 1

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON."""
        return {
            "p_value": self.p_value,
            "alarm": self.alarm,
            "moved": self.moved.value,
            "told_apart": self.told_apart,
            "sentence": self.sentence,
            "detectable_mm": self.detectable_mm,
            "views": list(self.views),
            "causes": [
                {
                    "moved": cause.moved.value,
                    "joint": cause.joint or None,
                    "p_value": cause.p_value,
                    "translation_mm": cause.translation_mm,
                    "rotation_deg": cause.rotation_deg,
                    "log_likelihood": cause.log_likelihood,
                }
                for cause in self.causes
            ],
        }


@dataclass(frozen=True, eq=False)
class Rows:
    """New views linearised at an estimate.

    Parameters
    ----------
    e
        (6 K,) twists between chain and picture.
    covariance
        (6 K, 6 K) of them if nothing has moved.
    shifts
        What each cause does to them: (6 K, d) for a shift of d numbers, by cause and joint.
    """

    e: FloatArray
    covariance: FloatArray
    shifts: dict[tuple[Moved, str], FloatArray]


def check_views(estimate: Estimate, views: Measurements, alarm: float = ALARM) -> Check:
    """Test whether camera, board and arm still are where an estimate says.

    Parameters
    ----------
    estimate
        Of the old views, by the default model.
    views
        New ones of the same board through the same camera.
    alarm
        Chance of a false alarm.

    Raises
    ------
    InputError
        No view, or views without the joint positions of an arm that is known.
    """
    if len(views) == 0:
        raise InputError("no view to check with", code=Code.TOO_FEW_VIEWS, hint="take two, of the same board")
    names = tuple(view.name for view in views.views)
    return check_rows(rows_of(estimate, views), estimate.degrees_of_freedom, names, alarm)


def check_rows(rows: Rows, freedom: float, names: tuple[str, ...], alarm: float = ALARM) -> Check:
    """Test whether what new views miss by is what is left where nothing has moved.

    Parameters
    ----------
    rows
        The new views, linearised.
    freedom
        Degrees of freedom of the noise levels behind their covariance.
    names
        Of the views.
    alarm
        Chance of a false alarm.
    """
    whitened, root = _whitened(rows)
    squared = float(whitened @ whitened)
    causes: list[Cause] = []
    for (moved, joint), columns in rows.shifts.items():
        onto = np.linalg.solve(root, columns)
        scale = np.linalg.norm(onto, axis=0)
        shift = np.asarray(np.linalg.pinv(onto / scale, rcond=1e-10) @ whitened, np.float64) / scale
        count = columns.shape[1]
        explained = squared - float(np.sum((whitened - onto @ shift) ** 2))
        causes.append(
            Cause(
                moved,
                joint,
                _tail(explained / count, count, freedom),
                1e3 * float(np.linalg.norm(shift[:3])) if count == _TWIST else 0.0,
                float(np.rad2deg(np.linalg.norm(shift[-3:]))),
                0.5 * explained - 0.5 * count * float(np.log(max(len(rows.e), 2))),
            )
        )
    # Of equals the camera first, as of one view all are.
    causes.sort(key=lambda cause: (-round(cause.log_likelihood, 6), cause.moved is not Moved.CAMERA))
    # All at once, and each cause by itself: the more often it is asked, the less each may alarm.
    overall = _tail(squared / len(rows.e), len(rows.e), freedom)
    kinds = len({cause.moved for cause in causes}) + 1
    by_kind: dict[Moved, float] = {}
    for cause in causes:
        same = sum(other.moved is cause.moved for other in causes)
        by_kind[cause.moved] = min(by_kind.get(cause.moved, 1.0), cause.p_value * same)
    p_value = min(1.0, kinds * min(overall, *by_kind.values()))
    found = p_value < alarm
    onto = np.linalg.solve(root, rows.shifts[Moved.CAMERA, ""])
    return Check(
        p_value,
        found,
        causes[0].moved if found else Moved.NOTHING,
        tuple(causes),
        names,
        1e3 * _detectable(onto.T @ onto),
        tuple(whitened.tolist()),
    )


_TWIST = 6
# Noncentrality at which a test of six numbers at 5 % alarms in half of all cases.
_HALF = 9.8


def _tail(value: float, numerator: float, denominator: float) -> float:
    """Chance that F with these degrees of freedom exceeds a value."""
    return 1.0 - f_cumulative(value, numerator, denominator)


def _detectable(information: FloatArray) -> float:
    """Translation that is found in half of all cases, root mean square over directions, metres."""
    covariance = np.linalg.inv(information)[:3, :3]
    return float(np.sqrt(_HALF * np.trace(covariance) / 3))


def _whitened(rows: Rows) -> tuple[FloatArray, FloatArray]:
    root = np.asarray(np.linalg.cholesky(rows.covariance), np.float64)
    return np.asarray(np.linalg.solve(root, rows.e), np.float64), root


def rows_of(estimate: Estimate, views: Measurements) -> Rows:
    """Linearise new views at an estimate.

    Raises
    ------
    InputError
        Views without the joint positions of an arm that is known.
    """
    known = estimate.corrected(views.through(estimate.camera))
    board = estimate.board_scale is not None
    seen = _core.PoseMeasurements(
        known.problem, known.camera_poses, free_camera=list(estimate.free_camera) or None, board_scale=board
    )
    variances = np.maximum(np.array(seen.variances_px2), _LEAST_PIXEL_PX**2)
    # A few points of a few views say little of their noise: what the calibration found counts as well.
    variances = np.maximum(variances, estimate.candidate_sigma_px**2)
    pixels = seen.covariances * variances[:, np.newaxis, np.newaxis]
    joints = None if estimate.arm is None else known.joints
    chains, parameters, noise, of_joints = _chain_rows(estimate, known.motions, joints)
    first = _TWIST * 2
    width = len(estimate.free_camera) + board
    sensitivities = seen.sensitivities
    parameters[:, :, first : first + width] = sensitivities
    if board:  # the linearisation stands at the scale as stated, the estimate at the one it found
        scale = sensitivities[:, :, -1] * (estimate.board_scale or 0.0)
    else:
        scale = np.zeros((len(known), _TWIST))
    e = _core.se3_log(np.ascontiguousarray(chains @ inverses(known.camera_poses))) + scale
    stacked = parameters.reshape(-1, parameters.shape[2])
    covariance = stacked @ estimate.covariance @ stacked.T
    for k in range(len(known)):
        at = slice(_TWIST * k, _TWIST * (k + 1))
        covariance[at, at] += pixels[k] + noise[k]
    shifts = {
        (Moved.CAMERA, ""): stacked[:, :_TWIST],
        (Moved.BOARD, ""): stacked[:, _TWIST:first],
    }
    if estimate.arm is not None:
        names = estimate.arm.kinematics.joint_names
        # The zero of the first joint moves the base, and of the last the flange: camera or board tell that.
        for joint in estimate.arm.free:
            shifts[Moved.JOINT, names[joint]] = of_joints[:, :, joint].reshape(-1, 1)
    return Rows(e.ravel(), covariance, shifts)


def _chain_rows(
    estimate: Estimate, motions: FloatArray, joints: FloatArray | None
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Chains (K, 4, 4), rows of parameters (K, 6, n), noise of the arm, rows per joint (K, 6, j)."""
    chains, of_chain, noise = chain_rows(
        estimate.X, estimate.Y, motions, estimate.expected_noise.roots(estimate.mounting)
    )
    rows = np.zeros((len(motions), _TWIST, len(estimate.covariance)))
    rows[:, :, : 2 * _TWIST] = of_chain
    arm, of_x = estimate.arm, estimate.X.adjoint()
    if arm is None or joints is None:
        return chains, rows, noise, np.zeros((len(motions), _TWIST, 0))
    roots, constants = arm.candidates(estimate.mounting, joints, estimate.expected_noise.joint_rad)
    rows[:, :, -arm.constants :] = of_x @ constants
    moved = of_x @ roots
    by_joint = of_x @ arm.kinematics.motion_jacobians(estimate.mounting, joints)
    return chains, rows, noise + moved @ np.swapaxes(moved, 1, 2), by_joint


def chain_rows(
    X: Pose, Y: Pose, motions: FloatArray, robot: tuple[FloatArray | None, FloatArray | None]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Chains `X A Y` (K, 4, 4), how twists of X and Y move them (K, 6, 12), and the robot's noise (K, 6, 6).

    Parameters
    ----------
    X, Y
        Of the chain.
    motions
        (K, 4, 4) A of each station.
    robot
        Roots (6, 6) of the covariances of the robot's error on the left and on the right of A.
    """
    before = np.ascontiguousarray(X.matrix @ motions)
    of_x, of_y = X.adjoint(), _core.se3_adjoint(before)
    rows = np.zeros((len(motions), _TWIST, 2 * _TWIST))
    rows[:, :, :_TWIST] = np.eye(_TWIST)
    rows[:, :, _TWIST:] = of_y
    left, right = robot
    noise = np.zeros((len(motions), _TWIST, _TWIST))
    if left is not None:
        noise += of_x @ left @ (of_x @ left).T
    if right is not None:
        moved = of_y @ right
        noise += moved @ np.swapaxes(moved, 1, 2)
    return before @ Y.matrix, rows, noise


def plan_check(
    estimate: Estimate, motions: FloatArray, joints: FloatArray | None, count: int = 2
) -> tuple[list[int], float]:
    """Choose views that would show a shift best: indices of motions (N, 4, 4), and what they show, metres.

    Best is the largest determinant of what they tell of shifts of camera and board together: both are found,
    and told apart. First the best pair of all, then one by one.

    Raises
    ------
    InputError
        Fewer candidates than views.
    """
    _, rows, noise, _ = _chain_rows(estimate, motions, joints)
    return choose_rows(estimate.covariance, rows, noise + _predicted_pixels(estimate, motions), count)


def choose_rows(
    covariance: FloatArray, rows: FloatArray, noise: FloatArray, count: int
) -> tuple[list[int], float]:
    """Choose views as `plan_check` does, by what they depend on and what is new in each.

    Parameters
    ----------
    covariance
        (n, n) of the parameters, X and Y first.
    rows
        (N, 6, n) how the twist of each candidate depends on them.
    noise
        (N, 6, 6) what is new in it; not finite where it cannot be taken.
    count
        How many to choose.

    Raises
    ------
    InputError
        Fewer candidates than views.
    """
    usable = [i for i in range(len(rows)) if np.isfinite(noise[i]).all()]
    if len(usable) < count or count < 2:
        raise InputError(
            f"{len(usable)} of {len(rows)} candidates show the board, {count} are needed, at least two",
            code=Code.TOO_FEW_VIEWS,
        )

    def worth(views: Sequence[int]) -> tuple[float, float]:
        return _worth(covariance, rows, noise, views)

    pairs = [(i, j) for i in usable for j in usable if j < i]
    chosen = sorted(max(pairs, key=lambda pair: worth(pair)[0]))
    while len(chosen) < count:
        left = [i for i in usable if i not in chosen]
        chosen.append(max(left, key=lambda i: worth((*chosen, i))[0]))
    return chosen, worth(chosen)[1]


def _predicted_pixels(estimate: Estimate, motions: FloatArray) -> FloatArray:
    """(N, 6, 6) covariance of the board's pose in pictures at motions (N, 4, 4); infinite where not seen."""
    predictor = _core.Predictor(
        estimate.camera.lens,
        estimate.camera.parameters,
        estimate.target.points,
        estimate.target.radii_m,
        estimate.X.matrix,
        estimate.Y.matrix,
        pixel_sigma=estimate.candidate_sigma_px,
        image_size=estimate.camera.size_px,
        fewest=estimate.target.point_count,
    )
    information = predictor.informations(motions)[:, :_TWIST, :_TWIST]
    seen = np.linalg.matrix_rank(information) == _TWIST
    found = np.full_like(information, np.inf)
    found[seen] = np.linalg.inv(information[seen])
    return found


def _worth(
    parameters: FloatArray, rows: FloatArray, noise: FloatArray, views: Sequence[int]
) -> tuple[float, float]:
    """Return the worth of some views, and the shift that they find in half of all cases, metres."""
    some = rows[list(views)]
    stacked = some.reshape(-1, some.shape[2])
    covariance = stacked @ parameters @ stacked.T
    for k, view in enumerate(views):
        at = slice(_TWIST * k, _TWIST * (k + 1))
        covariance[at, at] += noise[view]
    both = stacked[:, : 2 * _TWIST]
    information = both.T @ np.linalg.solve(covariance, both)
    return float(np.linalg.slogdet(information)[1]), _detectable(information[:_TWIST, :_TWIST])
