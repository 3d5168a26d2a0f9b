"""The order that travels least: the best of all where all can be tried, never longer than what was given."""

from itertools import permutations

import numpy as np
import pytest

from handeye.errors import InputError
from handeye.planning.candidates import Candidate
from handeye.planning.ordering import METRES_PER_RADIAN, MOST_EXACT, Measure, shortest_path, travel_order
from handeye.types import Pose
from handeye.types.arrays import FloatArray


def distances(seed: int, count: int) -> FloatArray:
    places = np.random.default_rng(seed).uniform(size=(count + 1, 3))
    return np.linalg.norm(places[:, np.newaxis] - places, axis=2)


def length(costs: FloatArray, order: list[int]) -> float:
    return float(costs[[0, *order[:-1]], order].sum())


@pytest.mark.parametrize("count", [1, 2, 6])
def test_a_few_are_ordered_as_well_as_by_trying_all(count: int) -> None:
    for seed in range(5):
        costs = distances(seed, count)
        order, exact = shortest_path(costs)
        assert exact
        assert sorted(order) == list(range(1, count + 1))
        best = min(length(costs, list(some)) for some in permutations(range(1, count + 1)))
        assert length(costs, order) == pytest.approx(best, abs=1e-12)


def test_many_are_ordered_well() -> None:
    # Places on a line in a random order: the best path is known, and the arm stands at its end.
    random = np.random.default_rng(3)
    line = np.concatenate([[0.0], random.permutation(np.arange(1.0, 31.0))])
    costs = np.abs(line[:, np.newaxis] - line)
    order, exact = shortest_path(costs)
    assert not exact
    assert length(costs, order) == pytest.approx(30.0)
    # In space: nothing that is known to be shorter, and much shorter than by chance.
    costs = distances(4, MOST_EXACT + 8)
    order, _ = shortest_path(costs)
    by_chance = [length(costs, list(random.permutation(np.arange(1, len(costs))))) for _ in range(200)]
    assert length(costs, order) < 0.7 * min(by_chance)


def at(name: str, *joints: float) -> Candidate:
    return Candidate(name, Pose.exp([*joints, *[0.0] * (6 - len(joints))]), joints)


def test_by_the_time_of_motions_where_joints_are_known() -> None:
    views = [at("far", 2.0, 0.0), at("near", 0.5, 0.0), at("middle", 1.0, 0.2)]
    route = travel_order(views, at("here", 0.0, 0.0), speed_rad_s=0.5)
    assert [view.name for view in route.candidates] == ["near", "middle", "far"]
    assert route.measure is Measure.MOTION_TIME
    # Half a radian at half a radian per second, and a quarter of a second to get there.
    assert route.legs == pytest.approx([1.25, 1.25, 2.25])
    assert (route.exact, route.total) == (True, pytest.approx(4.75))
    assert route.as_given == pytest.approx(4.25 + 3.25 + 1.25)
    # A joint that is slow makes another way the shortest.
    slow = travel_order(views, at("here", 0.0, 0.0), velocities=[np.inf, 0.01], speed_rad_s=0.5)
    assert [view.name for view in slow.candidates] == ["near", "far", "middle"]


def test_by_the_distance_of_poses_where_they_are_not() -> None:
    views = [
        Candidate("turned", Pose.exp([0.1, 0, 0, 0, 0, 1.0])),
        Candidate("moved", Pose.exp([0.2, 0, 0, 0, 0, 0])),
    ]
    route = travel_order(views, Candidate("here", Pose.identity(), (0.0,)))
    assert route.measure is Measure.POSE_DISTANCE
    assert [view.name for view in route.candidates] == ["moved", "turned"]
    assert route.legs[0] == pytest.approx(0.2)
    apart = np.linalg.norm(views[0].T_base_flange.translation - [0.2, 0, 0])
    assert route.legs[1] == pytest.approx(apart + METRES_PER_RADIAN)


def test_nothing_to_order_and_no_speed_are_refused() -> None:
    with pytest.raises(InputError, match="no views"):
        travel_order([], at("here", 0.0))
    with pytest.raises(InputError):
        travel_order([at("there", 1.0)], at("here", 0.0), speed_rad_s=0.0)
    with pytest.raises(InputError):
        travel_order([at("there", 1.0)], at("here", 0.0), velocities=[-1.0])
