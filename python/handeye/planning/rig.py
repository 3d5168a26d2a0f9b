"""What a station teaches that is seen by several cameras: one gain over all that is asked for.

The robot's error at a station is the same for all of its views, so their information does not add up. Every
pair of camera and target gives the information of its pixels on the parameters and on that error; summed over
the pairs, the error is then eliminated, ``I = H_tt - H_tu (H_uu + 1)^-1 H_ut``. As that is costly for many
candidates, those are looked at whose gains, each camera for itself, sum up to the most.

Of what is asked for, a pose counts by the determinant of its covariance, and what is touched by the cube of
its mean square error: the same measure for an error that is as large along all three axes.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import DegenerateError, InputError
from handeye.estimation import Estimate, RigEstimate
from handeye.estimation.touch import touch_rows
from handeye.estimation.work import Work, lay_out
from handeye.planning.candidates import Pool
from handeye.planning.constraints import ViewLimits, corners_at, out_of_limits
from handeye.planning.prediction import Prediction, Sight
from handeye.planning.rig_request import Aim, Pair, seen_most
from handeye.planning.visibility import obstacles
from handeye.types.arrays import FloatArray
from handeye.types.mounting import Mounting
from handeye.types.pose import inverses
from handeye.types.rig import Body

# Candidates whose joint information is computed.
SHORTLIST = 24


def mounted_on_flange(estimate: RigEstimate) -> FloatArray:
    """(P, 3) points in the flange of what is mounted there: centres of cameras, corners of targets."""
    fit = estimate.fit
    parts = [
        fit.X[name].inverse().matrix[np.newaxis, :3, 3]
        for name, one in fit.measurements.cameras.items()
        if one.body is Body.FLANGE
    ]
    parts += [
        corners_at(one.target, fit.Y[name])
        for name, one in fit.measurements.targets.items()
        if one.body is Body.FLANGE
    ]
    return np.concatenate([np.zeros((0, 3)), *parts])


@dataclass(frozen=True, eq=False)
class RigGains:
    """Gains of candidates.

    Parameters
    ----------
    gains
        (N,) gain in nats over what is asked for; NaN where no camera would see a target, or for those that
        were not looked at closely.
    seen
        Cameras and targets that would be seen at each candidate that was looked at.
    """

    gains: FloatArray
    seen: Mapping[int, tuple[Pair, ...]] = field(default_factory=dict[int, tuple[Pair, ...]])

    @property
    def best(self) -> int | None:
        """The candidate that gains most; None if none can be used."""
        return None if np.isnan(self.gains).all() else int(np.nanargmax(self.gains))


def rig_gains(
    estimate: RigEstimate,
    pool: Pool,
    wanted: Collection[Aim],
    sight: Sight | None = None,
    limits: ViewLimits | None = None,
) -> RigGains:
    """Gain of every candidate for what is wanted: `RigRequest.missing`, or all cameras where that is empty.

    Parameters
    ----------
    estimate
        What is believed now.
    pool
        Candidates.
    wanted
        What is asked for and not reached.
    sight
        What a camera must see of a target.
    limits
        From how far and how obliquely; None for any.

    Raises
    ------
    DegenerateError
        The information of the stations is singular.
    InputError
        Nothing in a box of work that is asked for can be seen and touched.
    """
    sight = sight or Sight(margin_px=20.0)
    aims = list(wanted) or [Aim((name,)) for name in estimate.fit.measurements.cameras]
    pairs = {
        (camera, target): estimate.of_pair(camera, target)
        for camera, target in estimate.fit.measurements.pairs
        if estimate.fit.measurements.moves(camera, target)
    }
    needed = {name for aim in aims for name in aim.cameras}
    sums = np.zeros(len(pool))
    visible: dict[Pair, np.ndarray] = {}
    criterion = _core.Criterion("entropy_handeye")
    in_base = np.array([candidate.T_base_flange.matrix for candidate in pool.candidates]).reshape(-1, 4, 4)
    motions: dict[Mounting, FloatArray] = {
        Mounting.EYE_IN_HAND: inverses(in_base),
        Mounting.EYE_TO_HAND: in_base,
    }
    for pair, one in pairs.items():
        # What the arm adds is weighed for those on the short list only.
        gains = Prediction(_without_arm(one), sight, coarse=True).gains(criterion, motions[one.mounting])
        if limits is not None:
            gains[np.logical_or(*out_of_limits(one, motions[one.mounting], limits))] = np.nan
        visible[pair] = np.isfinite(gains)
        # A camera that is good enough still helps others a little, through the arm and the board.
        sums += np.nan_to_num(gains) * (1.0 if pair[0] in needed else 0.1)
    order = [int(i) for i in np.argsort(-sums, kind="stable")[:SHORTLIST] if sums[i] > 0]
    result = np.full(len(pool), np.nan)
    seen: dict[int, tuple[Pair, ...]] = {}
    if not order:
        return RigGains(result)
    short = Pool(tuple(pool.candidates[i] for i in order))
    for pair, one in pairs.items():
        there = short.motions(one.mounting)
        hidden = obstacles(one, there, sight)
        clear = Prediction(one, sight).in_sight(there) & np.array([why is None for why in hidden])
        visible[pair] = visible[pair][order] & clear
    informations = _joint(estimate, pairs, short, visible, sight)
    before = np.asarray(estimate.fit.posterior.information)
    combinations = [_combination(estimate, aim) for aim in aims]
    sizes = _log_sizes(np.concatenate([before[None], before + informations]), aims, combinations)
    value = np.sum(sizes[0] - sizes[1:], axis=1)
    usable = np.any([visible[pair] for pair in pairs], axis=0)
    for place, i in enumerate(order):
        if usable[place]:
            result[i] = 0.5 * value[place]
            seen[i] = tuple(pair for pair in pairs if visible[pair][place])
    return RigGains(result, seen)


def _without_arm(one: Estimate) -> Estimate:
    """Return an estimate whose arm is no part of it any more: a smaller problem."""
    if one.arm is None:
        return one
    kept = len(one.information) - one.arm.constants
    scale = 1 / np.sqrt(np.diag(one.information))
    inverse = np.linalg.inv(one.information * np.outer(scale, scale))[:kept, :kept]
    information = np.linalg.inv(inverse) / np.outer(scale[:kept], scale[:kept])
    return replace(
        one,
        arm=None,
        information=0.5 * (information + information.T),
        covariance=one.covariance[:kept, :kept],
    )


def _combination(estimate: RigEstimate, aim: Aim) -> FloatArray:
    """(m, n) what is asked for, as a combination of the parameters: of a twist, or of touches."""
    fit = estimate.fit
    if aim.touch is not None:
        return _touches(estimate, aim.cameras[0], aim.touch)
    combination = np.zeros((6, len(fit.theta)))
    combination[:, fit.rows_of_x(aim.cameras[0])] = np.eye(6)
    if len(aim.cameras) > 1:
        a, b = aim.cameras
        combination[:, fit.rows_of_x(b)] = -(fit.X[a] @ fit.X[b].inverse()).adjoint()
    return combination


def _touches(estimate: RigEstimate, camera: str, work: Work) -> FloatArray:
    """(m, n) rows whose squares sum up, over a covariance, to the mean square of touch errors."""
    pair = seen_most(estimate, camera)
    one = estimate.of_pair(*pair)
    laid = lay_out(one, estimate.fit.measurements.pairs[pair], work)
    rows = touch_rows(one, laid.touches)[0].reshape(3 * len(laid.touches), -1)
    combination = np.zeros((rows.shape[1], len(estimate.fit.theta)))
    # As many rows as parameters say the same as those of all touches.
    combination[:, _rows(estimate, pair)] = np.linalg.qr(
        np.concatenate([rows, np.zeros((rows.shape[1], rows.shape[1]))]), mode="r"
    ) / np.sqrt(len(laid.touches))
    return combination


def _rows(estimate: RigEstimate, pair: Pair) -> list[int]:
    """Return where the parameters of a pair's estimate stand among those of all."""
    fit, (camera, target) = estimate.fit, pair
    return [
        *fit.rows_of_x(camera),
        *fit.rows_of_y(target),
        *fit.rows_of_camera(camera),
        fit.row_of_board(target),
        *fit.rows_of_arm,
    ]


def _log_sizes(
    informations: FloatArray, aims: Sequence[Aim], combinations: Sequence[FloatArray]
) -> FloatArray:
    """(N, C) sizes of what is asked for, C combinations (m, n): logarithms of determinants of covariances."""
    scale = 1 / np.sqrt(np.diag(informations[0]))
    rows = np.concatenate(combinations) * scale
    try:
        solved = np.linalg.solve(informations * scale[:, None] * scale, rows.T)
    except np.linalg.LinAlgError as error:
        raise DegenerateError("the information of the stations is singular") from error
    sizes: list[FloatArray] = []
    ends = np.cumsum([len(one) for one in combinations])
    for aim, one, end in zip(aims, combinations, ends, strict=True):
        part = slice(end - len(one), end)
        covariances = rows[part] @ solved[:, :, part]
        if aim.touch is None:
            signs, size = np.linalg.slogdet(covariances)
        else:
            mean_squares = np.trace(covariances, axis1=1, axis2=2)
            signs, size = np.sign(mean_squares), 3 * np.log(np.abs(mean_squares))
        if not np.all(signs > 0):
            raise DegenerateError("the information of the stations is singular")
        sizes.append(size)
    return np.stack(sizes, axis=1)


def _joint(
    estimate: RigEstimate,
    pairs: Mapping[Pair, Estimate],
    pool: Pool,
    visible: Mapping[Pair, np.ndarray],
    sight: Sight,
) -> FloatArray:
    """(N, n, n) information of candidates with all that is seen there, the robot's error shared."""
    count = len(estimate.fit.theta)
    total: FloatArray | None = None
    for (camera, target), one in pairs.items():
        motions = pool.motions(one.mounting)
        columns, shared = _columns(one, motions, pool.joints)
        width, height = one.camera.size_px
        predictor = _core.Predictor(
            one.camera.lens,
            one.camera.parameters,
            one.target.points,
            one.target.radii_m,
            one.X.matrix,
            one.Y.matrix,
            pixel_sigma=one.candidate_sigma_px,
            free_camera=list(one.free_camera) or None,
            board_scale=True,
            kinematic_count=columns.shape[2],
            image_size=(width, height),
            margin_px=sight.margin_px,
            fewest=sight.fewest or one.target.point_count,
        )
        own = predictor.informations(motions, arm=columns)
        rows = [*_rows(estimate, (camera, target)), *range(count, count + shared)]
        if total is None:
            total = np.zeros((len(motions), count + shared, count + shared))
        total[:, np.array(rows)[:, None], rows] += own * visible[camera, target][:, None, None]
    if total is None:
        raise InputError("no camera moves against a target", code=Code.NOT_TIED)
    across, of_error = total[:, :count, count:], total[:, count:, count:]
    eliminated = across @ np.linalg.solve(of_error + np.eye(of_error.shape[1]), np.swapaxes(across, 1, 2))
    return total[:, :count, :count] - eliminated


def _columns(one: Estimate, motions: FloatArray, joints: FloatArray | None) -> tuple[FloatArray, int]:
    """(N, 6, k + r) constants of the arm, and deviations of its error at a station, as twists left of A."""
    noise = one.station_noise
    adjoints = _core.se3_adjoint(motions)
    still = np.broadcast_to(np.eye(6), adjoints.shape)
    in_hand = one.mounting is Mounting.EYE_IN_HAND
    # In the hand A is the inverse of what the robot reports: an error of the arm acts backwards.
    flange, base = (-still, -adjoints) if in_hand else (adjoints, still)
    parts: list[FloatArray] = []
    errors: list[FloatArray] = []
    if one.arm is not None and joints is not None:
        roots, constants = one.arm.candidates(one.mounting, joints, noise.joint_rad)
        parts.append(constants)
        errors.append(roots)
    elif one.arm is not None:
        parts.append(np.zeros((len(motions), 6, one.arm.constants)))
    for side, (translation, rotation) in ((flange, noise.flange), (base, noise.base)):
        errors.append(side * np.array([translation] * 3 + [rotation] * 3))
    together = np.concatenate([*parts, *errors], axis=2)
    return together, sum(error.shape[2] for error in errors)
