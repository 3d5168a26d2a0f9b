"""The one JSON object."""

import json
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handeye.cli.answer import json_text

plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=20,
)


@given(st.dictionaries(st.text(max_size=5), plain, max_size=5))
def test_reads_back(data: dict[str, Any]) -> None:
    assert json.loads(json_text(data)) == data


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_json_does_not_know_is_null(value: float) -> None:
    text = json_text({"a": value, "b": [value, {"c": value}]})
    assert json.loads(text) == {"a": None, "b": [None, {"c": None}]}


def test_a_row_has_one_line() -> None:
    text = json_text({"T": [[1.0, 0.0], [0.0, 1.0]], "names": ["a", "b"], "none": {}})
    lines = text.splitlines()
    assert "    [1.0, 0.0]," in lines
    assert '  "names": ["a", "b"],' in lines
    assert '  "none": {}' in lines


def test_tuples_are_lists() -> None:
    assert json.loads(json_text({"a": (1, 2)})) == {"a": [1, 2]}


def test_foreign_values_are_a_mistake() -> None:
    with pytest.raises(TypeError):
        json_text({"a": object()})
