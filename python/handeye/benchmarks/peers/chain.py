"""The chain as the peers pose it: X and Y each a rotation vector and a translation, stacked to 12 numbers.

``p_camera = R(w_x) (R_A (R(w_y) p + t_y) + t_A) + t_x``, with derivatives through the left Jacobian of SO(3)
(Sola, Deray and Atchuthan 2018, equation 145).
"""

import numpy as np

from handeye import _core
from handeye.benchmarks.problems import Cell
from handeye.types.arrays import FloatArray


def stacked(X: FloatArray, Y: FloatArray) -> FloatArray:
    """(12,) rotation vector and translation of X, then of Y."""
    return np.concatenate([np.concatenate([_core.se3_log(_turn(T)[None])[0, 3:], T[:3, 3]]) for T in (X, Y)])


def unstacked(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """X and Y (4, 4) of the 12 numbers."""
    return _matrix(values[:6]), _matrix(values[6:])


def _turn(T: FloatArray) -> FloatArray:
    turn = np.eye(4)
    turn[:3, :3] = T[:3, :3]
    return turn


def _matrix(six: FloatArray) -> FloatArray:
    T = _core.se3_exp(np.concatenate([np.zeros(3), six[:3]])[None])[0]
    T[:3, 3] = six[3:]
    return T


def skew(v: FloatArray) -> FloatArray:
    """(..., 3, 3) cross-product matrices of (..., 3)."""
    S = np.zeros((*v.shape, 3))
    S[..., 0, 1], S[..., 0, 2], S[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    S[..., 1, 0], S[..., 2, 0], S[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return S


def left_jacobian(w: FloatArray) -> FloatArray:
    """(3, 3) left Jacobian of SO(3)."""
    angle = float(np.sqrt(w @ w))
    S = skew(w)
    if angle < 1e-6:
        return np.eye(3) + 0.5 * S
    return np.eye(3) + (1 - np.cos(angle)) / angle**2 * S + (angle - np.sin(angle)) / angle**3 * (S @ S)


def residuals(cell: Cell, values: FloatArray) -> FloatArray:
    """(2 K P,) pixels minus measurements of a pinhole camera."""
    X, Y = unstacked(values)
    T = X @ cell.motions @ Y
    p = cell.points @ T[:, :3, :3].transpose(0, 2, 1) + T[:, None, :3, 3]
    fx, fy, cx, cy = cell.parameters[:4]
    uv = p[..., :2] / p[..., 2:] * [fx, fy] + [cx, cy]
    found: FloatArray = (uv - cell.pixels).ravel()
    return found


def jacobian(cell: Cell, values: FloatArray) -> FloatArray:
    """(2 K P, 12) derivatives of the residuals."""
    X, Y = unstacked(values)
    b = cell.points @ Y[:3, :3].T
    q = (b + Y[:3, 3]) @ cell.motions[:, :3, :3].transpose(0, 2, 1) + cell.motions[:, None, :3, 3]
    a = q @ X[:3, :3].T
    p = a + X[:3, 3]
    fx, fy = cell.parameters[:2]
    z = p[..., 2]
    G = np.zeros((*z.shape, 2, 3))
    G[..., 0, 0], G[..., 1, 1] = fx / z, fy / z
    G[..., 0, 2], G[..., 1, 2] = -fx * p[..., 0] / z**2, -fy * p[..., 1] / z**2
    turned = X[:3, :3] @ cell.motions[:, :3, :3]
    G_y = G @ turned[:, None]
    J = np.empty((*z.shape, 2, 12))
    J[..., :3] = G @ (-skew(a) @ left_jacobian(values[:3]))
    J[..., 3:6] = G
    J[..., 6:9] = G_y @ (-skew(b) @ left_jacobian(values[6:9]))
    J[..., 9:] = G_y
    return J.reshape(-1, 12)
