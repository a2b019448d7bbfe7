"""The server of the page: its socket, and its address; it runs until SIGINT or SIGTERM."""

import asyncio
import errno
import socket
import sys
from contextlib import suppress
from functools import partial
from typing import Literal, cast

import uvicorn
from starlette.types import ASGIApp

from palpate.live.page_commands import LONGEST_MESSAGE
from palpate.live.peers import Connection, Door

WS: Literal["websockets-sansio"] = "websockets-sansio"
"""The implementation of web sockets."""
_GRACE_S = 1
_TRIED_PORTS = 20
_LAST_PORT = 65535
# EACCES: on Windows; elsewhere also of a port below 1024
_IN_USE = (errno.EADDRINUSE, errno.EACCES)
_BACKLOG = 32  # connections that are accepted in one go, before the door sees them
_SWITCH_S = (
    1e-4  # how long the reader of the source waits for the interpreter at most; Python: 5 ms
)
# RFC 5737: an address without a host; connecting a datagram socket sends nothing
_NOWHERE = ("192.0.2.1", 9)


class PortInUse(ValueError):
    """Another program listens at the port."""


def listen(host: str, port: int) -> socket.socket:
    """Return a listening socket; port 0: any free one. ValueError: no address of this machine; PortInUse."""
    try:
        [(family, *_, address), *_] = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        listening = socket.socket(family, socket.SOCK_STREAM)
    except OSError as error:
        raise ValueError(
            f"host: got {host!r}: {error.strerror}, allowed: a name or address of this machine"
        ) from error
    try:
        # On Windows SO_REUSEADDR would let two programs share a port, and each get some of the connections.
        option = getattr(socket, "SO_EXCLUSIVEADDRUSE", socket.SO_REUSEADDR)
        listening.setsockopt(socket.SOL_SOCKET, option, 1)
        listening.bind(address)
        listening.listen()
    except OSError as error:
        listening.close()
        kind = PortInUse if error.errno in _IN_USE else ValueError
        raise kind(
            f"port: got {port} at {host}: {error.strerror}, allowed: a free port, 0 takes any; an address of this machine"
        ) from error
    return listening


def listen_near(host: str, port: int) -> socket.socket:
    """Return a socket that listens at this port, or at one of the next ones that is free."""
    for number in range(port, min(port + _TRIED_PORTS, _LAST_PORT + 1)):
        with suppress(PortInUse):
            return listen(host, number)
    return listen(host, 0)


def address_of(listening: socket.socket, host: str, token: str | None = None) -> str:
    """Return the address of the page."""
    name = host
    if host in ("0.0.0.0", "::"):
        name = _own_address()
    if ":" in name:
        name = f"[{name}]"
    path = f"{token}/" if token else ""
    return f"http://{name}:{listening.getsockname()[1]}/{path}"


def serve(app: ASGIApp, listening: socket.socket, door: Door) -> None:
    """Serve until SIGINT or SIGTERM, in the main thread."""
    # The previous handlers of the signals run after the last page is closed.
    config = uvicorn.Config(
        app,
        http=cast("type[asyncio.Protocol]", partial(Connection, door)),
        ws=WS,
        lifespan="on",
        backlog=_BACKLOG,
        log_config=None,
        access_log=False,
        server_header=False,
        proxy_headers=False,
        ws_max_size=LONGEST_MESSAGE,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=_GRACE_S,
    )
    before = sys.getswitchinterval()
    sys.setswitchinterval(_SWITCH_S)
    try:
        asyncio.run(_Server(config).serve([listening]))
    finally:
        sys.setswitchinterval(before)


class _Server(uvicorn.Server):
    """A server whose application ends in order, also after a second Ctrl-C."""

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        await super().shutdown(sockets)
        # by a second Ctrl-C: the pages are not waited for, but the application ends in order
        if self.force_exit:
            await self.lifespan.shutdown()


def _own_address() -> str:
    """Return the address of this machine in the network; without a network, the loopback address."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_NOWHERE)
        except OSError:
            return "127.0.0.1"
        return str(probe.getsockname()[0])
