"""The server behind the page: the standard library's, on the loopback, for a few people.

Every answer is JSON, a picture, or one of the files beside this module. A page that another site has open in
the same browser must not be able to drive an arm: a request must name this host, and one that changes
something must come from this page. Beyond the loopback everything needs the token.
"""

import hmac
import ipaddress
import json
import secrets
import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any, Protocol, cast
from urllib.parse import parse_qs, unquote, urlsplit

from handeye.codes import Code
from handeye.errors import HandeyeError, InputError, OutputError
from handeye.ui.hub import Command, Hub, described

LOOPBACK = "127.0.0.1"
MAX_COMMAND_BYTES, MAX_PICTURE_BYTES = 64 << 10, 64 << 20
# A stream that is quiet this long says that it is still there.
_BEAT_S = 2.0
_TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
_FILES = frozenset({"index.html", "app.js", "scene.js", "charts.js", "panels.js", "style.css", "icon.svg"})
_POLICY = (
    "default-src 'self'; img-src 'self' blob: data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)

Upload = Callable[[bytes], str]


class Pictures(Protocol):
    """Gives pictures as JPEG, and what is drawn over those of views."""

    def picture(self, number: int) -> bytes | None:
        """Return the last picture, if it has that number."""
        ...

    def view(self, name: str) -> dict[str, Any] | None:
        """Return what is drawn over the picture of a view."""
        ...

    def view_picture(self, name: str) -> bytes | None:
        """Return the picture of a view."""
        ...


class Server:
    """Serves a hub's documents until it is closed.

    Parameters
    ----------
    hub
        What is shown, and where commands go.
    host
        Address to listen on; beyond the loopback a token is asked for.
    port
        0 for any that is free.
    pictures
        Gives the pictures.
    upload
        Takes the bytes of a picture that was brought; returns what is said about it.

    Raises
    ------
    OutputError
        The address cannot be listened on.
    """

    def __init__(
        self,
        hub: Hub,
        host: str = LOOPBACK,
        port: int = 0,
        *,
        pictures: Pictures | None = None,
        upload: Upload | None = None,
    ) -> None:
        self.hub = hub
        self.token = None if _is_loopback(host) else secrets.token_urlsafe(24)
        self.pictures, self.upload = pictures, upload
        try:
            self._server = _Http((host, port), _Handler)
        except (OSError, OverflowError) as error:
            raise OutputError(
                f"the page cannot be served at {host}:{port}: {error}",
                code=Code.ADDRESS,
                hint="choose another --ui-port, or an address of this machine",
            ) from error
        self._server.owner = self
        self.host, self.port = host, int(self._server.server_address[1])
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(0.25,), name="page", daemon=True
        )
        self._thread.start()

    @property
    def address(self) -> str:
        """Where the page is, with the token if there is one."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        token = "" if self.token is None else f"?token={self.token}"
        return f"http://{host}:{self.port}/{token}"

    def close(self) -> None:
        """Stop serving."""
        self.hub.close()
        self._server.shutdown()
        self._server.server_close()


class _Http(ThreadingHTTPServer):
    daemon_threads = True
    owner: Server

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401
        """Say nothing: a browser that goes away in the middle is no news."""


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "handeye", ""
    timeout = 60

    @property
    def _owner(self) -> Server:
        return cast("_Http", self.server).owner

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002, ANN401 - as the base has it
        """Say nothing."""

    def do_GET(self) -> None:
        """Answer with a file, a document, a picture, or the stream of versions."""
        parts = urlsplit(self.path)
        asked = parse_qs(parts.query)
        if not self._admitted(asked.get("token", [""])[0]):
            return
        if self._owner.token is not None and "token" in asked:
            self._redirected()
            return
        first, _, rest = parts.path.strip("/").partition("/")
        if first == "" or first in _FILES:
            self._file(first or "index.html")
        elif first == "events":
            self._events(asked.get("page", [""])[0])
        elif first == "document":
            with self._charged(rest):
                self._guarded(lambda: self._send(self._owner.hub.document(rest), "application/json"))
        elif self._owner.pictures is not None and first in {"picture", "view", "view_picture"}:
            with self._charged("picture"):
                self._pictured(self._owner.pictures, first, unquote(rest))
        else:
            self._refuse(HTTPStatus.NOT_FOUND, "nothing here")

    def _pictured(self, pictures: Pictures, kind: str, name: str) -> None:
        if kind == "view":
            drawn = pictures.view(name)
            content = None if drawn is None else json.dumps(drawn, allow_nan=False).encode()
        elif kind == "view_picture":
            content = pictures.view_picture(name)
        else:
            content = pictures.picture(int(name)) if name.isdecimal() and len(name) < 10 else None
        if content is None:
            self._refuse(HTTPStatus.NOT_FOUND, "no such picture")
        else:
            self._send(content, "application/json" if kind == "view" else "image/jpeg")

    def do_POST(self) -> None:
        """Take a command or a picture."""
        if not self._admitted("") or not self._from_here():
            return
        path = urlsplit(self.path).path
        largest = MAX_PICTURE_BYTES if path == "/picture" else MAX_COMMAND_BYTES
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > largest:
            self.close_connection = True
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"expected at most {largest} bytes")
            return
        body = self.rfile.read(int(length))
        if path == "/picture":
            self._guarded(lambda: self._picture(body))
        elif path == "/command":
            self._guarded(lambda: self._command(body))
        else:
            self._refuse(HTTPStatus.NOT_FOUND, "nothing here")

    # Who may ask

    def _admitted(self, token: str) -> bool:
        """Refuse requests that name another host, and beyond the loopback those without the token."""
        owner = self._owner
        if owner.token is None:
            name = self.headers.get("Host", "").rpartition(":")[0].strip("[]")
            if name in {"localhost", owner.host} or _is_loopback(name):
                return True
            self._refuse(HTTPStatus.FORBIDDEN, "another host is meant")
            return False
        given = token or self._cookie()
        if hmac.compare_digest(given.encode(), owner.token.encode()):
            return True
        self._refuse(HTTPStatus.FORBIDDEN, "open the address with the token that the program printed")
        return False

    def _from_here(self) -> bool:
        origin = urlsplit(self.headers.get("Origin", "")).netloc
        kind = self.headers.get("Content-Type", "").partition(";")[0]
        if origin == self.headers.get("Host", "") and kind in {
            "application/json",
            "application/octet-stream",
        }:
            return True
        self.close_connection = True
        self._refuse(HTTPStatus.FORBIDDEN, "not asked by this page")
        return False

    def _cookie(self) -> str:
        try:
            cookie = SimpleCookie(self.headers.get("Cookie", ""))
        except CookieError:
            return ""
        found = cookie.get(f"handeye_{self._owner.port}")
        return "" if found is None else found.value

    def _redirected(self) -> None:
        """Put the token where it is not seen in the address."""
        self.send_response(HTTPStatus.SEE_OTHER)
        cookie = f"handeye_{self._owner.port}={self._owner.token}; HttpOnly; SameSite=Strict; Path=/"
        self.send_header("Set-Cookie", cookie)
        self.send_header("Location", "/")
        self.send_header("Content-Length", "0")
        self.end_headers()

    # Answers

    def _command(self, body: bytes) -> None:
        try:
            asked: Any = json.loads(body)
        except (ValueError, RecursionError) as error:
            raise InputError(f"not JSON: {str(error)[:200]}", code=Code.NOT_JSON) from error
        if not isinstance(asked, dict):
            raise InputError("a command is an object", code=Code.WRONG_TYPE)
        values = cast("dict[str, Any]", asked)
        page, action = values.pop("page", None), values.pop("action", None)
        if not isinstance(page, str) or not isinstance(action, str):
            raise InputError("a command has a page and an action", code=Code.WRONG_TYPE)
        if action == "take_over":
            self._owner.hub.take_over(page)
        else:
            self._owner.hub.command(page, Command(action, values))
        self._send(b"{}", "application/json")

    def _picture(self, body: bytes) -> None:
        if self._owner.upload is None:
            raise InputError("no picture is waited for here", code=Code.NO_UPLOAD)
        said = self._owner.upload(body)
        self._owner.hub.say(said)
        self._send(json.dumps({"said": said}).encode(), "application/json")

    def _events(self, page: str) -> None:
        """Send the versions of all documents whenever one changes, until the page goes away."""
        hub = self._owner.hub
        if not 8 <= len(page) <= 64:
            self._refuse(HTTPStatus.BAD_REQUEST, "a page needs a name")
            return
        try:
            hub.enter(page)
        except InputError as error:
            self._refuse(HTTPStatus.SERVICE_UNAVAILABLE, error.message)
            return
        self.close_connection = True
        try:
            self.send_response(HTTPStatus.OK)
            self.send_header("Content-Type", "text/event-stream")
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            seen: dict[str, int] = {}
            while not hub.closed:
                seen = hub.wait(seen, _BEAT_S)
                self.wfile.write(b"data: " + json.dumps(seen).encode() + b"\n\n")
                self.wfile.flush()
        except OSError:
            pass
        finally:
            hub.leave(page)

    def _file(self, name: str) -> None:
        content = files("handeye.ui").joinpath("static", name).read_bytes()
        self._send(content, _TYPES[name[name.rindex(".") :]])

    @contextmanager
    def _charged(self, name: str) -> Generator[None]:
        """Charge a document with the processor time that an answer takes."""
        began = time.thread_time()
        yield
        self._owner.hub.charge(name, time.thread_time() - began)

    def _guarded(self, answer: Callable[[], None]) -> None:
        try:
            answer()
        except HandeyeError as error:
            self._send(
                json.dumps({"error": described(error)}).encode(), "application/json", HTTPStatus.CONFLICT
            )

    def _send(self, content: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK) -> None:
        self.send_response(status)
        self.send_header("Content-Type", f"{kind}; charset=utf-8" if kind.startswith("text/") else kind)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", _POLICY)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        self.end_headers()
        self.wfile.write(content)

    def _refuse(self, status: HTTPStatus, why: str) -> None:
        self._send(f"{why}\n".encode(), "text/plain", status)


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
