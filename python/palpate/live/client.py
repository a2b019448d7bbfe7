"""An open page: it gets rows as soon as there are some; fewer and larger frames if it reads slowly."""

import asyncio
from collections.abc import Iterator
from itertools import count

from msgspec.structs import replace
from starlette.websockets import WebSocket

from palpate.live.multiresolution import MultiresolutionRows
from palpate.live.noise import noise_of
from palpate.live.page_commands import NoiseCommand, PageCommand, ViewCommand
from palpate.live.page_frames import FrameKind, pack
from palpate.live.protocol import DoneMessage, TouchesMessage, TouchRow, encode

FRAME_ROWS = 1024  # rows of a frame; a page that was asleep gets what it missed in several frames
HELLO = "hello"
STATE = "state"
TOUCHES = "touches"


class PageClient:
    """One open page: how far it has read the rows, the newest message of each kind, and what it asked for.

    While the connection of a page is full, as it is asleep or its line is slow, nothing more is sent; afterwards it continues
    where it stopped, so that it draws no hole. If those rows are no longer kept for it, it begins again with the recent ones,
    and asks for views of those before.
    """

    def __init__(self, socket: WebSocket, levels: MultiresolutionRows) -> None:
        self._socket = socket
        # by kind of message, in order; a number: an answer
        self._queue: dict[str | int, str | bytes] = {}
        self._numbers: Iterator[int] = count()
        self._touches: TouchesMessage | None = None  # the newest table of touches
        self._has: list[TouchRow] = []  # the rows of it that the page has
        self._something = asyncio.Event()
        self.wake = self._something.set  # look at the rows again
        self.begin(levels)

    def begin(self, levels: MultiresolutionRows) -> None:
        """Follow these rows from the oldest recent one."""
        self._levels = levels
        self._next = levels.begin
        self._is_new = True
        self.wake()

    def send_message(self, kind: str, message: str) -> None:
        """Queue a message; it replaces a message of the same kind that is still in the queue.

        The state keeps its place: an answer comes behind it. The others move to the end, behind a hello.
        """
        if kind != STATE:
            self._queue.pop(kind, None)
        self._queue[kind] = message
        self.wake()

    def send_answer(self, answer: str | bytes) -> None:
        """Queue an answer, behind the messages before it."""
        self._queue[next(self._numbers)] = answer
        self.wake()

    def show_touches(self, touches: TouchesMessage) -> None:
        """Queue the rows of the table of touches that this page lacks, if there are any."""
        if touches is not self._touches:
            self._touches = touches
            self.send_message(TOUCHES, "")

    def run(self, command: PageCommand) -> DoneMessage:
        """Do a command of this page alone; return the answer."""
        match command:
            case NoiseCommand():
                text = noise_of(self._levels.newest_rows())  # takes 1 ms
                return DoneMessage(command.do, text)
            case ViewCommand():
                rows = self._levels.view(command.from_s, command.to_s, command.rows)
                self.send_answer(pack(command.id, rows, FrameKind.VIEW))
                return DoneMessage(command.do, "")

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
            elif kind == HELLO:  # the page may forget its touches
                self._has = []
                self.send_message(TOUCHES, "")
            if isinstance(message, str):
                await self._socket.send_text(message)
            else:
                await self._socket.send_bytes(message)
            return True
        if self._is_new or self._next < self._levels.end:
            await self._socket.send_bytes(self._frame())
            return True
        return False

    def _lacking(self) -> str:
        """Return the message `touches`: of the rows only those that the page does not have yet, and the number of all."""
        assert self._touches is not None
        rows = self._touches.rows
        new = [row for row, before in zip(rows, self._has, strict=False) if row is not before]
        new += rows[len(self._has) :]
        self._has = rows
        return encode(replace(self._touches, rows=new))

    def _frame(self) -> bytes:
        missed, rows = self._levels.following(self._next, FRAME_ROWS)
        self._next += missed + len(rows)
        kind = FrameKind.ANEW if self._is_new or missed else FrameKind.NEXT
        self._is_new = False
        return pack(0, rows, kind)
