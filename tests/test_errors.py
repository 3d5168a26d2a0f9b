"""The family of errors and its exit codes."""

import pickle

import pytest

from handeye import errors


def test_every_error_has_its_own_exit_code_and_word() -> None:
    family = [e for e in errors.HandeyeError.__subclasses__() if e.__module__ == errors.__name__]
    assert {(e.__name__, int(e.exit_code)) for e in family} == {
        ("InputError", 3),
        ("DegenerateError", 4),
        ("DetectionError", 5),
        ("SolveError", 6),
        ("OutputError", 7),
        ("DeviceError", 8),
    }
    assert len({e.default_code for e in family}) == len(family)


def test_an_error_carries_what_it_was_given() -> None:
    error = errors.InputError("12 poses but 11 images", code="count_mismatch", hint="pair them by name")
    assert (str(error), error.message) == ("12 poses but 11 images",) * 2
    assert (error.code, error.hint) == ("count_mismatch", "pair them by name")
    assert errors.InputError("x").code == "invalid_input"


@pytest.mark.parametrize("kind", errors.HandeyeError.__subclasses__())
def test_errors_survive_the_way_between_processes(kind: type[errors.HandeyeError]) -> None:
    error = pickle.loads(pickle.dumps(kind("what", code="word", hint="do this")))
    assert type(error) is kind
    assert (str(error), error.code, error.hint) == ("what", "word", "do this")
