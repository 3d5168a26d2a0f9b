"""The default model: robot, camera and board are known only roughly, and the views say how roughly.

One linear mixed model (`handeye-core`, room `estimation`): every view is the pose of the target in its image
with that pose's covariance; what is constant is a parameter with a prior, what is new at every station is
noise; all levels are found together by restricted likelihood, and the answer is averaged over what they may
be. See `docs/model.md`.
"""

from dataclasses import dataclass, replace

import numpy as np

from handeye.estimation.attribution import Levels, arm_constants, attribution, noise_of
from handeye.estimation.cell_fit import CellFit, fit_cell
from handeye.estimation.estimate import Estimate
from handeye.estimation.height import Height, with_height
from handeye.estimation.initialize import check_views
from handeye.estimation.measurements import Measurements
from handeye.estimation.observability import undetermined
from handeye.estimation.rig_measurements import RigMeasurements
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Finding, ModelName, Noise, Unobservable
from handeye.types.kinematics import Kinematics
from handeye.types.probing import Probing
from handeye.types.rig import CAMERA, TARGET


@dataclass(frozen=True)
class AutoOptions:
    """What may be said of a cell beyond its views; nothing needs to be.

    Parameters
    ----------
    kinematics
        The arm, if it is known; every view must then have joint positions.
    camera_fixed
        Whether the camera is held as it is given.
    probing
        Points that were touched.
    play
        Whether the joints have play, and came to every view straight from the one before. Of an arm that
        turns out to be rough that is looked for in any case.
    height
        Of the target, where somebody measured it: an arm that turns about one axis only cannot tell.

    Examples
    --------
    >>> AutoEstimator(AutoOptions(camera_fixed=True))(measurements).free_camera
    ()
    """

    kinematics: Kinematics | None = None
    camera_fixed: bool = False
    probing: Probing | None = None
    play: bool = False
    height: Height | None = None


@dataclass(frozen=True)
class AutoEstimator:
    """Estimates with the default model.

    Examples
    --------
    >>> AutoEstimator()(measurements).determined
    True
    """

    options: AutoOptions = AutoOptions()

    def __call__(self, measurements: Measurements, previous: Estimate | None = None) -> Estimate:
        """Estimate from these measurements, averaged over what the noise may be.

        Raises
        ------
        InputError
            Fewer than three views, or views without the joint positions that the arm needs.
        """
        check_views(measurements)
        fit = fit_cell(
            RigMeasurements.of_one(measurements),
            self.options.kinematics,
            camera_fixed=self.options.camera_fixed,
            start=None if previous is None else (previous.X.matrix[None], previous.Y.matrix[None]),
            probing=self.options.probing,
            play=self.options.play,
        )
        used = fit.measurements.pairs[CAMERA, TARGET]
        noise = noise_of(fit.posterior, fit.measurements.whole, fit.arm, fit.pixels[CAMERA, TARGET].sigma_px)
        unobservable = undetermined(used, fit.X[CAMERA], fit.Y[TARGET], noise)
        estimate = estimate_of(fit, CAMERA, TARGET, noise, unobservable, attribution_of(fit, noise))
        return estimate if self.options.height is None else with_height(estimate, self.options.height)


def attribution_of(fit: CellFit, noise: Noise) -> Finding:
    """Say what explains the misfit of a fit best; of several cameras or boards, the one that is off most."""
    names = list(fit.measurements.cameras)
    shifts = {name: fit.theta[fit.rows_of_camera(name)] - prior.mean for name, prior in fit.priors.items()}

    def size(name: str) -> float:
        shift, information = shifts[name], fit.priors[name].information
        return float(shift @ information @ shift) if len(shift) else 0.0

    worst = max(names, key=size)
    scales = [float(fit.theta[fit.row_of_board(target)]) for target in fit.measurements.targets]
    return attribution(
        fit.posterior,
        fit.priors[worst],
        fit.arm,
        noise,
        camera_shift=shifts[worst],
        camera_name=worst if len(names) > 1 else "",
        board_scale=max(scales, key=abs),
    )


def estimate_of(
    fit: CellFit,
    camera: str,
    target: str,
    noise: Noise,
    unobservable: tuple[Unobservable, ...],
    of_misfit: Finding,
) -> Estimate:
    """Return the part of a fit that is about one camera and one target."""
    prior, posterior, arm = fit.priors[camera], fit.posterior, fit.arm
    X, Y = fit.X[camera], fit.Y[target]
    levels = Levels.of(posterior)
    constants, of_constants = arm_constants(posterior)
    correction = None if arm is None else arm.correction(constants)
    rounds, _, at_rest = posterior.effort
    board = fit.row_of_board(target)
    # What planning predicts with: a lag between clocks is no part of it.
    poses = [*fit.rows_of_x(camera), *fit.rows_of_y(target)]
    kept = [*poses, *fit.rows_of_camera(camera), board, *fit.rows_of_arm]
    pixels = fit.pixels.get((camera, target))
    if pixels is None:
        pixels = next(noise for (name, _), noise in fit.pixels.items() if name == camera)
    return Estimate(
        mounting=fit.measurements.cameras[camera].mounting,
        target=fit.measurements.targets[target].target,
        X=X,
        Y=Y,
        camera=fit.cameras[camera],
        covariance=np.asarray(posterior.covariance)[np.ix_(kept, kept)],
        information=_information(np.asarray(posterior.information), kept, fit),
        noise=replace(noise, pixel_shared=pixels.shared),
        model=ModelName.AUTO,
        start=posterior.origin,
        ending="converged_average" if at_rest else "iteration_limit",
        iterations=rounds,
        candidate_sigma_px=pixels.usual_px,
        station_noise=levels.station_noise(),
        expected_noise=Levels.expected_noise(posterior),
        free_camera=prior.free,
        board_scale=float(fit.theta[board]),
        unobservable=unobservable,
        degrees_of_freedom=posterior.degrees_of_freedom[list(fit.measurements.cameras).index(camera)],
        arm=arm,
        joint_offsets=() if arm is None else arm.offsets(constants, of_constants),
        link_errors=() if arm is None or correction is None else arm.link_errors(correction.displacements),
        arm_correction=correction,
        attribution=of_misfit,
        tips=fit.tips,
    )


def _information(information: FloatArray, kept: list[int], fit: CellFit) -> FloatArray:
    """Return the information of some parameters; of several cameras, with what the others leave of it."""
    if len(fit.measurements.cameras) == 1 and len(fit.measurements.targets) == 1:
        return information[np.ix_(kept, kept)]
    block = fit.inverse_information[np.ix_(kept, kept)]
    scale = 1 / np.sqrt(np.diag(block))
    found = np.linalg.inv(block * np.outer(scale, scale)) * np.outer(scale, scale)
    return 0.5 * (found + found.T)
