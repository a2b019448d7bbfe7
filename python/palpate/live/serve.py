"""The socket, its address, and the server, which runs until SIGINT or SIGTERM."""

import asyncio
import errno
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

import uvicorn
from starlette.types import ASGIApp

from palpate.live.access.gatekeeper import has_token
from palpate.live.access.guarded import Requests, Sockets
from palpate.live.access.lobby import Lobby
from palpate.live.protocol import LONGEST

_GRACE_S = 1
_BACKLOG = 1024
_SWITCH_S = 1e-4  # how long the reader of the source waits for the interpreter at most; Python: 5 ms
_NOWHERE = ("192.0.2.1", 9)  # RFC 5737: an address without a host; connecting a datagram socket sends nothing


def listen(host: str, port: int) -> socket.socket:
    """Return a listening socket.

    Parameters
    ----------
    host : str
    port : int
        0: any free port.

    Raises
    ------
    ValueError
        The host is not an address of this machine, or the port is in use.
    """
    try:
        [(family, *_, address), *_] = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        listening = socket.socket(family, socket.SOCK_STREAM)
    except OSError as error:
        raise ValueError(f"host: got {host!r}: {error.strerror}, allowed: a name or address of this machine") from error
    try:
        # On Windows SO_REUSEADDR would let two programs share a port, and each get some of the connections.
        option = getattr(socket, "SO_EXCLUSIVEADDRUSE", socket.SO_REUSEADDR)
        listening.setsockopt(socket.SOL_SOCKET, option, 1)
        listening.bind(address)
        listening.listen(_BACKLOG)
    except OSError as error:
        listening.close()
        if error.errno == errno.EADDRNOTAVAIL:
            raise ValueError(f"host: got {host!r}: {error.strerror}, allowed: an address of this machine") from error
        raise ValueError(
            f"port: got {port} at {host}: {error.strerror}, allowed: a free port; 0 takes any free one"
        ) from error
    return listening


def address_of(listening: socket.socket, host: str, token: str | None = None) -> str:
    """Return the address of the page."""
    name = host if host not in ("0.0.0.0", "::") else _own_address()
    name = f"[{name}]" if ":" in name else name
    query = f"?token={token}" if token else ""
    return f"http://{name}:{listening.getsockname()[1]}/{query}"


class _Server(uvicorn.Server):
    """A server that gets its connections from the lobby."""

    def __init__(
        self,
        config: uvicorn.Config,
        listening: socket.socket,
        tokens: tuple[str | None, ...],
        ended: Callable[[], bool],
    ) -> None:
        super().__init__(config)
        self._ended = ended
        self._listening, self._has_token = listening, has_token(*tokens)
        self._arriving: set[asyncio.Task[object]] = set()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets=[])
        self._lobby = Lobby(self._listening, self._has_token, self._admit)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        self._lobby.close()
        await super().shutdown(sockets)
        if self.force_exit:  # by a second Ctrl-C: the pages are not waited for, but the application ends in order
            await self.lifespan.shutdown()

    async def on_tick(self, counter: int) -> bool:
        return await super().on_tick(counter) or self._ended()

    def _admit(self, connection: socket.socket) -> None:
        protocol = partial(Requests, self.config, self.server_state, self.lifespan.state)
        loop = asyncio.get_running_loop()
        arriving = loop.create_task(loop.connect_accepted_socket(protocol, connection))
        self._arriving.add(arriving)
        arriving.add_done_callback(self._arriving.discard)


def serve(
    app: ASGIApp, listening: socket.socket, *tokens: str | None, ended: Callable[[], bool] = lambda: False
) -> None:
    """Serve until SIGINT or SIGTERM; their previous handlers run after the last page is closed.

    In another thread than the main one signals do not end it.

    Parameters
    ----------
    app : ASGI application
    listening : socket
    *tokens : str or None
        Requests with one of them take precedence; the application decides what they may do.
    ended : callable
        Whether to end, asked ten times a second.
    """
    config = uvicorn.Config(
        app,
        http="h11",
        ws=Sockets,
        lifespan="on",
        log_config=None,
        access_log=False,
        server_header=False,
        proxy_headers=False,
        ws_max_size=4 * LONGEST,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=_GRACE_S,
    )
    # Not the default loop: that of Windows has no add_reader.
    with _switching(_SWITCH_S), asyncio.Runner(loop_factory=asyncio.SelectorEventLoop) as runner:
        runner.run(_Server(config, listening, tokens, ended).serve())


@contextmanager
def _switching(interval_s: float) -> Iterator[None]:
    before = sys.getswitchinterval()
    sys.setswitchinterval(interval_s)
    try:
        yield
    finally:
        sys.setswitchinterval(before)


def _own_address() -> str:
    """Return the address of this machine in the network; without a network, the loopback address."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_NOWHERE)
        except OSError:
            return "127.0.0.1"
        return str(probe.getsockname()[0])
