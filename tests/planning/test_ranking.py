"""Ranking candidates: order, what is predicted after each, and why some cannot serve."""

from dataclasses import replace

import numpy as np
import pytest

from cells import Cell
from handeye import _core
from handeye.estimation import Estimate, Measurements, make_estimator
from handeye.planning import Candidate, Planner, PlannerOptions, Pool, rank
from handeye.planning.prediction import Prediction, Sight
from handeye.types import Pose
from handeye.types.calibration import ModelName

ENTROPY = _core.Criterion("entropy")


@pytest.fixture(scope="module")
def cell() -> Cell:
    return Cell(np.random.default_rng(5))


@pytest.fixture(scope="module")
def measurements(cell: Cell) -> Measurements:
    views = cell.views([cell.robot_pose(cell.look()) for _ in range(12)], sigma_px=0.1)
    return Measurements.of(cell.mounting, cell.camera, cell.target, views)


@pytest.fixture(scope="module", params=list(ModelName))
def model(request: pytest.FixtureRequest) -> ModelName:
    return request.param


@pytest.fixture(scope="module")
def estimate(measurements: Measurements, model: ModelName) -> Estimate:
    return make_estimator(model)(measurements.select(range(5)))


def pool_of(measurements: Measurements) -> Pool:
    return Pool.of_views(measurements.views[5:])


def test_best_is_what_the_planner_proposes(
    measurements: Measurements, estimate: Estimate, model: ModelName
) -> None:
    options = PlannerOptions(criterion=ENTROPY, sight=Sight(known=True))
    planner = Planner(measurements.select(range(5)), pool_of(measurements), make_estimator(model), options)
    ranking = rank(planner.estimate, planner.pool, ENTROPY, Sight(known=True))
    proposal = planner.ask()
    assert ranking.prospects[0].candidate == proposal.candidate  # type: ignore[union-attr]
    gains = [prospect.gain for prospect in ranking.prospects]
    assert gains == sorted(gains, reverse=True)
    assert ranking.feasible_count == len(gains) == 7


def test_prediction_is_what_the_paper_says(measurements: Measurements) -> None:
    """Under the paper's model the covariance after a view is the inverse of the sum of the informations."""
    estimate = make_estimator(ModelName.PAPER)(measurements.select(range(5)))
    best = rank(estimate, pool_of(measurements), ENTROPY, Sight(known=True)).prospects[0]
    motion = measurements.mounting.chain(best.candidate.T_base_flange).matrix[np.newaxis]
    prediction = Prediction(estimate, Sight(known=True))
    gained = prediction.informations(motion)[0]
    expected = np.linalg.inv(estimate.information + gained)[:6, :6]
    np.testing.assert_allclose(best.covariance, expected, rtol=1e-6, atol=1e-9 * expected.max())


def test_prediction_comes_true(measurements: Measurements, estimate: Estimate, model: ModelName) -> None:
    """Taking the view brings about the predicted accuracy, up to what it teaches about the noise."""
    before = np.sqrt(np.trace(estimate.hand_eye_covariance[:3, :3]))
    names = [view.name for view in measurements.views]
    for prospect in rank(estimate, pool_of(measurements), ENTROPY, Sight(known=True)).prospects:
        chosen = [*range(5), names.index(prospect.candidate.name)]
        after = make_estimator(model)(measurements.select(chosen))
        realised = np.sqrt(np.trace(after.hand_eye_covariance[:3, :3]))
        assert prospect.sigma_translation_m < before
        assert prospect.sigma_translation_m == pytest.approx(realised, rel=0.5)


def test_top_limits_the_prospects_only(measurements: Measurements, estimate: Estimate) -> None:
    pool = pool_of(measurements)
    whole = rank(estimate, pool, ENTROPY, Sight(known=True))
    short = rank(estimate, pool, ENTROPY, Sight(known=True), top=2)
    assert [p.candidate for p in short.prospects] == [p.candidate for p in whole.prospects[:2]]
    assert short.feasible_count == whole.feasible_count


def test_empty_pool(estimate: Estimate) -> None:
    ranking = rank(estimate, Pool(()), ENTROPY)
    assert (ranking.prospects, ranking.infeasible, ranking.feasible_count) == ((), {}, 0)


def test_reasons(cell: Cell, estimate: Estimate) -> None:
    good = cell.look(0.2, 0.2)
    turned_away = Pose.exp([0, 0, 0, 0, np.pi, 0]) @ good
    # Half a turn about the target's x axis shows its back at the same place.
    back = good @ Pose.exp([0, 0, 0, np.pi, 0, 0])
    aside = Pose.exp([0.35, 0, 0, 0, 0, 0]) @ good
    named = {"good": good, "turned_away": turned_away, "back": back, "aside": aside}
    pool = Pool(tuple(Candidate(name, cell.robot_pose(pose)) for name, pose in named.items()))
    ranking = rank(estimate, pool, ENTROPY)
    assert [p.candidate.name for p in ranking.prospects] == ["good"]
    assert "behind the camera" in ranking.infeasible["turned_away"]
    assert "back of the target" in ranking.infeasible["back"]
    assert "of 63 points would be in the image" in ranking.infeasible["aside"]
    lenient = rank(estimate, pool, ENTROPY, Sight(fewest=4))
    assert {p.candidate.name for p in lenient.prospects} == {"good", "aside"}


def test_margin(cell: Cell, estimate: Estimate) -> None:
    pool = Pool((Candidate("good", cell.robot_pose(cell.look(0.2, 0.2))),))
    assert rank(estimate, pool, ENTROPY, Sight(margin_px=10)).feasible_count == 1
    assert rank(estimate, pool, ENTROPY, Sight(margin_px=500)).feasible_count == 0


def test_what_no_view_lessens_stays_in(measurements: Measurements) -> None:
    """Errors of an arm that is not described come again in every view: the prediction keeps them."""
    estimate = make_estimator(ModelName.AUTO)(measurements.select(range(5)))
    kept = np.diag([1e-2**2] * 3 + [1e-3**2] * 3)
    covariance = np.array(estimate.covariance)
    covariance[:6, :6] += kept
    pool = pool_of(measurements)
    narrow = rank(estimate, pool, ENTROPY, Sight(known=True)).prospects[0]
    wide = rank(replace(estimate, covariance=covariance), pool, ENTROPY, Sight(known=True)).prospects[0]
    np.testing.assert_allclose(np.diag(wide.covariance), np.diag(narrow.covariance + kept), rtol=1e-2)
