"""A certificate that the poses were fitted to their global optimum: a lower bound that no X and Y can beat.

The weighted pose problem ``C W = X A`` with ``W = inv(Y)``,

    min sum_k |R_C R_W - R_X R_A|^2 / s_R^2 + |R_C t_W + t_C - R_X t_A - t_X|^2 / s_t^2,

is quadratic in the entries of the rotations once the translations are eliminated, under quadratic constraints
that make them orthogonal. So every choice of multipliers of the constraints gives a bound from below by the
smallest eigenvalue of a matrix (Lagrange duality; for robot-world and hand-eye calibration Wise et al.,
arXiv 2507.23045). The multipliers are those that stationarity at the answer asks for, which are unique and
solved for linearly: no semidefinite program is needed.

Nothing is assumed of the multipliers: the bound holds whatever they are, so no answer is falsely certified.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from handeye.codes import Code
from handeye.errors import DegenerateError, InputError
from handeye.estimation.measurements import Measurements
from handeye.estimation.rig import RigCalibration
from handeye.types.arrays import FloatArray
from handeye.types.calibration import Calibration
from handeye.types.pose import inverses
from handeye.types.recording import Recording
from handeye.types.units import MM_PER_M

# Relative gap between cost and bound that counts as none; costs are in units of the noise.
CLOSED_GAP = 1e-6
# Rounding of a sum of products, in units of the norms and of the number of terms.
ROUNDING = float(np.finfo(np.float64).eps)
MOST_STEPS, SMALL_STEP = 100, 1e-13
LEAST_SIGMA = 1e-9


@dataclass(frozen=True, eq=False)
class PoseProblem:
    """Poses of one or several cameras that see one or several targets, moved by one arm.

    Parameters
    ----------
    A, C
        (K, 4, 4) motions of the arm, and measured poses of target ``targets[k]`` in camera ``cameras[k]``.
    cameras, targets
        (K,) indices from 0; None where there is one.
    sigmas
        Standard deviations of a pose per axis, radians and metres; None for those of the residuals.
    """

    A: FloatArray
    C: FloatArray
    cameras: tuple[int, ...] | None = None
    targets: tuple[int, ...] | None = None
    sigmas: tuple[float, float] | None = None


@dataclass(frozen=True, eq=False)
class Certificate:
    """What was found about an answer.

    Parameters
    ----------
    certified
        Whether no other X and Y can fit the poses better, to a relative gap of a millionth.
    cost, bound
        Sum of squares in units of the noise at the optimum next to the answer, and what none can be below.
    X, Y
        (n, 4, 4) that optimum.
    sigmas
        Standard deviations that weighted the poses, radians and metres.
    moved_rad, moved_m
        How far the optimum is from the answer that was asked about: the largest angle, the largest distance.
        The descent from the answer ended there, so the answer lies in its basin.
    seconds
        What it took.
    """

    certified: bool
    cost: float
    bound: float
    X: FloatArray
    Y: FloatArray
    sigmas: tuple[float, float]
    moved_rad: float
    moved_m: float
    seconds: float

    @property
    def gap(self) -> float:
        """By what share the bound is below the cost."""
        return max(self.cost - self.bound, 0.0) / max(self.cost, 1.0)

    @property
    def sentence(self) -> str:
        """What was found, in words."""
        if self.certified:
            return "no other answer fits the poses better: the bound from below meets the cost"
        return f"not certified: by the bound from below, another answer may fit {self.gap:.1%} better"

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON, units in the keys."""
        return {
            "certified": self.certified,
            "cost": self.cost,
            "bound": self.bound,
            "gap": self.gap,
            "rotation_sigma_deg": float(np.rad2deg(self.sigmas[0])),
            "translation_sigma_mm": MM_PER_M * self.sigmas[1],
            "moved_mm": MM_PER_M * self.moved_m,
            "moved_deg": float(np.rad2deg(self.moved_rad)),
            "milliseconds": 1e3 * self.seconds,
        }


def certify(problem: PoseProblem, X: FloatArray, Y: FloatArray) -> Certificate:
    """Descend from an answer to the optimum of the pose problem, and bound every other from below.

    Parameters
    ----------
    X, Y
        (4, 4), or (cameras, 4, 4) and (targets, 4, 4): the answer.

    Raises
    ------
    InputError
        Fewer than three views.
    DegenerateError
        The views do not determine the answer.

    Examples
    --------
    >>> found = certify(PoseProblem(measurements.motions, measurements.camera_poses), X.matrix, Y.matrix)
    >>> found.certified, found.gap
    """
    began = time.perf_counter()
    if len(problem.A) < 3:
        raise InputError(f"{len(problem.A)} views, at least 3 are needed", code=Code.TOO_FEW_VIEWS)
    given_x, given_y = X.reshape(-1, 4, 4), Y.reshape(-1, 4, 4)
    sigmas = problem.sigmas or _sigmas(problem, given_x, given_y)
    system = _System.of(problem, len(given_x), len(given_y), sigmas)
    rotations = np.concatenate([np.swapaxes(given_y[:, :3, :3], 1, 2), given_x[:, :3, :3]])
    rotations = _descend(system, rotations)
    z = np.append(_stacked(rotations), 1.0)
    residual = system.M @ z
    cost = float(residual @ residual)
    bound = cost - float(z @ z) * _shortfall(system.M, z, cost)
    x, y = _answer(system, rotations, z, len(given_x))
    difference = np.concatenate([inverses(given_x) @ x, inverses(given_y) @ y])
    angles = np.arccos(np.clip((np.trace(difference[:, :3, :3], axis1=1, axis2=2) - 1) / 2, -1, 1))
    return Certificate(
        certified=cost - bound <= CLOSED_GAP * max(cost, 1.0),
        cost=cost,
        bound=bound,
        X=x,
        Y=y,
        sigmas=sigmas,
        moved_rad=float(angles.max()),
        moved_m=float(np.linalg.norm(difference[:, :3, 3], axis=1).max()),
        seconds=time.perf_counter() - began,
    )


def certify_calibration(recording: Recording, calibration: Calibration) -> Certificate:
    """Certify the answer of `solve` on the poses of the target found in each used view alone.

    The robot's poses are taken as reported, and the poses in the images through the camera of the answer.

    Raises
    ------
    InputError, DegenerateError
        As `certify`.
    """
    used = {view.name for view in calibration.views if view.used}
    views = [view for view in recording.views if view.name in used]
    measured = Measurements.of(recording.mounting, calibration.camera, recording.target, views)
    problem = PoseProblem(measured.motions, measured.camera_poses)
    return certify(problem, calibration.X.matrix, calibration.Y.matrix)


def certify_rig(rig: RigCalibration) -> Certificate:
    """Certify the answer for several cameras and targets at once, on the poses of the targets found.

    Raises
    ------
    InputError, DegenerateError
        As `certify`.
    """
    fit = rig.estimate.fit
    cameras, targets = list(fit.measurements.cameras), list(fit.measurements.targets)
    pairs = fit.measurements.pairs
    of = [(cameras.index(c), targets.index(t)) for (c, t), seen in pairs.items() for _ in range(len(seen))]
    problem = PoseProblem(
        np.concatenate([seen.motions for seen in pairs.values()]),
        np.concatenate([seen.camera_poses for seen in pairs.values()]),
        tuple(camera for camera, _ in of),
        tuple(target for _, target in of),
    )
    X, Y = ([poses[name].matrix for name in names] for poses, names in ((fit.X, cameras), (fit.Y, targets)))
    return certify(problem, np.array(X), np.array(Y))


def _indices(problem: PoseProblem) -> tuple[Sequence[int], Sequence[int]]:
    zeros = (0,) * len(problem.A)
    return problem.cameras or zeros, problem.targets or zeros


def _sigmas(problem: PoseProblem, X: FloatArray, Y: FloatArray) -> tuple[float, float]:
    """Standard deviations per axis of the residuals of an answer, radians and metres."""
    cameras, targets = _indices(problem)
    W = inverses(Y)
    residual: FloatArray = problem.C @ W[list(targets)] - X[list(cameras)] @ problem.A
    # The difference of two rotation matrices has twice the square of the angle between them.
    rotation = np.sqrt(float(np.sum(residual[:, :3, :3] ** 2)) / len(residual) / 6)
    translation = np.sqrt(float(np.sum(residual[:, :3, 3] ** 2)) / len(residual) / 3)
    return max(float(rotation), LEAST_SIGMA), max(float(translation), LEAST_SIGMA)


@dataclass(frozen=True, eq=False)
class _System:
    """The cost as ``|M z|^2`` in the entries of the rotations (W first, then X, by columns) and a one."""

    M: FloatArray
    translations: FloatArray
    """From z to all translations, W first."""

    @classmethod
    def of(cls, problem: PoseProblem, cameras: int, targets: int, sigmas: tuple[float, float]) -> "_System":
        of_camera, of_target = _indices(problem)
        count, blocks = len(problem.A), cameras + targets
        width = 9 * blocks
        rows = np.zeros((count, 12, width + 1 + 3 * blocks))
        A, C, eye, view = problem.A, problem.C, np.eye(3), np.arange(count)[:, np.newaxis]
        w = 9 * np.array(of_target)[:, np.newaxis] + np.arange(9)
        x = 9 * (targets + np.array(of_camera)[:, np.newaxis]) + np.arange(9)
        t_w, t_x = (width + 1 + block[:, :1] // 3 + np.arange(3) for block in (w, x))
        seen, hand = C[:, :3, :3], A[:, :3, :3]
        turned = np.einsum("ij,kpq->kipjq", eye, seen).reshape(count, 9, 9) / sigmas[0]
        carried = np.einsum("kji,pq->kipjq", hand, eye).reshape(count, 9, 9) / sigmas[0]
        moved = np.einsum("kj,pq->kpjq", A[:, :3, 3], eye).reshape(count, 3, 9) / sigmas[1]
        for row in range(9):
            rows[view, row, w], rows[view, row, x] = turned[:, row], -carried[:, row]
        for row in range(3):
            rows[view, 9 + row, x] = -moved[:, row]
            rows[view, 9 + row, t_w] = seen[:, row] / sigmas[1]
            rows[view, 9 + row, t_x] = -eye[row] / sigmas[1]
        rows[:, 9:, width] = C[:, :3, 3] / sigmas[1]
        flat = rows.reshape(12 * count, -1)
        fixed, free = flat[:, : width + 1], flat[:, width + 1 :]
        values = np.linalg.svd(free, compute_uv=False)
        if values[-1] < 1e-9 * values[0]:
            raise DegenerateError("these views do not determine the translations", code=Code.DEGENERATE)
        solve = -np.asarray(np.linalg.lstsq(free, fixed, rcond=None)[0], np.float64)
        left = fixed + free @ solve
        return cls(np.asarray(np.linalg.qr(left, mode="r"), np.float64), solve)


def _stacked(rotations: FloatArray) -> FloatArray:
    """Entries of rotations (n, 3, 3) by columns, one after another."""
    return np.swapaxes(rotations, 1, 2).reshape(-1)


def _turned(rotations: FloatArray, step: FloatArray) -> FloatArray:
    """Turn rotations (n, 3, 3) by rotation vectors (n, 3) from the left (Rodrigues)."""
    angle = np.linalg.norm(step, axis=1)[:, np.newaxis, np.newaxis]
    K = _hats(step)
    first = np.sinc(angle / np.pi)
    second = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    turned = (np.eye(3) + first * K + second * K @ K) @ rotations
    u, _, v = np.linalg.svd(turned)
    return u @ v


def _hats(vectors: FloatArray) -> FloatArray:
    """(n, 3, 3) matrices of cross products with vectors (n, 3)."""
    hats = np.zeros((len(vectors), 3, 3))
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        hats[:, k, j], hats[:, j, k] = vectors[:, i], -vectors[:, i]
    return hats


def _tangent(rotations: FloatArray) -> FloatArray:
    """(9 n + 1, 3 n) derivative of z by rotation vectors from the left."""
    derivative = np.zeros((9 * len(rotations) + 1, 3 * len(rotations)))
    for i, rotation in enumerate(rotations):
        derivative[9 * i : 9 * i + 9, 3 * i : 3 * i + 3] = -_hats(rotation.T).reshape(9, 3)
    return derivative


def _descend(system: _System, rotations: FloatArray) -> FloatArray:
    """Levenberg-Marquardt on the rotations, the translations eliminated."""
    damping = 1e-12
    residual = system.M @ np.append(_stacked(rotations), 1.0)
    cost = float(residual @ residual)
    for _ in range(MOST_STEPS):
        J = system.M @ _tangent(rotations)
        H, g = J.T @ J, J.T @ residual
        scale = np.diag(np.maximum(np.diag(H), 1e-300))
        while True:
            step = -np.asarray(np.linalg.lstsq(H + damping * scale, g, rcond=1e-15)[0], np.float64)
            turned = _turned(rotations, step.reshape(-1, 3))
            residual_next = system.M @ np.append(_stacked(turned), 1.0)
            after = float(residual_next @ residual_next)
            if after <= cost or damping > 1e6:
                break
            damping = max(10 * damping, 1e-6)
        if after > cost:
            break
        rotations, residual, cost, damping = turned, residual_next, after, damping / 10
        if np.abs(step).max() < SMALL_STEP:
            break
    return rotations


def _answer(
    system: _System, rotations: FloatArray, z: FloatArray, cameras: int
) -> tuple[FloatArray, FloatArray]:
    both = np.tile(np.eye(4), (len(rotations), 1, 1))
    both[:, :3, :3] = rotations
    both[:, :3, 3] = (system.translations @ z).reshape(-1, 3)
    return both[-cameras:], inverses(both[:-cameras])


def _shortfall(M: FloatArray, z: FloatArray, cost: float) -> float:
    """Return by how much the matrix of the multipliers misses being positive, rounded up.

    The matrix is ``H = M' M - cost E + sum l_i A_i`` (E is one where z is the one), and ``y' H y + cost`` is
    the cost of whatever y is feasible; the cost can be less by minus its smallest eigenvalue times |y|^2.
    In a basis whose first axis is along z its first entry is zero, whatever the multipliers; the rest of the
    first row is what stationarity leaves, and vanishes to rounding.
    """
    constraints = _constraints((len(z) - 1) // 9)
    length = float(np.linalg.norm(z))
    across = np.linalg.svd(z[np.newaxis])[2][1:].T
    residual, wide = M @ z, M @ across
    gradient = wide.T @ residual - cost * across[-1]
    at_z = across.T @ (constraints @ z).T
    multipliers = np.asarray(np.linalg.lstsq(at_z, -gradient, rcond=None)[0], np.float64)
    forms: FloatArray = np.tensordot(multipliers, constraints, 1)
    F = wide.T @ wide - cost * np.outer(across[-1], across[-1]) + across.T @ forms @ across
    size = float(np.linalg.norm(multipliers))
    terms = np.linalg.norm(wide) * np.linalg.norm(residual) + np.linalg.norm(at_z) * size
    row = float(np.linalg.norm(gradient + at_z @ multipliers) + ROUNDING * terms) / length
    values = np.linalg.eigvalsh(0.5 * (F + F.T))
    least = float(values[0] - ROUNDING * len(z) * (np.abs(values).max() + size))
    # Of [[0, row'], [row, F]] the smallest eigenvalue is above -row^2 / least, or above least - row.
    return row**2 / least if least > row else row - min(least, 0.0)


@cache
def _constraints(rotations: int) -> FloatArray:
    """(6 n, d, d) forms that vanish where the columns of n rotations are orthonormal."""
    size = 9 * rotations + 1
    found: list[FloatArray] = []
    for first in range(0, 9 * rotations, 9):
        for a in range(3):
            for b in range(a, 3):
                form = np.zeros((size, size))
                for i in range(3):
                    form[first + 3 * a + i, first + 3 * b + i] += 0.5
                    form[first + 3 * b + i, first + 3 * a + i] += 0.5
                form[-1, -1] = -1.0 if a == b else 0.0
                found.append(form)
    return np.array(found)
