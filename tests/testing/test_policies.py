"""The shipped tests of policies, stop rules: ours pass, and each rule finds the member that breaks it."""

import numpy as np
import pytest

from handeye.planning import (
    POLICIES,
    Accuracy,
    GainThreshold,
    NumberOfViews,
    Policy,
    Stop,
    StopRule,
    ToolAccuracy,
)
from handeye.planning.policies import Choice, NextBestView, Situation
from handeye.planning.stopping import State, StopReason
from handeye.testing import MockCell, PolicyTests, StopRuleTests
from handeye.types.arrays import FloatArray
from rules import rules_of


class TestOurs(PolicyTests):
    @pytest.fixture(params=list(POLICIES.values()), ids=list(POLICIES))
    def policy(self, request: pytest.FixtureRequest) -> Policy:
        return request.param()


class Mine(NextBestView):
    name = "mine"


class TakenName(Policy):
    name = "random"

    def choose(self, situation: Situation) -> Choice:
        return Choice(int(situation.feasible[0]), 0.0)


class First(Mine):
    def choose(self, situation: Situation) -> Choice:
        return Choice(0, 0.0)


class OwnChance(Mine):
    def __init__(self) -> None:
        self.random = np.random.default_rng(0)

    def choose(self, situation: Situation) -> Choice:
        return Choice(int(self.random.choice(situation.feasible)), 0.0)


class Scribbles(Mine):
    def choose(self, situation: Situation) -> Choice:
        choice = super().choose(situation)
        situation.gains[choice.index] = 0.0
        return choice


class NoScore(Mine):
    def choose(self, situation: Situation) -> Choice:
        return Choice(super().choose(situation).index, float("nan"))


class OneWorth(Mine):
    def worth(self, gains: FloatArray, seconds: FloatArray | None) -> FloatArray:
        return np.zeros(1)


class WorthWithoutGain(Mine):
    def worth(self, gains: FloatArray, seconds: FloatArray | None) -> FloatArray:
        return np.nan_to_num(gains)


BROKEN = [
    (TakenName, "test_has_a_name_of_its_own"),
    (First, "test_takes_a_candidate_that_shows_enough"),
    (NoScore, "test_takes_a_candidate_that_shows_enough"),
    (OwnChance, "test_the_same_chance_makes_the_same_choice"),
    (Scribbles, "test_leaves_the_situation_as_it_is"),
    (OneWorth, "test_says_what_candidates_are_worth_by_their_gains"),
    (WorthWithoutGain, "test_says_what_candidates_are_worth_by_their_gains"),
]


@pytest.mark.parametrize(("policy", "rule"), BROKEN)
def test_each_rule_finds_the_policy_that_breaks_it(policy: type[Policy], rule: str) -> None:
    getattr(PolicyTests(), rule)(Mine())
    with pytest.raises(AssertionError):
        getattr(PolicyTests(), rule)(policy())


@pytest.fixture(scope="module")
def eight() -> State:
    return MockCell(points_only=True).state(8)


RULES = [NumberOfViews(4), GainThreshold(99.0), Accuracy(99.0, 99.0), ToolAccuracy(np.zeros((1, 3)), 99.0)]


class TestOurStopRules(StopRuleTests):
    @pytest.fixture(params=RULES, ids=[type(rule).__name__ for rule in RULES])
    def rule(self, request: pytest.FixtureRequest) -> StopRule:
        return request.param

    @pytest.fixture
    def state(self, eight: State) -> State:
        return eight


class Mute(StopRule):
    def verdict(self, state: State) -> Stop | None:
        return Stop(StopReason.VIEWS_TAKEN, " ", {"views": state.views})


class WithoutEvidence(StopRule):
    def verdict(self, state: State) -> Stop | None:
        return Stop(StopReason.VIEWS_TAKEN, "enough")


class Forgetful(StopRule):
    def verdict(self, state: State) -> Stop | None:
        self.asked = getattr(self, "asked", 0) + 1
        return Stop(StopReason.VIEWS_TAKEN, "enough", {"asked": self.asked})


class Greedy(StopRule):
    def verdict(self, state: State) -> Stop | None:
        return Stop(StopReason.VIEWS_TAKEN, "enough", {"best": int(np.nanargmax(state.gains))})


BROKEN_RULES = [
    (Mute(), "test_stops_with_a_reason"),
    (WithoutEvidence(), "test_stops_with_a_reason"),
    (Forgetful(), "test_says_the_same_twice"),
    (Greedy(), "test_survives_candidates_without_a_gain"),
]


@pytest.mark.parametrize(("rule", "name"), BROKEN_RULES)
def test_each_rule_finds_the_stop_rule_that_breaks_it(rule: StopRule, name: str, eight: State) -> None:
    with pytest.raises((AssertionError, ValueError)):
        getattr(StopRuleTests(), name)(rule, eight)


def test_every_rule_of_policies_is_broken_by_somebody() -> None:
    assert {rule for _, rule in BROKEN} == rules_of(PolicyTests)


def test_every_rule_of_stop_rules_is_broken_by_somebody() -> None:
    assert {rule for _, rule in BROKEN_RULES} == rules_of(StopRuleTests)
