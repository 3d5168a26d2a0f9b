"""From stations with several cameras and targets to the calibration of them all in one estimate.

The robot's noise at a station is the same for all that was seen there, so the pose of two cameras of one body
in each other comes out free of the arm where they share stations: ``T_a_b = X_a X_b^-1``, with the covariance
of ``xi_a - Ad(T_a_b) xi_b``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from handeye.codes import Code
from handeye.errors import DegenerateError, InputError
from handeye.estimation.attribution import noise_of
from handeye.estimation.auto import attribution_of, estimate_of
from handeye.estimation.calibrate import require_determined, to_calibration
from handeye.estimation.cell_fit import CellFit, fit_cell
from handeye.estimation.confidence import Within, within
from handeye.estimation.estimate import Estimate
from handeye.estimation.faults import Examination
from handeye.estimation.measurements import Measurements
from handeye.estimation.rig_checks import check_constants, check_tied, examine_rig
from handeye.estimation.rig_labels import agree_on_labels
from handeye.estimation.rig_measurements import Pair, RigMeasurements
from handeye.estimation.rig_observability import undetermined_rig
from handeye.types.arrays import FloatArray
from handeye.types.calibration import TWIST_ORDER, Calibration, Finding, Noise, Unobservable
from handeye.types.kinematics import Kinematics
from handeye.types.pose import Pose
from handeye.types.recording import Recording
from handeye.types.rig import Body, RigRecording


@dataclass(frozen=True, eq=False)
class Relative:
    """The pose of one thing in another on the same body, with its uncertainty.

    Parameters
    ----------
    pose
        Such as `T_left_right`.
    covariance
        (6, 6) covariance of the twist on its left, in `TWIST_ORDER`.
    degrees_of_freedom
        Of the noise levels behind it.
    shared
        Number of stations at which both were measured; without any the pose comes through the arm.

    Examples
    --------
    >>> relative = rig_estimate.camera_to_camera("left", "right")
    >>> relative.covariance.shape
    (6, 6)
    """

    pose: Pose
    covariance: FloatArray
    degrees_of_freedom: float
    shared: int

    @property
    def within_95(self) -> Within:
        """How far off it may be, with 95 % probability."""
        return within(self.covariance, self.degrees_of_freedom)

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON."""
        return {
            "T": self.pose.to_list(),
            "within_95": self.within_95.to_dict(),
            "covariance": self.covariance.tolist(),
            "covariance_order": list(TWIST_ORDER),
            "degrees_of_freedom": self.degrees_of_freedom,
            "shared_stations": self.shared,
        }


@dataclass(frozen=True, eq=False)
class RigEstimate:
    """What is believed of all cameras and targets after some stations.

    Parameters
    ----------
    fit
        The fit behind it.
    noise
        Noise levels; pixels over all views.
    unobservable
        What the stations leave open, by camera.

    Examples
    --------
    >>> rig_estimate.determined
    True
    >>> rig_estimate.of_camera("left").within_95.rotation_deg < 1.0
    True
    """

    fit: CellFit
    noise: Noise
    unobservable: Mapping[str, tuple[Unobservable, ...]]
    attribution: Finding

    @property
    def determined(self) -> bool:
        """Whether the stations determine every camera."""
        return not any(self.unobservable.values())

    @cached_property
    def covariance(self) -> FloatArray:
        """(n, n) covariance of all parameters, in the order of the fit."""
        return np.asarray(self.fit.posterior.covariance)

    def target_of(self, camera: str) -> str | None:
        """Return the target that stands for a camera: of those that move against it, the one most seen."""
        seen = self.fit.measurements.of_camera(camera)
        moving = [target for target in seen if self.fit.measurements.moves(camera, target)]
        return max(moving, key=lambda target: len(seen[target])) if moving else None

    def of_camera(self, camera: str) -> Estimate:
        """Return what is believed of one camera and the target that stands for it."""
        target = self.target_of(camera) or next(iter(self.fit.measurements.of_camera(camera)))
        return self.of_pair(camera, target)

    def of_pair(self, camera: str, target: str) -> Estimate:
        """Return what is believed of one camera and one target."""
        views = [pixels.sigma_px for (name, _), pixels in self.fit.pixels.items() if name == camera]
        noise = replace(self.noise, pixel_sigma_px=tuple(float(s) for s in np.concatenate(views)))
        return estimate_of(self.fit, camera, target, noise, self.unobservable[camera], self.attribution)

    def camera_to_camera(self, a: str, b: str) -> Relative:
        """Return the pose of camera b in camera a, both on one body.

        Raises
        ------
        InputError
            The arm moves one against the other: there is no such pose.
        """
        cameras = self.fit.measurements.cameras
        if cameras[a].body is not cameras[b].body:
            raise InputError(
                f"cameras {a} and {b} are not on one body: the arm moves them against each other",
                code=Code.NOT_RIGID,
            )
        pose = self.fit.X[a] @ self.fit.X[b].inverse()
        combination = np.zeros((6, len(self.fit.theta)))
        combination[:, self.fit.rows_of_x(a)] = np.eye(6)
        combination[:, self.fit.rows_of_x(b)] = -pose.adjoint()
        return self._relative(pose, combination, len(self.shared(a, b)))

    def target_pose(self, target: str) -> Relative:
        """Return the pose of a target on its body; the covariance is that of the twist on the left."""
        combination = np.zeros((6, len(self.fit.theta)))
        combination[:, self.fit.rows_of_y(target)] = np.eye(6)
        seen = {
            view.name
            for (_, name), m in self.fit.measurements.pairs.items()
            if name == target
            for view in m.views
        }
        return self._relative(self.fit.Y[target], combination, len(seen))

    def shared(self, a: str, b: str) -> set[str]:
        """Return the stations at which two cameras both measured."""
        first, second = (
            {
                view.name
                for measured in self.fit.measurements.of_camera(name).values()
                for view in measured.views
            }
            for name in (a, b)
        )
        return first & second

    def _relative(self, pose: Pose, combination: FloatArray, shared: int) -> Relative:
        covariance = combination @ self.covariance @ combination.T
        degrees = self.fit.posterior.degrees_of_freedom_of(combination[None])[0]
        return Relative(pose, 0.5 * (covariance + covariance.T), degrees, shared)


@dataclass(frozen=True, eq=False)
class RigCalibration:
    """The calibration of several cameras and targets.

    Parameters
    ----------
    cameras
        The calibration of each camera; its Y is the pose of the target in `targets_of`.
    targets_of
        The target that stands for each camera, None where it saw none that the arm moves against it.
    targets
        Pose of each target on its body, by name.
    camera_to_camera
        Poses of cameras of one body in each other, by the two names.

    Examples
    --------
    >>> sorted(solve_rig(rig).cameras)
    ['front', 'left', 'right', 'side']
    """

    cameras: Mapping[str, Calibration]
    targets_of: Mapping[str, str | None]
    targets: Mapping[str, Relative]
    target_bodies: Mapping[str, Body]
    camera_to_camera: Mapping[Pair, Relative]
    estimate: RigEstimate
    diagnosis: tuple[Finding, ...] = ()
    warnings: tuple[str, ...] = field(default_factory=tuple)

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON: the keys of one camera under its name, and what lies between them."""
        cameras: dict[str, object] = {}
        for name, calibration in self.cameras.items():
            data = {"within_95": within(calibration.covariance, calibration.degrees_of_freedom).to_dict()}
            data |= calibration.to_dict()
            if self.targets_of[name] is None:
                del data[calibration.mounting.y_name]
            cameras[name] = data | {"target": self.targets_of[name]}
        noise = self.estimate.noise.to_dict()
        del noise["pixel_sigma_per_view_px"]
        return {
            "cameras": cameras,
            "camera_to_camera": {
                f"T_{a}_{b}": relative.to_dict() for (a, b), relative in self.camera_to_camera.items()
            },
            "targets": {
                name: {"on": self.target_bodies[name].value, **relative.to_dict()}
                for name, relative in self.targets.items()
            },
            "noise": noise,
            "diagnosis": [finding.to_dict() for finding in self.diagnosis],
            "warnings": list(self.warnings),
        }


def solve_rig(
    recording: RigRecording | Recording,
    *,
    reduced: bool = False,
    kinematics: Kinematics | None = None,
    camera_fixed: bool = False,
) -> RigCalibration:
    """Calibrate all cameras and targets from all usable stations in one estimate.

    Parameters
    ----------
    recording
        Stations; a recording of one camera is the simple case, with the same answer to the last bit.
    reduced, kinematics, camera_fixed
        As for `handeye.estimation.solve`.

    Raises
    ------
    InputError, DegenerateError, SolveError
        As for `handeye.estimation.solve`; the message names the camera. Also where nothing ties a camera to
        the arm.

    Examples
    --------
    >>> solved = solve_rig(rig)
    >>> solved.camera_to_camera["left", "right"].within_95.translation_mm < 5.0
    True
    """
    if isinstance(recording, Recording):
        recording = RigRecording.of(recording)
    measurements = RigMeasurements.of(recording)
    examinations = examine_rig(measurements, by_joints=kinematics is not None)
    measurements = measurements.with_pairs({pair: e.measurements for pair, e in examinations.items()})
    measurements = agree_on_labels(measurements)
    estimate = estimate_rig(measurements, kinematics, camera_fixed=camera_fixed)
    if not reduced:
        _require_determined(estimate)
    return _calibration(measurements, examinations, estimate)


def estimate_rig(
    measurements: RigMeasurements,
    kinematics: Kinematics | None = None,
    *,
    camera_fixed: bool = False,
    previous: RigEstimate | None = None,
) -> RigEstimate:
    """Estimate all cameras and targets at once.

    Parameters
    ----------
    measurements
        What every camera saw.
    kinematics
        The arm, if it is known.
    camera_fixed
        Hold the cameras as they are given.
    previous
        An earlier estimate to start from.

    Raises
    ------
    InputError
        Fewer than three stations, a camera that nothing ties to the arm, or views without joints that the arm
        needs.
    SolveError
        The views contradict one another: no camera or board is as they would have it.

    Examples
    --------
    >>> estimate_rig(RigMeasurements.of(rig)).determined
    True
    """
    check_tied(measurements)
    start = None
    if previous is not None:
        start = (np.asarray(previous.fit.posterior.x), np.asarray(previous.fit.posterior.y))
    fit = fit_cell(measurements, kinematics, camera_fixed=camera_fixed, start=start)
    check_constants(fit)
    sigmas = np.concatenate([pixels.sigma_px for pixels in fit.pixels.values()])
    noise = noise_of(fit.posterior, fit.measurements.whole, fit.arm, sigmas)
    return RigEstimate(fit, noise, undetermined_rig(fit, noise), attribution_of(fit, noise))


def _require_determined(estimate: RigEstimate) -> None:
    for name, open_directions in estimate.unobservable.items():
        if not open_directions:
            continue
        one = len(estimate.unobservable) == 1
        try:
            require_determined(estimate.of_camera(name))
        except DegenerateError as error:
            if one:
                raise
            raise DegenerateError(f"camera {name}: {error.message}", hint=error.hint) from error


def _calibration(
    measurements: RigMeasurements, examinations: Mapping[Pair, Examination], estimate: RigEstimate
) -> RigCalibration:
    cameras: dict[str, Calibration] = {}
    targets_of = {camera: estimate.target_of(camera) for camera in measurements.cameras}
    several = len(measurements.pairs) > 1
    for camera in measurements.cameras:
        of_pairs = measurements.of_camera(camera)
        told = [
            _told(estimate, camera, target, measured, examinations[camera, target])
            for target, measured in of_pairs.items()
        ]
        main = targets_of[camera] or next(iter(of_pairs))
        cameras[camera] = _together(list(of_pairs).index(main), told)
    findings = [
        replace(finding, sentence=f"{camera}: {finding.sentence}" if several else finding.sentence)
        for (camera, _), examination in examinations.items()
        for finding in examination.findings
    ]
    relative = {
        (a, b): estimate.camera_to_camera(a, b)
        for i, a in enumerate(measurements.cameras)
        for b in list(measurements.cameras)[i + 1 :]
        if measurements.cameras[a].body is measurements.cameras[b].body
    }
    return RigCalibration(
        cameras,
        targets_of,
        {target: estimate.target_pose(target) for target in measurements.targets},
        {target: one.body for target, one in measurements.targets.items()},
        relative,
        estimate,
        (*findings, *([estimate.attribution] if estimate.determined else [])),
        _warnings(cameras, relative),
    )


def _told(
    estimate: RigEstimate, camera: str, target: str, measured: Measurements, examination: Examination
) -> Calibration:
    of_camera = replace(estimate.of_camera(camera), Y=estimate.fit.Y[target], target=measured.target)
    told = examination.told(to_calibration(measured, of_camera))
    if not estimate.determined:
        return told
    return replace(told, diagnosis=(*told.diagnosis, estimate.attribution))


def _together(main: int, told: list[Calibration]) -> Calibration:
    """Return the calibration of a camera of what it says of each target that it saw."""
    if len(told) == 1:
        return told[0]
    counts = np.array([len(one.used) for one in told], dtype=float)
    rmse = np.sqrt(np.sum(counts * [one.rmse_px**2 if one.used else 0.0 for one in told]) / counts.sum())
    return replace(told[main], views=tuple(view for one in told for view in one.views), rmse_px=float(rmse))


def _warnings(cameras: Mapping[str, Calibration], relative: Mapping[Pair, Relative]) -> tuple[str, ...]:
    said = dict.fromkeys(warning for one in cameras.values() for warning in one.warnings)
    apart = [
        f"cameras {a} and {b} share no station: their pose in each other comes through the arm, with its "
        "errors; take stations at which both see a target"
        for (a, b), one in relative.items()
        if one.shared == 0
    ]
    return (*said, *apart)
