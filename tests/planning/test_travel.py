"""How long motions take, and views chosen for what they teach per second."""

import numpy as np
import pytest

from handeye.errors import InputError
from handeye.planning.candidates import Pool
from handeye.planning.policies import GainPerSecond, NextBestView, Situation
from handeye.planning.travel import Travel
from handeye.types import Pose

TRAVEL = Travel(np.zeros(2), np.array([0.5, 1.0]), ramp_s=0.2, look_s=1.0)


def test_the_slowest_joint_decides_and_short_ways_never_reach_full_speed() -> None:
    ways = [[0.5, 0.0], [0.5, 0.9], [0.0, 0.9], [0.0, 0.05], [0.0, 0.0]]
    assert TRAVEL.seconds(ways) == pytest.approx([2.2, 2.2, 2.1, 1 + 2 * np.sqrt(0.05 * 0.2), 1.0])


def test_times_are_those_of_a_fine_simulation() -> None:
    # One joint under bang-bang acceleration, stepped through.
    for way in (0.02, 0.1, 0.6):
        speed, acceleration, place, now, step = 0.0, 1.0 / 0.2, 0.0, 0.0, 1e-5
        while place < way:
            braking = speed**2 / (2 * acceleration) >= way - place
            speed = (
                max(speed - acceleration * step, 1e-4) if braking else min(speed + acceleration * step, 1.0)
            )
            place, now = place + speed * step, now + step
        assert TRAVEL.seconds([[0.0, way]])[0] - 1.0 == pytest.approx(now, abs=2e-3)


def test_a_view_nearby_wins_where_time_counts() -> None:
    pool = Pool.of_poses([Pose.identity(), Pose.exp([1, 0, 0, 0, 0, 0]), Pose.exp([2, 0, 0, 0, 0, 0])])
    gains = np.array([2.0, 3.0, np.nan])
    random = np.random.default_rng(0)
    timed = Situation((), pool, gains, random, np.array([2.0, 4.0, 1.0]))
    assert NextBestView().choose(timed).index == 1
    choice = GainPerSecond().choose(timed)
    assert (choice.index, choice.score) == (0, 1.0)
    # Without times, only the gain is known.
    assert GainPerSecond().choose(Situation((), pool, gains, random)).index == 1


def test_an_arm_that_does_not_move_has_no_times() -> None:
    with pytest.raises(InputError):
        Travel(np.zeros(2), np.array([0.0, 1.0]))
