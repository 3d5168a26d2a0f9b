"""What every stop rule must do."""

import json
from collections.abc import Iterator

import numpy as np

from handeye.planning import Stop, StopRule
from handeye.planning.stopping import State


class StopRuleTests:
    """Subclass it and give the fixtures `rule`, one of yours, and `state`, in which it says to stop.

    `handeye.testing.MockCell.state()` makes states of any number of views.

    Examples
    --------
    >>> class TestMine(StopRuleTests):  # with the fixtures `rule` and `state`
    ...     pass
    >>> hasattr(TestMine, "test_stops_with_a_reason")
    True
    """

    def test_stops_with_a_reason(self, rule: StopRule, state: State) -> None:
        """A sentence for a person, and evidence that JSON can hold."""
        stop = rule.verdict(state)
        assert isinstance(stop, Stop), f"{stop!r}, expected Stop"
        assert stop.sentence.strip()
        assert "\n" not in stop.sentence
        assert stop.evidence, "what was measured is missing"
        json.dumps(stop.evidence, allow_nan=False)

    def test_says_the_same_twice(self, rule: StopRule, state: State) -> None:
        """It has no memory: a session that is resumed ends where it would have ended."""
        assert rule.verdict(state) == rule.verdict(state)

    def test_survives_candidates_without_a_gain(self, rule: StopRule, state: State) -> None:
        """A pool in which nothing shows enough is no mistake."""
        for gains in self._gains():
            answer = rule.verdict(State(state.measurements, state.estimate, gains))
            assert answer is None or isinstance(answer, Stop)

    def _gains(self) -> Iterator[np.ndarray]:
        yield np.zeros(0)
        yield np.full(3, np.nan)
        yield np.array([np.nan, 1.0])
