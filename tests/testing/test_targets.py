"""The shipped tests of targets: ours pass, and each rule finds the family that breaks it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest

from handeye.testing import TargetTests
from handeye.types import Chessboard, Target
from handeye.types.arrays import FloatArray
from rules import rules_of

BOARDS = [member.usual(0.03, {}) for member in Target.members.values()]


class TestOurs(TargetTests):
    @pytest.fixture(params=BOARDS, ids=[board.family for board in BOARDS])
    def target(self, request: pytest.FixtureRequest) -> Target:
        return request.param


@dataclass(frozen=True)
class Board(Chessboard):
    """A chessboard; those below spoil it."""


class Shifted(Board):
    def _layout(self) -> FloatArray:
        return super()._layout() + 0.01


class Stacked(Board):
    def _layout(self) -> FloatArray:
        layout = super()._layout().copy()
        layout[1] = layout[0]
        return layout


class Stretched(Board):
    def _layout(self) -> FloatArray:
        return super()._layout() * [1.02, 1.0]


class Speechless(Board):
    @property
    def caption(self) -> str:
        return "two\nlines"


class Lossy(Board):
    def to_dict(self) -> dict[str, Any]:
        return super().to_dict() | {"rows": self.rows + 1}


class Credulous(Board):
    def __post_init__(self) -> None:
        pass


@dataclass
class Changing:
    family: ClassVar[str] = "changing"
    scale: ClassVar[str] = "pitch_m"
    usual_measures: ClassVar[Mapping[str, Any]] = {}
    pitch_m: float = 0.02
    __hash__ = object.__hash__

    def changed(self, **measures: Any) -> "Changing":
        return replace(self, **measures)


class HalfTurned(Board):
    @property
    def symmetries(self) -> tuple[Any, ...]:
        return (np.arange(self.point_count)[::-1],)


BROKEN = [
    (Changing, "test_cannot_be_changed"),
    (Lossy, "test_is_written_and_read_back"),
    (Shifted, "test_points_lie_flat_and_apart"),
    (Stacked, "test_points_lie_flat_and_apart"),
    (HalfTurned, "test_symmetries_are_turns_onto_itself"),
    (Speechless, "test_describes_itself_in_a_line"),
    (Credulous, "test_refuses_measures_that_cannot_be"),
    (Stretched, "test_its_points_are_found_in_its_picture"),
]


@pytest.mark.parametrize(("family", "rule"), BROKEN)
def test_each_rule_finds_the_family_that_breaks_it(family: type, rule: str, spared: None) -> None:
    target = family() if family is Changing else family(7, 10, 0.02)
    arguments = (target, -1.0) if rule == "test_refuses_measures_that_cannot_be" else (target,)
    with pytest.raises((AssertionError, pytest.fail.Exception)):
        getattr(TargetTests(), rule)(*arguments)


@pytest.fixture
def spared() -> Iterator[None]:
    """Leave the list of families as it was."""
    before = dict(Target.members)
    yield
    Target.members.clear()
    Target.members.update(before)


def test_every_rule_of_targets_is_broken_by_somebody() -> None:
    assert {rule for _, rule in BROKEN} == rules_of(TargetTests)
