"""The table of formats is complete, and the tests that it names exist."""

import ast
import re
from pathlib import Path

import pytest

from handeye.datasets import IMPORTERS
from handeye.datasets.camera_files import FORMATS
from handeye.export import EXPORTERS

TESTS = Path(__file__).resolve().parents[1]
PAGE = TESTS.parent / "docs" / "formats.md"
HEAD = ["format", "exported by", "checked against", "golden test", "hostile test", "round trip"]
# Beside those in the lists of the package: our own, and what is told by its folders or its name.
OURS = {"recording", "several cameras", "camera folders"}


def tables() -> list[list[list[str]]]:
    """The rows of each table, without its head."""
    found: list[list[list[str]]] = []
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")] if line.startswith("|") else []
        if cells == HEAD:
            found.append([])
        elif cells and not set(cells[0]) <= {"-"}:
            assert len(cells) == len(HEAD), line
            found[-1].append(cells)
    return found


def test_every_format_has_its_row() -> None:
    data, cameras, answers = ([row[0] for row in table] for table in tables())
    assert sorted(data) == sorted([*IMPORTERS, *OURS])
    assert sorted(cameras) == sorted([*(member.name for member in FORMATS), "ost.txt"])
    assert sorted(answers) == sorted(EXPORTERS)


@pytest.mark.parametrize("row", [row for table in tables() for row in table], ids=lambda row: row[0])
def test_every_format_has_its_tests(row: list[str]) -> None:
    name, exported, checked, golden, hostile, round_trip = row
    assert checked, name
    assert golden, name
    assert hostile, name
    assert round_trip or not exported, f"{name} is exported and nothing reads it back"
    for cell in (golden, hostile, round_trip):
        for path, function in re.findall(r"`([\w/]+\.py)::(\w+)`", cell):
            module = ast.parse((TESTS / path).read_text(encoding="utf-8"))
            assert function in {n.name for n in module.body if isinstance(n, ast.FunctionDef)}, cell
        assert not cell or "::" in cell, cell
