"""Who may open the page, what a connection may do, and that neither stops the recording."""

import asyncio
import socket
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import palpate
import pytest
from live_bench import HOST, ORIGIN, OWN, PORT
from live_server import Live
from palpate.live import commands, feed, files, measurement
from palpate.live.access import HEADERS, Gatekeeper, new_token
from palpate.live.app import PageApp

TOKEN = "Q4h-Zk_0aBcDeFgHiJkLmNoPqRsTuVwX"
COOKIE = f"palpate-{PORT}={TOKEN}"


async def _page(scope: Any, _: Any, send: Any) -> None:
    await send({"type": "websocket.accept"} if scope["type"] == "websocket" else
               {"type": "http.response.start", "status": 200})  # fmt: skip


def asked(
    app: Any, kind: str = "http", path: str = "/", query: bytes = b"", **headers: str
) -> dict[str, Any]:
    """Return the begin of the answer to a request of the page itself, but for these headers."""
    told: list[dict[str, Any]] = []

    async def send(message: Any) -> None:
        told.append(message)

    async def receive() -> dict[str, Any]:
        return {"type": f"{kind}.request"}

    own = {"host": OWN} | headers
    scope = {"type": kind, "method": "GET", "path": path, "raw_path": b"", "query_string": query, "root_path": "",
             "headers": [(name.encode(), value.encode("latin-1", "replace")) for name, value in own.items()],
             "http_version": "1.1", "scheme": "http", "extensions": {"websocket.http.response": {}}}  # fmt: skip
    asyncio.run(app(scope, receive, send))
    return told[0]


def status(app: Any, *args: Any, **headers: Any) -> int:
    """Return the status; 200: let in."""
    return int(asked(app, *args, **headers).get("status", 200))


@pytest.mark.parametrize(
    ("headers", "wanted", "socket"),
    [
        ({}, 200, 403),  # a web socket always needs the Origin
        ({"origin": ORIGIN}, 200, 200),
        ({"host": f"localhost:{PORT}", "origin": f"http://localhost:{PORT}"}, 200, 200),
        ({"host": f"[::1]:{PORT}", "origin": f"http://[::1]:{PORT}"}, 200, 200),
        ({"host": f"evil.example:{PORT}", "origin": f"http://evil.example:{PORT}"}, 400, 400),
        ({"host": f"localhost.evil.example:{PORT}"}, 400, 400),
        ({"origin": "http://evil.example"}, 403, 403),
        ({"origin": "null"}, 403, 403),
        ({"origin": f"https://{OWN}"}, 403, 403),
    ],
)
def test_only_the_page_itself_may_ask(headers: dict[str, str], wanted: int, socket: int) -> None:
    app = Gatekeeper(_page, HOST, PORT)
    assert status(app, **headers) == wanted
    assert status(app, "websocket", **headers) == socket


def test_at_every_address_any_name_is_valid_with_the_token() -> None:
    app = Gatekeeper(_page, "0.0.0.0", PORT, TOKEN)
    assert status(app, host=f"192.0.2.7:{PORT}") == 403
    assert status(app, host=f"192.0.2.7:{PORT}", cookie=COOKIE) == 200
    assert (
        status(Gatekeeper(_page, "192.0.2.7", PORT, TOKEN), host="192.0.2.8", cookie=COOKIE) == 400
    )


@pytest.mark.parametrize(
    ("cookie", "wanted"),
    [
        (COOKIE, 200),
        (f"theme=dark; {COOKIE}; _xsrf=2|a|b", 200),
        (f"palpate-{PORT + 1}={TOKEN}", 403),
        (f"{COOKIE}x", 403),
        ("", 403),
        ("\xff; =; ;;", 403),
    ],
)
def test_the_cookie_has_the_token(cookie: str, wanted: int) -> None:
    app = Gatekeeper(_page, HOST, PORT, TOKEN)
    assert status(app, cookie=cookie) == wanted
    assert status(app, "websocket", cookie=cookie, origin=ORIGIN) == wanted


def test_the_token_in_the_address_becomes_a_cookie_and_a_ticket_is_valid_once() -> None:
    ticket = new_token()
    app = Gatekeeper(_page, HOST, PORT, TOKEN, ticket)
    for given_, wanted in [
        ("wrong", 403),
        (TOKEN, 303),
        (TOKEN, 303),
        (ticket, 303),
        (ticket, 403),
        ("", 403),
    ]:
        answer = asked(app, "http", "/", f"token={given_}".encode())
        assert answer["status"] == wanted
        headers = dict(answer["headers"])
        assert {name.lower().encode() for name in HEADERS} <= set(headers)
        if wanted == 303:
            assert headers[b"location"] == b"/"
            assert {COOKIE, "HttpOnly", "SameSite=strict"} <= set(
                headers[b"set-cookie"].decode().split("; ")
            )


def test_only_files_of_the_page_are_served() -> None:
    bench: Any = SimpleNamespace(
        measurement=SimpleNamespace(
            number=1, levels=None, files=SimpleNamespace(find=lambda _: None)
        )
    )
    app, locked = (PageApp(bench).app(HOST, PORT, token) for token in (None, TOKEN))
    for path, wanted in [("/", 200), ("/page.js", 200), ("/charts/plot.js", 200), ("/recording/run.csv", 404), ("/page.py", 404), ("/../server.py", 404),
                         ("/charts/../../server.py", 404), ("/index.html", 404), ("/recording/..%2Fsecret.csv", 404)]:  # fmt: skip
        assert (status(app, "http", path), status(locked, "http", path)) == (wanted, 403)


def test_the_limits_are_those_that_the_pages_promise() -> None:
    """SECURITY.md and docs/live.md have these numbers."""
    assert (commands.LONGEST, commands.LONGEST_TEXT, files.LONGEST) == (32768, 4000, 100)
    assert HEADERS["Content-Security-Policy"].startswith("default-src 'none'; script-src 'self';")
    assert (measurement.KEPT, feed.BINS_PER_S, len(new_token())) == (65_536, 500.0, 192 / 6)


def test_half_a_request_a_long_one_and_nonsense_do_not_stop_the_recording(tmp_path: Path) -> None:
    with (
        Live("--record", str(tmp_path / "run.csv")) as live,
        socket.create_connection((HOST, live.port), timeout=60) as slow,
    ):
        slow.sendall(b"GET / HTTP/1.1\r\nHost: ")
        for sent in (b"nonsense\r\n\r\n", b"GET / HTTP/1.1\r\nX: " + b"x" * 30000):
            with socket.create_connection((HOST, live.port), timeout=60) as client:
                client.sendall(sent)
                assert client.recv(4096).startswith(b"HTTP/1.1 400 ")
        assert live.asks("/", live.token) == 200
        assert live.end() == 130
        assert slow.recv(1) == b""
    assert palpate.check(tmp_path / "run.csv").clean
