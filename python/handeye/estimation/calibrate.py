"""From a recording to a calibration: the one entry where the views are taken already."""

from dataclasses import replace

import numpy as np

from handeye.errors import DegenerateError
from handeye.estimation.auto import AutoEstimator, AutoOptions
from handeye.estimation.estimate import Estimate, Estimator, regular_information
from handeye.estimation.faults import Examination, examine, measured
from handeye.estimation.height import Height
from handeye.estimation.initialize import check_views
from handeye.estimation.measurements import Measurements
from handeye.estimation.paper import paper_estimate
from handeye.estimation.work import Work, touch_where_possible
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Calibration, ModelName, ViewResult
from handeye.types.kinematics import Kinematics
from handeye.types.mounting import Mounting
from handeye.types.probing import Probing
from handeye.types.recording import Recording

WHAT_NO_VIEW_SHOWS = (
    "constant errors of the arm turn the whole base as a camera beside it sees it, and no view shows that: "
    "the stated accuracy holds what such errors usually are; describe the arm and record its joints to have "
    "them found"
)


def make_estimator(
    model: ModelName,
    kinematics: Kinematics | None = None,
    *,
    camera_fixed: bool = False,
    probing: Probing | None = None,
    height: Height | None = None,
) -> Estimator:
    """Return what estimates under a model's assumptions; the paper's has no use for arm or touches.

    Parameters
    ----------
    model
        Noise from the data, or robot and camera as exact.
    kinematics
        The arm, if it is known.
    camera_fixed
        Hold the camera as it is given.
    probing
        Points that were touched.
    height
        Of the target, for an arm that turns about one axis only.

    Examples
    --------
    >>> from handeye.types.calibration import ModelName
    >>> make_estimator(ModelName.PAPER)(measurements).model.value
    'paper'
    """
    if ModelName(model) is ModelName.PAPER:
        return paper_estimate
    return AutoEstimator(AutoOptions(kinematics, camera_fixed, probing, height=height))


def solve(
    recording: Recording,
    model: ModelName = ModelName.AUTO,
    *,
    reduced: bool = False,
    kinematics: Kinematics | None = None,
    camera_fixed: bool = False,
    work: Work | None = None,
    probing: Probing | None = None,
    height: Height | None = None,
) -> Calibration:
    """Calibrate from all usable views of a recording.

    Views with a mistake are put right or left out, and named in `diagnosis`; see `docs/mistakes.md`.

    Parameters
    ----------
    recording
        Views, camera and target.
    model
        Assumptions about robot and camera.
    reduced
        Answer even where the views leave directions open: these are listed in `unobservable`, a weak prior
        stands in for them, and the covariance says so. An arm with four axes can only be calibrated so.
    kinematics
        The arm, if it is known: errors of its joints are then part of the model. Every view must have joint
        positions.
    camera_fixed
        Whether the camera is held as it is given; the paper's model always holds it.
    work
        What is seen and touched, for the touch error; None for none. `Work()` is a usual tool where the board
        was seen.
    probing
        Points that were touched, as measurements beside the pictures.
    height
        Of the target, as measured: what an arm that turns about one axis only cannot tell.

    Raises
    ------
    InputError
        Fewer than three usable views, or views without the joint positions that the arm needs. A mistake that
        all views share (a wrong direction, unit or order of numbers, images filed with the wrong poses); the
        code names it.
    DegenerateError
        The views do not determine the answer, and it was not asked for reduced; the message names what they
        leave open, the hint how to cure it.
    SolveError
        No minimum was found.

    Examples
    --------
    >>> import handeye
    >>> from handeye.datasets.shipped import shipped_recording
    >>> calibration = solve(handeye.open_folder(shipped_recording()).recording)
    >>> 1e3 * calibration.sigma_translation_m < 0.1  # mm
    True
    """
    return calibrate(
        measured(recording),
        ModelName(model),
        reduced=reduced,
        kinematics=kinematics,
        camera_fixed=camera_fixed,
        work=work,
        probing=probing,
        height=height,
    )


def calibrate(
    measurements: Measurements,
    model: ModelName = ModelName.AUTO,
    *,
    reduced: bool = False,
    kinematics: Kinematics | None = None,
    camera_fixed: bool = False,
    work: Work | None = None,
    probing: Probing | None = None,
    height: Height | None = None,
) -> Calibration:
    """Calibrate from measurements; see `solve`.

    Parameters
    ----------
    measurements
        Views of one target through one camera.
    model
        Noise from the data, or robot and camera as exact.
    reduced
        For the paper's model: the camera is not refined.
    kinematics
        The arm, if it is known.
    camera_fixed
        Hold the camera as it is given.
    work
        What is touched, for the touch error.
    probing
        Points that were touched.
    height
        Of the target.

    Raises
    ------
    HandeyeError
        As `solve`.

    Examples
    --------
    >>> calibrate(measurements).mounting.value
    'eye_in_hand'
    """
    check_views(measurements)
    return calibrate_examined(
        examine(measurements, by_joints=kinematics is not None),
        model,
        reduced=reduced,
        kinematics=kinematics,
        camera_fixed=camera_fixed,
        work=work,
        probing=probing,
        height=height,
    )


def calibrate_examined(
    examination: Examination,
    model: ModelName = ModelName.AUTO,
    *,
    reduced: bool = False,
    kinematics: Kinematics | None = None,
    camera_fixed: bool = False,
    work: Work | None = None,
    probing: Probing | None = None,
    height: Height | None = None,
) -> Calibration:
    """Calibrate from measurements whose mistakes have been looked for; see `solve`.

    Parameters
    ----------
    examination
        Measurements without those that are wrong, and what was found.
    model, reduced, kinematics, camera_fixed, work, probing, height
        As for `calibrate`.

    Raises
    ------
    HandeyeError
        As `solve`.

    Examples
    --------
    >>> from handeye.estimation.faults import examine
    >>> len(calibrate_examined(examine(measurements)).used)
    9
    """
    measurements = examination.measurements
    check_views(measurements)
    estimate = make_estimator(model, kinematics, camera_fixed=camera_fixed, probing=probing, height=height)(
        measurements
    )
    if not reduced:
        require_determined(estimate)
    calibration = examination.told(to_calibration(measurements, estimate))
    if work is not None:
        calibration = replace(calibration, touch=touch_where_possible(estimate, measurements, work))
    if calibration.model is ModelName.PAPER or not estimate.determined:
        return calibration
    if estimate.attribution is None:
        raise AssertionError  # the default model always has one
    return replace(calibration, diagnosis=(*calibration.diagnosis, estimate.attribution))


def require_determined(estimate: Estimate) -> None:
    """Raise where the views leave something open.

    Raises
    ------
    DegenerateError
        The message names what is open, the hint how to cure it.

    Examples
    --------
    >>> require_determined(estimate)
    """
    if not estimate.determined:
        sentences = list(dict.fromkeys(direction.sentence for direction in estimate.unobservable))
        raise DegenerateError("; ".join(sentences), hint=estimate.unobservable[0].cure)


def to_calibration(measurements: Measurements, estimate: Estimate) -> Calibration:
    """Return the calibration of an estimate: residuals of every view, covariance, warnings.

    Parameters
    ----------
    measurements
        The views.
    estimate
        What is believed after them.

    Examples
    --------
    >>> calibration = to_calibration(measurements, estimate)
    >>> calibration.covariance.shape  # (metres, radians) squared
    (6, 6)
    """
    rmse = view_rmse_px(measurements, estimate)
    views = [
        ViewResult(view.name, float(value)) for view, value in zip(measurements.views, rmse, strict=True)
    ]
    views += [
        ViewResult(name, float("nan"), used=False, reason=reason)
        for name, reason in measurements.rejected.items()
    ]
    counts = measurements.point_counts
    return Calibration(
        mounting=measurements.mounting,
        X=estimate.X,
        Y=estimate.Y,
        camera=estimate.camera,
        covariance=estimate.hand_eye_covariance,
        information=regular_information(estimate.covariance),
        rmse_px=float(np.sqrt(np.sum(counts * rmse**2) / np.sum(counts))),
        ending=estimate.ending,
        iterations=estimate.iterations,
        noise=estimate.noise,
        model=estimate.model,
        start=estimate.start,
        views=tuple(views),
        unobservable=estimate.unobservable,
        degrees_of_freedom=estimate.degrees_of_freedom,
        joint_offsets=estimate.joint_offsets,
        link_errors=estimate.link_errors,
        arm_correction=estimate.arm_correction,
        warnings=_what_no_view_shows(estimate),
    )


def _what_no_view_shows(estimate: Estimate) -> tuple[str, ...]:
    """Say what the stated accuracy can only believe, and what would cure it."""
    beside = estimate.mounting is Mounting.EYE_TO_HAND
    if estimate.model is ModelName.PAPER or estimate.arm is not None or not beside:
        return ()
    return (WHAT_NO_VIEW_SHOWS,)


def view_rmse_px(measurements: Measurements, estimate: Estimate) -> FloatArray:
    """(K,) root mean square over the points of each view of the residual's norm.

    Robot poses are as reported, put right by what is known of the joints and links of a known arm.
    Infinite where the estimate puts the target out of sight.
    """
    problem = estimate.corrected(measurements).with_camera(estimate.camera).problem
    return np.array(
        [
            np.sqrt(problem.squared_error(estimate.X.matrix, estimate.Y.matrix, views=[k]) / count)
            for k, count in enumerate(measurements.point_counts)
        ]
    )
