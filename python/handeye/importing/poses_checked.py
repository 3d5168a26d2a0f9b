"""Replay and check without pictures: what poses of the target tell, and whether new ones agree with old."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.codes import Code
from handeye.datasets import PosePairs
from handeye.errors import DegenerateError, InputError, SolveError
from handeye.estimation.confidence import Within, foretold, within
from handeye.estimation.estimate import StationNoise
from handeye.estimation.shift import Check, Moved, Rows, chain_rows, check_rows, choose_rows
from handeye.importing.poses_alone import PosesSolved, solve_some
from handeye.types.arrays import FloatArray
from handeye.types.pose import inverses


def station_rows(solved: PosesSolved, motions: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Chains (K, 4, 4), how twists of X and Y move them (K, 6, 12), and noise of each station (K, 6, 6).

    Parameters
    ----------
    solved
        What is known, noise levels of robot and detector among it.
    motions
        (K, 4, 4) A of the chain of each station.
    """
    levels = solved.levels
    flange, base = (
        (levels[f"{side}_rad"] * levels[f"{side}_lever_m"], levels[f"{side}_rad"])
        for side in ("flange", "base")
    )
    robot = StationNoise(flange, base).roots(solved.pairs.mounting)
    chains, rows, noise = chain_rows(solved.X, solved.Y, motions, robot)
    places = chains[:, :3, 3]
    sight = places / np.linalg.norm(places, axis=1, keepdims=True)
    along = np.einsum("ki,kj->kij", sight, sight)
    across, depth = levels["detector_across_m"] ** 2, levels["detector_along_m"] ** 2
    noise[:, :3, :3] += across * (np.eye(3) - along) + depth * along
    # A turn about the target's own place, as a twist in the camera.
    turned = np.zeros((len(motions), 6, 3))
    turned[:, 3:] = np.eye(3)
    turned[:, :3] = np.cross(places[:, np.newaxis], np.eye(3)).swapaxes(1, 2)
    noise += levels["detector_rad"] ** 2 * turned @ turned.swapaxes(1, 2)
    return chains, rows, noise


def check_poses(solved: PosesSolved, new: PosePairs) -> Check:
    """Test whether camera and target still are where poses of an earlier day say; see `check_views`.

    Parameters
    ----------
    solved
        The earlier day.
    new
        Poses of the same target in the same camera. A joint is not told from the rest.

    Raises
    ------
    InputError
        The camera sits elsewhere.
    """
    if new.mounting is not solved.pairs.mounting:
        raise InputError(
            f"{new.name}: {new.mounting.value}, the calibration is {solved.pairs.mounting.value}",
            code=Code.WRONG_MOUNTING,
        )
    chains, rows, noise = station_rows(solved, new.motions)
    e = _core.se3_log(np.ascontiguousarray(chains @ inverses(new.camera_poses)))
    stacked = rows.reshape(-1, 12)
    covariance = stacked @ solved.chain_covariance @ stacked.T
    for k in range(len(new)):
        at = slice(6 * k, 6 * (k + 1))
        covariance[at, at] += noise[k]
    shifts = {(Moved.CAMERA, ""): stacked[:, :6], (Moved.BOARD, ""): stacked[:, 6:]}
    names = tuple(pair.name for pair in new.pairs)
    return check_rows(Rows(e.ravel(), covariance, shifts), solved.degrees_of_freedom, names)


def plan_pose_check(solved: PosesSolved, count: int) -> tuple[list[int], float]:
    """Choose samples whose poses would show a shift best, and what they show, metres; see `plan_check`.

    Raises
    ------
    InputError
        Fewer samples than asked for, or fewer than two are.
    """
    _, rows, noise = station_rows(solved, solved.pairs.motions)
    return choose_rows(solved.chain_covariance, rows, noise, count)


@dataclass(frozen=True)
class Posed:
    """Samples that are gone through again, as `handeye.planning.hindsight` asks for stations."""

    pairs: PosePairs

    @property
    def names(self) -> Sequence[str]:
        """Names of the samples."""
        return [pair.name for pair in self.pairs.pairs]

    def solve(self, chosen: list[int], previous: PosesSolved | None) -> PosesSolved | None:
        """Fit some of them; None where they leave something open."""
        del previous
        try:
            return solve_some(self.pairs, chosen)
        except (DegenerateError, SolveError):
            return None

    def known(self, estimate: PosesSolved) -> Within:
        """How far off an estimate may be."""
        return estimate.within_95

    def worth(self, estimate: PosesSolved, left: list[int]) -> FloatArray:
        """(len(left),) what samples take off the entropy of X and Y, nats."""
        _, rows, noise = station_rows(estimate, self.pairs.motions[left])
        now = _core.Belief(estimate.information).entropy
        taught = _informations(rows, noise)
        return np.array([now - _core.Belief(estimate.information + one).entropy for one in taught])

    def more(self, estimate: PosesSolved, count: int) -> tuple[tuple[str, ...], Within]:
        """Choose poses to go to once more: their names, and how far off the answer may be then."""
        _, rows, noise = station_rows(estimate, self.pairs.motions)
        taught = _informations(rows, noise)
        information = estimate.information
        names: list[str] = []
        for _ in range(count):
            after = [_core.Belief(information + one).hand_eye_entropy for one in taught]
            best = int(np.argmin(after))
            names.append(self.names[best])
            information = information + taught[best]
        before, then = (_core.Belief(one).covariance[:6, :6] for one in (estimate.information, information))
        found = foretold(before, estimate.covariance, then, comes_again=True)
        return tuple(names), within(found, estimate.degrees_of_freedom)


def _informations(rows: FloatArray, noise: FloatArray) -> FloatArray:
    return rows.swapaxes(1, 2) @ np.linalg.solve(noise, rows)
