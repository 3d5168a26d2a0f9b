"""Many checks: the night of a shift is named, though what the calibration does not know looks like one."""

import numpy as np

from handeye.estimation.change import change_of

NIGHTS, NUMBERS = 100, 12
# A direction in which the calibration is off every night, and one of a shift of three deviations per axis.
BIAS = 3.0 * np.eye(NUMBERS)[0]
SHIFT = 3.0 * np.sqrt(3) * np.eye(NUMBERS)[5]


def nights(random: np.random.Generator, *levels: tuple[int, float]) -> np.ndarray:
    """Misses of checks: so many nights with so many times the shift, one after the other."""
    moved = np.concatenate([np.full(count, times) for count, times in levels])
    return BIAS + moved[:, np.newaxis] * SHIFT + random.standard_normal((len(moved), NUMBERS))


def test_it_names_the_night() -> None:
    random = np.random.default_rng(0)
    right, early = 0, 0
    for _ in range(200):
        night = int(random.integers(1, 95))
        found = change_of(nights(random, (night, 0.0), (NIGHTS - night, 1.0))).first
        right += found == night
        early += change_of(nights(random, (NIGHTS, 0.0))).first is not None
    assert right >= 190
    assert early <= 2


def test_what_moved_before_the_first_check_is_found() -> None:
    random = np.random.default_rng(1)
    assert change_of(nights(random, (1, 2.0))).first == 0
    assert change_of(nights(random, (20, 2.0))).first == 0
    assert change_of([]).first is None


def test_one_bad_night_and_what_was_put_back_are_no_shift() -> None:
    random = np.random.default_rng(2)
    assert change_of(nights(random, (40, 0.0), (1, 3.0), (40, 0.0))).first is None
    assert change_of(nights(random, (40, 0.0), (10, 3.0), (40, 0.0))).first is None


def test_nights_noisier_than_the_calibration_expects_are_no_shift() -> None:
    random = np.random.default_rng(3)
    assert all(change_of(3.0 * nights(random, (NIGHTS, 0.0))).first is None for _ in range(20))
