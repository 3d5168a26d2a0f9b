"""Take the pictures of the page that the documentation shows, in a real browser.

    .venv/bin/python tools/picture_of_page.py

Drives a simulated arm by hand and writes docs/images/page.png (wide) and page-narrow.png. Needs chromium.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from playwright.sync_api import expect  # noqa: E402

from browsers import NARROW, browser  # noqa: E402

VIEWS = 6


def main() -> None:
    """Drive a session for some views and take the pictures while it waits."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        command = [sys.executable, "-m", "handeye", "run", "--session", str(folder / "s"), "--ui"]
        command += ["--robot", "ur5e", "--accuracy-mm", "0.15", "--accuracy-deg", "0.015"]
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        try:
            assert process.stderr is not None
            found = re.search(r"http://\S+", process.stderr.readline())
            assert found is not None
            with browser(folder) as opened:
                wide = opened(found[0], (1360, 900)).page
                for number in range(1, VIEWS + 1):
                    waits = re.compile(rf"view_0{number}\.\d.*Waiting")
                    expect(wide.locator("#state")).to_have_text(waits, timeout=60_000)
                    wide.click("[data-action=go]")
                expect(wide.locator("#state")).to_have_text(re.compile("Waiting|Ended"), timeout=60_000)
                wide.wait_for_timeout(1000)
                wide.screenshot(path=ROOT / "docs" / "images" / "page.png", full_page=True)
                narrow = opened(found[0], NARROW).page
                narrow.wait_for_timeout(2000)
                narrow.screenshot(path=ROOT / "docs" / "images" / "page-narrow.png", full_page=True)
        finally:
            process.kill()


if __name__ == "__main__":
    main()
