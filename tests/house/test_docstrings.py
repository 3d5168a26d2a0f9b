"""`help(handeye)` shows the way: every public name says what it is, with an example that runs."""

import doctest
import importlib
import inspect
import pkgutil
from pathlib import Path

import numpy as np
import pytest

import handeye

NAMES = [name for name in handeye.__all__ if not name.startswith("__")]
ROOMS = [
    module.name
    for module in pkgutil.iter_modules(handeye.__path__)
    if module.ispkg and module.name not in {"cli", "benchmarks"}
]
# Rooms whose names all have an example; the others have one where it helps.
WITH_EXAMPLES = {"types"}


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


@pytest.mark.parametrize("room", ROOMS)
def test_every_public_name_of_a_room_says_what_it_is_and_its_examples_run(
    room: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module(f"handeye.{room}")
    report: list[str] = []
    for name in getattr(module, "__all__", ()):
        value = getattr(module, name)
        if not (inspect.isclass(value) or inspect.isfunction(value)):
            continue
        text = value.__doc__
        assert text, f"{room}.{name} has no docstring"
        known = {**vars(module), "np": np} if room == "types" else {name: value}
        test = doctest.DocTestParser().get_doctest(
            inspect.cleandoc(text), known, f"{room}.{name}", None, None
        )
        assert test.examples or room not in WITH_EXAMPLES, f"{room}.{name} has no example"
        failed = doctest.DocTestRunner().run(test, out=report.append).failed
        assert failed == 0, "".join(report)
