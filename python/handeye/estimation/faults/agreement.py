"""What views predict of each other under the model of the estimate (`_core.Agreement`)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye import _core
from handeye.estimation.faults.stations import Stations, inverted
from handeye.types.arrays import FloatArray
from handeye.types.mounting import Mounting

BoolArray = NDArray[np.bool_]

# Pairs of nodes that predictions are averaged over: a gate needs fewer than an answer.
NODE_PAIRS = 5


@dataclass(frozen=True, eq=False)
class SetFit:
    """What a set of views says of every view: of a member what the other members say.

    Parameters
    ----------
    members
        (K,) which views.
    log_evidence
        Logarithm of the marginal likelihood of the set.
    levels
        Levels of the error by name.
    camera_shift
        (n,) by how much the free parameters of the camera are off.
    board_scale
        By how much the board is larger than stated, relative to it.
    X, Y
        (4, 4) of the chain.
    deviation, covariance
        (K, 6) twist between chain and image, and (K, 6, 6) what is expected of it.
    log_density
        (K,) logarithm of its density.
    p_value
        (K,) probability of a twist at least as unusual.
    """

    members: BoolArray
    log_evidence: float
    levels: dict[str, float]
    camera_shift: FloatArray
    board_scale: float
    X: FloatArray
    Y: FloatArray
    deviation: FloatArray
    covariance: FloatArray
    log_density: FloatArray
    p_value: FloatArray


class Agreement:
    """Views linearised at X and Y (4, 4)."""

    def __init__(self, stations: Stations, X: FloatArray, Y: FloatArray) -> None:
        self.stations, self.X, self.Y = stations, X, Y
        prior = stations.camera
        free = len(prior.free)
        belief = (prior.information, prior.mean, prior.inflated) if free else None
        in_hand = stations.mounting is Mounting.EYE_IN_HAND
        self._core = _core.Agreement(
            stations.robot,
            stations.images,
            stations.poses,
            stations.seen,
            stations.variances_px2,
            (in_hand, free, prior.from_these_pixels, belief),
            X,
            Y,
        )
        self._fits: dict[bytes, SetFit] = {}
        # Where the search for the levels begins: at those of the set before.
        self._levels: list[float] | None = None

    def fit(self, members: BoolArray) -> SetFit:
        """Fit a set of views.

        Raises
        ------
        SolveError
            The model is singular: the views are as far apart as no noise explains.
        """
        which = members.tobytes()
        if which not in self._fits:
            evidence, levels, constants, X, Y, deviation, covariance, density, p_value = self._core.fit(
                np.flatnonzero(members), self._levels, NODE_PAIRS
            )
            self._levels = [level for _, level in levels]
            self._fits[which] = SetFit(
                members,
                evidence,
                dict(levels),
                np.array(constants[:-1]),
                constants[-1],
                X,
                Y,
                deviation,
                covariance,
                np.array(density),
                np.array(p_value),
            )
        return self._fits[which]

    def robot_levels(self, fit: SetFit) -> tuple[float, float]:
        """Translation (metres) and rotation (radians) of the robot's noise per axis, at the flange."""
        level = fit.levels
        flange, base = (
            np.repeat([level[f"{side}_rad"] * level[f"{side}_lever_m"], level[f"{side}_rad"]], 3)
            for side in ("flange", "base")
        )
        # A twist of the base as one of the flange.
        to_flange = _core.se3_adjoint(inverted(self.stations.robot)) * base
        variance = np.square(flange) + np.einsum("kij,kij->i", to_flange, to_flange) / len(to_flange)
        return float(np.sqrt(variance[:3].mean())), float(np.sqrt(variance[3:].mean()))

    def at_flange(self, fit: SetFit) -> tuple[FloatArray, FloatArray]:
        """Deviations (K, 6) and covariances (K, 6, 6) as errors of the robot in the flange frame."""
        in_hand, motions = self.stations.mounting is Mounting.EYE_IN_HAND, self.stations.motions
        frames = np.broadcast_to(self.X, motions.shape) if in_hand else self.X @ motions
        back = _core.se3_adjoint(inverted(frames))
        deviation = np.einsum("kij,kj->ki", back, fit.deviation)
        return deviation, back @ fit.covariance @ np.swapaxes(back, 1, 2)
