"""Outlines of patterns of cells."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from handeye.printing.outline import outline
from ink import is_inside

Bits = NDArray[np.bool_]


@st.composite
def patterns(draw: st.DrawFn) -> Bits:
    rows, columns = draw(st.integers(1, 7)), draw(st.integers(1, 7))
    cells = draw(st.lists(st.booleans(), min_size=rows * columns, max_size=rows * columns))
    return np.array(cells).reshape(rows, columns)


def filled(dark: Bits) -> Bits:
    """What the outline fills, looked at in the middle of every cell and of those around."""
    rows, columns = dark.shape
    y, x = np.meshgrid(np.arange(-1, rows + 1) + 0.5, np.arange(-1, columns + 1) + 0.5, indexing="ij")
    return is_inside(outline(dark), np.column_stack([x.ravel(), y.ravel()])).reshape(y.shape)


@given(patterns())
def test_outline_fills_what_is_dark(dark: Bits) -> None:
    np.testing.assert_array_equal(filled(dark), np.pad(dark, 1))


@given(patterns())
def test_loops_are_upright_and_enclose_the_area_once(dark: Bits) -> None:
    area = 0.0
    for loop in outline(dark):
        steps = np.roll(loop, -1, axis=0) - loop
        assert ((steps == 0).sum(axis=1) == 1).all()  # along the axes, no corner twice
        assert (steps[:, 0] * np.roll(steps[:, 0], -1) == 0).all()  # every corner turns
        x, y = loop.T
        area += float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2
    assert area == dark.sum()  # holes count negative, and nothing is covered twice


@pytest.mark.parametrize("dark", [np.eye(2, dtype=bool), ~np.eye(2, dtype=bool)])
def test_cells_that_touch_at_a_corner_stay_apart(dark: Bits) -> None:
    assert [len(loop) for loop in outline(dark)] == [4, 4]


def test_nothing_dark_has_no_outline() -> None:
    assert outline(np.zeros((3, 2), dtype=bool)) == []
