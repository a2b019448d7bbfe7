"""The door: connections wait here until they have sent something, and those without the token are refused here.

That costs a tenth of a connection in the server. So thousands that send nothing, or not the token, keep neither the
measurement waiting nor a page out.
"""

import asyncio
import socket
from collections.abc import Callable
from contextlib import suppress

from palpate.live.access.gatekeeper import HEADERS, NO_TOKEN
from palpate.live.access.limits import HEAD, PATIENCE_S, REQUESTS, STRANGERS, WAITING, Bucket

_AT_ONCE = 32
_LATER_S = 0.1
_END = b"\r\n\r\n"


class Lobby:
    """Accepts connections; hands those that have sent the token to the server.

    A request that has not arrived as a whole goes there as well, a few each second: the server waits for the rest.

    Parameters
    ----------
    listening : socket
    has_token : callable
        Whether the beginning of a request has the token.
    admit : callable
        Takes a connection with its first bytes unread.
    """

    def __init__(
        self, listening: socket.socket, has_token: Callable[[bytes], bool], admit: Callable[[socket.socket], None]
    ) -> None:
        self._listening, self._has_token, self._admit = listening, has_token, admit
        self._loop = asyncio.get_running_loop()
        self._waiting: dict[socket.socket, float] = {}
        self._requests, self._strangers = Bucket(REQUESTS), Bucket(STRANGERS)
        listening.setblocking(False)
        self._resting = self._loop.call_later(0, self._open)
        self._sweep()

    def close(self) -> None:
        """Accept no more, and close who waits."""
        self._sweeping.cancel()
        self._resting.cancel()
        self._loop.remove_reader(self._listening.fileno())
        while self._waiting:
            self._dismiss(next(iter(self._waiting)))

    def _open(self) -> None:
        self._loop.add_reader(self._listening.fileno(), self._accept)

    def _sweep(self) -> None:
        """Close who has waited too long; the oldest come first."""
        self._sweeping = self._loop.call_later(PATIENCE_S / 4, self._sweep)
        while self._waiting and self._waiting[oldest := next(iter(self._waiting))] < self._loop.time():
            self._dismiss(oldest)

    def _accept(self) -> None:
        for _ in range(_AT_ONCE):
            try:
                connection, _ = self._listening.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                return
            except OSError:  # no file descriptor is free
                self._rest()
                return
            self._receive(connection)

    def _rest(self) -> None:
        self._loop.remove_reader(self._listening.fileno())
        self._resting = self._loop.call_later(_LATER_S, self._open)

    def _receive(self, connection: socket.socket) -> None:
        if len(self._waiting) >= WAITING:
            self._dismiss(next(iter(self._waiting)))
        connection.setblocking(False)
        self._waiting[connection] = self._loop.time() + PATIENCE_S
        self._watch(connection)

    def _watch(self, connection: socket.socket) -> None:
        self._loop.add_reader(connection.fileno(), self._look, connection)

    def _look(self, connection: socket.socket) -> None:
        """Look at the first bytes, which stay in the connection."""
        try:
            head = connection.recv(HEAD, socket.MSG_PEEK)
        except OSError:
            head = b""
        known = self._has_token(head)
        if known and head and not self._requests.take():
            self._look_later(connection)
        elif not (head and (known or self._strangers.take())):
            self._dismiss(connection)
        elif known or not (_END in head or len(head) == HEAD):
            self._forget(connection)
            self._admit(connection)
        else:
            self._refuse(connection, head)

    def _look_later(self, connection: socket.socket) -> None:
        self._loop.remove_reader(connection.fileno())
        self._loop.call_later(_LATER_S, self._look_again, connection)

    def _look_again(self, connection: socket.socket) -> None:
        if connection in self._waiting:
            self._watch(connection)

    def _refuse(self, connection: socket.socket, head: bytes) -> None:
        with suppress(OSError):
            connection.recv(len(head))  # bytes left unread would take the answer with them
            connection.send(_REFUSAL)
        self._dismiss(connection)

    def _dismiss(self, connection: socket.socket) -> None:
        self._forget(connection)
        connection.close()

    def _forget(self, connection: socket.socket) -> None:
        del self._waiting[connection]
        self._loop.remove_reader(connection.fileno())


def _refusal() -> bytes:
    body = f"{NO_TOKEN}\n"
    headers = {**HEADERS, "Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body))}
    lines = ["HTTP/1.1 403 Forbidden", *(f"{name}: {value}" for name, value in headers.items()), "", body]
    return "\r\n".join(lines).encode()


_REFUSAL = _refusal()
