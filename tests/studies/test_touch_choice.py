"""What the best choice of views would bring: no choice is below it, and one that is exchanged comes to it."""

from itertools import combinations

import numpy as np
import pytest

from handeye.estimation import Measurements, make_estimator
from handeye.estimation.touch import touch_error
from handeye.estimation.work import Work, lay_out
from handeye.robots import ArmKinematics
from handeye.simulation.cells import CellOptions, ErrorKind, simulate, simulated_arm
from handeye.studies.touch_choice import by_hindsight
from handeye.types import Mounting
from handeye.types.calibration import ModelName


@pytest.mark.parametrize("mounting", Mounting)
def test_no_choice_is_below_the_best(mounting: Mounting) -> None:
    recording = simulate(ErrorKind.MIXTURE_CELL, 5, CellOptions(mounting=mounting, views=(8, 8)))
    measurements = Measurements.of_recording(recording)
    estimate = make_estimator(ModelName.AUTO, ArmKinematics(simulated_arm()))(measurements)
    every = [(0, 1, *rest) for rest in combinations(range(2, 8), 3)]
    found = by_hindsight(estimate, measurements, Work(), every, 2)
    assert found.best == min(found.of_choices)
    worst = every[int(np.argmax(found.of_choices))]
    exchanged = by_hindsight(estimate, measurements, Work(), [worst], 2)
    assert exchanged.of_choices == (max(found.of_choices),)
    assert exchanged.best <= 1.02 * found.best < exchanged.of_choices[0]


@pytest.mark.parametrize("mounting", Mounting)
def test_of_all_views_it_is_the_touch_error(mounting: Mounting) -> None:
    recording = simulate(ErrorKind.MIXTURE_CELL, 6, CellOptions(mounting=mounting, views=(12, 12)))
    measurements = Measurements.of_recording(recording)
    estimate = make_estimator(ModelName.AUTO, ArmKinematics(simulated_arm()))(measurements)
    whole = by_hindsight(estimate, measurements, Work(), [range(12)], 12)
    stated = touch_error(estimate, lay_out(estimate, measurements, Work()).touches).covariances
    assert whole.best == pytest.approx(np.sqrt(np.trace(stated, axis1=1, axis2=2).mean()), rel=0.2)
