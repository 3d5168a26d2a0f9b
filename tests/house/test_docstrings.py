"""`help(handeye)` shows the way: every public name says what it is, with an example that runs."""

import doctest
import inspect
from pathlib import Path

import pytest

import handeye

NAMES = [name for name in handeye.__all__ if not name.startswith("__")]


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_has_an_example_that_runs(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    value = getattr(handeye, name)
    text = inspect.getdoc(value)
    assert text is not None
    test = doctest.DocTestParser().get_doctest(text, {name: value}, name, None, None)
    assert test.examples, f"{name} has no example"
    report: list[str] = []
    assert doctest.DocTestRunner().run(test, out=report.append).failed == 0, "".join(report)


@pytest.mark.parametrize("name", NAMES)
def test_functions_say_what_they_raise_and_what_shapes_they_take(name: str) -> None:
    value = getattr(handeye, name)
    text = inspect.getdoc(value) or ""
    if inspect.isfunction(value):
        assert "Raises\n------" in text
        assert len(inspect.signature(value).parameters) == 1 or "Parameters\n----------" in text


def test_the_package_names_what_it_offers() -> None:
    text = inspect.getdoc(handeye) or ""
    assert "handeye.solve" in text
    for name in NAMES:
        assert name in text, f"help(handeye) does not mention {name}"
