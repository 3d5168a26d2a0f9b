"""Peers in JAX, compiled for the shapes at hand."""

# What JAX traces has no types of its own.
# pyright: basic
# ruff: noqa: ANN001, ANN002, ANN202

from collections.abc import Callable

import numpy as np

from handeye.benchmarks.peers import chain
from handeye.benchmarks.peers.availability import optional
from handeye.benchmarks.problems import SIGMA_PX, Cell
from handeye.benchmarks.stopping import COST_TOLERANCE, MOST_STEPS
from handeye.types.arrays import FloatArray


def solver(cell: Cell) -> Callable[[], tuple[FloatArray, FloatArray]]:
    """Return what solves a cell by Levenberg-Marquardt with forward derivatives."""
    jax = optional("jax")
    jax.config.update("jax_enable_x64", True)
    jnp = jax.numpy
    fx, fy, cx, cy = cell.parameters[:4]

    def turn(w):
        squared = w @ w
        angle = jnp.sqrt(jnp.where(squared > 1e-16, squared, 1.0))
        S = jnp.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
        return jnp.eye(3) + jnp.sin(angle) / angle * S + (1 - jnp.cos(angle)) / angle**2 * (S @ S)

    def residuals(v, points, motions, pixels):
        q = points @ turn(v[6:9]).T + v[9:]
        q = jnp.einsum("kij,pj->kpi", motions[:, :3, :3], q) + motions[:, None, :3, 3]
        p = q @ turn(v[:3]).T + v[3:6]
        uv = p[..., :2] / p[..., 2:] * jnp.array([fx, fy]) + jnp.array([cx, cy])
        return ((uv - pixels) / SIGMA_PX).ravel()

    derivative = jax.jacfwd(residuals)

    def levenberg_marquardt(start, *data):
        def normal(v):
            r, J = residuals(v, *data), derivative(v, *data)
            return J.T @ J, J.T @ r, r @ r

        def step(state):
            v, H, g, cost, damping, _, count = state
            moved = v - jnp.linalg.solve(H + damping * jnp.diag(jnp.diag(H)), g)
            H_new, g_new, cost_new = normal(moved)
            better = cost_new < cost
            change = jnp.where(better, (cost - cost_new) / cost, 1.0)
            damping = jnp.where(better, damping / 10, damping * 10)
            return (
                jnp.where(better, moved, v),
                jnp.where(better, H_new, H),
                jnp.where(better, g_new, g),
                jnp.where(better, cost_new, cost),
                damping,
                change,
                count + 1,
            )

        def going(state):
            return (state[5] > COST_TOLERANCE) & (state[6] < MOST_STEPS)

        state = jax.lax.while_loop(going, step, (start, *normal(start), 1e-4, 1.0, 0))
        return state[0], jnp.linalg.inv(state[1])

    compiled = jax.jit(levenberg_marquardt)
    start = chain.stacked(cell.X_start, cell.Y_start)

    def solve() -> tuple[FloatArray, FloatArray]:
        values, covariance = compiled(start, cell.points, cell.motions, cell.pixels)
        covariance.block_until_ready()
        return chain.unstacked(np.asarray(values))

    return solve


def scorer(*, reduced: bool) -> Callable[[Cell, FloatArray, FloatArray], Callable[[], FloatArray]]:
    """Return what prepares the scoring of motions by 12 x 12, or by the reduced form of 6 x 6."""

    def prepare(cell: Cell, information: FloatArray, motions: FloatArray) -> Callable[[], FloatArray]:
        jax = optional("jax")
        jax.config.update("jax_enable_x64", True)
        jnp = jax.numpy
        fx, fy = cell.parameters[:2] / SIGMA_PX
        X, Y, points = jnp.asarray(cell.X), jnp.asarray(cell.Y), jnp.asarray(cell.points)
        covariance = jnp.asarray(np.linalg.inv(information))
        before = float(np.linalg.slogdet(information)[1])

        def one(motion):
            XA = X @ motion
            T = XA @ Y
            p = points @ T[:3, :3].T + T[:3, 3]
            inverse = 1 / p[:, 2]
            u, v, none = p[:, 0] * inverse, p[:, 1] * inverse, jnp.zeros(len(cell.points))
            rows = [
                [fx * inverse, none, -fx * u * inverse, -fx * u * v, fx * (1 + u * u), -fx * v],
                [none, fy * inverse, -fy * v * inverse, -fy * (1 + v * v), fy * u * v, fy * u],
            ]
            J = jnp.concatenate([jnp.stack(row, axis=1) for row in rows])
            R, t = XA[:3, :3], XA[:3, 3]
            across = jnp.array([[0.0, -t[2], t[1]], [t[2], 0.0, -t[0]], [-t[1], t[0], 0.0]]) @ R
            adjoint = jnp.block([[R, across], [jnp.zeros((3, 3)), R]])
            if reduced:
                B = jnp.concatenate([jnp.eye(6), adjoint], axis=1)
                moved = jnp.eye(6) + (J.T @ J) @ (B @ covariance @ B.T)
                return 0.5 * jnp.linalg.slogdet(moved)[1]
            whole = jnp.concatenate([J, J @ adjoint], axis=1)
            factor = jnp.linalg.cholesky(information + whole.T @ whole)
            return jnp.sum(jnp.log(jnp.diagonal(factor))) - 0.5 * before

        compiled = jax.jit(jax.vmap(one))

        def score() -> FloatArray:
            return np.asarray(compiled(motions))

        return score

    return prepare
