"""The server's protocols with limits: what a connection may do, over real sockets."""

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from functools import partial
from typing import Any

import pytest
import uvicorn
from attacks import Target, frame
from palpate.live.access import guarded
from palpate.live.access.limits import BYTES, FRAGMENTS
from uvicorn.server import ServerState

PATIENCE_S = 0.2
_LONG_S = 30.0
"""Long, since a busy machine is slow."""
Client = tuple[asyncio.StreamReader, asyncio.StreamWriter]


@pytest.fixture(autouse=True)
def long_patience(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guarded, "PATIENCE_S", _LONG_S)


async def endless(scope: Any, receive: Any, send: Any) -> None:
    """Send without end; echo on web sockets, where the path asks for it."""
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.accept"})
        while scope["path"] == "/echo" and (await receive())["type"] == "websocket.receive":
            await send({"type": "websocket.send", "text": "heard"})
        while scope["path"] != "/echo":
            await send({"type": "websocket.send", "bytes": b"x" * 65536})
            await asyncio.sleep(0)
        return
    await send({"type": "http.response.start", "status": 200, "headers": [(b"connection", b"close")]})
    while scope["path"] != "/short":
        await send({"type": "http.response.body", "body": b"x" * 65536, "more_body": True})
        await asyncio.sleep(0)
    await send({"type": "http.response.body", "body": b"short"})


@asynccontextmanager
async def serving() -> AsyncIterator[Callable[[], Awaitable[Client]]]:
    config = uvicorn.Config(endless, http="h11", ws=guarded.Sockets, log_config=None, access_log=False)
    config.load()
    state = ServerState()
    protocol = partial(guarded.Requests, config, state, {})
    server = await asyncio.get_running_loop().create_server(protocol, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    clients: list[Client] = []

    async def connect() -> Client:
        clients.append(await asyncio.open_connection("127.0.0.1", port, limit=1024))
        return clients[-1]

    try:
        yield connect
    finally:
        server.close()
        for _, writer in clients:
            writer.close()
        for task in state.tasks:
            task.cancel()


def run(test: Callable[[Callable[[], Awaitable[Client]]], Awaitable[None]]) -> None:
    async def all_of_it() -> None:
        async with serving() as connect:
            await asyncio.wait_for(test(connect), _LONG_S)

    asyncio.run(all_of_it())


def _head(path: str, *more: str) -> bytes:
    return Target("http://127.0.0.1:8746/?token=x", 1).head(path, *more)


_UPGRADE = ("Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==",
            "Sec-WebSocket-Version: 13")  # fmt: skip


async def _rest(reader: asyncio.StreamReader) -> bytes:
    """Return all that comes until the connection ends."""
    found = b""
    try:
        while part := await reader.read(65536):
            found += part
    except ConnectionResetError:
        pass
    return found


def test_one_request_is_answered() -> None:
    async def test(connect: Callable[[], Awaitable[Client]]) -> None:
        reader, writer = await connect()
        for byte in _head("/short"):
            writer.write(bytes([byte]))
        assert (await _rest(reader)).endswith(b"short\r\n0\r\n\r\n")

    run(test)


@pytest.mark.parametrize(
    ("sent", "said"),
    [
        (b"GET / HTTP/1.1\r\nHost: a\r\nX: " + b"x" * 20000, b"16384 in 100 lines"),
        (b"BREW / HTCPCP/1.0\r\n\r\n", b"GET and HEAD"),
        (_head("/short") * 2, b"one on a connection"),
        (b"GET / HTTP/1.1\r\nHost: a", b""),
        (b"", b""),
    ],
)
def test_a_request_that_is_no_page_s(sent: bytes, said: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    if not said:
        monkeypatch.setattr(guarded, "PATIENCE_S", PATIENCE_S)

    async def test(connect: Callable[[], Awaitable[Client]]) -> None:
        begun = time.monotonic()
        reader, writer = await connect()
        writer.write(sent)
        answer = await _rest(reader)
        assert said in answer
        assert bool(said) == answer.startswith(b"HTTP/1.1 400 ")
        assert said or time.monotonic() - begun > PATIENCE_S / 2

    run(test)


@pytest.mark.parametrize("request_", [_head("/"), _head("/", *_UPGRADE)], ids=["answer", "web socket"])
def test_who_does_not_read_is_closed(request_: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guarded, "PATIENCE_S", 1.0)
    gone = asyncio.Event()
    for kind in (guarded.Requests, guarded.Sockets):

        def lost(self: Any, error: Any, before: Any = kind.connection_lost) -> None:
            gone.set()
            before(self, error)

        monkeypatch.setattr(kind, "connection_lost", lost)

    async def test(connect: Callable[[], Awaitable[Client]]) -> None:
        reader, writer = await connect()
        writer.write(request_)
        await gone.wait()  # the reader takes 2 kB, the kernel the rest, until both are full
        async with asyncio.timeout(_LONG_S):
            await _rest(reader)

    run(test)


def test_a_new_connection_takes_the_place_of_the_oldest_that_asks_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    async def test(connect: Callable[[], Awaitable[Client]]) -> None:
        asks = await connect()
        asks[1].write(_head("/", *_UPGRADE).replace(b"GET / ", b"GET /echo "))
        assert (await asks[0].readline()).startswith(b"HTTP/1.1 101 ")
        waiting = [await connect() for _ in range(2)]
        await asyncio.sleep(0.1)
        last = await connect()
        assert await waiting[0][0].read(1) == b""
        for reader, writer in (waiting[1], last):
            writer.write(_head("/short"))
            assert (await _rest(reader)).endswith(b"short\r\n0\r\n\r\n")

    monkeypatch.setattr(guarded, "OPEN", 3)
    run(test)


@pytest.mark.parametrize(
    ("sent", "reason"),
    [
        (frame(1, end=False) + frame(0, end=False) * (FRAGMENTS + 1), b"fragments"),
        (frame(9, b"x" * 100) * (int(BYTES.at_once) // 100), b"bytes a second"),
        (frame(1, b"x") * int(BYTES.at_once // 7 + 1), b"bytes a second"),
    ],
)
def test_a_web_socket_beyond_a_limit_is_closed_with_the_reason(sent: bytes, reason: bytes) -> None:
    async def test(connect: Callable[[], Awaitable[Client]]) -> None:
        reader, writer = await connect()
        writer.write(_head("/echo", *_UPGRADE))
        while (await reader.readline()).strip():
            pass
        writer.write(frame(1, b'{"do": "seen"}'))
        assert await reader.readexactly(7) == b"\x81\x05heard"
        writer.write(sent)
        rest = await _rest(reader)
        assert b"\x03\xf0" in rest  # 1008
        assert reason in rest

    run(test)
