"""`help(handeye)` shows the way: every public name says what it is, with an example that runs.

Public is what the reference documents: the `__all__` of the rooms that it lists, and the core's stub.
"""

import ast
import doctest
import importlib
import importlib.util
import inspect
from pathlib import Path
from typing import Any

import pytest

import documented
import handeye

ROOT = Path(__file__).resolve().parents[2]
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
NAMES = [name for name in handeye.__all__ if not name.startswith("__")]


def rooms() -> tuple[str, ...]:
    path = ROOT / "docs" / "_extensions" / "generated_reference.py"
    spec = importlib.util.spec_from_file_location("generated_reference", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.ROOMS


def public() -> list[tuple[str, str]]:
    """Room and name of every public class and function, each once."""
    found: dict[int, tuple[str, str]] = {}
    for room in rooms():
        module = importlib.import_module(room)
        for name in module.__all__:
            value = getattr(module, name)
            if inspect.isclass(value) or inspect.isfunction(value):
                found.setdefault(id(value), (room, name))
    return list(found.values())


PUBLIC = public()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("documented") / "folder"


@pytest.mark.parametrize(("room", "name"), PUBLIC, ids=[f"{room}.{name}" for room, name in PUBLIC])
def test_every_public_name_has_an_example_that_runs(
    room: str, name: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module(room)
    text = inspect.cleandoc(getattr(module, name).__doc__ or "")
    known = documented.names(module, folder)
    test = doctest.DocTestParser().get_doctest(text, known, f"{room}.{name}", None, None)
    assert any(not example.options.get(doctest.SKIP) for example in test.examples), "no example that is run"
    report: list[str] = []
    failed = doctest.DocTestRunner(optionflags=FLAGS).run(test, out=report.append).failed
    assert failed == 0, "".join(report)


FUNCTIONS = [
    (room, name) for room, name in PUBLIC if inspect.isfunction(getattr(importlib.import_module(room), name))
]


@pytest.mark.parametrize(("room", "name"), FUNCTIONS, ids=[f"{room}.{name}" for room, name in FUNCTIONS])
def test_functions_say_what_they_take_and_what_they_raise(room: str, name: str) -> None:
    value: Any = getattr(importlib.import_module(room), name)
    text = inspect.getdoc(value) or ""
    assert "Raises\n------" in text or "Raises nothing" in text
    assert len(inspect.signature(value).parameters) <= 1 or "Parameters\n----------" in text


def test_the_package_names_what_it_offers() -> None:
    text = inspect.getdoc(handeye) or ""
    assert "handeye.solve" in text
    for name in NAMES:
        assert name in text, f"help(handeye) does not mention {name}"


def test_everything_of_the_core_says_what_it_is() -> None:
    tree = ast.parse((ROOT / "python" / "handeye" / "_core.pyi").read_text())
    silent: list[str] = []
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            inner = node.body if isinstance(node, ast.ClassDef) else []
            members = [m for m in inner if isinstance(m, ast.FunctionDef) and not m.name.startswith("_")]
            silent += [node.name] * (ast.get_docstring(node) is None)
            silent += [f"{node.name}.{m.name}" for m in members if ast.get_docstring(m) is None]
    assert silent == []
