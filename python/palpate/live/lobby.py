"""The door: connections wait here, at little cost, until they have sent something.

A connection costs 0.03 ms here, and 0.5 ms in the server. So thousands that send nothing, or not the token, keep neither
the measurement waiting nor a page out.
"""

import asyncio
import socket
from collections.abc import Callable

from palpate.live.limits import HEAD, PATIENCE_S, REQUESTS, STRANGERS, WAITING, Bucket

_AT_ONCE = 32
_NO_FILES_S = 0.1


class Lobby:
    """Accepts connections; hands those that have sent something to the server.

    Parameters
    ----------
    listening : socket
    is_known : callable
        Whether the beginning of a request has the token.
    admit : callable
        Takes a connection with its first bytes unread.
    """

    def __init__(
        self, listening: socket.socket, is_known: Callable[[bytes], bool], admit: Callable[[socket.socket], None]
    ) -> None:
        self._listening, self._is_known, self._admit = listening, is_known, admit
        self._loop = asyncio.get_running_loop()
        self._waiting: dict[socket.socket, asyncio.TimerHandle] = {}
        self._known, self._strangers = Bucket(REQUESTS), Bucket(STRANGERS)
        listening.setblocking(False)
        self._open()

    def close(self) -> None:
        """Accept no more, and close who waits."""
        self._loop.remove_reader(self._listening)
        while self._waiting:
            self._dismiss(next(iter(self._waiting)))

    def _open(self) -> None:
        self._loop.add_reader(self._listening, self._accept)

    def _accept(self) -> None:
        for _ in range(_AT_ONCE):
            try:
                connection, _ = self._listening.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                return
            except OSError:  # no file descriptor is free
                self._loop.remove_reader(self._listening)
                self._loop.call_later(_NO_FILES_S, self._open)
                return
            self._receive(connection)

    def _receive(self, connection: socket.socket) -> None:
        if len(self._waiting) >= WAITING:
            self._dismiss(next(iter(self._waiting)))
        connection.setblocking(False)
        self._waiting[connection] = self._loop.call_later(PATIENCE_S, self._dismiss, connection)
        self._loop.add_reader(connection, self._look, connection)

    def _look(self, connection: socket.socket) -> None:
        """Look at the first bytes, which stay in the connection."""
        try:
            head = connection.recv(HEAD, socket.MSG_PEEK)
        except OSError:
            head = b""
        known = self._is_known(head)
        if head and (self._known if known else self._strangers).take():
            self._forget(connection)
            self._admit(connection)
        else:
            self._dismiss(connection)

    def _dismiss(self, connection: socket.socket) -> None:
        self._forget(connection)
        connection.close()

    def _forget(self, connection: socket.socket) -> None:
        self._waiting.pop(connection).cancel()
        self._loop.remove_reader(connection)
