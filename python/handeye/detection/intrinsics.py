"""Ordinary camera calibration: lens parameters from several views of one flat target.

Zhang, "A flexible new technique for camera calibration" (PAMI 2000): the reprojection error over lens
parameters and one pose for each view is minimised by Levenberg-Marquardt. It is the optimum that
`cv2.calibrateCamera` seeks too, but for every lens of ours in the same way, with circles seen at their area
centroids, and with the full covariance of the parameters. Among lenses of more and more coefficients the one
that the views support is kept (Schwarz, "Estimating the Dimension of a Model", Annals of Statistics 1978):
coefficients that only follow the noise would pull the focal length with them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.detection.base import Detection
from handeye.detection.bundle import Bundle, ParameterPrior, minimise
from handeye.errors import DegenerateError, HandeyeError, InputError, SolveError
from handeye.types import LENSES, Camera, Pose, Target
from handeye.types.arrays import FloatArray
from handeye.types.ordinary_lens import ordinary_lens

MIN_VIEWS = 3
MIN_POINTS = 4
# Focal lengths to begin with, in image widths: from a fisheye of 180 degrees to a field of view of 6 degrees.
START_FOCALS = (0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0)
# Views that choose among them.
START_VIEWS = 8
# From which a lens is chosen, where none is asked for. Ordinary views cannot tell further coefficients
# from each other: a lens that needs them has to be named.
CHOICE = ("pinhole", "brown_conrady_4", "brown_conrady_5")
# Where ordinary lenses are believed in, such coefficients do no harm.
ORDINARY_CHOICE = ("brown_conrady_5", "kannala_brandt")
# By so much its criterion has to be lower before another lens than the first of these is believed in: very
# strong evidence (Kass and Raftery, "Bayes Factors", 1995).
DECISIVE = 10.0
# The noise of a point, px, until the residuals tell.
USUAL_NOISE_PX = 0.2
# No detection is better: lenses that all fit to less are equally good.
LEAST_NOISE_PX = 1e-3
# Parameters known no better than this (focal length and centre, in image widths) are not known.
LARGEST_SIGMA = 0.2


@dataclass(frozen=True, eq=False)
class CameraCalibration:
    """A camera calibrated from views of a target.

    Attributes
    ----------
    camera
        The camera, with the covariance of its parameters.
    rmse_px
        Root mean square of the residual's norm over all points of all views.
    sigma_px
        Noise of one coordinate of a point, from the residuals, for the number of parameters estimated.
    view_rmse_px
        As `rmse_px`, of each view.
    poses
        `T_camera_target` of each view.
    rejected
        Views that could not be used, and why.

    Examples
    --------
    >>> found = {view.name: Detection(view.point_ids, view.pixels) for view in recording.views}
    >>> calibrate_camera(board, found, camera.size_px).rmse_px < 1.0
    True
    """

    camera: Camera
    rmse_px: float
    sigma_px: float
    view_rmse_px: Mapping[str, float]
    poses: Mapping[str, Pose]
    rejected: Mapping[str, str]


def calibrate_camera(
    target: Target,
    detections: Mapping[str, Detection],
    size_px: tuple[int, int],
    *,
    lens: str | None = None,
    ordinary: bool = False,
) -> CameraCalibration:
    """Calibrate a camera from the points found in several images of one target.

    Parameters
    ----------
    target
        The target.
    detections
        Its points in each image, by name of the image.
    size_px
        Width and height of the images.
    lens
        Name of one of `handeye.types.LENSES`; by default the one of `CHOICE` with the lowest Bayesian
        information criterion; with `ordinary` one of `ORDINARY_CHOICE`.
    ordinary
        Believe besides that the lens is like ordinary ones (`handeye.types.ordinary_lens`): few views then
        do not bend it to their noise, and the covariance says what they leave open.

    Raises
    ------
    InputError
        An unknown lens, or fewer than three views with four points.
    DegenerateError
        The views do not determine the camera: all face the board squarely, or too few for such a lens.
    SolveError
        The iteration does not converge.

    Examples
    --------
    >>> found = {view.name: Detection(view.point_ids, view.pixels) for view in recording.views}
    >>> calibrate_camera(board, found, camera.size_px, lens="pinhole").camera.lens
    'pinhole'
    """
    if lens is not None and lens not in LENSES:
        raise InputError(f"lens {lens!r}, expected one of {', '.join(LENSES)}", code=Code.UNKNOWN_LENS)
    rejected = {
        name: f"{len(found)} points, at least {MIN_POINTS} are needed"
        for name, found in detections.items()
        if len(found) < MIN_POINTS
    }
    usable = {name: found for name, found in detections.items() if name not in rejected}
    _check_number(usable)
    lenses = (ORDINARY_CHOICE if ordinary else CHOICE) if lens is None else (lens,)
    # Without distortion all lenses of the choice are the same.
    first = lenses[0]
    begin = _start(first, target, usable, size_px)
    poses: dict[str, FloatArray] = {}
    for name, found in usable.items():
        try:
            poses[name] = _pose(first, begin, target, found)[0]
        except HandeyeError as error:
            rejected[name] = error.message
    usable = {name: usable[name] for name in poses}
    _check_number(usable)
    ids = np.concatenate([found.point_ids for found in usable.values()])
    start = Bundle(
        lens=first,
        parameters=begin,
        poses=np.array(list(poses.values())),
        points=target.points[ids],
        radii=target.radii_m[ids],
        pixels=np.concatenate([found.pixels for found in usable.values()]),
        counts=np.array([len(found) for found in usable.values()]),
    )
    fits: list[tuple[float, CameraCalibration]] = []
    failures: list[HandeyeError] = []
    for candidate in lenses:
        parameters = np.concatenate([begin[:4], np.zeros(len(LENSES[candidate]) - 4)])
        try:
            guess = replace(start, lens=candidate, parameters=parameters)
            best, converged = _as_ordinary(guess, size_px) if ordinary else minimise(guess)
            # What the views do not determine drifts: that is then why there is no end.
            fit = _calibration(best, tuple(usable), size_px, rejected)
            if not converged:
                raise SolveError(
                    f"camera calibration: no convergence with the lens {candidate}",
                    code=Code.NOT_CONVERGED,
                    hint="take more views, or a lens with fewer parameters",
                )
        except HandeyeError as error:
            failures.append(error)
            continue
        fits.append((_information_criterion(fit, len(ids)), fit))
    if not fits:
        raise failures[0]
    best, chosen = min(fits, key=lambda fit: fit[0])
    first, usual = fits[0]
    return usual if ordinary and first < best + DECISIVE else chosen


def _as_ordinary(guess: Bundle, size_px: tuple[int, int]) -> tuple[Bundle, bool]:
    """Return the likeliest guess if the lens is an ordinary one; then again with the noise that it leaves."""
    mean, sigmas = ordinary_lens(guess.lens, size_px, float(guess.parameters[0]))
    noise, converged = USUAL_NOISE_PX, False
    for _ in range(2):
        guess, converged = minimise(replace(guess, prior=ParameterPrior(mean, noise**2 / sigmas**2)))
        residuals = guess.residuals()
        if residuals is None:  # `minimise` ends where all points are seen
            raise AssertionError
        noise = max(float(np.sqrt(np.mean(residuals**2))), LEAST_NOISE_PX)
    return guess, converged


def _information_criterion(fit: CameraCalibration, points: int) -> float:
    """Return Schwarz's criterion with the noise at its likeliest; what all lenses share is left out."""
    mean_square = max(fit.rmse_px**2 / 2, LEAST_NOISE_PX**2)
    return 2 * points * float(np.log(mean_square)) + len(fit.camera.parameters) * float(np.log(2 * points))


def _calibration(
    best: Bundle, names: tuple[str, ...], size_px: tuple[int, int], rejected: Mapping[str, str]
) -> CameraCalibration:
    residuals = best.residuals()
    if residuals is None:  # `minimise` ends where all points are seen
        raise AssertionError
    squared = (residuals**2).sum(axis=1)
    freedom = residuals.size - len(best.parameters) - 6 * len(best.poses)
    if freedom <= 0:
        raise DegenerateError(
            f"{residuals.size} measurements for {residuals.size - freedom} unknowns: take more views",
            code=Code.TOO_FEW_VIEWS,
        )
    sigma = float(np.sqrt(squared.sum() / freedom))
    covariance = best.parameter_covariance() * sigma**2
    _check_determined(best.lens, covariance, size_px)
    views = np.split(squared, np.cumsum(best.counts)[:-1])
    return CameraCalibration(
        camera=Camera(best.lens, best.parameters, *size_px, covariance=covariance),
        rmse_px=float(np.sqrt(squared.mean())),
        sigma_px=sigma,
        view_rmse_px={name: float(np.sqrt(v.mean())) for name, v in zip(names, views, strict=True)},
        poses={name: Pose(pose) for name, pose in zip(names, best.poses, strict=True)},
        rejected=rejected,
    )


def _check_number(usable: Mapping[str, Detection]) -> None:
    if len(usable) < MIN_VIEWS:
        raise InputError(
            f"{len(usable)} views with at least {MIN_POINTS} points, expected {MIN_VIEWS} or more",
            code=Code.TOO_FEW_VIEWS,
            hint="take more images of the board, tilted in different directions",
        )


def _check_determined(lens: str, covariance: FloatArray, size_px: tuple[int, int]) -> None:
    sigma = np.sqrt(np.diag(covariance)[:4]) / max(size_px)
    worst = int(np.argmax(sigma))
    if not sigma[worst] <= LARGEST_SIGMA:
        name = LENSES[lens][worst]
        raise DegenerateError(
            f"the views do not determine {name}: its deviation is {sigma[worst]:.0%} of the image width",
            code=Code.CAMERA_NOT_DETERMINED,
            hint="tilt the board by 30 to 50 degrees, in different directions",
        )


def _start(
    lens: str, target: Target, usable: Mapping[str, Detection], size_px: tuple[int, int]
) -> FloatArray:
    """Return parameters without distortion whose focal length fits some of the views best."""
    chosen = list(usable.values())[:: max(1, len(usable) // START_VIEWS)]
    centre = [(size_px[0] - 1) / 2, (size_px[1] - 1) / 2]
    best, least = np.zeros(0), np.inf
    for share in START_FOCALS:
        focal = share * size_px[0]
        parameters = np.array([focal, focal, *centre, *np.zeros(len(LENSES[lens]) - 4)])
        errors = [_error(lens, parameters, target, found) for found in chosen]
        # The median: one view with a wrong label must not decide.
        error = float(np.median(errors))
        if error < least:
            best, least = parameters, error
    if not np.isfinite(least):
        raise DegenerateError(
            "no view of the target looks like that of a flat board",
            code=Code.CAMERA_NOT_DETERMINED,
            hint="check rows, columns and pitch of the target",
        )
    return best


def _error(lens: str, parameters: FloatArray, target: Target, found: Detection) -> float:
    try:
        return _pose(lens, parameters, target, found)[1]
    except HandeyeError:
        return np.inf


def _pose(lens: str, parameters: FloatArray, target: Target, found: Detection) -> tuple[FloatArray, float]:
    points, radii = target.points[found.point_ids], target.radii_m[found.point_ids]
    best, _ = _core.planar_pose(lens, parameters, points, radii, found.pixels)
    return best[0], best[1]
