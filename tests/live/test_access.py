"""Who may open the page, what a connection may do, and that neither stops the recording."""

import asyncio
import json
import os
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Self

import palpate
import pytest
import uvicorn
from live_bench import HOST, ORIGIN, OWN, PORT, begun, client
from live_browser import Browser
from live_server import PATIENCE_S, Live
from palpate.live import measurement, page_frames, peers
from palpate.live.access import HEADERS, Gatekeeper
from palpate.live.app import PageApp, page_files
from palpate.live.opened_source import OpenedSource
from palpate.live.server import WS
from recording_bench import soon

TOKEN = "Q4h-Zk_0aBcDeFgHiJkLmNoPqRsTuVwX"
UPGRADE = (
    "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
)
OTHER_UID = 65534
"""Another user of the machine: nobody."""


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
    page = f"/{TOKEN}/"
    assert status(app, host=f"192.0.2.7:{PORT}") == 403
    assert status(app, "http", page, host=f"192.0.2.7:{PORT}") == 200
    assert (
        status(Gatekeeper(_page, "192.0.2.7", PORT, TOKEN), "http", page, host="192.0.2.8") == 400
    )


@pytest.mark.parametrize(
    ("site", "dest", "wanted"),
    [
        ("same-origin", "script", 200),
        ("none", "document", 200),  # typed, or from a bookmark
        ("cross-site", "document", 200),  # the file that leads the browser to the page
        ("same-site", "script", 403),  # a server on another port of this machine
        ("cross-site", "image", 403),
        ("cross-site", "iframe", 403),
        ("cross-site", "", 403),
    ],
)
def test_other_pages_in_the_browser_may_only_open_it(site: str, dest: str, wanted: int) -> None:
    app = Gatekeeper(_page, HOST, PORT)
    assert status(app, **{"sec-fetch-site": site, "sec-fetch-dest": dest}) == wanted


@pytest.mark.parametrize(
    ("path", "wanted"),
    [
        (f"/{TOKEN}/", 200),
        (f"/{TOKEN}/ws", 200),
        (f"/{TOKEN}", 303),
        (f"/{TOKEN}x/", 403),
        (f"/{TOKEN[:-1]}/", 403),
        (f"//{TOKEN}/", 403),
        (f"/x/{TOKEN}/", 403),
        ("/", 403),
        ("", 403),
        ("/\xff/", 403),
    ],
)
def test_the_path_has_the_token(path: str, wanted: int) -> None:
    app = Gatekeeper(_page, HOST, PORT, TOKEN)
    answer = asked(app, "http", path)
    assert answer.get("status", 200) == wanted
    assert status(app, "websocket", path, origin=ORIGIN) == wanted
    headers = dict(answer.get("headers", []))
    assert {name.lower().encode() for name in HEADERS} <= set(headers)
    assert b"set-cookie" not in headers
    if wanted == 303:
        assert headers[b"location"] == f"/{TOKEN}/".encode()


def test_a_wrong_token_shows_a_page_that_says_what_to_type(page: Browser) -> None:
    with Live() as live:
        page.driver.get(f"{live.origin}{live.token[:-1]}/")
        text = page.run("return document.body.innerText")
        assert "This address is not valid." in text
        assert "palpate live prints a new address" in text
        ground = "return getComputedStyle(document.querySelector('main')).backgroundColor"
        assert page.run(ground) == "rgb(255, 255, 255)"  # its own style is let through
        assert not [one for one in page.complaints() if "403" not in one]


def test_only_files_of_the_page_are_served() -> None:
    bench: Any = SimpleNamespace(
        measurement=SimpleNamespace(
            number=1, levels=None, files=SimpleNamespace(find=lambda _: None)
        )
    )
    app, locked = (PageApp(OpenedSource(bench)).app(HOST, PORT, token) for token in (None, TOKEN))
    for path, wanted in [("/", 200), ("/page.js", 200), ("/charts/plot.js", 200), ("/recording/run.csv", 404), ("/page.py", 404), ("/../server.py", 404),
                         ("/charts/../../server.py", 404), ("/index.html", 404), ("/recording/..%2Fsecret.csv", 404)]:  # fmt: skip
        assert (status(app, "http", path), status(locked, "http", path)) == (wanted, 403)
        assert status(locked, "http", f"/{TOKEN}{path}") == wanted


def test_the_page_is_sent_compressed_to_a_browser_that_takes_it(tmp_path: Path) -> None:
    """The whole page is at most 240 kB on the wire, and the same with and without compression."""
    bench = begun("sim:tremor", tmp_path, record=False)
    page = client(bench)
    total = 0
    for path, file in page_files().items():
        plain = page.get(path, headers={"Accept-Encoding": "identity"})
        packed = page.get(path, headers={"Accept-Encoding": "gzip"})
        assert plain.content == packed.content == file.content
        assert "Content-Encoding" not in plain.headers
        assert packed.headers["Content-Encoding"] == "gzip"
        total += int(packed.headers["Content-Length"])
    bench.measurement.close()
    assert total < 240_000


def test_the_limits_are_those_that_the_pages_promise() -> None:
    """docs/live.md has these numbers."""
    assert HEADERS["Content-Security-Policy"].startswith("default-src 'none'; script-src 'self';")
    assert (measurement.KEPT, page_frames.BINS_PER_S) == (65_536, 500.0)


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


def test_another_server_of_this_machine_gets_no_token(
    serve: Callable[..., Live], page: Browser
) -> None:
    """A cookie knows no port; the page therefore has none, and says nobody where it was."""
    live = serve()
    page.driver.get(live.lab)
    page.until(lambda: page["simulated"].is_displayed())
    heard = []
    with socket.create_server((HOST, 0)) as other:
        page.run(f"open('http://{HOST}:{other.getsockname()[1]}/')")
        client, _ = other.accept()
        with client:
            heard.append(client.recv(65536).decode())
    assert "GET / HTTP/1.1" in heard[0]
    assert "cookie" not in heard[0].lower()
    assert live.token not in heard[0]
    assert page.driver.get_cookies() == []
    live.end()


@contextmanager
def user(uid: int) -> Iterator[None]:
    """Let sockets and files be opened as another user; the kernel then names that user."""
    if os.geteuid() != 0:
        pytest.skip("only root can act as another user")
    os.seteuid(uid)
    try:
        yield
    finally:
        os.seteuid(0)


def answer_to(live: Live, request: str, uid: int = 0) -> bytes:
    """Return the first bytes that a user gets for a request; none: the connection was closed."""
    with user(uid):
        client = socket.create_connection((HOST, live.port), timeout=PATIENCE_S)
    with client, suppress(ConnectionError):
        client.sendall(request.encode())
        return client.recv(4096)
    return b""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux says whose a connection is")
def test_another_user_gets_nothing_even_with_the_token(tmp_path: Path) -> None:
    """Page, web socket, and the refusal of a wrong token."""
    with Live(told=subprocess.PIPE) as live:
        head = f"Host: {HOST}:{live.port}\r\nOrigin: {live.origin.rstrip('/')}\r\n"
        page = f"GET /{live.token}/ HTTP/1.1\r\n{head}\r\n"
        web_socket = f"GET /{live.token}/ws HTTP/1.1\r\n{head}{UPGRADE}\r\n"
        guessed = f"GET /x/ HTTP/1.1\r\n{head}\r\n"
        for request, own in ((page, b"200 OK"), (web_socket, b"101 Sw"), (guessed, b"403 Fo")):
            assert answer_to(live, request)[9:15] == own
            assert answer_to(live, request, OTHER_UID) == b""
        live.process.send_signal(signal.SIGINT)
        _, told = live.process.communicate(timeout=PATIENCE_S)
    refusal = f"refused a connection of user {OTHER_UID}, allowed: only your own and root's"
    assert told.count(refusal) == 1


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux says whose a connection is")
def test_the_user_of_a_connection() -> None:
    for family, address in ((socket.AF_INET, "127.0.0.1"), (socket.AF_INET6, "::1")):
        with socket.socket(family) as listening:
            listening.bind((address, 0))
            assert not peers.lists_users(listening)
            listening.listen()
            assert peers.lists_users(listening)
            with socket.create_connection(listening.getsockname()[:2]) as client:
                ends = client.getsockname(), client.getpeername()
                assert peers.uid_of_peer(*ends) == os.getuid()
                assert peers.uid_of_peer(ends[0], (address, 1)) is None
            assert peers.uid_of_peer(*ends) is None  # closed: the kernel would say root
    with socket.socket() as listening:
        listening.bind((HOST, 0))
        listening.listen()
        with user(OTHER_UID), closing(socket.socket(socket.AF_INET6)) as client:
            client.connect((f"::ffff:{HOST}", listening.getsockname()[1]))
            accepted, _ = listening.accept()
            with accepted:
                ends = accepted.getpeername(), accepted.getsockname()
                assert peers.uid_of_peer(*ends) == OTHER_UID


class VirtualLoop(asyncio.SelectorEventLoop):
    """An event loop whose clock the test can set forward."""

    later_s = 0.0

    def time(self) -> float:
        """Return the time of its clock."""
        return super().time() + self.later_s


class AtDoor:
    """A server that only notes the requests with the token, in a loop with a virtual clock."""

    def __init__(self, uids: frozenset[int] | None = None) -> None:
        self.loop = VirtualLoop()
        self.told: list[str] = []
        self.paths: list[str] = []
        app = Gatekeeper(self._app, HOST, PORT, TOKEN)
        self._config = uvicorn.Config(app, log_config=None, interface="asgi3", ws=WS)
        self._door = peers.Door(uids, self.told.append)
        serving = self.loop.create_server(self._connection, HOST, 0)
        self._server = self.loop.run_until_complete(serving)
        self.address = self._server.sockets[0].getsockname()

    def _connection(self) -> peers.Connection:
        state = uvicorn.server.ServerState()
        return peers.Connection(
            self._door, config=self._config, server_state=state, app_state={}, _loop=self.loop
        )

    async def _app(self, scope: Any, receive: Any, send: Any) -> None:
        self.paths.append(scope["path"])
        if scope["type"] == "websocket":
            await send({"type": "websocket.accept"})
            while (await receive())["type"] != "websocket.disconnect":
                pass

    def turn(self) -> None:
        """Do what is due."""
        self.loop.run_until_complete(asyncio.sleep(0.01))

    def __enter__(self) -> Self:
        """Return the server."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""
        self._server.close()
        self.turn()
        self.loop.close()


def is_closed(client: socket.socket) -> bool:
    """Return whether the server has closed a connection."""
    client.setblocking(False)
    try:
        return client.recv(1) == b""
    except BlockingIOError:
        return False


def test_a_connection_without_the_token_is_closed_after_a_time() -> None:
    with AtDoor() as server, ExitStack() as end:
        silent = end.enter_context(socket.create_connection(server.address))
        slow = end.enter_context(socket.create_connection(server.address))
        slow.sendall(b"GET / HTTP/1.1\r\nHost: ")
        server.turn()
        server.loop.later_s = peers.WAIT_S - 1
        server.turn()
        assert not is_closed(silent)
        server.loop.later_s = peers.WAIT_S + 1
        server.turn()
        assert is_closed(silent)
        assert is_closed(slow)
    assert server.told == []


def request(path: str, token: str = TOKEN, more: str = "") -> str:
    """Return a request of the page."""
    return f"GET /{token}/{path} HTTP/1.1\r\nHost: {OWN}\r\nOrigin: {ORIGIN}\r\n{more}\r\n"


def test_a_page_with_the_token_stays() -> None:
    with AtDoor() as server, ExitStack() as end:
        page, stranger = (
            end.enter_context(socket.create_connection(server.address)) for _ in range(2)
        )
        page.sendall(request("ws", more=UPGRADE).encode())
        stranger.sendall(request("ws", token="x", more=UPGRADE).encode())
        server.turn()
        assert page.recv(4096).startswith(b"HTTP/1.1 101 ")
        assert stranger.recv(4096).startswith(b"HTTP/1.1 403 ")
        server.loop.later_s = peers.WAIT_S + 1
        server.turn()
        assert not is_closed(page)
        assert is_closed(stranger)
        assert server.paths == [f"/{TOKEN}/ws"]


def test_the_oldest_of_too_many_connections_is_closed() -> None:
    with AtDoor() as server, ExitStack() as end:
        clients = []
        for _ in range(peers.MOST_WAITING + 3):
            clients.append(end.enter_context(socket.create_connection(server.address)))
            server.turn()
        assert [is_closed(client) for client in clients].count(True) == 3
        assert all(map(is_closed, clients[:3]))
    assert server.told == ["more than 64 connections without a request: the oldest were closed"]


@pytest.mark.parametrize("own", [True, False])
def test_a_request_whose_connection_is_already_reset(own: bool) -> None:
    """The kernel does not say any more whose it was, but its data can be read: it is refused."""
    uids = frozenset({os.getuid()})
    with AtDoor(uids if own else None) as server:
        client = socket.create_connection(server.address)
        client.sendall(request("x").encode())
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        client.close()
        server.turn()
        assert server.paths == ([] if own else [f"/{TOKEN}/x"])


def test_idle_connections_leave_descriptors_to_the_recording(tmp_path: Path) -> None:
    """Of a user who is let in: those of other users are closed at once."""
    resource = pytest.importorskip("resource")
    most = resource.getrlimit(resource.RLIMIT_NOFILE)
    path = tmp_path / "run.csv"
    with ExitStack() as end:
        resource.setrlimit(resource.RLIMIT_NOFILE, (256, most[1]))
        try:
            live = end.enter_context(
                Live("--no-token", "--record", str(path), told=subprocess.PIPE)
            )
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, most)
        for _ in range(400):
            end.enter_context(socket.create_connection((HOST, live.port), timeout=PATIENCE_S))
        rows = checkpoint(path)
        soon(lambda: checkpoint(path) > rows)
        assert live.asks("/") == 200
        live.process.send_signal(signal.SIGINT)
        _, told = live.process.communicate(timeout=PATIENCE_S)
    assert palpate.check(path).clean
    assert told.count("connections without a request") == 1
    assert len(told) < 1000, told


def checkpoint(path: Path) -> int:
    """Return how many rows the last checkpoint of a recording has."""
    return int(json.loads(path.with_suffix(".json").read_text())["checkpoint"]["rows"])
