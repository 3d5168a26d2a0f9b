"""The one fit behind every estimate: all cameras and targets of a cell in one linear mixed model.

One camera and one target are the simple case, and go the same way.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NotRequired, TypedDict

import numpy as np

from handeye import _core
from handeye.errors import InputError, SolveError
from handeye.estimation.arm import ArmModel, behind, velocities
from handeye.estimation.camera_prior import CameraPrior, camera_prior
from handeye.estimation.measurements import Measurements, ViewPose
from handeye.estimation.pixels import Pixels, camera_of_pixels, moved_cameras, pixels_of
from handeye.estimation.probing import ProbingRows, probing_rows
from handeye.estimation.rig_measurements import Pair, RigMeasurements
from handeye.types.arrays import FloatArray
from handeye.types.camera import Camera
from handeye.types.kinematics import Kinematics
from handeye.types.pose import Pose
from handeye.types.probing import Probing, Tip
from handeye.types.rig import Body

# Pairs of nodes that the answer is averaged over.
NODE_PAIRS = 24
MOST_LINEARISATIONS = 8
# A mirrored pose is looked at where it fits less than this many times worse than the best.
MIRROR_RATIO = 8.0
MOST_CAMERAS = 4
# Noise of a rotation or joint that arms in good order do not have, and about what they have at most.
ROUGH_RAD, USUAL_NOISE_RAD = float(np.deg2rad(0.15)), float(np.deg2rad(0.03))
# Where the arm is not described part of what hides shows as noise; by `handeye study cheap-arms`.
NOT_DESCRIBED_POWER = 0.65
# Components of the error whose constants belong to the arm.
OF_ARM = frozenset({"joint_offsets", "links"})
# Levels that residuals show, whatever is believed of what hides.
SHOWN = frozenset(
    {
        "camera_inflation",
        "board_scale",
        "flange_rad",
        "flange_lever_m",
        "base_rad",
        "base_lever_m",
        "joint_rad",
    }
)

Start = tuple[FloatArray, FloatArray]


class _Begin(TypedDict):
    start: Start
    levels: NotRequired[list[tuple[str, float]]]


@dataclass(frozen=True, eq=False)
class CellFit:
    """What is believed of a cell, and where its parameters stand.

    Parameters
    ----------
    measurements
        As they were used: through the cameras of the priors, mirrored poses put right.
    priors
        What was believed of each camera.
    pixels
        What the pixels of each pair say.
    arm
        The arm, if it is known.
    posterior
        Of all parameters.
    probing
        Points that were touched; None without any.
    """

    measurements: RigMeasurements
    priors: Mapping[str, CameraPrior]
    pixels: Mapping[Pair, Pixels]
    arm: ArmModel | None
    posterior: _core.Posterior
    probing: Probing | None = None

    @cached_property
    def X(self) -> dict[str, Pose]:
        """X of each camera."""
        return {name: Pose(x) for name, x in zip(self.measurements.cameras, self.posterior.x, strict=True)}

    @cached_property
    def Y(self) -> dict[str, Pose]:
        """Y of each target."""
        return {name: Pose(y) for name, y in zip(self.measurements.targets, self.posterior.y, strict=True)}

    @cached_property
    def theta(self) -> FloatArray:
        """(n,) all parameters."""
        return np.asarray(self.posterior.theta)

    @cached_property
    def cameras(self) -> dict[str, Camera]:
        """The cameras as found.

        Raises
        ------
        SolveError
            One is no camera any more: no error of the lens is as large as the views contradict one another.
        """
        found: dict[str, Camera] = {}
        for name, prior in self.priors.items():
            parameters = np.array(prior.camera.parameters)
            parameters[list(prior.free)] += self.theta[self.rows_of_camera(name)]
            try:
                found[name] = Camera(prior.camera.lens, parameters, *prior.camera.size_px)
            except InputError as error:
                raise SolveError(f"the views contradict one another: {error.message}") from error
        return found

    @cached_property
    def inverse_information(self) -> FloatArray:
        """(n, n) inverse of the information."""
        information = np.asarray(self.posterior.information)
        scale = 1 / np.sqrt(np.diag(information))
        return np.linalg.inv(information * np.outer(scale, scale)) * np.outer(scale, scale)

    def rows_of_x(self, camera: str) -> list[int]:
        """Return where the twist of a camera's X stands among the parameters."""
        first = 6 * list(self.measurements.cameras).index(camera)
        return list(range(first, first + 6))

    def rows_of_y(self, target: str) -> list[int]:
        """Return where the twist of a target's Y stands."""
        first = 6 * (len(self.measurements.cameras) + list(self.measurements.targets).index(target))
        return list(range(first, first + 6))

    def rows_of_camera(self, camera: str) -> list[int]:
        """Return where the free parameters of a camera stand."""
        first = 6 * (len(self.measurements.cameras) + len(self.measurements.targets))
        for name, prior in self.priors.items():
            if name == camera:
                break
            first += len(prior.free)
        return list(range(first, first + len(self.priors[camera].free)))

    def row_of_board(self, target: str) -> int:
        """Return where the scale of a target stands."""
        free = sum(len(prior.free) for prior in self.priors.values())
        poses = 6 * (len(self.measurements.cameras) + len(self.measurements.targets))
        return poses + free + list(self.measurements.targets).index(target)

    @cached_property
    def tips(self) -> dict[str, Tip]:
        """Tips of the touches where they were found, with the largest of their deviations per axis."""
        if self.probing is None:
            return {}
        first = self.row_of_board(next(iter(self.measurements.targets))) + len(self.measurements.targets)
        covariance = np.asarray(self.posterior.covariance)
        found: dict[str, Tip] = {}
        for i, (name, tip) in enumerate(self.probing.tips.items()):
            rows = slice(first + 3 * i, first + 3 * i + 3)
            x, y, z = (np.array(tip.at_m) + self.theta[rows]).tolist()
            largest = float(np.linalg.eigvalsh(covariance[rows, rows])[-1])
            found[name] = Tip(tip.body, (x, y, z), max(largest, 0.0) ** 0.5)
        return found

    @property
    def at_rest(self) -> bool:
        """Whether poses and levels came to rest."""
        return self.posterior.effort[2]

    @cached_property
    def rows_of_arm(self) -> list[int]:
        """Where the constants of the arm stand."""
        return [i for name, a, b in self.posterior.constants if name in OF_ARM for i in range(a, b)]


def fit_cell(
    measurements: RigMeasurements,
    kinematics: Kinematics | None = None,
    *,
    camera_fixed: bool = False,
    start: Start | None = None,
    probing: Probing | None = None,
    play: bool = False,
) -> CellFit:
    """Fit everything in a cell to its measurements.

    Parameters
    ----------
    measurements
        Of every pair of camera and target.
    kinematics
        The arm, if it is known; every station must then have joint positions.
    camera_fixed
        Whether the cameras are held as they are given.
    start
        X (C, 4, 4) and Y (T, 4, 4) to try among other starts.
    probing
        Points that were touched, of the first target.
    play
        Whether the joints of a known arm have play, and came to every station straight from the one before.

    Raises
    ------
    InputError
        Views or touches without the joint positions that the arm needs, touches of points that the board does
        not have, or a camera that nothing ties to the arm.
    """
    priors = {
        name: camera_prior(one.camera, fixed=camera_fixed) for name, one in measurements.cameras.items()
    }
    changed = {
        name: prior.camera
        for name, prior in priors.items()
        if prior.camera is not measurements.cameras[name].camera
    }
    if changed:
        measurements = measurements.through(changed)
    arm = None if kinematics is None else ArmModel.of(kinematics)
    touched = None if probing is None else probing_rows(measurements, probing, arm)
    once = partial(_once, arm=arm, touched=touched, play=play)
    pixels = pixels_of(measurements, priors)
    # To where the pixels alone put the cameras, before all else is fitted around them.
    of_pixels = {name: camera_of_pixels(pixels, name, prior) for name, prior in priors.items()}
    if moved := moved_cameras(priors, of_pixels):
        measurements, priors, pixels = _through(measurements, priors, moved)
    fit = once(measurements, priors, pixels, start=start)
    for _ in range(MOST_CAMERAS):
        if not (moved := moved_cameras(priors, fit.cameras)):
            break
        measurements, priors, pixels = _through(measurements, priors, moved)
        fit = once(measurements, priors, pixels, **_going_on(fit))
    unmirrored = {
        (camera, target): put_right
        for (camera, target), measured in measurements.pairs.items()
        if (put_right := prefer_consistent_poses(measured, fit.X[camera], fit.Y[target])) is not None
    }
    if unmirrored:
        measurements = measurements.with_pairs(unmirrored)
        pixels = pixels_of(measurements, priors)
        fit = once(measurements, priors, pixels, **_going_on(fit))
    rough = roughness(fit.posterior, described=arm is not None)
    if rough == 1.0:
        return fit
    # Such an arm has play too, most likely: as much as the views show of it.
    found = _going_on(fit, many_modes=True)
    return once(measurements, priors, pixels, rough=rough, play=arm is not None, **found)


def _through(
    measurements: RigMeasurements, priors: Mapping[str, CameraPrior], moved: Mapping[str, Camera]
) -> tuple[RigMeasurements, dict[str, CameraPrior], dict[Pair, Pixels]]:
    """Return measurements, beliefs and pixels as of cameras that have moved."""
    measurements = measurements.near(moved)
    priors = {name: prior.moved(moved[name]) if name in moved else prior for name, prior in priors.items()}
    return measurements, priors, pixels_of(measurements, priors)


def roughness(posterior: _core.Posterior, *, described: bool) -> float:
    """How many times rougher an arm is than those that priors are about, by what its noise shows; else one.

    Servos that miss by a degree have zeros and links that are off as much: what hides in X and Y is believed
    to be as large as what shows.
    """
    levels = dict(zip(posterior.level_names, posterior.mode, strict=True))
    noise = float(
        np.hypot.reduce([levels.get(name, 0.0) for name in ("flange_rad", "base_rad", "joint_rad")])
    )
    if noise <= ROUGH_RAD:
        return 1.0
    return (noise / USUAL_NOISE_RAD) ** (1.0 if described else NOT_DESCRIBED_POWER)


def _going_on(fit: CellFit, *, many_modes: bool = False) -> _Begin:
    """Return where the next fit begins.

    Where the likelihood has more modes than one, as of several cameras or of rough arms, with the levels that
    residuals showed; what hides begins by what is believed of it.
    """
    begin: _Begin = {"start": (np.asarray(fit.posterior.x), np.asarray(fit.posterior.y))}
    if (many_modes or len(fit.measurements.pairs) > 1) and fit.at_rest:
        found = zip(fit.posterior.level_names, fit.posterior.mode, strict=True)
        begin["levels"] = [(name, level) for name, level in found if name in SHOWN]
    return begin


def _once(
    measurements: RigMeasurements,
    priors: Mapping[str, CameraPrior],
    pixels: Mapping[Pair, Pixels],
    *,
    arm: ArmModel | None,
    start: Start | None,
    touched: ProbingRows | None,
    play: bool,
    rough: float = 1.0,
    levels: Sequence[tuple[str, float]] = (),
) -> CellFit:
    whole = measurements.whole
    if arm is not None:
        arm.check(whole)
    place = {view.name: k for k, view in enumerate(measurements.stations)}
    camera_of = {name: i for i, name in enumerate(measurements.cameras)}
    target_of = {name: i for i, name in enumerate(measurements.targets)}
    seen = [
        (
            camera_of[camera],
            target_of[target],
            one.poses,
            [place[view.name] for view in measurements.pairs[camera, target].views],
            (one.shared**2 * np.square(one.sigma_px)).tolist(),
        )
        for (camera, target), one in pixels.items()
    ]
    of_arm = approach = None
    if arm is not None:
        joints = whole.joints if touched is None else np.concatenate([whole.joints, touched.joints])
        by_joint, by_link = arm.at_flange(joints)
        if play:
            approach = behind(by_joint, joints)
        of_arm = (by_joint, by_link, arm.scales.tolist(), list(arm.free), list(arm.lengths))
    cameras = [
        (
            measurements.cameras[name].body is Body.FLANGE,
            len(prior.free),
            prior.from_these_pixels,
            (prior.information, prior.mean, prior.inflated) if prior.free else None,
        )
        for name, prior in priors.items()
    ]
    stations = whole.flange_poses
    moving = velocities(whole)
    if touched is not None:
        stations = np.concatenate([stations, touched.poses])
        # A tip that touches stands still.
        moving = None if moving is None else np.concatenate([moving, np.zeros((len(touched.poses), 6))])
    posterior = _core.estimate_cell(
        stations,
        cameras,
        [one.body is Body.FLANGE for one in measurements.targets.values()],
        seen,
        velocities=moving,
        arm=of_arm,
        approach=approach,
        roughness=rough,
        board_scale=True,
        start=start,
        tips=[] if touched is None else touched.tips,
        touches=[] if touched is None else touched.touches,
        pairs=NODE_PAIRS,
        most_rounds=MOST_LINEARISATIONS,
        levels=list(levels),
    )
    return CellFit(measurements, priors, pixels, arm, posterior, None if touched is None else touched.probing)


def prefer_consistent_poses(measurements: Measurements, X: Pose, Y: Pose) -> Measurements | None:
    """Return the measurements with mirrored poses where the chain agrees better with them; None if nowhere.

    A plane seen from afar has two poses that fit almost equally; the other views decide.
    """
    poses: list[ViewPose] = []
    changed = False
    predicted = X.matrix @ measurements.motions @ Y.matrix
    for pose, chain in zip(measurements.poses, predicted, strict=True):
        other = pose.mirrored
        if other is not None and pose.ambiguity_ratio < MIRROR_RATIO:
            to_chain = Pose(chain).inverse()
            if (to_chain @ other[0]).rotation_angle_rad < (
                to_chain @ pose.T_camera_target
            ).rotation_angle_rad:
                pose = ViewPose(other[0], other[1], pose.information, (pose.T_camera_target, pose.rmse_px))  # noqa: PLW2901
                changed = True
        poses.append(pose)
    return replace(measurements, poses=tuple(poses)) if changed else None
