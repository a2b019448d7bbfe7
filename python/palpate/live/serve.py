"""The socket, its address, and the server, which runs until SIGINT or SIGTERM."""

import errno
import socket

import uvicorn
from starlette.types import ASGIApp

from palpate.live.protocol import LONGEST

_GRACE_S = 1
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
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(address)
        listening.listen(64)
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


def serve(app: ASGIApp, listening: socket.socket) -> None:
    """Serve until SIGINT or SIGTERM; their previous handlers run after the last page is closed."""
    config = uvicorn.Config(
        app,
        http="h11",
        ws="websockets-sansio",
        loop="asyncio",
        lifespan="on",
        log_level="warning",
        access_log=False,
        server_header=False,
        proxy_headers=False,
        ws_max_size=4 * LONGEST,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=_GRACE_S,
    )
    uvicorn.Server(config).run(sockets=[listening])


def _own_address() -> str:
    """Return the address of this machine in the network; without a network, the loopback address."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_NOWHERE)
        except OSError:
            return "127.0.0.1"
        return str(probe.getsockname()[0])
