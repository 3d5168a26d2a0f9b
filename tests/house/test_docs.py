"""The documentation builds without a warning and reads without a network."""

import re
from pathlib import Path

LOADED_FROM_ELSEWHERE = re.compile(
    r"""<(?:script|link|img|iframe|source)\b[^>]*\b(?:src|href)=["'](?:https?:)?//|url\(["']?(?:https?:)?//|@import"""
)


def test_pages_load_nothing_from_elsewhere(html: Path) -> None:
    found = [
        f"{path.relative_to(html)}: {match.group()}"
        for path in [*html.rglob("*.html"), *html.rglob("*.css")]
        for match in LOADED_FROM_ELSEWHERE.finditer(path.read_text())
    ]
    assert not found, "\n".join(found)


def test_formulas_are_written_as_mathml(html: Path) -> None:
    assert "<math" in (html / "conventions.html").read_text()
