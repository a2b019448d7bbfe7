"""Random sessions with the live page, as a client could have them: each step is valid, or nearly, or not at all."""

import json
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from random import Random

from attacks import Target, drain, frame, said
from palpate.live.protocol import COMMANDS

_COMMANDS = ("seen", "tare", "tare anyway", "mark", "mark text", "note", "again", "record", "plan", "specimen", "assign",
             "discard", "keep", "more", "report", "", "seen ", None, 1, "x" * 300)  # fmt: skip
_TEXTS = (
    "here",
    "",
    " ",
    "\0",
    "é" * 200,
    "x" * 201,
    "\ud800",
    "../out.csv",
    "a; 1\nb; 2\na; 3",
    "a; 1e999\n" * 400,
    5,
    None,
)
_FRAMES = (0, 1, 30, 2**31, 2**32, -1, 1.5, True, "1", None)
_VALUES: dict[str, tuple[object, ...]] = {name: _FRAMES for name in ("frame", "id", "touch", "wanted")}
_ANY = ("text", "frame")
_CODES = (1000, 1001, 1005, 1006, 2999, 3000, 65535)


def _command(draw: Random) -> bytes:
    do = draw.choice(_COMMANDS)
    message = {name: draw.choice(_VALUES.get(name.rstrip("?"), _TEXTS)) for name in COMMANDS.get(str(do), _ANY)}
    kept = [name for name in message if draw.random() < 0.9]
    return said({"do": do, **{name.rstrip("?"): message[name] for name in kept}})


def _text(draw: Random) -> bytes:
    text = json.dumps({"do": "mark", "text": "x" * draw.randrange(300)}).encode()
    at = draw.randrange(len(text))
    return frame(1, text[:at] + draw.randbytes(draw.randrange(4)) + text[at + draw.randrange(3) :])


def _fragments(draw: Random) -> bytes:
    text = b'{"do": "seen", "frame": 1}'
    cuts = sorted(draw.randrange(len(text)) for _ in range(draw.randrange(6)))
    parts = [text[i:j] for i, j in zip([0, *cuts], [*cuts, len(text)], strict=True)]
    frames = [frame(0 if i else 1, part, end=i == len(parts) - 1) for i, part in enumerate(parts)]
    frames.insert(draw.randrange(len(frames) + 1), frame(9, b"between"))
    return b"".join(frames if draw.random() < 0.7 else frames[:-1])


def _control(draw: Random) -> bytes:
    return frame(draw.choice((9, 10)), draw.randbytes(draw.choice((0, 4, 125, 126))), end=draw.random() < 0.9)


def _odd(draw: Random) -> bytes:
    return frame(
        draw.randrange(16), draw.randbytes(draw.randrange(20)), end=draw.random() < 0.5, masked=draw.random() < 0.7
    )


def _close(draw: Random) -> bytes:
    return frame(8, draw.choice((b"", b"\x03", draw.choice(_CODES).to_bytes(2, "big") + draw.randbytes(3))))


_STEPS: list[Callable[[Random], bytes]] = [_command, _command, _command, _text, _fragments, _control, _odd, _close]


def _asked(target: Target, draw: Random) -> bytes:
    """Return a request, whole or not, with one thing changed."""
    path = draw.choice(("/", "/page.js", "/recording/run.csv", "/recording/x", "/ws", "/%ff", "//", "*", "/?token=x"))
    more = draw.choice(
        ((), ("Upgrade: websocket", "Connection: Upgrade"), ("Content-Length: 3",), ("Expect: 100-continue",))
    )
    request = bytearray(target.head(path, *more, verb=draw.choice(("GET", "GET", "HEAD", "POST", "PRI"))))
    if draw.random() < 0.5:
        request[draw.randrange(len(request))] = draw.randrange(256)
    return bytes(request[: draw.choice((len(request), draw.randrange(len(request))))])


def _send(client: socket.socket, data: bytes, draw: Random) -> None:
    at = draw.randrange(len(data)) if data and draw.random() < 0.2 else 0
    for part in (data[:at], data[at:]):
        client.sendall(part)
        if at:
            time.sleep(draw.random() * 0.02)


def play(target: Target, draw: Random) -> None:
    """Have one session: some requests, or a web socket until it is closed."""
    with suppress(OSError):
        if draw.random() < 0.3:
            with target.connect() as client:
                _send(client, _asked(target, draw), draw)
                drain(client)
            return
        with target.page() as client:
            for _ in range(draw.randrange(1, 30)):
                _send(client, draw.choice(_STEPS)(draw), draw)
                if draw.random() < 0.5:
                    drain(client)
                if draw.random() < 0.1:
                    time.sleep(draw.random() * 0.1)
