"""An open page: it gets rows as soon as there are some; fewer and larger frames if it reads slowly."""

import asyncio

from starlette.websockets import WebSocket

from palpate.live.feed import Document, Kind, message_of, pack
from palpate.live.levels import Levels
from palpate.live.noise import noise_of

FRAME_ROWS = 1024  # rows of a frame; a page that was asleep gets what it missed in several frames
TOUCHES = "touches"


class Page:
    """One open page: how far it has read the rows, the newest message of each kind, and what it asked for.

    While the connection of a page is full, as it is asleep or its line is slow, nothing more is sent; afterwards it continues
    where it stopped, so that it draws no hole. If those rows are no longer kept for it, it begins again with the recent ones,
    and asks for views of those before.
    """

    def __init__(self, socket: WebSocket, levels: Levels) -> None:
        self._socket = socket
        self._queue: dict[object, str | bytes] = {}
        self._touches: Document = {"rows": []}  # the newest table of touches
        self._has: list[Document] = []  # the rows of it that the page has
        self._something = asyncio.Event()
        self.wake = self._something.set  # look at the rows again
        self.begin(levels)

    def begin(self, levels: Levels) -> None:
        """Follow these rows from the oldest recent one."""
        self._levels, self._next, self._anew = levels, levels.begin, True
        self.wake()

    def tell(self, kind: object, message: str | bytes) -> None:
        """Queue a message; it replaces a message of the same kind that is still in the queue."""
        self._queue[kind] = message
        self.wake()

    def show_touches(self, touches: Document) -> None:
        """Queue the rows of the table of touches that this page lacks, if there are any."""
        if touches is not self._touches:
            self._touches = touches
            self.tell(TOUCHES, "")

    def view(self, id: int, from_s: float, to_s: float, rows: int) -> str:
        """Queue a view."""
        self.tell(object(), pack(id, self._levels.view(from_s, to_s, rows), Kind.VIEW))
        return ""

    def noise(self) -> str:
        """Return the noise of the newest samples without contact, in words; takes 1 ms."""
        return noise_of(self._levels.newest_rows())

    async def send(self) -> None:
        """Send the queue, until cancelled."""
        while True:
            self._something.clear()
            while await self._send_next():
                pass
            await self._something.wait()

    async def _send_next(self) -> bool:
        """Send what comes first, and return whether there was something that may be sent now."""
        if self._queue:
            kind = next(iter(self._queue))
            message = self._queue.pop(kind)
            if kind == TOUCHES:
                message = self._lacking()
            elif kind == "hello":  # the page may forget its touches
                self._has = []
                self.tell(TOUCHES, "")
            await (
                self._socket.send_text(message)
                if isinstance(message, str)
                else self._socket.send_bytes(message)
            )
        elif self._anew or self._next < self._levels.end:
            await self._socket.send_bytes(self._frame())
        else:
            return False
        return True

    def _lacking(self) -> str:
        """Return the message `touches`: of the rows only those that the page does not have yet, and the number of all."""
        rows, has = self._touches["rows"], self._has
        new = [row for at, row in enumerate(rows) if at >= len(has) or row is not has[at]]
        self._has = rows
        return message_of(TOUCHES, **{**self._touches, "rows": new, "count": len(rows)})

    def _frame(self) -> bytes:
        missed, rows = self._levels.following(self._next, FRAME_ROWS)
        self._next += missed + len(rows)
        kind, self._anew = Kind.ANEW if self._anew or missed else Kind.NEXT, False
        return pack(0, rows, kind)
