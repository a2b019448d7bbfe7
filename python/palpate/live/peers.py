"""Connections to the server of the page: of which user they are, and how long one may wait without the token."""

import asyncio
import ipaddress
import os
import socket
import struct
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

from palpate.live.access import ADMIT

WAIT_S = 10.0
"""How long a connection may be open without a request that has the token."""
MOST_WAITING = 64
"""How many connections may wait without the token; one more closes the oldest of them. The files of a
recording need descriptors, too, and systems give a process 256 or more."""
_ROOT = 0
_TABLES = (Path("/proc/net/tcp"), Path("/proc/net/tcp6"))


def uid_of_peer(peer: tuple[Any, ...], own: tuple[Any, ...]) -> int | None:
    """Return the user of the other end of a connection on this machine.

    Parameters
    ----------
    peer, own : tuple
        Address and port of the ends, as `socket.getpeername` and `getsockname` return them.

    Returns
    -------
    int or None
        None: the system does not say. Only Linux does, and not of an end that no process has any more.
    """
    ends = set(zip(_table_names(peer), _table_names(own), strict=True))
    for local, remote, uid, inode in _table_rows():
        if (local, remote) in ends and inode != "0":
            return int(uid)
    return None


def lists_users(listening: socket.socket) -> bool:
    """Return whether the system says of which user a connection to this socket is."""
    names = _table_names(listening.getsockname())
    return any(local in names for local, *_ in _table_rows())


def _table_rows() -> Iterator[tuple[str, str, str, str]]:
    """Yield local and remote end, uid and inode of each TCP connection that the kernel lists."""
    for table in _TABLES:
        try:
            lines = table.read_text().splitlines()[1:]
        except OSError:  # not Linux, or without IPv6
            continue
        for line in lines:
            cells = line.split()
            yield cells[1], cells[2], cells[7], cells[9]


def _table_names(address: tuple[Any, ...]) -> list[str]:
    """Return how the kernel's tables write an address: as it is, and IPv4 as a part of IPv6."""
    host = address[0].partition("%")[0]
    names = []
    for text in (host, f"::ffff:{host}"):
        try:
            packed = ipaddress.ip_address(text).packed
        except ValueError:  # IPv6 has only one form
            continue
        words = struct.unpack(f"={len(packed) // 4}I", packed)
        hexadecimal = "".join(f"{word:08X}" for word in words)
        names.append(f"{hexadecimal}:{address[1]:04X}")
    return names


class Door:
    """Closes connections of other users at once, and those that do not show the token in time.

    Parameters
    ----------
    uids : frozenset of int or None
        Users whose connections are let in, on this machine; None: those of every user.
    notify : callable
        Gets each message, once.
    """

    def __init__(self, uids: frozenset[int] | None, notify: Callable[[str], None]) -> None:
        self._uids = uids
        self._notify = notify
        self._notified: set[str] = set()
        self._waiting: dict[asyncio.Transport, asyncio.TimerHandle] = {}

    def enter(self, transport: asyncio.Transport) -> None:
        """Let a new connection wait for its token, or close it."""
        if self._uids is not None:
            uid = _uid_of(transport)
            if uid not in self._uids:
                transport.abort()
                self._say_once(
                    f"refused a connection of {_user_text(uid)}, allowed: only your own and "
                    "root's; with --no-token every user of this machine may open the page"
                )
                return
        if len(self._waiting) >= MOST_WAITING:
            self._close(next(iter(self._waiting)))
            self._say_once(
                f"more than {MOST_WAITING} connections without a request: the oldest were closed"
            )
        loop = asyncio.get_running_loop()
        self._waiting[transport] = loop.call_later(WAIT_S, self._close, transport)

    def leave(self, transport: asyncio.Transport) -> None:
        """Do not close a connection: it has shown the token, or is closed."""
        timer = self._waiting.pop(transport, None)
        if timer:
            timer.cancel()

    def _close(self, transport: asyncio.Transport) -> None:
        self.leave(transport)
        transport.abort()

    def _say_once(self, message: str) -> None:
        if message not in self._notified:
            self._notified.add(message)
            self._notify(message)


def door_for(
    listening: socket.socket, notify: Callable[[str], None], *, own_user_only: bool
) -> Door:
    """Return the door of a listening socket; the own user only where the system says who connects."""
    if own_user_only and sys.platform == "linux":
        if lists_users(listening):
            return Door(frozenset({os.getuid(), _ROOT}), notify)
        notify("this system does not say of which user a connection is: only the token is checked")
    return Door(None, notify)


class Connection(H11Protocol):
    """A connection to the server of the page."""

    def __init__(self, door: Door, **options: Any) -> None:
        super().__init__(**options)
        self._door = door

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin, unless the door closes it; `Gatekeeper` finds the way to let it stay in its scope."""
        super().connection_made(transport)
        self.app_state = {**self.app_state, ADMIT: partial(self._door.leave, transport)}
        self._door.enter(transport)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget it."""
        self._door.leave(self.transport)
        super().connection_lost(exc)


def _uid_of(transport: asyncio.Transport) -> int | None:
    peer = transport.get_extra_info("peername")
    if peer is None:  # it was reset before it was accepted, but its data can still be read
        return None
    return uid_of_peer(peer, transport.get_extra_info("sockname"))


def _user_text(uid: int | None) -> str:
    if uid is None:
        return "a user whom the system does not name"
    return f"user {uid}"
