"""Formulas read well in real browsers: brackets as high as what they hold, nothing beyond the page."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from browsers import NARROW, WIDE, browser, needs_browser
from firefox import firefox, needs_firefox

Ask = Callable[[str, tuple[int, int], str], Any]
# Of brackets drawn as borders: height, style, rows, and height of the letters. Of those of a stated size: height,
# and the least stated. Of bars: from their far side to what they hold.
MEASURED = """(() => {
    const height = e => e.getBoundingClientRect().height;
    const letters = e => parseFloat(getComputedStyle(e).fontSize);
    const all = text => [...document.querySelectorAll(text)];
    const values = e => e.getAttribute('form') === 'prefix'
        ? e.nextElementSibling.getBoundingClientRect().left - e.getBoundingClientRect().left
        : e.getBoundingClientRect().right - e.previousElementSibling.getBoundingClientRect().right;
    return {
        matrices: all('mtable.matrix').map(e =>
            [height(e), getComputedStyle(e).borderLeftStyle, e.querySelectorAll('mtr').length, letters(e)]),
        sized: all('mo[minsize]').map(e => [height(e), parseFloat(e.getAttribute('minsize')) * letters(e)]),
        bars: all('math mo').filter(e => e.textContent === '|').map(values),
        wide: document.documentElement.scrollWidth - innerWidth,
        formulas: all('math').map(height),
    };
})()"""


@pytest.fixture(
    scope="module",
    params=[
        pytest.param("chromium", marks=needs_browser),
        pytest.param("firefox", marks=needs_firefox),
    ],
)
def ask(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ask]:
    folder = tmp_path_factory.mktemp("browser")
    if request.param == "firefox":
        with firefox(folder) as one:

            def in_firefox(address: str, size: tuple[int, int], expression: str) -> Any:
                one.open(address, size)
                return one.evaluate(expression)

            yield in_firefox
        return
    with browser(folder) as opened:
        yield lambda address, size, expression: opened(address, size).page.evaluate(expression)


@pytest.mark.parametrize("size", [NARROW, WIDE], ids=["narrow", "wide"])
def test_formulas_read_well(html: Path, ask: Ask, size: tuple[int, int]) -> None:
    counted = dict.fromkeys(("matrices", "sized", "bars", "formulas"), 0)
    for path in sorted(html.rglob("*.html")):
        if "<math" not in path.read_text():
            continue
        found = ask(path.as_uri(), size, MEASURED)
        for name in counted:
            counted[name] += len(found[name])
        assert found["wide"] <= 1, path.name
        assert min(found["formulas"]) > 5  # px: none is empty
        for height, style, rows, letters in found["matrices"]:
            assert style == "solid"
            assert height > 1.15 * rows * letters
        for height, least in found["sized"]:
            assert height > 0.95 * least, path.name
        for room in found["bars"]:
            assert 2 < room < 7.8, path.name  # px; with the room of an operator it is 8 or more
    assert min(counted.values()) > 0, counted
