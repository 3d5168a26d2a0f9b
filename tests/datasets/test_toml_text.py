"""The TOML we write, read by Python's own reader."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handeye.datasets.toml_text import toml_text
from strategies import floats

TEXTS = st.text(st.characters(exclude_categories=("Cs",)), max_size=12)
SCALARS = TEXTS | st.booleans() | st.integers(-(2**63), 2**63 - 1) | floats(-1e308, 1e308)
LISTS = st.lists(SCALARS, max_size=3)
VALUES = SCALARS | LISTS | st.lists(st.lists(floats(-1e3, 1e3), max_size=3), max_size=3)
KEYS = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,8}", fullmatch=True)
TABLES = st.dictionaries(KEYS, VALUES, max_size=4)


@given(st.dictionaries(KEYS, VALUES | TABLES | st.lists(TABLES, min_size=1, max_size=3), max_size=5))
def test_everything_reads_back(document: dict[str, object]) -> None:
    assert tomllib.loads(toml_text(document)) == document


def test_a_matrix_has_a_line_per_row() -> None:
    assert toml_text({"T": [[1.0, 2.0], [3.0, 4.0]]}) == "T = [\n  [1.0, 2.0],\n  [3.0, 4.0],\n]\n"


def test_what_toml_lacks_is_refused() -> None:
    with pytest.raises(TypeError):
        toml_text({"a": None})
