"""The documentation builds without a warning and reads without a network."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LOADED_FROM_ELSEWHERE = re.compile(
    r"""<(?:script|link|img|iframe|source)\b[^>]*\b(?:src|href)=["'](?:https?:)?//|url\(["']?(?:https?:)?//|@import"""
)


@pytest.fixture(scope="module")
def html(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("sphinx", reason="the documentation tools are not installed")
    folder = tmp_path_factory.mktemp("html")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"]
    command += ["-d", str(folder / "doctrees"), str(ROOT / "docs"), str(folder / "pages")]
    build = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert build.returncode == 0, build.stderr
    return folder / "pages"


def test_pages_load_nothing_from_elsewhere(html: Path) -> None:
    found = [
        f"{path.relative_to(html)}: {match.group()}"
        for path in [*html.rglob("*.html"), *html.rglob("*.css")]
        for match in LOADED_FROM_ELSEWHERE.finditer(path.read_text())
    ]
    assert not found, "\n".join(found)


def test_formulas_are_written_as_mathml(html: Path) -> None:
    assert "<math" in (html / "conventions.html").read_text()
