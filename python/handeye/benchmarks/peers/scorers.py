"""Peers of the scorer: each turns a cell, a belief and candidates into a function that scores them all once.

All compute ``1/2 ln |L + J'J| - 1/2 ln |L|`` for every candidate, with no test of what is in sight.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from handeye.benchmarks.peers import programs, with_jax
from handeye.benchmarks.peers.chain import skew
from handeye.benchmarks.problems import SIGMA_PX, Cell
from handeye.types.arrays import FloatArray

Score = Callable[[], FloatArray]
BLOCK = 256


@dataclass(frozen=True)
class ScorePeer:
    """A peer of the scorer.

    Parameters
    ----------
    what
        What it does, for the reader of the table.
    prepare
        Makes the function that scores motions (N, 4, 4) on top of an information (12, 12).
    most
        Most candidates that it is given: times are per candidate anyway, and a slow one needs no more.
    """

    what: str
    prepare: Callable[[Cell, FloatArray, FloatArray], Score]
    most: int = 10_000


def _jacobians(cell: Cell, motions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(N, 2P, 6) derivatives in the twist of X on the left, and (N, 6, 6) that of Y follows by."""
    XA = cell.X @ motions
    T = XA @ cell.Y
    p = cell.points @ T[:, :3, :3].transpose(0, 2, 1) + T[:, None, :3, 3]
    fx, fy = cell.parameters[:2] / SIGMA_PX
    inverse = 1 / p[..., 2]
    u, v = p[..., 0] * inverse, p[..., 1] * inverse
    J = np.zeros((*u.shape, 2, 6))
    J[..., 0, 0], J[..., 0, 2] = fx * inverse, -fx * u * inverse
    J[..., 0, 3], J[..., 0, 4], J[..., 0, 5] = -fx * u * v, fx * (1 + u * u), -fx * v
    J[..., 1, 1], J[..., 1, 2] = fy * inverse, -fy * v * inverse
    J[..., 1, 3], J[..., 1, 4], J[..., 1, 5] = -fy * (1 + v * v), fy * u * v, fy * u
    adjoint = np.zeros((len(motions), 6, 6))
    adjoint[:, :3, :3] = adjoint[:, 3:, 3:] = XA[:, :3, :3]
    adjoint[:, :3, 3:] = skew(XA[:, :3, 3]) @ XA[:, :3, :3]
    return J.reshape(len(motions), -1, 6), adjoint


def _log_determinants(matrices: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.slogdet(matrices)[1], dtype=float)


def _loop(cell: Cell, information: FloatArray, motions: FloatArray) -> Score:
    before = _log_determinants(information)

    def score() -> FloatArray:
        gains = np.empty(len(motions))
        for i in range(len(motions)):
            left, adjoint = _jacobians(cell, motions[i : i + 1])
            J = np.hstack([left[0], left[0] @ adjoint[0]])
            gains[i] = 0.5 * (_log_determinants(information + J.T @ J) - before)
        return gains

    return score


def _batched(cell: Cell, information: FloatArray, motions: FloatArray) -> Score:
    before = _log_determinants(information)

    def score() -> FloatArray:
        gains = np.empty(len(motions))
        for first in range(0, len(motions), BLOCK):
            part = slice(first, first + BLOCK)
            left, adjoint = _jacobians(cell, motions[part])
            J = np.concatenate([left, left @ adjoint], axis=2)
            gains[part] = 0.5 * (_log_determinants(information + J.transpose(0, 2, 1) @ J) - before)
        return gains

    return score


def _reduced(cell: Cell, information: FloatArray, motions: FloatArray) -> Score:
    covariance = np.linalg.inv(information)

    def score() -> FloatArray:
        gains = np.empty(len(motions))
        for first in range(0, len(motions), BLOCK):
            part = slice(first, first + BLOCK)
            left, adjoint = _jacobians(cell, motions[part])
            B = np.concatenate([np.broadcast_to(np.eye(6), adjoint.shape), adjoint], axis=2)
            predicted = B @ covariance @ B.transpose(0, 2, 1)
            seen = left.transpose(0, 2, 1) @ left
            gains[part] = 0.5 * _log_determinants(np.eye(6) + seen @ predicted)
        return gains

    return score


def _eigen(mode: int) -> Callable[[Cell, FloatArray, FloatArray], Score]:
    def prepare(cell: Cell, information: FloatArray, motions: FloatArray) -> Score:
        run = programs.eigen_score()
        return lambda: run(cell, information, motions, mode)

    return prepare


PEERS = {
    "eigen": ScorePeer("Eigen in C++ for this machine, rank update and LLT of 12 x 12", _eigen(0)),
    "eigen_ldlt": ScorePeer("Eigen in C++ for this machine, J'J and LDLT of 12 x 12", _eigen(1)),
    "jax": ScorePeer("JAX compiled over all candidates, Cholesky of 12 x 12", with_jax.scorer(reduced=False)),
    "jax_reduced": ScorePeer(
        "JAX compiled over all candidates, determinant of 6 x 6", with_jax.scorer(reduced=True)
    ),
    "numpy_batched": ScorePeer("NumPy in blocks of 256, matmul and slogdet of 12 x 12", _batched),
    "numpy_reduced": ScorePeer("NumPy in blocks of 256, slogdet of 6 x 6", _reduced),
    "numpy_loop": ScorePeer("NumPy, one candidate after the other", _loop, most=500),
}
