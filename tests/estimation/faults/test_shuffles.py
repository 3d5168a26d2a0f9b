"""Images find the poses at which they were taken, with and without knowing X and Y."""

from dataclasses import replace

import numpy as np
import pytest

from handeye.estimation import Measurements
from handeye.estimation.faults.kinds.view_shuffled import shift_of
from handeye.estimation.faults.shuffles import find_pairing
from handeye.estimation.faults.stations import Stations
from handeye.studies.planted import made_up


@pytest.mark.parametrize("number", [0, 1, 6, 11])
def test_any_pairing_is_found_from_screws(number: int) -> None:
    stations = Stations.of(Measurements.of_recording(made_up(number, 3)))
    order = np.random.default_rng(number).permutation(len(stations))
    pairing = find_pairing(replace(stations, robot=stations.robot[order]))
    assert pairing is not None
    np.testing.assert_array_equal(pairing, np.argsort(order))


def test_images_of_another_board_find_nothing() -> None:
    one = Stations.of(Measurements.of_recording(made_up(0, 3)))
    other = Stations.of(Measurements.of_recording(made_up(4, 3)))
    count = min(len(one), len(other))
    kept = np.arange(count)
    mixed = replace(one.paired(kept, kept), robot=other.robot[:count])
    assert find_pairing(mixed) is None


def test_patterns_are_put_in_words() -> None:
    assert "shifted by 1" in shift_of({0: 1, 1: 2, 2: 3, 3: 0}, 4)
    assert "reverse" in shift_of({0: 3, 1: 2, 2: 1, 3: 0}, 4)
    assert shift_of({0: 1, 1: 0}, 4) == ""
