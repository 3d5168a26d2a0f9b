"""Every code that the package raises is a member of the list, with wording, advice and a place on the page."""

import ast
import importlib.util
from collections.abc import Iterator
from pathlib import Path

import pytest

from handeye.codes import Code, advice
from handeye.errors import DeviceError

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "python" / "handeye"
NAMES = ("code", "default_code", "BAD_FRAME", "BAD_IMAGE", "BAD_READING", "BAD_STAMP")


def words(value: ast.expr | None) -> Iterator[str]:
    """The words that an expression can be."""
    if isinstance(value, ast.Constant) and isinstance(value.value, str):
        yield value.value
    elif isinstance(value, ast.IfExp):
        yield from words(value.body)
        yield from words(value.orelse)
    elif isinstance(value, ast.Tuple):
        for one in value.elts[:1]:
            yield from words(one)
    elif isinstance(value, ast.Attribute) and ast.unparse(value.value) == "Code":
        yield Code[value.attr]


def raised(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            for keyword in node.keywords:
                if keyword.arg == "code":
                    yield from words(keyword.value)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            named = target.elts[0] if isinstance(target, ast.Tuple) else target
            if isinstance(named, ast.Name) and named.id in NAMES:
                yield from words(node.value)


def all_raised() -> dict[str, Path]:
    """Where each word is given, but for the codes of data faults, which have pages of their own."""
    faults = PACKAGE / "estimation" / "faults" / "kinds"
    files = (p for p in sorted(PACKAGE.rglob("*.py")) if p.name != "codes.py" and faults not in p.parents)
    return {str(word): path for path in files for word in raised(path)}


def test_each_code_raised_is_a_member_and_each_member_is_raised() -> None:
    found = all_raised()
    assert {word: path for word, path in found.items() if word not in set(map(str, Code))} == {}
    assert set(map(str, Code)) - set(found) == set()


@pytest.mark.parametrize("code", Code)
def test_each_has_wording_and_advice(code: Code) -> None:
    assert code == code.name.lower()
    for text in (code.meaning, code.advice):
        assert len(text.split()) > 1
        assert not text.endswith(".")
        assert "|" not in text
    assert code.meaning != code.advice


def test_each_stands_on_the_page_once() -> None:
    path = ROOT / "docs" / "_extensions" / "generated_reference.py"
    spec = importlib.util.spec_from_file_location("generated_reference", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    page: str = module.codes_page()
    for code in Code:
        assert page.count(f"\n| `{code}` |") == 1


def test_drivers_of_other_packages_may_have_words_of_their_own() -> None:
    error = DeviceError("the lamp is off", code="lamp_off")
    assert error.code == "lamp_off"
    assert advice(error.code) is None
    assert advice("missing_file") == Code.MISSING_FILE.advice
