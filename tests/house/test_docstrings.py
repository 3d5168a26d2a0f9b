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
from handeye import _core

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


def run_examples(name: str, text: str, known: dict[str, Any]) -> None:
    test = doctest.DocTestParser().get_doctest(inspect.cleandoc(text), known, name, None, None)
    assert any(not example.options.get(doctest.SKIP) for example in test.examples), "no example that is run"
    report: list[str] = []
    failed = doctest.DocTestRunner(optionflags=FLAGS).run(test, out=report.append).failed
    assert failed == 0, "".join(report)


@pytest.mark.parametrize(("room", "name"), PUBLIC, ids=[f"{room}.{name}" for room, name in PUBLIC])
def test_every_public_name_has_an_example_that_runs(
    room: str, name: str, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module(room)
    known = documented.names(module, folder)
    run_examples(f"{room}.{name}", getattr(module, name).__doc__ or "", known)


FUNCTIONS = [
    (room, name) for room, name in PUBLIC if inspect.isfunction(getattr(importlib.import_module(room), name))
]


# What cannot fail whatever it is given that its types allow: of others the section Raises is asked for.
NEVER_RAISES = {
    "clutter",
    "detect_all",
    "drawn_over",
    "is_session",
    "make_estimator",
    "recording_warnings",
    "relabeled",
    "rig_warnings",
    "shipped_arms",
    "shown_board",
    "to_calibration",
    "without_lengths",
}


@pytest.mark.parametrize(("room", "name"), FUNCTIONS, ids=[f"{room}.{name}" for room, name in FUNCTIONS])
def test_functions_say_what_they_take_and_what_they_raise(room: str, name: str) -> None:
    value: Any = getattr(importlib.import_module(room), name)
    text = inspect.getdoc(value) or ""
    assert ("Raises\n------" in text) is (name not in NEVER_RAISES)
    assert len(inspect.signature(value).parameters) <= 1 or "Parameters\n----------" in text


def test_the_package_names_what_it_offers() -> None:
    text = inspect.getdoc(handeye) or ""
    assert "handeye.solve" in text
    for name in NAMES:
        assert name in text, f"help(handeye) does not mention {name}"


STUB = ast.parse((ROOT / "python" / "handeye" / "_core.pyi").read_text())
CORE = [
    node
    for node in STUB.body
    if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_")
]


@pytest.mark.parametrize("node", CORE, ids=lambda node: node.name)
def test_everything_of_the_core_has_an_example_that_runs(node: ast.ClassDef, folder: Path) -> None:
    known = documented.names(handeye, folder) | {"_core": _core}
    run_examples(f"handeye._core.{node.name}", ast.get_docstring(node) or "", known)


def test_everything_of_the_core_says_what_it_is() -> None:
    silent = [
        f"{node.name}.{member.name}"
        for node in CORE
        if isinstance(node, ast.ClassDef)
        for member in node.body
        if isinstance(member, ast.FunctionDef) and not member.name.startswith("_")
        if ast.get_docstring(member) is None
    ]
    assert silent == []
