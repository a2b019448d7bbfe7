"""Sends the measurement to the pages as soon as there are rows; fewer and larger frames to a page that reads slowly."""

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Protocol

from palpate.live.feed import History, joined, pack
from palpate.live.protocol import told
from palpate.live.workbench import Workbench

AHEAD = 30  # sent frames that a page has not confirmed; more would only fill buffers and be shown late
ROWS = 1024
"""Rows of a frame; a page that was asleep gets what it missed in several frames."""
PAGES = 16
_STATES_PER_S = 5
_ANSWERS = 32


class Sending(Protocol):
    """The methods of a web socket that a page needs."""

    def send_text(self, data: str) -> Awaitable[None]: ...  # noqa: D102
    def send_bytes(self, data: bytes) -> Awaitable[None]: ...  # noqa: D102


class Page:
    """One open page: how far it has read the history, and the newest message of each kind.

    The page confirms every fourth frame. One that confirms nothing, asleep or on a slow line, gets nothing more;
    afterwards it continues where it stopped, so that it draws no hole. If the history no longer has those rows, it begins again.

    Attributes
    ----------
    sent : int
        Number of frames sent.
    lost : int
        Number of samples that the history no longer had.
    """

    def __init__(self, socket: Sending) -> None:
        self.sent: int = 0
        self.lost: int = 0
        self._socket = socket
        self._unseen: deque[int] = deque()
        self._latest: dict[str, str] = {}
        self._answers: deque[str] = deque(maxlen=_ANSWERS)
        self._something = asyncio.Event()
        self.begin(History())

    def begin(self, history: History) -> None:
        """Follow this history from its beginning."""
        self._history, self._next, self._past = history, history.begin, True
        self._something.set()

    def wake(self) -> None:
        """Look at the history again."""
        self._something.set()

    def tell(self, kind: str, message: str) -> None:
        """Queue a message; it replaces a message of the same kind that is still in the queue."""
        self._latest[kind] = message
        self._something.set()

    def answer(self, message: str) -> None:
        """Queue the answer to a command of the page."""
        self._answers.append(message)
        self._something.set()

    def seen(self, number: int) -> None:
        """Confirm all frames up to this number."""
        while self._unseen and self._unseen[0] <= number:
            self._unseen.popleft()
        self._something.set()

    async def send(self) -> None:
        """Send the queue, until cancelled."""
        while True:
            self._something.clear()
            await self._send_waiting()
            await self._something.wait()

    async def _send_waiting(self) -> None:
        while self._answers or self._latest or self._has_rows():
            if self._latest:  # the state before the answer, so that the page shows it when the answer arrives
                await self._socket.send_text(self._latest.pop(next(iter(self._latest))))
            elif self._answers:
                await self._socket.send_text(self._answers.popleft())
            else:
                await self._socket.send_bytes(self._frame())

    def _has_rows(self) -> bool:
        return len(self._unseen) < AHEAD and (self._past or self._next < self._history.end)

    def _frame(self) -> bytes:
        missed = max(self._history.begin - self._next, 0)
        self.lost += missed
        self._next += missed
        rows = self._history.rows(self._next, ROWS)
        self._next += len(rows)
        self.sent += 1
        self._unseen.append(self.sent)
        past, self._past = self._past or missed > 0, False
        return pack(self.sent, rows, past=past)


class Hub:
    """All pages of a workbench; runs in the event loop of the server.

    Parameters
    ----------
    bench : Workbench
    """

    def __init__(self, bench: Workbench) -> None:
        self.pages: set[Page] = set()
        self._bench, self._session = bench, bench.session
        self._history = History()
        self._measurement = bench.session.number
        self._told: dict[str, str] = {}

    def join(self, page: Page) -> None:
        """Add a page and send it everything."""
        self._greet(page)
        for kind, message in self._told.items():
            page.tell(kind, message)
        page.begin(self._history)
        self.pages.add(page)

    async def run(self) -> None:
        """Send rows when they come, and states, until cancelled."""
        loop = asyncio.get_running_loop()

        def take() -> None:
            with suppress(RuntimeError):  # the server has ended
                loop.call_soon_threadsafe(self._take)

        self._session.on_rows = take
        while True:
            self._take()
            self.send_state()
            await asyncio.sleep(1 / _STATES_PER_S)

    def send_state(self) -> None:
        """Send the state to every page, and each other document that has changed."""
        for kind, document in self._bench.told.items():
            self._announce(kind, told(kind, **document()))
        state = self._bench.state()
        for page in self.pages:
            page.tell("state", told("state", **state, frames={"sent": page.sent, "lost": page.lost}))

    def _greet(self, page: Page) -> None:
        page.tell("hello", told("hello", **self._bench.hello()))

    def _announce(self, kind: str, message: str) -> None:
        if self._told.get(kind) != message:
            self._told[kind] = message
            self._for_all(lambda page: page.tell(kind, message))

    def _take(self) -> None:
        number, parts = self._session.number, self._session.take()
        if number != self._measurement:
            self._measurement, self._history = number, History()
            self._for_all(lambda page: page.begin(self._history))
            self._for_all(self._greet)
        if len(rows := joined(parts)):
            self._history.add(rows)
            self._for_all(Page.wake)

    def _for_all(self, do: Callable[[Page], None]) -> None:
        for page in self.pages:
            do(page)
