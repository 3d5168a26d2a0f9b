"""The loop: ask proposes or stops with its evidence, tell takes a view in, and the same seed decides the same."""

import numpy as np
import pytest

from cells import Cell
from handeye import _core
from handeye.errors import InputError
from handeye.estimation import AutoEstimator, Measurements, paper_estimate
from handeye.estimation.accuracy import box_corners, tool_deviations_m
from handeye.planning import (
    Accuracy,
    GainThreshold,
    NumberOfViews,
    Planner,
    PlannerOptions,
    Pool,
    Proposal,
    Stop,
    StopReason,
    ToolAccuracy,
    make_policy,
    replay,
)
from handeye.planning.prediction import Prediction, Sight, gains
from handeye.types import Pose, View


def scene(seed: int, count: int = 15) -> tuple[Cell, list[View]]:
    cell = Cell(np.random.default_rng(seed))
    poses = [cell.robot_pose(cell.look()) for _ in range(count)]
    return cell, cell.views(poses, sigma_px=0.2)


def planner(cell: Cell, views: list[View], **options: object) -> Planner:
    first = Measurements.of(cell.mounting, cell.camera, cell.target, views[:3])
    return Planner(first, Pool.of_views(views), paper_estimate, PlannerOptions(**options))  # type: ignore[arg-type]


def test_next_best_view_takes_the_largest_gain_and_entropy_falls() -> None:
    cell, views = scene(1)
    loop = planner(cell, views, stop_rules=(NumberOfViews(8),))
    entropies = [loop.estimate.entropy]
    by_name = {view.name: view for view in views}
    while isinstance(proposal := loop.ask(), Proposal):
        assert proposal.predicted_gain == np.nanmax(proposal.gains)
        assert proposal.names[int(np.nanargmax(proposal.gains))] == proposal.candidate.name
        verdict = loop.tell(by_name[proposal.candidate.name])
        assert verdict.predicted_gain == proposal.predicted_gain
        # The pixel noise is estimated again with every view, and the entropy of twelve parameters with it.
        assert verdict.realised_gain == pytest.approx(proposal.predicted_gain, abs=1.5)
        entropies.append(verdict.estimate.entropy)
    assert proposal.reason is StopReason.VIEWS_TAKEN
    assert len(loop.measurements) == 8
    assert np.all(np.diff(entropies) < 0)


def test_gains_are_the_determinants_of_the_paper() -> None:
    """`1/2 (ln |Lambda + I| - ln |Lambda|)` with the candidate's information as the core predicts it."""
    cell, views = scene(2)
    loop = planner(cell, views)
    estimate = loop.estimate
    information = estimate.information
    added = Prediction(estimate, Sight()).informations(loop.pool.motions(cell.mounting))
    expected = 0.5 * (np.linalg.slogdet(information + added)[1] - np.linalg.slogdet(information)[1])
    np.testing.assert_allclose(loop.gains(), expected, rtol=1e-9)


def test_predicted_information_is_that_of_the_view_taken() -> None:
    """With the answer known well, the information after a view is what was predicted before it."""
    cell, views = scene(3)
    measurements = Measurements.of(cell.mounting, cell.camera, cell.target, views[:10])
    before = paper_estimate(measurements)
    added = Prediction(before, Sight()).informations(Pool.of_views(views[10:11]).motions(cell.mounting))[0]
    after = measurements.with_views(views[10:11]).problem.solve(
        before.X.matrix, before.Y.matrix, _core.Model(np.full(11, before.candidate_sigma_px))
    )
    predicted = before.information + added
    assert np.abs(after.information - predicted).max() < 2e-3 * np.abs(predicted).max()


@pytest.mark.parametrize("policy", ["random", "max_distance", "next_best_view"])
def test_the_same_seed_decides_the_same(policy: str) -> None:
    cell, views = scene(4)

    def run(seed: int) -> list[str]:
        loop = planner(cell, views, policy=make_policy(policy), seed=seed, stop_rules=(NumberOfViews(9),))
        return [p.candidate.name for p in replay(loop, views) if isinstance(p, Proposal)]

    assert run(1) == run(1)
    assert len(set(run(1))) == 6
    if policy == "random":
        assert run(1) != run(2)


def test_max_distance_goes_to_the_loneliest_place() -> None:
    cell, views = scene(5)
    proposal = planner(cell, views, policy=make_policy("max_distance")).ask()
    assert isinstance(proposal, Proposal)
    positions = {view.name: view.T_base_flange.translation for view in views}
    taken = [positions[view.name] for view in views[:3]]
    distance = {
        name: min(float(np.linalg.norm(positions[name] - other)) for other in taken)
        for name in proposal.names
    }
    assert proposal.candidate.name == max(distance, key=lambda name: distance[name])


def test_stop_rules_bring_their_evidence() -> None:
    cell, views = scene(6)
    threshold = planner(cell, views, stop_rules=(GainThreshold(100.0),)).ask()
    assert isinstance(threshold, Stop)
    assert threshold.reason is StopReason.GAIN_BELOW_THRESHOLD
    assert threshold.evidence["best_gain"] < 100
    accuracy = planner(cell, views, stop_rules=(Accuracy(1000, 90),)).ask()
    assert isinstance(accuracy, Stop)
    assert accuracy.reason is StopReason.ACCURACY_REACHED
    corners = box_corners([-0.1, -0.1, 0.4], [0.1, 0.1, 0.6])
    tool = planner(cell, views, stop_rules=(ToolAccuracy(corners, 1000.0),)).ask()
    assert isinstance(tool, Stop)
    assert tool.evidence["worst_mm"] >= tool.evidence["mean_mm"] > 0
    assert isinstance(planner(cell, views, stop_rules=(Accuracy(1e-6, 1e-6),)).ask(), Proposal)
    empty = planner(cell, views[:3]).ask()
    assert isinstance(empty, Stop)
    assert empty.reason is StopReason.NO_CANDIDATE


def test_an_undetermined_start_does_not_stop_early_and_is_cured() -> None:
    """Three views that differ by translation only: the plan goes on, and its first choice turns."""
    cell, views = scene(7)
    first = cell.robot_pose(cell.look(0.3))
    alike = cell.views([cell.turned(first, np.zeros(3)) for _ in range(3)], sigma_px=0.1)
    start = [View(f"start_{v.name}", v.T_base_flange, v.point_ids, v.pixels) for v in alike]
    measurements = Measurements.of(cell.mounting, cell.camera, cell.target, start)
    for estimator in (paper_estimate, AutoEstimator()):
        rules = (GainThreshold(100.0), Accuracy(1e4, 90), NumberOfViews(7))
        options = PlannerOptions(stop_rules=rules, sight=Sight(known=True))
        loop = Planner(measurements, Pool.of_views(views), estimator, options)
        assert not loop.estimate.determined
        proposal = loop.ask()
        assert isinstance(proposal, Proposal)
        loop.tell(next(view for view in views if view.name == proposal.candidate.name))
        second = loop.ask()
        if isinstance(second, Proposal):
            loop.tell(next(view for view in views if view.name == second.candidate.name))
        assert loop.estimate.determined
        assert (loop.estimate.X @ cell.X.inverse()).rotation_angle_rad < 0.02


def test_unusable_views_change_nothing() -> None:
    cell, views = scene(8)
    loop = planner(cell, views)
    with pytest.raises(InputError, match="already taken"):
        loop.tell(views[0])
    few = View("few", views[5].T_base_flange, views[5].point_ids[:3], views[5].pixels[:3])
    with pytest.raises(InputError, match="few: 3 points"):
        loop.tell(few)
    assert len(loop.measurements) == 3
    loop.give_up(views[5].name)
    assert views[5].name not in {candidate.name for candidate in loop.pool.candidates}


def test_candidates_out_of_sight_have_no_gain() -> None:
    cell, views = scene(9)
    away = Pose(views[5].T_base_flange.matrix) @ Pose.exp([0, 0, 0, 0, 2.5, 0])
    measurements = Measurements.of(cell.mounting, cell.camera, cell.target, views[:4])
    pool = Pool.of_poses([views[5].T_base_flange, away])
    gains = Planner(measurements, pool, paper_estimate).gains()
    assert np.isfinite(gains[0])
    assert np.isnan(gains[1])


def test_tool_deviations_agree_with_sampling() -> None:
    random = np.random.default_rng(10)
    root = random.normal(size=(6, 6)) * 1e-3
    covariance = root @ root.T
    points = np.array([[0.1, -0.2, 0.5], [0.0, 0.0, 1.0]])
    twists = random.multivariate_normal(np.zeros(6), covariance, 200_000)
    moved = twists[:, None, :3] + np.cross(twists[:, None, 3:], points)
    sampled = np.sqrt(np.mean(np.sum(moved**2, axis=2), axis=0))
    np.testing.assert_allclose(tool_deviations_m(covariance, points), sampled, rtol=0.01)


@pytest.mark.parametrize("seed", range(3))
def test_averaging_over_the_posterior_is_close_for_a_settled_estimate(seed: int) -> None:
    cell, views = scene(20 + seed)
    measurements = Measurements.of(cell.mounting, cell.camera, cell.target, views[:8])
    estimate = AutoEstimator()(measurements)
    motions = Pool.of_views(views[8:]).motions(cell.mounting)
    entropy = _core.Criterion("entropy")
    plain = gains(estimate, entropy, motions, Sight())
    averaged = gains(estimate, entropy, motions, Sight(), over_posterior=True)
    np.testing.assert_allclose(averaged, plain, rtol=0.05)
    assert not np.array_equal(averaged, plain)
