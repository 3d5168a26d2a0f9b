"""What many views would come to: near what they do come to, and requests far beyond it are refused early."""

import numpy as np
import pytest

from handeye.estimation import Measurements, make_estimator
from handeye.planning.prospect import FEWEST_VIEWS, MANY_VIEWS, OutOfReach, prospect
from handeye.planning.stopping import State, StopReason
from handeye.session.wish import Wish
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types.calibration import ModelName


@pytest.fixture(scope="module")
def measurements() -> Measurements:
    views = (MANY_VIEWS, MANY_VIEWS)
    return Measurements.of_recording(
        simulate(ErrorKind.ROBOT_NOISE_1_DEG, 1, CellOptions(views=views), seed=3)
    )


def test_a_forecast_is_near_what_many_views_come_to(measurements: Measurements) -> None:
    estimator = make_estimator(ModelName.AUTO)
    young = estimator(measurements.select(range(6)))
    then = prospect(young, measurements.select(range(6)))
    old = estimator(measurements).within_95
    assert then.translation_mm < young.within_95.translation_mm
    assert 0.3 < then.translation_mm / old.translation_mm < 3.0
    same = prospect(young, measurements.select(range(6)), 6)
    assert same.translation_mm <= young.within_95.translation_mm * 1.001


def test_what_is_far_out_of_reach_is_refused_within_six_views(measurements: Measurements) -> None:
    estimator = make_estimator(ModelName.AUTO)
    for count in (FEWEST_VIEWS - 1, FEWEST_VIEWS):
        taken = measurements.select(range(count))
        state = State(taken, estimator(taken), np.ones(1))
        then = prospect(state.estimate, taken)
        stop = OutOfReach(then.translation_mm / 10, then.rotation_deg / 10).verdict(state)
        assert (stop is not None) == (count >= FEWEST_VIEWS)
        if stop is not None:
            assert stop.reason is StopReason.OUT_OF_REACH
            assert "this arm cannot reach" in stop.sentence
            assert f"with {MANY_VIEWS} views it would come to" in stop.sentence
        # Forecasts are rough: what they miss by two is not refused.
        for share in (1, 2):
            asked = OutOfReach(then.translation_mm / share, then.rotation_deg / share)
            assert asked.verdict(state) is None


def test_a_wish_refuses_unless_it_is_told_to_go_on() -> None:
    kinds = [type(rule) for rule in Wish().rules()]
    assert OutOfReach in kinds
    assert OutOfReach not in [type(rule) for rule in Wish(anyway=True).rules()]
    assert OutOfReach not in [type(rule) for rule in Wish(accuracy_px=1.0).rules()]
