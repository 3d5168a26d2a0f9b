"""What a station teaches that is seen by several cameras: one gain over all that is asked for.

The robot's error at a station is the same for all of its views, so their information does not add up. Every
pair of camera and target gives the information of its pixels on the parameters and on that error; summed over
the pairs, the error is then eliminated, ``I = H_tt - H_tu (H_uu + 1)^-1 H_ut``. As that is costly for many
candidates, those are looked at whose gains, each camera for itself, sum up to the most.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.errors import DegenerateError, InputError
from handeye.estimation import Estimate, RigEstimate
from handeye.estimation.confidence import Within
from handeye.planning.candidates import Pool
from handeye.planning.constraints import ViewLimits, corners_at, out_of_limits
from handeye.planning.prediction import Prediction, Sight
from handeye.planning.visibility import obstacles
from handeye.types.arrays import FloatArray
from handeye.types.mounting import Mounting
from handeye.types.rig import Body

Pair = tuple[str, str]
# Candidates whose joint information is computed.
SHORTLIST = 24
FEWEST_STATIONS = 6


@dataclass(frozen=True)
class RigRequest:
    """How accurate all cameras must be: radii that hold their errors with 95 % probability.

    Parameters
    ----------
    translation_mm, rotation_deg
        Of the pose of each camera.
    cameras
        Those that are asked for; None for all.
    camera_to_camera
        The same two radii for cameras of one body in each other; None if that is not asked for.

    Raises
    ------
    InputError
        A radius that is not above zero.
    """

    translation_mm: float = 0.5
    rotation_deg: float = 0.05
    cameras: tuple[str, ...] | None = None
    camera_to_camera: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if min(self.translation_mm, self.rotation_deg, *(self.camera_to_camera or ())) <= 0:
            raise InputError("an accuracy above zero is needed", code=Code.OUT_OF_RANGE)

    def missing(self, estimate: RigEstimate) -> dict[tuple[str, ...], float]:
        """Return what does not meet the request, and by which factor; cameras, or two in each other."""
        found: dict[tuple[str, ...], float] = {}
        for name in estimate.fit.measurements.cameras:
            if self.cameras is None or name in self.cameras:
                now = estimate.of_camera(name).within_95
                found[(name,)] = _factor(now, self.translation_mm, self.rotation_deg)
        if self.camera_to_camera is not None:
            for a, b in rigid_pairs(estimate):
                found[a, b] = _factor(estimate.camera_to_camera(a, b).within_95, *self.camera_to_camera)
        return {names: factor for names, factor in found.items() if factor > 1}


def rigid_pairs(estimate: RigEstimate) -> list[Pair]:
    """Return the pairs of cameras on one body."""
    cameras = estimate.fit.measurements.cameras
    names = list(cameras)
    return [(a, b) for i, a in enumerate(names) for b in names[i + 1 :] if cameras[a].body is cameras[b].body]


def _factor(now: Within, translation_mm: float, rotation_deg: float) -> float:
    return max(now.translation_mm / translation_mm, now.rotation_deg / rotation_deg)


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
    wanted: Mapping[tuple[str, ...], float],
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
        Cameras, or two in each other, by their names.
    sight
        What a camera must see of a target.
    limits
        From how far and how obliquely; None for any.

    Raises
    ------
    DegenerateError
        The information of the stations is singular.
    """
    sight = sight or Sight(margin_px=20.0)
    targets = list(wanted) or [(name,) for name in estimate.fit.measurements.cameras]
    pairs = {
        (camera, target): estimate.of_pair(camera, target)
        for camera, target in estimate.fit.measurements.pairs
        if estimate.fit.measurements.moves(camera, target)
    }
    needed = {name for names in targets for name in names}
    sums = np.zeros(len(pool))
    visible: dict[Pair, np.ndarray] = {}
    criterion = _core.Criterion("entropy_handeye")
    in_base = np.array([candidate.T_base_flange.matrix for candidate in pool.candidates]).reshape(-1, 4, 4)
    motions: dict[Mounting, FloatArray] = {
        Mounting.EYE_IN_HAND: np.asarray(np.linalg.inv(in_base), dtype=np.float64),
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
    combinations = np.array([_combination(estimate, names) for names in targets])
    before = np.asarray(estimate.fit.posterior.information)
    sizes = _log_sizes(np.concatenate([before[None], before + informations]), combinations)
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


def _combination(estimate: RigEstimate, names: tuple[str, ...]) -> FloatArray:
    """(6, n) the twist that is asked for, as a combination of the parameters."""
    fit = estimate.fit
    combination = np.zeros((6, len(fit.theta)))
    combination[:, fit.rows_of_x(names[0])] = np.eye(6)
    if len(names) > 1:
        combination[:, fit.rows_of_x(names[1])] = -(fit.X[names[0]] @ fit.X[names[1]].inverse()).adjoint()
    return combination


def _log_sizes(informations: FloatArray, combinations: FloatArray) -> FloatArray:
    """(N, C) logarithms of the determinants of the covariances of combinations (C, 6, n)."""
    scale = 1 / np.sqrt(np.diag(informations[0]))
    rows = combinations * scale
    try:
        solved = np.linalg.solve(informations * scale[:, None] * scale, rows.reshape(-1, len(scale)).T)
    except np.linalg.LinAlgError as error:
        raise DegenerateError("the information of the stations is singular") from error
    blocks = rows @ np.swapaxes(solved.reshape(len(informations), len(scale), -1, 6), 1, 2)
    signs, logarithms = np.linalg.slogdet(blocks)
    if not np.all(signs > 0):
        raise DegenerateError("the information of the stations is singular")
    return logarithms


def _joint(
    estimate: RigEstimate,
    pairs: Mapping[Pair, Estimate],
    pool: Pool,
    visible: Mapping[Pair, np.ndarray],
    sight: Sight,
) -> FloatArray:
    """(N, n, n) information of candidates with all that is seen there, the robot's error shared."""
    fit = estimate.fit
    count = len(fit.theta)
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
        nothing = np.zeros((len(motions), 6, 1))
        own = predictor.informations(motions, arm=(nothing, columns))
        rows = [
            *fit.rows_of_x(camera),
            *fit.rows_of_y(target),
            *fit.rows_of_camera(camera),
            fit.row_of_board(target),
            *fit.rows_of_arm,
            *range(count, count + shared),
        ]
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
