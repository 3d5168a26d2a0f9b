"""What every policy must do."""

import copy
import math
from collections.abc import Iterator

import numpy as np

from handeye.planning import POLICIES, Policy, Pool
from handeye.planning.policies import Choice, Situation
from handeye.types import Pose, View
from handeye.types.arrays import FloatArray


class PolicyTests:
    """Subclass it and give the fixture `policy`, an instance of yours.

    Examples
    --------
    >>> class TestMine(PolicyTests):  # with the fixture `policy`
    ...     pass
    >>> hasattr(TestMine, "test_has_a_name_of_its_own")
    True
    """

    situations = 25
    """So many different situations are tried."""

    def test_has_a_name_of_its_own(self, policy: Policy) -> None:
        """A word, and not that of another policy."""
        assert isinstance(policy, Policy), "it does not derive from Policy"
        assert policy.name.isidentifier(), f"name {policy.name!r}, expected a word"
        known = POLICIES.get(policy.name)
        assert known in {None, type(policy)}, f"{policy.name} is the name of another policy"

    def test_takes_a_candidate_that_shows_enough(self, policy: Policy) -> None:
        """An index into the pool, never of a candidate without a gain; also where only one is left."""
        for situation in self._situations():
            choice = policy.choose(situation)
            assert isinstance(choice, Choice), f"{type(choice).__name__}, expected Choice"
            assert choice.index in situation.feasible, "the candidate shows too little of the target"
            assert math.isfinite(choice.score), f"score {choice.score}"

    def test_the_same_chance_makes_the_same_choice(self, policy: Policy) -> None:
        """Whatever is drawn comes from the situation's own source."""
        for situation in self._situations():
            again = copy.deepcopy(situation)
            assert policy.choose(situation) == policy.choose(again)

    def test_leaves_the_situation_as_it_is(self, policy: Policy) -> None:
        """Others look at it too."""
        for situation in self._situations():
            gains, pool = situation.gains.copy(), situation.pool
            seconds = None if situation.seconds is None else situation.seconds.copy()
            policy.choose(situation)
            assert np.array_equal(situation.gains, gains, equal_nan=True), "the gains were changed"
            assert situation.pool is pool
            if seconds is not None:
                assert np.array_equal(np.asarray(situation.seconds), seconds), "the seconds were changed"

    def test_says_what_candidates_are_worth_by_their_gains(self, policy: Policy) -> None:
        """Nothing, or a value for each; one without a gain is worth nothing."""
        for situation in self._situations():
            worth = policy.worth(situation.gains, situation.seconds)
            if worth is None:
                continue
            assert worth.shape == situation.gains.shape
            assert np.isnan(worth[np.isnan(situation.gains)]).all()

    def _situations(self) -> Iterator[Situation]:
        for seed in range(self.situations):
            yield situation_of(seed)


def situation_of(seed: int) -> Situation:
    """Return a situation: a few views taken, some candidates, of which some show too little."""
    random = np.random.default_rng(seed)

    def pose() -> Pose:
        return Pose.exp(random.uniform(-0.5, 0.5, 6))

    joints = [tuple(random.uniform(-1, 1, 6)) for _ in range(int(random.integers(1, 30)))]
    poses = [pose() for _ in joints]
    gains: FloatArray = random.exponential(1.0, len(joints))
    gains[random.uniform(size=len(gains)) < 0.4] = np.nan
    if np.isnan(gains).all():
        gains[int(random.integers(len(gains)))] = 0.1
    views = [View(f"v{i}", pose(), [0], [[1.0, 2.0]], joints_rad=joints[0]) for i in range(3)]
    seconds = None if seed % 3 == 0 else random.uniform(0.5, 5.0, len(gains))
    return Situation(views, Pool.of_poses(poses), gains, np.random.default_rng(seed), seconds)
