"""The certificate: global optima certified, local minima never, the bound below every answer that can be tried."""

import numpy as np
import pytest
from numpy.typing import NDArray

from handeye import _core
from handeye.errors import DegenerateError, InputError
from handeye.estimation import solve, solve_rig
from handeye.estimation.certificate import PoseProblem, certify, certify_calibration, certify_rig
from handeye.simulation.cells import ErrorKind, simulate
from handeye.simulation.rigs import simulate_rig

Array = NDArray[np.float64]


def transforms(random: np.random.Generator, count: int, metres: float, radians: float) -> Array:
    return _core.se3_exp(random.uniform(-1, 1, (count, 6)) * np.repeat([metres, radians], 3))


def drawn(
    seed: int, noise_rad: float | None = None, cameras: int = 1, targets: int = 1
) -> tuple[PoseProblem, Array, Array]:
    """A problem with noise of 0.1 to 10 mrad unless given, and the truth."""
    random = np.random.default_rng(seed)
    views = int(random.integers(4, 16)) * cameras * targets
    X, Y = transforms(random, cameras, 0.5, 2.0), transforms(random, targets, 0.5, 2.0)
    A = transforms(random, views, 0.5, random.uniform(0.4, 1.5))
    of_camera = tuple(k % cameras for k in range(views))
    of_target = tuple((k // cameras) % targets for k in range(views))
    noise_rad = noise_rad if noise_rad is not None else 10 ** random.uniform(-4, -2)
    off = random.normal(size=(views, 6)) * np.repeat([0.5 * noise_rad, noise_rad], 3)
    C = _core.se3_exp(off) @ X[list(of_camera)] @ A @ Y[list(of_target)]
    return PoseProblem(A, C, of_camera, of_target), X, Y


def cost_at(problem: PoseProblem, sigmas: tuple[float, float], X: Array, Y: Array) -> float:
    """The sum of squares by its definition."""
    W = np.linalg.inv(Y)[list(problem.targets or ())]
    off = problem.C @ W - X[list(problem.cameras or ())] @ problem.A
    rotation, translation = np.sum(off[:, :3, :3] ** 2), np.sum(off[:, :3, 3] ** 2)
    return float(rotation / sigmas[0] ** 2 + translation / sigmas[1] ** 2)


def test_optima_are_certified_and_local_minima_are_not() -> None:
    planted = 0
    for seed in range(60):
        problem, X, Y = drawn(seed)
        found = certify(problem, X, Y)
        assert found.certified, seed
        random = np.random.default_rng([1, seed])
        weighted = PoseProblem(problem.A, problem.C, problem.cameras, problem.targets, found.sigmas)
        for _ in range(3):
            elsewhere = certify(weighted, *transforms(random, 2, 0.5, 3.0)[:, None])
            if elsewhere.cost > found.cost * (1 + 1e-5):
                planted += 1
                assert not elsewhere.certified
                assert elsewhere.bound <= found.cost * (1 + 1e-9)
            else:
                assert elsewhere.cost == pytest.approx(found.cost, rel=1e-6)
    assert planted >= 5


@pytest.mark.parametrize(("cameras", "targets"), [(1, 1), (3, 1), (2, 2)])
def test_no_answer_is_below_the_bound_and_the_cost_is_that_of_its_definition(
    cameras: int, targets: int
) -> None:
    for seed in range(4):
        problem, X, Y = drawn(seed, None, cameras, targets)
        found = certify(problem, X, Y)
        assert found.certified
        assert cost_at(problem, found.sigmas, found.X, found.Y) == pytest.approx(found.cost, rel=1e-6)
        random = np.random.default_rng(seed)
        for size in (1e-5, 1e-3, 0.1, 2.0):
            near = transforms(random, cameras, size, size) @ found.X
            other = transforms(random, targets, size, size) @ found.Y
            assert cost_at(problem, found.sigmas, near, other) >= found.bound * (1 - 1e-9)


def test_large_noise_is_certified_too_and_little_noise_is_no_obstacle() -> None:
    for noise in (0.3, 1e-6, 0.0):
        problem, X, Y = drawn(2, noise)
        found = certify(problem, X, Y)
        assert found.certified, noise
        assert found.gap < 1e-6


def test_the_answer_of_solve_is_certified_and_lies_in_the_basin() -> None:
    recording = simulate(ErrorKind.WHITE_FLANGE, 3)
    calibration = solve(recording)
    found = certify_calibration(recording, calibration)
    assert found.certified
    assert found.moved_m < 5e-3
    data = found.to_dict()
    assert data["certified"] is True
    assert data["moved_mm"] == pytest.approx(1e3 * found.moved_m)
    assert "no other answer" in found.sentence


def test_the_answer_for_several_cameras_is_certified_and_another_is_not_taken_for_it() -> None:
    rig = solve_rig(simulate_rig(ErrorKind.WHITE_FLANGE, 1))
    found = certify_rig(rig)
    assert found.certified
    assert found.moved_m < 5e-3
    assert len(found.X) == len(rig.cameras) > 1
    assert len(found.Y) == len(rig.targets)
    fit = rig.estimate.fit
    for name, camera in zip(fit.measurements.cameras, found.X, strict=True):
        np.testing.assert_allclose(camera, fit.X[name].matrix, atol=5e-3)


def test_what_cannot_be_certified_is_refused() -> None:
    problem, X, Y = drawn(1)
    with pytest.raises(InputError, match="2 views"):
        certify(PoseProblem(problem.A[:2], problem.C[:2]), X, Y)
    still = np.repeat(problem.A[:1], 5, axis=0)
    with pytest.raises(DegenerateError, match="translations"):
        certify(PoseProblem(still, X @ still @ Y), X, Y)
