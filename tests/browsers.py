"""A real browser for tests: Debian's Chromium, driven by Playwright; skipped with a reason where there is none."""

import importlib.util
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
WIDE, NARROW = (1360, 900), (400, 820)
SERIOUS = {"serious", "critical"}

needs_browser = pytest.mark.skipif(
    CHROMIUM is None or importlib.util.find_spec("playwright") is None,
    reason="needs chromium (apt-get install chromium) and playwright, which make test installs",
)


class Window:
    """A page of the browser that remembers what went wrong in it and which hosts it asked."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.errors: list[str] = []
        self.hosts: set[str] = set()
        page.on("console", lambda m: self.errors.append(m.text) if m.type in {"error", "warning"} else None)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("request", lambda request: self._asked(request.url))

    def _asked(self, url: str) -> None:
        if urlsplit(url).scheme not in {"data", "blob", "file"}:
            self.hosts.add(urlsplit(url).hostname or "")

    def check(self) -> None:
        """Nothing was complained about, and nobody but this machine was asked."""
        assert self.errors == []
        assert self.hosts <= {"127.0.0.1"}


def serious(window: Window) -> list[tuple[str, str]]:
    """Return what keeps people from reading or using what a window shows: the rule of axe, and where."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-playwright-python")
    found = axe.Axe().run(window.page).response["violations"]
    return [(v["id"], v["nodes"][0]["html"][:200]) for v in found if v["impact"] in SERIOUS]


@contextmanager
def browser(folder: Path) -> Iterator[Any]:
    """Give a function that opens a window of a size at an address; a new profile in `folder`."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        context = playwright.chromium.launch_persistent_context(
            str(folder / "profile"), executable_path=CHROMIUM, headless=True, args=FLAGS
        )
        try:

            def opened(address: str, size: tuple[int, int] = WIDE) -> Window:
                page = context.new_page()
                page.set_viewport_size({"width": size[0], "height": size[1]})
                window = Window(page)
                page.goto(address)
                return window

            yield opened
        finally:
            context.close()
