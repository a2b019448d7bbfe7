"""Fuzz targets of the live page, functions of bytes: messages on its web socket, and requests."""

from collections.abc import Coroutine
from contextlib import suppress
from typing import Any

from palpate.live.access import Gatekeeper, new_token
from palpate.live.commands import LARGEST_S, LONGEST_PLAN, Command, parse
from palpate.live.feed import RefusedCommand

HOST, PORT, TOKEN = "127.0.0.1", 8746, new_token()
OWN = (HOST, "localhost", "[::1]")


def message(data: bytes) -> None:
    """Parse a message: a command, or an error that can be shown."""
    try:
        said: Command | str = parse(data.decode("utf-8", "replace"))
    except RefusedCommand as refusal:
        said = str(refusal)
    if isinstance(said, Command):
        for value in said.given.values():
            assert len(value) <= LONGEST_PLAN if isinstance(value, str) else abs(value) <= LARGEST_S
    else:
        assert len(said) < 300


def request(data: bytes) -> None:
    """Request the page or its web socket: a query on the first line, headers on the next lines.

    No access without the token if there is one, nor with another host name, nor from a page of another origin.
    """
    query, *lines = data.split(b"\n")
    headers = [(name.strip().lower(), value.strip()) for name, _, value in (line.partition(b"=") for line in lines)]
    for kind in ("http", "websocket"):
        scope = {"type": kind, "path": "/", "query_string": query, "headers": headers}
        assert not _passed(scope, TOKEN)
        if _passed(scope, None):
            host, *_ = [value.decode("latin-1") for name, value in headers if name == b"host"]
            origins = [value.decode("latin-1") for name, value in headers if name == b"origin"]
            assert host.lower().startswith(OWN)
            assert origins == [f"http://{host}"] or (not origins and kind == "http")


def _passed(scope: dict[str, Any], token: str | None) -> bool:
    passed = False

    async def page(*_: Any) -> None:
        nonlocal passed
        passed = True

    async def receive() -> dict[str, Any]:
        return {"type": "http.request"}

    async def send(_: Any) -> None:
        """Ignore the message."""

    _run(Gatekeeper(page, HOST, PORT, token)(scope, receive, send))
    return passed


def _run(asked: Coroutine[Any, Any, None]) -> None:
    """Run a coroutine that never waits, so without an event loop."""
    with suppress(StopIteration):
        asked.send(None)
        raise AssertionError("it waited")
