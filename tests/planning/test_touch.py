"""Planning for the touch error: what a view is worth, and when it is enough."""

import numpy as np
import pytest

from handeye import _core
from handeye.errors import InputError
from handeye.estimation import Estimate, Measurements, make_estimator
from handeye.estimation.touch import touch_rows
from handeye.estimation.work import Work, lay_out, touch_map
from handeye.planning.prediction import Prediction, Sight
from handeye.planning.stopping import State, StopReason
from handeye.planning.touch import TouchAccuracy, touch_criterion
from handeye.robots import ArmKinematics, open_arm
from handeye.simulation.cells import CellOptions, ErrorKind, simulate
from handeye.types.calibration import ModelName

WORK = Work()


def solved(count: int) -> tuple[Estimate, Measurements, Measurements]:
    recording = simulate(ErrorKind.MIXTURE_CELL, 5, CellOptions(views=(14, 14)))
    everything = Measurements.of_recording(recording)
    taken, left = everything.select(range(count)), everything.select(range(count, 14))
    return make_estimator(ModelName.AUTO, ArmKinematics(open_arm("ur5e")))(taken), taken, left


def test_a_view_is_worth_what_it_takes_off_the_touch_error() -> None:
    estimate, taken, left = solved(6)
    rows, _ = touch_rows(estimate, lay_out(estimate, taken, WORK).touches)
    prediction = Prediction(estimate, Sight(known=True))
    gains = prediction.gains(touch_criterion(estimate, taken, WORK), left.motions, left.joints)

    def root(information: np.ndarray) -> float:
        covariance = np.linalg.inv(information)
        return float(np.sqrt(np.einsum("qij,jk,qik->", rows, covariance, rows) / len(rows)))

    views = prediction.informations(left.motions, left.joints)
    expected = [root(estimate.information) - root(estimate.information + one) for one in views]
    np.testing.assert_allclose(gains, expected, rtol=1e-5)
    assert np.all(gains > 0)


def test_a_task_has_as_many_columns_as_there_are_parameters() -> None:
    estimate, _, left = solved(6)
    prediction = Prediction(estimate, Sight(known=True))
    with pytest.raises(InputError, match="5 columns"):
        prediction.gains(_core.Criterion("task", tasks=np.ones((1, 3, 5))), left.motions, left.joints)
    with pytest.raises(InputError, match="all finite"):
        _core.Criterion("task", tasks=np.full((1, 3, 5), np.nan))


def test_it_stops_where_the_worst_point_is_good_enough() -> None:
    estimate, taken, _ = solved(8)
    worst = 1e3 * touch_map(estimate, taken, WORK).worst_m
    state = State(taken, estimate, np.ones(3))
    stop = TouchAccuracy(WORK, worst * 1.01).verdict(state)
    assert stop is not None
    assert stop.reason is StopReason.ACCURACY_REACHED
    assert stop.evidence["worst_mm"] == pytest.approx(worst)
    assert TouchAccuracy(WORK, worst * 0.99).verdict(state) is None
    few = State(taken.select(range(5)), estimate, np.ones(3))
    assert TouchAccuracy(WORK, worst * 1.01).verdict(few) is None
    with pytest.raises(InputError, match="above zero"):
        TouchAccuracy(WORK, 0.0)
