"""Take the pictures of the page that the documentation shows, in a real browser.

    .venv/bin/python tools/picture_of_page.py

Drives a simulated arm by hand and writes docs/images/page.png (wide) and page-narrow.png, then the page of a
simulated rig as page-rig.png. Needs chromium.
"""

import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from playwright.sync_api import expect  # noqa: E402

from browsers import NARROW, browser  # noqa: E402

Open = Callable[..., Any]
VIEWS, PATIENCE_MS = 6, 120_000
IMAGES = ROOT / "docs" / "images"


@contextmanager
def page_of(*arguments: str) -> Iterator[str]:
    """Run a command that shows a page; give its address."""
    process = subprocess.Popen(
        [sys.executable, "-m", "handeye", *arguments], stderr=subprocess.PIPE, text=True
    )
    try:
        assert process.stderr is not None
        found = re.search(r"http://\S+", process.stderr.readline())
        assert found is not None
        yield found[0]
    finally:
        process.kill()


def session(folder: Path, opened: Open) -> None:
    """Drive a session for some views and take the pictures while it waits."""
    asked = ("--robot", "ur5e", "--accuracy-mm", "0.15", "--accuracy-deg", "0.015")
    with page_of("run", "--session", str(folder / "s"), "--ui", *asked) as address:
        wide = opened(address, (1360, 900)).page
        for number in range(1, VIEWS + 1):
            waits = re.compile(rf"view_0{number}\.\d.*Waiting")
            expect(wide.locator("#state")).to_have_text(waits, timeout=PATIENCE_MS)
            wide.click("[data-action=go]")
        expect(wide.locator("#state")).to_have_text(re.compile("Waiting|Ended"), timeout=PATIENCE_MS)
        wide.wait_for_timeout(1000)
        wide.screenshot(path=IMAGES / "page.png", full_page=True)
        narrow = opened(address, NARROW).page
        narrow.wait_for_timeout(2000)
        narrow.screenshot(path=IMAGES / "page-narrow.png", full_page=True)


def rig(folder: Path, opened: Open) -> None:
    """Take the picture of a rig, with one view chosen."""
    subprocess.run([sys.executable, "-m", "handeye", "demo", "--rig", str(folder / "rig")], check=True)
    with page_of("solve", str(folder / "rig"), "--ui") as address:
        page = opened(address, (1360, 900)).page
        page.locator("#views button").nth(3).click(timeout=PATIENCE_MS)
        expect(page.locator("#picture-text")).to_contain_text("px RMS", timeout=PATIENCE_MS)
        page.wait_for_timeout(1000)
        page.screenshot(path=IMAGES / "page-rig.png", full_page=True)


def main() -> None:
    """Take all pictures."""
    with tempfile.TemporaryDirectory() as name, browser(Path(name)) as opened:
        session(Path(name), opened)
        rig(Path(name), opened)


if __name__ == "__main__":
    main()
