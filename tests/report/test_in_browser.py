"""The report in a real browser: readable on a telephone, two pages on paper, no label over another."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from browsers import NARROW, WIDE, browser, needs_browser
from commands import Handeye
from handeye.datasets import write_rig
from handeye.datasets.shipped import shipped_recording
from handeye.session.configuration import begin, prepare
from handeye.simulation.cells import ErrorKind
from handeye.simulation.rigs import simulate_rig
from sessions import configured

pytestmark = needs_browser
COLLISIONS = """[...document.querySelectorAll('svg')].flatMap(svg => {
    const labels = [...svg.querySelectorAll('text')].map(e => [e.getBoundingClientRect(), e.textContent]);
    return labels.flatMap(([a, one], i) => labels.slice(i + 1).filter(([b]) =>
        a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 2 && b.top < a.bottom - 2
    ).map(([, other]) => `${one} | ${other}`));
})"""

# Names that stand letter below letter.
SQUEEZED = """[...document.querySelectorAll('.poses th')].filter(e => e.getBoundingClientRect().height > 80)
    .map(e => e.textContent)"""


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with browser(tmp_path_factory.mktemp("browser")) as open_window:
        yield open_window


@pytest.fixture
def report(request: pytest.FixtureRequest, handeye: Handeye, tmp_path: Path) -> str:
    folder: Path = shipped_recording()
    if request.param == "rig":
        folder = tmp_path / "rig"
        write_rig(simulate_rig(ErrorKind.WHITE_FLANGE, 2), folder)
    elif request.param != "recording":
        folder = tmp_path / "s"
        session, store = begin(prepare(configured(2, mounting=request.param)), folder)
        session.run()
        store.close()
    outcome = handeye("report", folder, "--output", tmp_path / "report.html")
    assert outcome.code == 0, outcome.err
    return (tmp_path / "report.html").as_uri()


@pytest.mark.parametrize("report", ["recording", "eye_in_hand", "eye_to_hand", "rig"], indirect=True)
def test_it_reads_well_at_any_size_and_on_paper(report: str, opened: Any) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-playwright-python")
    for size in (NARROW, WIDE):
        window = opened(report, size)
        assert window.page.evaluate("document.documentElement.scrollWidth") <= size[0]
        assert window.page.evaluate(COLLISIONS) == []
        assert window.page.evaluate(SQUEEZED) == []
        assert [v["id"] for v in axe.Axe().run(window.page).response["violations"]] == []
        window.check()
    pages = re.findall(rb"/Type\s*/Page[^s]", window.page.pdf(format="A4"))
    assert 1 <= len(pages) <= 2
