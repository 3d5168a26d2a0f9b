"""Every link of the built documentation leads somewhere, and every page reads well in a real browser."""

import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest

from browsers import NARROW, browser, needs_browser, serious


class Page(HTMLParser):
    """Links and anchors of one page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.anchors |= {v for v in (values.get("id"), values.get("name")) if v}
        self.links += [v for v in (values.get("href"), values.get("src")) if v]


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with browser(tmp_path_factory.mktemp("browser")) as open_window:
        yield open_window


def test_no_link_is_dead(html: Path) -> None:
    pages = {path.resolve(): Page(path.read_text()) for path in html.rglob("*.html")}
    dead: list[str] = []
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            anchors = pages[target].anchors if target in pages else set()
            if not target.exists() or (target in pages and parts.fragment and parts.fragment not in anchors):
                dead.append(f"{path.relative_to(html.resolve())}: {link}")
    assert not dead, "\n".join(dead)
    assert len(pages) > 30


def test_every_page_can_be_reached_from_the_first(html: Path) -> None:
    reached, left = set[Path](), [(html / "index.html").resolve()]
    while left:
        path = left.pop()
        if path in reached or path.suffix != ".html" or not path.exists():
            continue
        reached.add(path)
        links = [urlsplit(link) for link in Page(path.read_text()).links]
        left += [(path.parent / unquote(p.path)).resolve() for p in links if not p.scheme and p.path]
    own = {p.resolve() for p in html.rglob("*.html") if p.name not in {"search.html", "genindex.html"}}
    assert own <= reached, [str(p) for p in own - reached]


def test_the_reference_is_made_from_the_code(html: Path) -> None:
    python = (html / "reference" / "python.html").read_text()
    for name in ("handeye.solve", "handeye.Pose", "handeye.open_folder"):
        assert f">{name}<" in python
    commands = re.sub(r"<[^>]+>", "", (html / "reference" / "command-line.html").read_text())
    assert "handeye solve" in commands
    assert "--camera-fixed" in commands
    assert "se3_exp" in (html / "reference" / "core.html").read_text()


@needs_browser
def test_every_page_reads_well(html: Path, opened: Any) -> None:
    window, bad = opened((html / "index.html").as_uri(), NARROW), dict[str, object]()
    for path in sorted(html.rglob("*.html")):
        window.page.goto(path.as_uri())
        wide = window.page.evaluate("document.documentElement.scrollWidth") > NARROW[0] + 1
        found = serious(window)
        if wide or found:
            bad[str(path.relative_to(html))] = (wide, found)
    assert bad == {}
