"""X and Y that most views agree on, whatever the others say: seeds of three views, then concentration.

Screws of the robot's and the camera's motion between two views are congruent (Chen 1991): the rotation angles
agree and so do the translations along the axes. Three views give two motions and with them X and Y in closed
form (Park and Martin 1994). Seeds are ranked by the sum of the logarithms of the distances of all views,
which bad views cannot dominate; the best are refitted to the views that agree best, again and again
(Rousseeuw and Van Driessen 1999).
"""

from dataclasses import dataclass

import numpy as np

from handeye import _core
from handeye.estimation.faults.stations import Stations, centres, inverted, twists
from handeye.types.arrays import FloatArray, IndexArray

MOST_TRIPLES = 250
REFINED_SEEDS = 8
# Subsets of the views that are started from many rotations, and the noise that is assumed there.
STARTED_SUBSETS = 10
START_SHARE = 1e-3
CONCENTRATIONS = 4
GAUSS_NEWTON_STEPS = 4
SMALLEST_STEP = 1e-9
# Share of the views that a step of concentration fits to.
CORE_SHARE = 0.6
# Distances below this share of the working distance tell nothing of which seed is better.
FLOOR_SHARE = 5e-4
LARGEST_ANGLE_RAD = np.deg2rad(170)


@dataclass(frozen=True, eq=False)
class Consensus:
    """What most views agree on.

    Parameters
    ----------
    X, Y
        (4, 4) of the chain.
    labels
        (K,) which of its alternative poses each view shows.
    distances_m
        (K,) how far the views are off, rotations as their arc at the target.
    score
        Mean logarithm of the distances relative to the working distance: lower is better.
    """

    X: FloatArray
    Y: FloatArray
    labels: IndexArray
    distances_m: FloatArray
    score: float


def consensus_as_labelled(stations: Stations) -> Consensus:
    """Fit X and Y to all views as they are labelled, then to those that agree best."""
    sigma = np.array([START_SHARE * stations.distance_m] * 3 + [START_SHARE] * 3)
    weight = np.tile(np.diag(np.square(sigma)), (len(stations), 1, 1))
    X, Y, _, _ = _core.start_from_poses(stations.motions, stations.poses, weight)
    candidates = stations.poses[:, np.newaxis]
    away, labels = _nearest(stations, candidates, X[np.newaxis], Y[np.newaxis], stations.distance_m)
    seeds = _Seeds(
        X[np.newaxis].copy(), Y[np.newaxis].copy(), labels, away, _score(away, stations.distance_m)
    )
    _concentrate(stations, candidates, seeds)
    return seeds.best()


def find_consensus(stations: Stations, candidates: FloatArray) -> Consensus:
    """Find X and Y that agree with most views, each showing one of its candidate poses (K, M, 4, 4)."""
    distance = stations.distance_m
    X, Y = _seeds(stations, candidates)
    away, labels = _nearest(stations, candidates, X, Y, distance)
    scores = _score(away, distance)
    few = np.argsort(scores)[:REFINED_SEEDS]
    seeds = _Seeds(X[few], Y[few], labels[few], away[few], scores[few])
    _concentrate(stations, candidates, seeds)
    return seeds.best()


@dataclass
class _Seeds:
    """Some `Consensus`, one per row."""

    X: FloatArray
    Y: FloatArray
    labels: IndexArray
    away: FloatArray
    scores: FloatArray

    def best(self) -> Consensus:
        n = int(np.argmin(self.scores))
        return Consensus(self.X[n], self.Y[n], self.labels[n], self.away[n], float(self.scores[n]))


def _seeds(stations: Stations, candidates: FloatArray) -> tuple[FloatArray, FloatArray]:
    """X and Y (N, 4, 4) of triples of views, and of all views together."""
    count, kinds = candidates.shape[:2]
    triples = _triples(count)
    motions = stations.motions
    # The label of the first view is free to choose: a turn of all views at once is a change of Y.
    pairs = triples[:, [[0, 1], [0, 2]]]
    labels = np.zeros((len(triples), 2), dtype=np.int64)
    if kinds > 1:
        robot = screws(motions[pairs[..., 0]] @ inverted(motions[pairs[..., 1]]))
        seen = candidates[pairs[..., 0], 0][:, :, np.newaxis] @ inverted(candidates[pairs[..., 1]])
        camera = screws(seen)
        lever = stations.distance_m
        mismatch = np.hypot(
            lever * (camera[..., 0] - robot[..., np.newaxis, 0]), camera[..., 1] - robot[..., np.newaxis, 1]
        )
        # The two likeliest labels of each: a half turn of the board can look congruent by chance.
        order = np.argsort(mismatch, axis=2)[..., :2]
        combos = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])
        labels = np.stack([order[:, 0, combos[:, 0]], order[:, 1, combos[:, 1]]], axis=2).reshape(-1, 2)
        triples = np.repeat(triples, 4, axis=0)
    poses = np.stack(
        [
            candidates[triples[:, 0], 0],
            candidates[triples[:, 1], labels[:, 0]],
            candidates[triples[:, 2], labels[:, 1]],
        ],
        axis=1,
    )
    X, Y = closed_forms(motions[triples], poses)
    more_X, more_Y = _started(stations)
    return np.concatenate([X, more_X]), np.concatenate([Y, more_Y])


def _started(stations: Stations) -> tuple[FloatArray, FloatArray]:
    """X and Y (N, 4, 4) from many starts, of all views and of some.

    Triples whose motions are half turns, or share an axis, have no closed form; more views together may.
    """
    count = len(stations)
    size = max(min(count, 4), int(np.ceil(CORE_SHARE * count)))
    random = np.random.default_rng(0)
    subsets = [np.arange(count)]
    if size < count:
        subsets += [random.permutation(count)[:size] for _ in range(STARTED_SUBSETS)]
    sigma = np.array([START_SHARE * stations.distance_m] * 3 + [START_SHARE] * 3)
    weight = np.diag(np.square(sigma))
    found = [
        _core.start_from_poses(
            stations.motions[chosen], stations.poses[chosen], np.tile(weight, (len(chosen), 1, 1))
        )
        for chosen in subsets
    ]
    return np.array([x for x, _, _, _ in found]), np.array([y for _, y, _, _ in found])


def _triples(count: int) -> IndexArray:
    """(N, 3) triples of views, all or a fixed sample."""
    first, second, third = np.meshgrid(*[np.arange(count)] * 3, indexing="ij")
    ordered = (first < second) & (second < third)
    triples = np.stack([first[ordered], second[ordered], third[ordered]], axis=1)
    if len(triples) > MOST_TRIPLES:
        triples = np.random.default_rng(0).permutation(triples)[:MOST_TRIPLES]
    return triples


def screws(motions: FloatArray) -> FloatArray:
    """(..., 2) angle in radians and translation along the axis in metres of motions (..., 4, 4)."""
    twist = twists(motions)
    angle = np.linalg.norm(twist[..., 3:], axis=-1)
    along = np.einsum("...i,...i->...", twist[..., :3], twist[..., 3:]) / np.maximum(angle, 1e-9)
    return np.stack([angle, np.where(angle > 1e-3, along, 0.0)], axis=-1)


def nearest_rotations(matrices: FloatArray) -> FloatArray:
    """(N, 3, 3) rotations nearest to matrices (Kabsch 1976)."""
    u, _, vt = np.linalg.svd(matrices)
    u[..., :, 2] *= np.linalg.det(u @ vt)[..., np.newaxis]
    return u @ vt


def closed_forms(motions: FloatArray, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """X and Y (N, 4, 4) of small sets of views: motions and poses (N, V, 4, 4)."""
    V = motions.shape[1]
    first, second = np.triu_indices(V, 1)
    robot = motions[:, first] @ inverted(motions[:, second])
    camera = poses[:, first] @ inverted(poses[:, second])
    alpha, beta = twists(robot)[..., 3:], twists(camera)[..., 3:]
    near_half_turn = np.linalg.norm(beta, axis=-1) > LARGEST_ANGLE_RAD
    alpha = np.where(near_half_turn[..., np.newaxis], 0.0, alpha)
    rx = nearest_rotations(np.einsum("nmi,nmj->nij", beta, alpha))
    turned = rx[:, np.newaxis] @ motions[..., :3, :3]
    ry = nearest_rotations(np.sum(np.swapaxes(turned, -1, -2) @ poses[..., :3, :3], axis=1))
    # R_X R_A t_Y + t_X = t_C - R_X t_A
    system = np.concatenate([np.broadcast_to(np.eye(3), turned.shape), turned], axis=-1).reshape(-1, 3 * V, 6)
    right = poses[..., :3, 3] - np.einsum("nij,nvj->nvi", rx, motions[..., :3, 3])
    normal = np.swapaxes(system, 1, 2) @ system + 1e-9 * np.eye(6)
    product = np.swapaxes(system, 1, 2) @ right.reshape(-1, 3 * V, 1)
    t = np.asarray(np.linalg.solve(normal, product), dtype=np.float64)[..., 0]
    X, Y = np.tile(np.eye(4), (len(rx), 1, 1)), np.tile(np.eye(4), (len(rx), 1, 1))
    X[:, :3, :3], X[:, :3, 3] = rx, t[:, :3]
    Y[:, :3, :3], Y[:, :3, 3] = ry, t[:, 3:]
    return X, Y


def distances(predicted: FloatArray, poses: FloatArray, centre_m: FloatArray, lever_m: float) -> FloatArray:
    """(...) how far predicted poses (..., 4, 4) are off: shift of the target's centre and arc of its turn."""
    shift = np.linalg.norm(centres(predicted, centre_m) - centres(poses, centre_m), axis=-1)
    # |R - R'|_F = 2 sqrt 2 sin(angle / 2)
    turn = np.linalg.norm(predicted[..., :3, :3] - poses[..., :3, :3], axis=(-2, -1)) / np.sqrt(2)
    return np.hypot(shift, lever_m * turn)


def _nearest(
    stations: Stations, candidates: FloatArray, X: FloatArray, Y: FloatArray, lever_m: float
) -> tuple[FloatArray, IndexArray]:
    """Distances (N, K) of the views from X and Y (N, 4, 4) at their nearest alternatives (N, K)."""
    predicted = X[:, np.newaxis] @ stations.motions @ Y[:, np.newaxis]
    every = distances(predicted[:, :, np.newaxis], candidates[np.newaxis], stations.centre_m, lever_m)
    labels = np.argmin(every, axis=2)
    return np.take_along_axis(every, labels[..., np.newaxis], axis=2)[..., 0], labels


def _score(away: FloatArray, distance_m: float) -> FloatArray:
    return np.mean(np.log(np.square(away / distance_m) + FLOOR_SHARE**2), axis=-1) / 2


def _concentrate(stations: Stations, candidates: FloatArray, seeds: _Seeds) -> None:
    """Refit each seed to the views that agree with it best, until its score no longer falls."""
    distance, count = stations.distance_m, len(stations)
    core = max(min(count, 4), int(np.ceil(CORE_SHARE * count)))
    going = np.arange(len(seeds.scores))
    for _ in range(CONCENTRATIONS):
        chosen = np.argsort(seeds.away[going], axis=1)[:, :core]
        shown = candidates[chosen, np.take_along_axis(seeds.labels[going], chosen, axis=1)]
        X, Y = refine(seeds.X[going], seeds.Y[going], stations.motions[chosen], shown, distance)
        away, labels = _nearest(stations, candidates, X, Y, distance)
        scores = _score(away, distance)
        better = scores < seeds.scores[going] - 1e-6
        going = going[better]
        if not len(going):
            break
        seeds.X[going], seeds.Y[going] = X[better], Y[better]
        seeds.labels[going], seeds.away[going], seeds.scores[going] = (
            labels[better],
            away[better],
            scores[better],
        )


def refine(
    X: FloatArray, Y: FloatArray, motions: FloatArray, poses: FloatArray, lever_m: float
) -> tuple[FloatArray, FloatArray]:
    """Least squares of the twists between chains and poses, translations in units of the lever.

    X and Y are (N, 4, 4), motions and poses (N, V, 4, 4).
    """
    weight = np.array([1.0] * 3 + [lever_m] * 3)
    N, V = motions.shape[:2]
    back, x, y = inverted(poses), X, Y
    for _ in range(GAUSS_NEWTON_STEPS):
        forward = x[:, np.newaxis] @ motions
        error = twists(forward @ y[:, np.newaxis] @ back)
        to_y = _core.se3_adjoint(forward.reshape(-1, 4, 4)).reshape(N, V, 6, 6)
        rows = np.concatenate([np.broadcast_to(np.eye(6), to_y.shape), to_y], axis=3)
        rows = (rows * weight[:, np.newaxis]).reshape(N, 6 * V, 12)
        transposed = np.swapaxes(rows, 1, 2)
        normal = transposed @ rows
        diagonal = np.arange(12)
        normal[:, diagonal, diagonal] = normal[:, diagonal, diagonal] * (1 + 1e-9) + 1e-12
        right = transposed @ (error * weight).reshape(N, 6 * V, 1)
        step = -np.asarray(np.linalg.solve(normal, right), dtype=np.float64)[..., 0]
        x, y = _core.se3_exp(step[:, :6]) @ x, _core.se3_exp(step[:, 6:]) @ y
        if np.abs(step).max() < SMALLEST_STEP:
            break
    return x, y
