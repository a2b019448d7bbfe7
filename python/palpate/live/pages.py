"""One open page: what it gets, and in which order."""

import asyncio
from collections import deque
from collections.abc import Awaitable
from typing import Protocol

from palpate.live.access.limits import TRACES, VIEWS, VIEWS_WAITING, Bucket
from palpate.live.feed import Kind, pack
from palpate.live.levels import Levels
from palpate.live.protocol import Command

AHEAD = 30  # sent frames that a page has not confirmed; more would only fill buffers and be shown late
ROWS = 1024
"""Rows of a frame; a page that was asleep gets what it missed in several frames."""
_ANSWERS = 32


class Sending(Protocol):
    """The methods of a web socket that a page needs."""

    def send_text(self, data: str) -> Awaitable[None]: ...  # noqa: D102
    def send_bytes(self, data: bytes) -> Awaitable[None]: ...  # noqa: D102


class Page:
    """One open page: how far it has read the rows, the newest message of each kind, and what it asked for.

    The page confirms every fourth frame. One that confirms nothing, asleep or on a slow line, gets nothing more;
    afterwards it continues where it stopped, so that it draws no hole. If those rows are no longer kept for it, it begins
    again with the recent ones, and asks for views of those before.

    Attributes
    ----------
    sent : int
        Number of frames sent; views are not counted.
    lost : int
        Number of rows that it did not get.
    listens : bool
        Whether it shows the noise.
    traces : Bucket
        Counts the courses of touches that it asks for.
    """

    def __init__(self, socket: Sending) -> None:
        self.sent: int = 0
        self.lost: int = 0
        self.listens: bool = False
        self.traces: Bucket = Bucket(TRACES)
        self._socket = socket
        self._unseen: deque[int] = deque()
        self._latest: dict[str, str] = {}
        self._answers: deque[str] = deque(maxlen=_ANSWERS)
        self._views: deque[Command] = deque(maxlen=VIEWS_WAITING)
        self._looks = Bucket(VIEWS)
        self._something = asyncio.Event()
        self.begin(Levels())

    def begin(self, levels: Levels) -> None:
        """Follow these rows from the oldest recent one."""
        self._levels, self._next, self._anew = levels, levels.recent.begin, True
        self._something.set()

    def wake(self) -> None:
        """Look at the rows again."""
        self._something.set()

    def tell(self, kind: str, message: str) -> None:
        """Queue a message; it replaces a message of the same kind that is still in the queue."""
        self._latest[kind] = message
        self._something.set()

    def answer(self, message: str) -> None:
        """Queue the answer to a command of the page."""
        self._answers.append(message)
        self._something.set()

    def look(self, view: Command) -> None:
        """Queue a view; of too many the newest are sent."""
        self._views.append(view)
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
            while await self._send_next():
                pass
            if self._views:
                asyncio.get_running_loop().call_later(1 / VIEWS.per_s, self._something.set)
            await self._something.wait()

    async def _send_next(self) -> bool:
        """Send what comes first, and return whether there was something that may be sent now."""
        if self._latest:  # the state before the answer, so that the page shows it when the answer arrives
            await self._socket.send_text(self._latest.pop(next(iter(self._latest))))
        elif self._answers:
            await self._socket.send_text(self._answers.popleft())
        elif self._views and self._looks.take():
            await self._socket.send_bytes(self._view(self._views.popleft()))
        elif self._has_rows():
            await self._socket.send_bytes(self._frame())
        else:
            return False
        return True

    def _has_rows(self) -> bool:
        return len(self._unseen) < AHEAD and (self._anew or self._next < self._levels.recent.end)

    def _frame(self) -> bytes:
        missed, rows = self._levels.following(self._next, ROWS)
        self.lost += missed
        self._next += missed + len(rows)
        self.sent += 1
        self._unseen.append(self.sent)
        kind, self._anew = Kind.ANEW if self._anew or missed else Kind.NEXT, False
        return pack(self.sent, rows, kind)

    def _view(self, asked: Command) -> bytes:
        rows = self._levels.view(asked["from_s"], asked["to_s"], asked["rows"])
        return pack(asked["id"], rows, Kind.VIEW)
