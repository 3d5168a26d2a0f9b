"""Least squares over the lens parameters and the pose of a flat target in each view."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from handeye import _core
from handeye.codes import Code
from handeye.errors import DegenerateError, SolveError
from handeye.types.arrays import FloatArray
from handeye.types.pose import through_twist

MAX_ITERATIONS = 200
COST_TOLERANCE = 1e-13
STRONGEST_DAMPING = 1e12


@dataclass(frozen=True)
class Bundle:
    """A guess, and what was measured.

    Attributes
    ----------
    lens, parameters
        The lens and its parameters (n,).
    poses
        (K, 4, 4) `T_camera_target` of each view.
    points, radii, pixels
        (N, 3), (N,), (N, 2) features of the target, metres, and where they were found; view by view.
    counts
        (K,) number of features of each view.
    prior
        Belief about the parameters besides what was measured; None for none.
    """

    lens: str
    parameters: FloatArray
    poses: FloatArray
    points: FloatArray
    radii: FloatArray
    pixels: FloatArray
    counts: NDArray[np.int64]
    prior: "ParameterPrior | None" = None

    def cost(self, residuals: FloatArray) -> float:
        """Return the sum of squared residuals, with that of the prior."""
        squares = float((residuals**2).sum())
        if self.prior is None:
            return squares
        off = self.parameters - self.prior.mean
        return squares + float(off**2 @ self.prior.weights)

    def residuals(self) -> FloatArray | None:
        """Return measured minus predicted pixels (N, 2); None if a feature is out of the lens's sight."""
        predicted = np.empty_like(self.pixels)
        for pose, part in zip(self.poses, self._parts(), strict=True):
            predicted[part], seen = _core.project_features(
                self.lens, self.parameters, pose, self.points[part], self.radii[part]
            )
            if not seen.all():
                return None
        return self.pixels - predicted

    def normal_equations(self, residuals: FloatArray) -> "NormalEquations":
        """Return the Gauss-Newton equations; a circle's derivatives are those of its centre."""
        n = len(self.parameters)
        blocks = NormalEquations(
            np.zeros((n, n)), np.zeros((len(self.poses), n, 6)), np.zeros((len(self.poses), 6, 6)),
            np.zeros(n), np.zeros((len(self.poses), 6)),
        )  # fmt: skip
        for k, (pose, part) in enumerate(zip(self.poses, self._parts(), strict=True)):
            seen = self.points[part] @ pose[:3, :3].T + pose[:3, 3]
            _, d_point, d_parameters, _ = _core.project_jacobians(self.lens, self.parameters, seen)
            G = through_twist(seen, d_point).reshape(-1, 6)
            F = d_parameters.reshape(-1, n)
            r = residuals[part].ravel()
            blocks.U[:] += F.T @ F
            blocks.W[k] = F.T @ G
            blocks.V[k] = G.T @ G
            blocks.g[:] += F.T @ r
            blocks.h[k] = G.T @ r
        if self.prior is not None:
            blocks.U[:] += np.diag(self.prior.weights)
            blocks.g[:] += self.prior.weights * (self.prior.mean - self.parameters)
        return blocks

    def moved(self, step: FloatArray, twists: FloatArray) -> "Bundle":
        """Return the guess after a step of the parameters (n,) and left perturbations (K, 6) of the poses."""
        return replace(self, parameters=self.parameters + step, poses=_core.se3_exp(twists) @ self.poses)

    def parameter_covariance(self) -> FloatArray:
        """Return the covariance (n, n) of the parameters at a noise of 1 px; poses are marginalised.

        Raises
        ------
        DegenerateError
            The views do not determine the parameters.
        """
        residuals = self.residuals()
        if residuals is None:
            raise DegenerateError("a point is out of the lens's sight", code=Code.CAMERA_NOT_DETERMINED)
        information, _ = self.normal_equations(residuals).without_poses(0.0)
        scale = 1 / np.sqrt(np.diag(information))
        try:
            factor = np.linalg.cholesky(information * np.outer(scale, scale))
        except np.linalg.LinAlgError as error:
            raise DegenerateError(
                "the views do not determine all parameters of the lens",
                code=Code.CAMERA_NOT_DETERMINED,
                hint="take more views, tilted, with the board also near the image's edges; or a simpler lens",
            ) from error
        root = np.linalg.solve(factor, np.diag(scale))
        return root.T @ root

    def _parts(self) -> list[slice]:
        ends = np.cumsum(self.counts)
        return [slice(int(end - count), int(end)) for end, count in zip(ends, self.counts, strict=True)]


@dataclass(frozen=True)
class ParameterPrior:
    """A Gaussian belief about the parameters of a lens, each for itself.

    Attributes
    ----------
    mean
        (n,) where it is centred.
    weights
        (n,) inverse variances in units of the pixel noise, px^2 over the square of the parameter's unit; zero
        where nothing is believed.
    """

    mean: FloatArray
    weights: FloatArray


@dataclass(frozen=True)
class NormalEquations:
    """`[U W; W' V] [dc; xi] = [g; h]` with block-diagonal V: (n, n), (K, n, 6), (K, 6, 6), (n,), (K, 6)."""

    U: FloatArray
    W: FloatArray
    V: FloatArray
    g: FloatArray
    h: FloatArray

    def without_poses(self, damping: float) -> tuple[FloatArray, FloatArray]:
        """Return matrix (n, n) and right side (n,) after the poses are eliminated (Schur complement).

        Raises
        ------
        numpy.linalg.LinAlgError
            A pose is not determined.
        """
        WV = self._w_times_v_inverse(damping)
        matrix = self.U + damping * np.diag(np.diag(self.U)) - _sum("kia,kja->ij", WV, self.W)
        return matrix, self.g - _sum("kia,ka->i", WV, self.h)

    def solve(self, damping: float) -> tuple[FloatArray, FloatArray]:
        """Return the step of the parameters (n,) and the twists (K, 6) of the poses."""
        matrix, b = self.without_poses(damping)
        scale = 1 / np.sqrt(np.diag(self.U))
        step = scale * np.linalg.solve(matrix * np.outer(scale, scale), scale * b)
        rest = self.h - _sum("kia,i->ka", self.W, step)
        return step, _solved(self._damped_v(damping), rest[:, :, np.newaxis])[:, :, 0]

    def _damped_v(self, damping: float) -> FloatArray:
        diagonal = _sum("kaa->ka", self.V)
        return self.V + damping * diagonal[:, :, np.newaxis] * np.eye(6)

    def _w_times_v_inverse(self, damping: float) -> FloatArray:
        return _solved(self._damped_v(damping), np.swapaxes(self.W, 1, 2)).swapaxes(1, 2)


def _sum(indices: str, *factors: FloatArray) -> FloatArray:
    return np.asarray(np.einsum(indices, *factors), dtype=np.float64)


def _solved(matrix: FloatArray, right: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)


def minimise(bundle: Bundle) -> tuple[Bundle, bool]:
    """Return the guess with the smallest cost, by Levenberg-Marquardt.

    Returns
    -------
    tuple
        The guess, and whether the iteration came to its end: parameters that the views do not determine may
        drift for ever.

    Raises
    ------
    SolveError
        A point is out of sight of the first guess.
    """
    residuals = bundle.residuals()
    if residuals is None:
        raise SolveError("camera calibration: a point is out of sight of the first guess", code=Code.DIVERGED)
    cost, damping = bundle.cost(residuals), 1e-3
    for _ in range(MAX_ITERATIONS):
        equations = bundle.normal_equations(residuals)
        while True:
            trial, trial_residuals = _trial(bundle, equations, damping)
            lower = np.inf if trial_residuals is None else trial.cost(trial_residuals)
            if trial_residuals is not None and lower <= cost:
                break
            damping *= 8
            if damping > STRONGEST_DAMPING:  # not even a vanishing step helps: this is the minimum
                return bundle, True
        gained = cost - lower
        bundle, residuals, cost, damping = trial, trial_residuals, lower, max(damping / 10, 1e-15)
        if gained <= COST_TOLERANCE * cost or cost < 1e-20 * len(residuals):
            return bundle, True
    return bundle, False


def _trial(bundle: Bundle, equations: NormalEquations, damping: float) -> tuple[Bundle, FloatArray | None]:
    try:
        step, twists = equations.solve(damping)
    except np.linalg.LinAlgError:
        return bundle, None
    if not (np.isfinite(step).all() and np.isfinite(twists).all()):
        return bundle, None
    if (bundle.parameters + step)[:2].min() <= 0:
        return bundle, None
    trial = bundle.moved(step, twists)
    return trial, trial.residuals()
