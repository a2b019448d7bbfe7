"""Attacks on the live page, each a program that tries as fast as it can for some seconds.

python tests/tools/attacks.py KIND ADDRESS SECONDS      ADDRESS: with the token, for those kinds that have stolen it
"""

import itertools
import json
import os
import resource
import socket
import struct
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from urllib.parse import urlsplit

_PAGES = 16
"""Pages that the server allows."""
_PATIENCE_S = 3.0


class Target:
    """The server, and the end of the attack."""

    def __init__(self, address: str, seconds: float, patience_s: float = _PATIENCE_S) -> None:
        self._patience_s = patience_s
        where = urlsplit(address)
        self.port = where.port or 80
        self.host = f"{where.hostname}:{self.port}"
        self.token = where.query.removeprefix("token=")
        self._end = time.monotonic() + seconds

    def going(self) -> Iterator[int]:
        """Count until the end."""
        for number in itertools.count():
            if time.monotonic() > self._end:
                return
            yield number

    def connect(self, receive: int | None = None) -> socket.socket:
        """Open a connection; receive: size of the buffer of the kernel."""
        client = socket.socket()
        if receive:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive)
        client.settimeout(self._patience_s)
        try:
            client.connect(("127.0.0.1", self.port))
        except OSError:
            client.close()
            raise
        return client

    def head(self, path: str = "/", *more: str, verb: str = "GET", known: bool = True) -> bytes:
        """Return a request with the stolen cookie, or without."""
        cookie = [f"Cookie: palpate-{self.port}={self.token}"] if known else []
        return "\r\n".join([f"{verb} {path} HTTP/1.1", f"Host: {self.host}", *cookie, *more, "", ""]).encode("latin-1")

    def page(self, receive: int | None = None) -> socket.socket:
        """Open a web socket."""
        client = self.connect(receive)
        upgrade = ("Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==")
        client.sendall(self.head("/ws", f"Origin: http://{self.host}", *upgrade, "Sec-WebSocket-Version: 13"))
        if not client.recv(4096).startswith(b"HTTP/1.1 101"):
            client.close()
            raise ConnectionRefusedError
        return client


def frame(opcode: int, payload: bytes = b"", *, end: bool = True, masked: bool = True) -> bytes:
    """Return a frame of a web socket; the mask is 0."""
    size = len(payload)
    length = (
        bytes([size])
        if size < 126
        else struct.pack("!BH", 126, size)
        if size < 65536
        else struct.pack("!BQ", 127, size)
    )
    return bytes([end * 0x80 | opcode, length[0] | 0x80 * masked]) + length[1:] + b"\0\0\0\0" * masked + payload


def said(message: object) -> bytes:
    """Return a message of a page as a frame."""
    return frame(1, json.dumps(message).encode())


def drain(client: socket.socket) -> None:
    """Read what has come, without waiting; raise OSError after the end."""
    client.setblocking(False)
    try:
        while client.recv(1 << 20):
            pass
        raise ConnectionResetError
    except BlockingIOError:
        client.settimeout(_PATIENCE_S)


def flood(target: Target, data: bytes, *, pages: int = 1, read: bool = True) -> None:
    """Send the same bytes on web sockets without a pause; open them again when they are closed."""
    open_: list[socket.socket] = []
    for _ in target.going():
        with suppress(OSError):
            while len(open_) < pages:
                open_.append(target.page())
        for client in list(open_):
            try:
                client.sendall(data)
                if read:
                    drain(client)
            except OSError:
                client.close()
                open_.remove(client)


def hold(target: Target, count: int, first: bytes, drip: bytes, every_s: float = 0.2) -> None:
    """Hold many connections open, and send a little on each now and then."""
    open_: list[socket.socket] = []
    for _ in target.going():
        with suppress(OSError):
            while len(open_) < count:
                open_.append(target.connect())
                open_[-1].sendall(first)
        for client in list(open_):
            try:
                client.sendall(drip)
                drain(client)
            except OSError:
                client.close()
                open_.remove(client)
        time.sleep(every_s)


def ask(target: Target, request: bytes, *, read: bool = True) -> None:
    """Send the same request on a new connection each time."""
    for _ in target.going():
        with suppress(OSError), target.connect() as client:
            client.sendall(request)
            while read and client.recv(1 << 20):
                pass


def storm(target: Target) -> None:
    """Connect and close."""
    for _ in target.going():
        with suppress(OSError):
            target.connect().close()


def keep_asking(target: Target, request: bytes) -> None:
    """Send requests on one connection without waiting for the answers, as long as it lives."""
    for _ in target.going():
        with suppress(OSError), target.connect() as client:
            for _ in target.going():
                client.sendall(request * 20)
                drain(client)


def endless(target: Target, first: bytes, data: bytes) -> None:
    """Send a body without end."""
    for _ in target.going():
        with suppress(OSError), target.connect() as client:
            client.sendall(first)
            for _ in target.going():
                client.sendall(data)


def deaf(target: Target, request: bytes | None, count: int) -> None:
    """Open many web sockets, or requests, and read nothing."""
    open_: list[socket.socket] = []
    for _ in target.going():
        with suppress(OSError):
            while len(open_) < count:
                open_.append(target.connect(4096) if request else target.page(4096))
                if request:
                    open_[-1].sendall(request)
        time.sleep(0.2)


def deep(target: Target) -> None:
    """Send messages that take the longest to refuse."""
    nested, digits = frame(1, b"[" * 4000), frame(1, b'{"do":' + b"9" * 4000 + b"}")
    flood(target, nested + digits)


def reopen(target: Target) -> None:
    """Open and close pages."""
    for _ in target.going():
        with suppress(OSError):
            target.page().close()


_LIST = "\n".join(f"{k}; {k + 1}" for k in range(200))
_END = b"\r\n\r\n"
_SLOW = "Content-Length: 100000"
_CHUNKED = "Transfer-Encoding: chunked"
KINDS: dict[str, Callable[[Target], None]] = {
    # with the token
    "seen": lambda t: flood(t, said({"do": "seen", "frame": 1}) * 500),
    "seen on 16 pages": lambda t: flood(t, said({"do": "seen", "frame": 1}) * 50, pages=_PAGES),
    "marks": lambda t: flood(t, (said({"do": "mark"}) + said({"do": "mark text", "id": 1, "text": "x" * 200})) * 20),
    "plans": lambda t: flood(t, said({"do": "plan", "text": _LIST, "wanted": 99}) + said({"do": "specimen", "name": "7"})),
    "notes": lambda t: flood(t, said({"do": "note", "text": "x" * 200}) * 20),
    "recordings": lambda t: flood(t, said({"do": "record", "name": "../../out.csv"}) * 20),
    "touches": lambda t: flood(t, (said({"do": "discard", "touch": 1}) + said({"do": "more"})) * 50),
    "unknown commands": lambda t: flood(t, said({"do": "x"}) * 200),
    "pings": lambda t: flood(t, frame(9) * 1000),
    "pings, nothing read": lambda t: flood(t, frame(9, b"x" * 125) * 100, read=False),
    "pongs": lambda t: flood(t, frame(10) * 1000),
    "empty fragments": lambda t: flood(t, frame(1, end=False) + frame(0, end=False) * 1000),
    "message of 16 MB": lambda t: flood(t, frame(1, b"x" * (16 << 20))),
    "deep JSON": deep,
    "invalid UTF-8": lambda t: flood(t, frame(1, b"\xff\xfe\xfd")),
    "frames without a mask": lambda t: flood(t, frame(1, b"{}", masked=False)),
    "web sockets, nothing read": lambda t: deaf(t, None, _PAGES),
    "pages opened and closed": reopen,
    "files": lambda t: keep_asking(t, t.head("/charts/charts.js")),
    "files, new connections": lambda t: ask(t, t.head("/charts/charts.js")),
    "downloads": lambda t: ask(t, t.head("/recording/run.csv")),
    "downloads, nothing read": lambda t: deaf(t, t.head("/recording/run.csv"), 100),
    # without the token
    "slow headers": lambda t: hold(t, 200, b"GET / HTTP/1.1\r\n", b"x"),
    "slow bodies": lambda t: hold(t, 200, t.head("/", _SLOW, verb="POST", known=False), b"x"),
    "half-open": lambda t: hold(t, 1100, b"", b""),
    "connections": storm,
    "no token": lambda t: keep_asking(t, t.head(known=False)),
    "big cookie": lambda t: ask(t, t.head("/", f"Cookie: palpate-{t.port}=\"" + "\\" * 60000 + '"', known=False)),
    "big query": lambda t: ask(t, t.head("/?" + "&".join(map(str, range(12000))), known=False)),
    "many headers": lambda t: ask(t, t.head("/", *["a: b"] * 9000, known=False)),
    "smuggled lengths": lambda t: keep_asking(t, t.head("/", _SLOW, _CHUNKED, verb="POST", known=False) + b"0\r\n\r\n" + t.head(known=False)),
    "endless chunks": lambda t: endless(t, t.head("/", _CHUNKED, verb="POST", known=False), b"1\r\nx\r\n" * 20000),
    "random bytes": lambda t: ask(t, os.urandom(4000) + _END),
}  # fmt: skip


def honest(target: Target) -> None:
    """Read all frames and confirm every fourth, as the page does; open the page again when it is closed."""
    for _ in target.going():
        with suppress(OSError), target.page() as client, client.makefile("rb") as incoming:
            for _ in target.going():
                opcode, length = incoming.read(2) or (8, 0)
                if opcode & 15 == 8:
                    break
                size = {126: ">H", 127: ">Q"}.get(length)
                payload = incoming.read(
                    struct.unpack(size, incoming.read(struct.calcsize(size)))[0] if size else length
                )
                frame = int.from_bytes(payload[4:8], "little")
                if opcode & 15 == 2 and frame % 4 == 0:
                    client.sendall(said({"do": "seen", "frame": frame}))


def fresh(target: Target) -> float:
    """Open the page as a browser does; return the time until its first samples are there, s."""
    begun = time.monotonic()
    for path in ("/page.js", "/charts/charts.js"):
        with target.connect() as client, client.makefile("rb") as incoming:
            client.sendall(target.head(path, "Connection: close"))
            if b" 200 " not in incoming.read(100):
                raise ConnectionRefusedError
    with target.page() as client:
        while not client.recv(1 << 20):
            pass
    return time.monotonic() - begun


def allow_files(count: int) -> None:
    """Allow this process so many open connections."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, min(count, hard)), hard))


def main() -> int:
    """Attack."""
    allow_files(1500)
    KINDS.get(sys.argv[1], honest)(Target(sys.argv[2], float(sys.argv[3])))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
