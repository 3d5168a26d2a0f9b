"""Who may ask the page's server, and for what."""

import http.client
import json
from collections.abc import Iterator
from typing import Any

import pytest

from handeye.errors import InputError, OutputError
from handeye.ui import Command, Hub, Server

PAGE = "0123456789abcdef"


class Client:
    def __init__(self, server: Server) -> None:
        self.server = server

    def __call__(
        self, method: str, path: str, body: bytes | None = None, **headers: str
    ) -> tuple[int, bytes, dict[str, str]]:
        connection = http.client.HTTPConnection("127.0.0.1", self.server.port, timeout=10)
        connection.putrequest(method, path, skip_host=True)
        own = f"127.0.0.1:{self.server.port}"
        usual = {"Host": own}
        if method == "POST":
            usual |= {"Origin": f"http://{own}", "Content-Type": "application/json"}
        if body is not None:
            usual["Content-Length"] = str(len(body))
        for name, value in (usual | {k.replace("_", "-"): v for k, v in headers.items()}).items():
            if value:
                connection.putheader(name, value)
        connection.endheaders(body)
        answer = connection.getresponse()
        found = answer.status, answer.read(), dict(answer.headers)
        connection.close()
        return found

    def command(self, **values: Any) -> tuple[int, Any]:
        status, body, _ = self("POST", "/command", json.dumps(values).encode())
        return status, json.loads(body)


class Pictures:
    def picture(self, number: int) -> bytes | None:
        return b"jpeg" if number == 3 else None

    def view(self, name: str) -> dict[str, Any] | None:
        return {"label": name} if name == "view 1" else None

    def view_picture(self, name: str) -> bytes | None:
        return b"of a view" if name == "view 1" else None


@pytest.fixture
def client() -> Iterator[Client]:
    server = Server(Hub(), pictures=Pictures())
    server.hub.enter(PAGE)
    yield Client(server)
    server.close()


@pytest.fixture
def guarded() -> Iterator[Client]:
    server = Server(Hub(), "0.0.0.0")
    yield Client(server)
    server.close()


def test_the_page_asks_nobody_else(client: Client) -> None:
    for path in ("/", "/app.js", "/scene.js", "/charts.js", "/panels.js", "/style.css", "/icon.svg"):
        status, body, headers = client("GET", path)
        assert status == 200
        assert "default-src 'self'" in headers["Content-Security-Policy"]
        assert b"https://" not in body


@pytest.mark.parametrize(
    "path",
    [
        "/../pyproject.toml",
        "/static/app.js",
        "/hub.py",
        "/document/../people",
        "/picture/4",
        "/picture/-1",
        "/picture/x",
        "/view/..%2f..%2fetc",
        "/view_picture/%2e%2e",
        "/%00",
    ],
)
def test_nothing_else_is_served(client: Client, path: str) -> None:
    assert client("GET", path)[0] in {404, 409}


def test_pictures_are_served_by_number_and_by_view(client: Client) -> None:
    assert client("GET", "/picture/3")[1] == b"jpeg"
    assert client("GET", "/view_picture/view%201")[1] == b"of a view"
    assert json.loads(client("GET", "/view/view%201")[1]) == {"label": "view 1"}


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example:80", ""])
def test_a_page_that_names_another_host_gets_nothing(client: Client, host: str) -> None:
    """A site whose name is made to point at this machine must not drive an arm."""
    assert client("GET", "/document/people", Host=host)[0] == 403
    assert client("POST", "/command", b"{}", Host=host)[0] == 403


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": ""},
        {"Origin": "null"},
        {"Content_Type": "text/plain"},
        {"Content_Type": "application/x-www-form-urlencoded"},
    ],
)
def test_another_site_cannot_press_a_button(client: Client, headers: dict[str, str]) -> None:
    body = json.dumps({"page": PAGE, "action": "go"}).encode()
    assert client("POST", "/command", body, **headers)[0] == 403
    assert client.server.hub.next_command(0) is None


def test_a_command_arrives(client: Client) -> None:
    assert client.command(page=PAGE, action="more", most_views=30) == (200, {})
    assert client.server.hub.next_command(0) == Command("more", {"most_views": 30})


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"[]",
        b"null",
        b"{",
        b"\xff\xfe",
        b"[" * 50_000,
        b'{"page": 1, "action": "go"}',
        b'{"action": "go"}',
    ],
)
def test_what_is_no_command_is_refused_in_words(client: Client, body: bytes) -> None:
    status, answer, _ = client("POST", "/command", body)
    assert status == 409
    assert json.loads(answer)["error"]["message"]


def test_too_much_is_not_read(client: Client) -> None:
    assert client("POST", "/command", None, Content_Length="1000000000")[0] == 413
    assert client("POST", "/command", None, Content_Length="-5")[0] == 413


def test_no_picture_is_taken_where_none_is_waited_for(client: Client) -> None:
    status, body, _ = client("POST", "/picture", b"x", Content_Type="application/octet-stream")
    assert status == 409
    assert b"no picture is waited for" in body


def test_beyond_the_loopback_everything_needs_the_token(guarded: Client) -> None:
    token = guarded.server.token
    assert token is not None
    assert token in guarded.server.address
    for path in ("/", "/app.js", "/document/people", "/events?page=" + PAGE):
        assert guarded("GET", path)[0] == 403
        assert guarded("GET", path, Cookie=f"handeye_{guarded.server.port}=wrong")[0] == 403
    assert guarded("POST", "/command", b"{}")[0] == 403
    status, _, headers = guarded("GET", f"/?token={token}")
    assert status == 303
    assert headers["Location"] == "/"
    assert "HttpOnly" in headers["Set-Cookie"]
    assert "SameSite=Strict" in headers["Set-Cookie"]
    cookie = headers["Set-Cookie"].partition(";")[0]
    assert guarded("GET", "/", Cookie=cookie)[0] == 200
    assert guarded("GET", "/?token=wrong", Cookie="")[0] == 403


def test_an_address_that_is_taken_is_named(client: Client) -> None:
    with pytest.raises(OutputError, match=f"127.0.0.1:{client.server.port}"):
        Server(Hub(), port=client.server.port)


def test_a_failing_document_is_an_error_in_words(client: Client) -> None:
    def fail() -> Any:
        raise InputError("no such view", code="unknown_view")

    client.server.hub.publish("scene", fail)
    status, body, _ = client("GET", "/document/scene")
    assert (status, json.loads(body)["error"]["code"]) == (409, "unknown_view")
