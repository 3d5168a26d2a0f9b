"""What the stations leave open of several cameras: null directions of what all pairs say together."""

from dataclasses import replace

import numpy as np

from handeye.estimation.cell_fit import CellFit
from handeye.estimation.observability import (
    UNDETERMINED,
    chain_information,
    named,
    plain_basis,
    undetermined,
)
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Noise, RobotSide, Unobservable

# Singular values of what an open direction does to one camera, below which it leaves that camera alone.
TOUCHES = 1e-3


def undetermined_rig(fit: CellFit, noise: Noise) -> dict[str, tuple[Unobservable, ...]]:
    """Name, by camera, what is left open of it; a camera may be held by another through a target of both."""
    measurements = fit.measurements
    found: dict[str, tuple[Unobservable, ...]] = {}
    if len(measurements.pairs) == 1:
        (((camera, target), measured),) = measurements.pairs.items()
        return {camera: undetermined(measured, fit.X[camera], fit.Y[target], noise)}
    null = _null_space(fit, noise)
    for camera in measurements.cameras:
        seen = {t: m for t, m in measurements.of_camera(camera).items() if len(m)}
        target = max(seen, key=lambda t: (measurements.moves(camera, t), len(seen[t])))
        part = null[[*fit.rows_of_x(camera), *fit.rows_of_y(target)]]
        axes, sizes, _ = np.linalg.svd(part, full_matrices=False)
        touches = axes[:, sizes > TOUCHES]
        if np.linalg.norm(touches[:6]) < TOUCHES:
            touches = touches[:, :0]
        found[camera] = named(seen[target], fit.X[camera], plain_basis(touches))
    return found


def _null_space(fit: CellFit, noise: Noise) -> FloatArray:
    """(n, D) directions of all X and Y that are open by the robot's motions, or by those of the images."""
    measurements = fit.measurements
    count = 6 * (len(measurements.cameras) + len(measurements.targets))
    null = np.zeros((count, 0))
    for by_robot in (True, False):
        information = np.zeros((count, count))
        for (camera, target), measured in measurements.pairs.items():
            if len(measured) == 0:
                continue
            X, Y = fit.X[camera], fit.Y[target]
            moves = measurements.moves(camera, target)
            of_pair = replace(
                noise,
                pixel_sigma_px=tuple(float(s) for s in fit.pixels[camera, target].sigma_px),
                robot_side=noise.robot_side if moves else RobotSide.NONE,
            )
            forward = X.matrix @ measured.motions if by_robot else measured.camera_poses @ Y.inverse().matrix
            rows = np.ix_(*[[*fit.rows_of_x(camera), *fit.rows_of_y(target)]] * 2)
            information[rows] += chain_information(measured, X, of_pair, forward)
        values, vectors = np.linalg.eigh(information)
        open_here = vectors[:, values < UNDETERMINED**-2]
        if open_here.shape[1] > null.shape[1]:
            null = open_here
    return null
