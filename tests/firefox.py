"""Firefox for tests, driven by its own remote protocol (Marionette); skipped with a reason where there is none.

Each message is its length in bytes, a colon, and JSON: `[0, number, command, parameters]` there,
`[1, number, error, result]` back.
"""

import json
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")
PATIENCE_S = 120

needs_firefox = pytest.mark.skipif(FIREFOX is None, reason="needs firefox (apt-get install firefox-esr)")


class Firefox:
    """One window of a headless Firefox."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._number = 0
        self._receive()
        self._ask("WebDriver:NewSession", {})

    def open(self, address: str, size: tuple[int, int]) -> None:
        """Load a page in a window whose inside is of a size."""
        width, height = size
        for _ in range(2):
            self._ask("WebDriver:SetWindowRect", {"width": width, "height": height})
            inner = self.evaluate("[innerWidth, innerHeight]")
            width, height = width + size[0] - inner[0], height + size[1] - inner[1]
        self._ask("WebDriver:Navigate", {"url": address})

    def evaluate(self, expression: str) -> Any:
        """Return what an expression is worth in the page."""
        script = {"script": f"return {expression}", "args": []}
        return self._ask("WebDriver:ExecuteScript", script)["value"]

    def screenshot(self) -> str:
        """Return the whole page as a PNG, in base 64."""
        return self._ask("WebDriver:TakeScreenshot", {"full": True, "hash": False})["value"]

    def _ask(self, command: str, parameters: dict[str, Any]) -> Any:
        self._number += 1
        message = json.dumps([0, self._number, command, parameters]).encode()
        self._connection.sendall(b"%d:%s" % (len(message), message))
        _, _, error, result = self._receive()
        assert error is None, error
        return result

    def _receive(self) -> Any:
        size = b""
        while not size.endswith(b":"):
            size += self._connection.recv(1)
        message = b""
        while len(message) < int(size[:-1]):
            message += self._connection.recv(65536)
        return json.loads(message)


@contextmanager
def firefox(folder: Path) -> Iterator[Firefox]:
    """Give a Firefox with a new profile in `folder`."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    profile = folder / "firefox"
    profile.mkdir()
    (profile / "user.js").write_text(f'user_pref("marionette.port", {port});\n')
    command = [str(FIREFOX), "--headless", "--marionette", "--no-remote", "--profile", str(profile)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        with _connected(port) as connection:
            yield Firefox(connection)
    finally:
        process.terminate()
        process.wait(PATIENCE_S)


def _connected(port: int) -> socket.socket:
    until = time.monotonic() + PATIENCE_S
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S)
        except OSError:
            if time.monotonic() > until:
                raise
            time.sleep(0.2)
