"""The server's protocols with limits that uvicorn does not have: counted when bytes arrive, before they are parsed."""

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import CloseCode, Frame

from palpate.live.access.limits import BYTES, FRAGMENTS, HEAD, LINES, OPEN, PATIENCE_S, Bucket

_END = b"\r\n\r\n"


def fault(head: bytes | bytearray) -> str:
    """Return why the beginning of a request is refused, or nothing.

    Examples
    --------
    >>> fault(b"GET / HTTP/1.1")
    ''
    >>> fault(b"POST / HTTP/1.1")
    'request: allowed: GET and HEAD, without a body'
    """
    if not head.startswith((b"GET ", b"HEAD ")[: len(head)]) and len(head) >= len(_END):
        return "request: allowed: GET and HEAD, without a body"
    if len(head) > HEAD or head.count(b"\n") > LINES:
        return f"request: got {len(head)} bytes or more, allowed: {HEAD} in {LINES} lines; remove cookies of this host"
    if _END in head[: -len(_END)]:
        return "request: got more than one, allowed: one on a connection, without a body"
    return ""


class Requests(H11Protocol):
    """One request on a connection: it arrives within 5 s, as a whole, and its answer is taken in time."""

    transport: asyncio.Transport

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._head, self._asked = bytearray(), False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Start the clock; make room for a new connection."""
        super().connection_made(transport)
        self._clock = self.loop.call_later(PATIENCE_S, transport.abort)
        if len(self.connections) > OPEN:
            unasked = [one for one in self.connections if isinstance(one, Requests) and not one._asked]
            min(unasked, key=lambda one: one._clock.when()).transport.abort()

    def data_received(self, data: bytes) -> None:
        """Collect the request; forward it when it is complete."""
        if self._asked:
            self.transport.abort()
            return
        self._head += data
        if reason := fault(self._head):
            self._refuse(reason)
        elif self._head.endswith(_END):
            self._asked = True
            self._clock.cancel()
            super().data_received(bytes(self._head))

    def pause_writing(self) -> None:
        """Start the clock: the client does not read."""
        super().pause_writing()
        self._clock = self.loop.call_later(2 * PATIENCE_S, self.transport.abort)

    def resume_writing(self) -> None:
        """Stop the clock."""
        self._clock.cancel()
        super().resume_writing()

    def on_response_complete(self) -> None:
        """Give the client time to take the end of the answer."""
        self._clock.cancel()
        self._clock = self.loop.call_later(2 * PATIENCE_S, self.transport.abort)
        super().on_response_complete()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the clock."""
        self._clock.cancel()
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Stop the clock: the web socket has its own."""
        self._clock.cancel()
        super().handle_websocket_upgrade(event)

    def _refuse(self, reason: str) -> None:
        self._asked = True
        body = f"{reason}\n".encode()
        head = (
            f"HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain\r\nContent-Length: {len(body)}\r\nConnection: close"
        )
        self.transport.write(head.encode() + _END + body)
        self.transport.close()


class Sockets(WebSocketsSansIOProtocol):
    """A web socket of a page: few bytes a second, few fragments, and it reads what it gets."""

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        self._bytes, self._fragments = Bucket(BYTES), 0
        self._clock: asyncio.TimerHandle | None = None

    def data_received(self, data: bytes) -> None:
        """Parse what arrives, if it is not too much."""
        if self.handshake_complete and not self._bytes.take(len(data)):
            self._end(f"messages: got more, allowed: {BYTES.per_s:.0f} bytes a second")
        else:
            super().data_received(data)

    def handle_cont(self, event: Frame) -> None:
        """Take a fragment, if there are not too many."""
        self._fragments = 0 if event.fin else self._fragments + 1
        if self._fragments > FRAGMENTS:
            self._end(f"message: got more fragments, allowed: {FRAGMENTS}")
        else:
            super().handle_cont(event)

    def pause_writing(self) -> None:
        """Start the clock: the client does not read."""
        super().pause_writing()
        self._clock = self.loop.call_later(2 * PATIENCE_S, self.transport.abort)

    def resume_writing(self) -> None:
        """Stop the clock."""
        self._stop_clock()
        super().resume_writing()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the clock."""
        self._stop_clock()
        super().connection_lost(exc)

    def _stop_clock(self) -> None:
        if self._clock:
            self._clock.cancel()

    def _end(self, reason: str) -> None:
        self.conn.fail(CloseCode.POLICY_VIOLATION, reason)
        self.handle_parser_exception()
