"""How well views agree: the density of each under what the others say, whatever the robot's noise may be.

With the chain linearised at X and Y, the twist between chain and image of view k is ``e_k = noise - B_k
theta`` with ``B_k = [I, Ad(X A_k), D_k]``, theta the twists of X and Y and the change of the camera, and
noise of covariance ``Sigma_k = sigma_k^2 M_k^-1 + S_k``. Integrating theta out leaves the evidence of a set
of views under each level of the robot's noise; the ratio of the evidence with and without a view is the
predictive density of that view.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.estimation.mistakes.noise_grid import BoolArray, NoiseGrid
from handeye.estimation.mistakes.sightings import Sightings, inverted, twists
from handeye.types.arrays import FloatArray
from handeye.types.mounting import Mounting

# Belief about X and Y around the point of linearisation: metres and radians, only to keep every set regular.
WEAK_SIGMA = np.array([1.0, 1.0, 1.0, 3.0, 3.0, 3.0, 10.0, 10.0, 10.0, 3.0, 3.0, 3.0])
LOG_2PI = float(np.log(2 * np.pi))
# Squared distances beyond this have a probability of zero.
FARTHEST = 1400.0
# Levels of noise less likely than this, whatever the set of views, are left aside.
NEGLIGIBLE = 1e-7


@dataclass(frozen=True, eq=False)
class Fit:
    """A set of views weighed under every hypothesis about the noise.

    Parameters
    ----------
    members
        (K,) which views.
    inverse
        (H, n, n) covariance of theta.
    theta
        (H, n) its mean.
    log_evidence_each
        (H,) logarithm of prior probability times evidence.
    """

    members: BoolArray
    inverse: FloatArray
    theta: FloatArray
    log_evidence_each: FloatArray

    @property
    def log_evidence(self) -> float:
        """Logarithm of the evidence under all hypotheses together."""
        return float(np.logaddexp.reduce(self.log_evidence_each))

    @property
    def weights(self) -> FloatArray:
        """(H,) probabilities of the hypotheses."""
        weights = np.exp(self.log_evidence_each - self.log_evidence_each.max())
        return weights / weights.sum()

    def select(self, chosen: BoolArray) -> "Fit":
        """Return it with some of the hypotheses."""
        return Fit(self.members, self.inverse[chosen], self.theta[chosen], self.log_evidence_each[chosen])


@dataclass(frozen=True, eq=False)
class Prediction:
    """What is expected of each view from others.

    Parameters
    ----------
    log_density
        (K,) logarithm of the density of the twist between chain and image.
    p_value
        (K,) probability of a twist at least as unusual.
    deviation
        (K, 6) the twist itself, with what the others say of X, Y and the camera.
    covariance
        (K, 6, 6) covariance expected of it.
    """

    log_density: FloatArray
    p_value: FloatArray
    deviation: FloatArray
    covariance: FloatArray


class Weighing:
    """Views linearised at X and Y (4, 4) under every hypothesis about the robot's noise."""

    def __init__(self, sightings: Sightings, X: FloatArray, Y: FloatArray, grid: NoiseGrid) -> None:
        self.sightings, self.X, self.Y, self.grid = sightings, X, Y, grid
        forward = X @ sightings.motions
        to_y = _core.se3_adjoint(forward)
        count, free = len(sightings), sightings.sensitivities.shape[2]
        self._rows = np.concatenate(
            [np.broadcast_to(np.eye(6), (count, 6, 6)), to_y, sightings.sensitivities], axis=2
        )
        self._deviation = twists(forward @ Y @ inverted(sightings.poses))
        # An error of the robot as a twist of a view, where it acts on the left of A, and on the right.
        self._from_robot = (np.broadcast_to(_core.se3_adjoint(X[np.newaxis]), to_y.shape), to_y)
        prior = np.zeros((12 + free, 12 + free))
        prior[np.arange(12), np.arange(12)] = WEAK_SIGMA**-2.0
        prior[12:, 12:] = sightings.camera_information
        self._sets = _core.ViewSets(
            self._deviation,
            self._rows,
            sightings.covariances,
            *self._from_robot,
            prior,
            np.concatenate([np.zeros(12), sightings.camera_gradient]),
        )
        self._fits: dict[bytes, Fit] = {}

    def narrowed(self, fits: Sequence[Fit]) -> "Weighing":
        """Return the same with only the levels that these fits, or one between them, could call for."""
        weights = np.max([fit.weights for fit in fits], axis=0) > NEGLIGIBLE
        chosen = np.ones(len(weights), dtype=bool)
        for level in (self.grid.translation_m, self.grid.rotation_rad):
            chosen &= (level >= level[weights].min() / 1.01) & (level <= level[weights].max() * 1.01)
        narrow = copy(self)
        narrow.grid = self.grid.select(chosen)
        narrow._fits = {which: fit.select(chosen) for which, fit in self._fits.items()}  # noqa: SLF001 - of this class
        return narrow

    def fit(self, members: BoolArray) -> Fit:
        """Weigh the hypotheses by a set of views."""
        which = members.tobytes()
        if which not in self._fits:
            grid = self.grid
            inverse, theta, log_likelihood = self._sets.fit(
                grid.left, grid.translation_m, grid.rotation_rad, np.flatnonzero(members)
            )
            self._fits[which] = Fit(members, inverse, theta, grid.log_prior + log_likelihood)
        return self._fits[which]

    def predict(self, fit: Fit) -> Prediction:
        """Return what a set says of every view: of a member what the other members say."""
        rows, noise = self._rows, self._noise_covariances()
        spread = rows[np.newaxis] @ fit.inverse[:, np.newaxis] @ np.swapaxes(rows, 1, 2)[np.newaxis]
        mean = self._deviation + np.einsum("kin,hn->hki", rows, fit.theta)
        covariance = noise + spread
        # Of a member the fit has seen: take it out again (Cook and Weisberg 1982, section 2.2).
        inside = np.flatnonzero(fit.members)
        own = noise[:, inside]
        remaining = own - spread[:, inside]  # (I - M) Sigma
        taken_out = own @ np.linalg.solve(remaining, np.eye(6))
        covariance[:, inside] = taken_out @ own
        mean[:, inside] = np.einsum("hkij,hkj->hki", taken_out, mean[:, inside])
        covariance = 0.5 * (covariance + np.swapaxes(covariance, -1, -2))
        solved = np.asarray(np.linalg.solve(covariance, mean[..., np.newaxis]), dtype=np.float64)[..., 0]
        distance = np.einsum("hki,hki->hk", mean, solved)
        # Lengths in a wrong unit make levers of kilometres, and rounding more than the noise.
        distance = np.maximum(distance, 0.0)
        log_each = -0.5 * (distance + np.linalg.slogdet(covariance)[1] + 6 * LOG_2PI)
        log_weights = np.repeat(fit.log_evidence_each[:, np.newaxis], len(rows), axis=1)
        log_weights[:, inside] -= log_each[:, inside]
        log_weights -= np.logaddexp.reduce(log_weights, axis=0)
        weights = np.exp(log_weights)
        half = 0.5 * np.minimum(distance, FARTHEST)
        tail = np.exp(-half) * (1 + half + 0.5 * half**2)  # chi-square with six degrees of freedom
        return Prediction(
            log_density=np.logaddexp.reduce(log_weights + log_each, axis=0),
            p_value=np.sum(weights * tail, axis=0),
            deviation=np.einsum("hk,hki->ki", weights, mean),
            covariance=np.einsum("hk,hkij->kij", weights, covariance),
        )

    def _noise_covariances(self) -> FloatArray:
        """(H, K, 6, 6) of the twists: noise of the images and of the robot."""
        grid = self.grid
        sigma = np.repeat(np.stack([grid.translation_m, grid.rotation_rad], axis=1), 3, axis=1)
        left, right = self._from_robot
        root = np.where(grid.left[:, np.newaxis, np.newaxis, np.newaxis], left, right)
        root = root * sigma[:, np.newaxis, np.newaxis, :]
        return self.sightings.covariances + root @ np.swapaxes(root, -1, -2)

    def estimate(self, fit: Fit) -> tuple[FloatArray, FloatArray]:
        """Return X and Y (4, 4) after the step that a fit asks for."""
        step = fit.weights @ fit.theta
        moved = _core.se3_exp(np.stack([step[:6], step[6:12]])) @ np.stack([self.X, self.Y])
        return moved[0], moved[1]

    def levels(self, fit: Fit) -> tuple[float, float]:
        """Return translation (metres) and rotation (radians) of the noise, geometric means over a fit."""
        weights = fit.weights
        return (
            float(np.exp(weights @ np.log(self.grid.translation_m))),
            float(np.exp(weights @ np.log(self.grid.rotation_rad))),
        )

    def at_flange(self, prediction: Prediction) -> tuple[FloatArray, FloatArray]:
        """Deviations (K, 6) and covariances (K, 6, 6) as errors of the robot in the flange frame."""
        left = self.sightings.mounting is Mounting.EYE_IN_HAND
        frames = (
            np.broadcast_to(self.X, self.sightings.motions.shape) if left else self.X @ self.sightings.motions
        )
        back = _core.se3_adjoint(inverted(frames))
        deviation = np.einsum("kij,kj->ki", back, prediction.deviation)
        return deviation, back @ prediction.covariance @ np.swapaxes(back, 1, 2)
