"""Views chosen together: close to the best of all choices, and never above the bound."""

from itertools import combinations

import numpy as np
import pytest

from cells import Cell
from handeye.errors import InputError
from handeye.estimation import AutoEstimator, Estimate, Measurements, paper_estimate
from handeye.planning import Pool
from handeye.planning.batch import OBJECTIVES, plan_batch
from handeye.planning.prediction import Prediction, Sight
from handeye.types.arrays import FloatArray

BOX = [[x, y, z] for x in (-0.2, 0.2) for y in (-0.2, 0.2) for z in (0.4, 0.8)]


def situation(seed: int, size: int, *, auto: bool = False) -> tuple[Estimate, Pool]:
    cell = Cell(np.random.default_rng(seed))
    poses = [cell.robot_pose(cell.look()) for _ in range(4 + size)]
    robot = np.array([3e-4] * 6)
    measurements = Measurements.of(
        cell.mounting, cell.camera, cell.target, cell.views(poses[:4], sigma_px=0.1, robot_sigma=robot)
    )
    estimate = AutoEstimator()(measurements) if auto else paper_estimate(measurements)
    return estimate, Pool.of_poses(poses[4:])


def worths(totals: FloatArray, objective: str) -> FloatArray:
    """Worth of many informations (N, n, n) at once, independently of the core."""
    if objective == "tool_point":
        points = np.array(BOX)
        hats = np.array([[[0, -p[2], p[1]], [p[2], 0, -p[0]], [-p[1], p[0], 0]] for p in points])
        jacobians = np.concatenate([np.broadcast_to(np.eye(3), hats.shape), -hats], axis=2)
        q = np.einsum("pij,pik->jk", jacobians, jacobians) / len(points)
        return -np.einsum("ij,nji->n", q, np.linalg.inv(totals)[:, :6, :6])
    whole = np.linalg.slogdet(totals)[1]
    return whole if objective == "entropy" else whole - np.linalg.slogdet(totals[:, 6:, 6:])[1]


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_five_of_twenty_seven_against_every_choice(objective: str) -> None:
    """All 80,730 choices are tried: the plan reaches 0.995 of the best, the bound is never below it."""
    estimate, pool = situation(1, 27)
    plan = plan_batch(estimate, pool, 5, objective=objective, tool_points_m=BOX)
    prediction = Prediction(estimate, Sight())
    base = estimate.information
    informations = prediction.informations(pool.motions(estimate.mounting))
    assert (np.trace(informations, axis1=1, axis2=2) > 0).all()
    best = -np.inf
    choices = np.array(list(combinations(range(27), 5)))
    for some in np.array_split(choices, 40):
        best = max(best, float(worths(base + informations[some].sum(axis=1), objective).max()))
    assert plan.bound >= best - 1e-9 * abs(best)
    if objective == "tool_point":
        efficiency = np.sqrt(best / plan.worth)
    else:
        efficiency = np.exp((plan.worth - best) / (12 if objective == "entropy" else 6))
    assert 0.995 <= efficiency <= 1 + 1e-9
    assert plan.efficiency <= efficiency + 1e-9


def test_with_robot_noise_and_camera_parameters() -> None:
    estimate, pool = situation(2, 20, auto=True)
    plan = plan_batch(estimate, pool, 4, objective="entropy_handeye")
    assert len({candidate.name for candidate in plan.candidates}) == 4
    assert 0.8 < plan.efficiency <= 1
    assert np.linalg.eigvalsh(estimate.hand_eye_covariance - plan.covariance).min() > 0
    assert "no choice of 4 of these poses" in plan.sentence


def test_impossible_questions_are_refused() -> None:
    estimate, pool = situation(3, 3)
    with pytest.raises(InputError, match="4 views of 3"):
        plan_batch(estimate, pool, 4)
    with pytest.raises(InputError, match="expected one of entropy"):
        plan_batch(estimate, pool, 2, objective="beauty")
    with pytest.raises(InputError, match="tool_points"):
        plan_batch(estimate, pool, 2, objective="tool_point")
