"""Sends the measurement to the pages as soon as there are rows; fewer and larger frames to a page that reads slowly."""

import asyncio
from contextlib import suppress
from typing import Any

from starlette.websockets import WebSocket

from palpate.live.commands import COMMANDS, Workbench
from palpate.live.feed import Document, Kind, message_of, pack
from palpate.live.levels import Levels
from palpate.live.noise import noise_of

PAGES = 16
FRAME_ROWS = 1024  # rows of a frame; a page that was asleep gets what it missed in several frames
_STATES_PER_S = 5
_TOUCHES = "touches"


class Page:
    """One open page: how far it has read the rows, the newest message of each kind, and what it asked for.

    While the connection of a page is full, as it is asleep or its line is slow, nothing more is sent; afterwards it continues
    where it stopped, so that it draws no hole. If those rows are no longer kept for it, it begins again with the recent ones,
    and asks for views of those before.
    """

    def __init__(self, socket: WebSocket, bench: Workbench) -> None:
        self._socket, self._bench = socket, bench
        self._queue: dict[object, str | bytes] = {}
        self._touches: Document = {"rows": []}  # the newest table of touches
        self._has: list[Document] = []  # the rows of it that the page has
        self._something = asyncio.Event()
        self.wake = self._something.set  # look at the rows again
        self.begin(bench.measurement.levels)

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
            self.tell(_TOUCHES, "")

    def do(self, do: str, /, **given: Any) -> Document:
        """Obey a command that is about this page alone; return the answer, empty without one."""
        answer = getattr(self, COMMANDS[do].obeys.removeprefix("page."))(**given)
        return {} if answer is None else {"message": answer}

    def look(self, id: int, from_s: float, to_s: float, rows: int) -> None:
        """Queue a view."""
        self.tell(object(), pack(id, self._levels.view(from_s, to_s, rows), Kind.VIEW))

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
            if kind == _TOUCHES:
                message = self._lacking()
            elif kind == "hello":  # the page may forget its touches
                self._has = []
                self.tell(_TOUCHES, "")
            await (self._socket.send_text(message) if isinstance(message, str) else self._socket.send_bytes(message))
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
        return message_of(_TOUCHES, **{**self._touches, "rows": new, "count": len(rows)})

    def _frame(self) -> bytes:
        missed, rows = self._levels.following(self._next, FRAME_ROWS)
        self._next += missed + len(rows)
        kind, self._anew = Kind.ANEW if self._anew or missed else Kind.NEXT, False
        return pack(0, rows, kind)


class Hub:
    """All pages of a workbench; runs in the event loop of the server."""

    def __init__(self, bench: Workbench) -> None:
        self.pages: set[Page] = set()
        self._bench, self._measurement = bench, bench.measurement
        self._number = self._measurement.number
        self._told: dict[str, str] = {}

    def join(self, page: Page) -> None:
        """Add a page and send it everything."""
        self._announce("hello")
        for kind, message in self._told.items():
            page.tell(kind, message)
        page.show_touches(self._bench.documents[_TOUCHES]())
        self.pages.add(page)

    async def run(self) -> None:
        """Send rows when they come, and states, until cancelled."""
        loop = asyncio.get_running_loop()

        def look() -> None:
            with suppress(RuntimeError):  # the server has ended
                loop.call_soon_threadsafe(self._look)

        self._measurement.on_rows = look
        while True:
            self._look()
            self.send_state()
            await asyncio.sleep(1 / _STATES_PER_S)

    def send_state(self) -> None:
        """Send the state to every page, and each other document that has changed."""
        for kind in self._bench.documents:
            if kind != _TOUCHES:
                self._announce(kind)
        touches = self._bench.documents[_TOUCHES]()
        state = message_of("state", **self._bench.state())
        for page in self.pages:
            page.show_touches(touches)
            page.tell("state", state)

    def _announce(self, kind: str) -> None:
        """Send a document to every page, if it has changed."""
        message = message_of(kind, **self._bench.documents[kind]())
        if self._told.get(kind) != message:
            self._told[kind] = message
            for page in self.pages:
                page.tell(kind, message)

    def _look(self) -> None:
        if self._number != self._measurement.number:
            self._number = self._measurement.number
            self.send_state()
            for page in self.pages:
                page.begin(self._measurement.levels)
        for page in self.pages:
            page.wake()
        if self._bench.is_news():
            self.send_state()
