"""Sends the measurement to the pages as soon as there are rows; fewer and larger frames to a page that reads slowly."""

import asyncio
from collections.abc import Callable, Collection
from contextlib import suppress

from palpate._core import Touch
from palpate.live.pages import Page
from palpate.live.protocol import Command, Refused, told
from palpate.live.traces import trace_of
from palpate.live.workbench import Workbench

PAGES = 16
_STATES_PER_S = 5
_TRACES = 24  # courses of touches that a page gets when it is opened


class Hub:
    """All pages of a workbench; runs in the event loop of the server.

    Parameters
    ----------
    bench : Workbench
    """

    def __init__(self, bench: Workbench) -> None:
        self.pages: set[Page] = set()
        self._bench, self._session = bench, bench.session
        self._measurement = bench.session.number
        self._told: dict[str, str] = {}
        self._traced = 0

    def join(self, page: Page) -> None:
        """Add a page and send it everything."""
        self._announce("hello", told("hello", **self._bench.hello()))
        for kind, message in self._told.items():
            page.tell(kind, message)
        page.begin(self._session.levels)
        self.pages.add(page)
        self._send_traces([page], 0)

    def hear(self, page: Page, command: Command) -> bool:
        """Obey a command that is about this page alone; return whether it is one.

        Raises
        ------
        Refused
            There is no such touch, or the page asks for too many.
        """
        about: dict[str, Callable[[Page, Command], None]] = {
            "seen": lambda page, command: page.seen(command["frame"]),
            "view": Page.look,
            "trace": self._show_trace,
            "noise": self._listen,
        }
        if command.do not in about:
            return False
        about[command.do](page, command)
        return True

    async def run(self) -> None:
        """Send rows when they come, and states, until cancelled."""
        loop = asyncio.get_running_loop()

        def look() -> None:
            with suppress(RuntimeError):  # the server has ended
                loop.call_soon_threadsafe(self._look)

        self._session.on_rows = look
        while True:
            self._look()
            self.send_state()
            await asyncio.sleep(1 / _STATES_PER_S)

    def send_state(self) -> None:
        """Send the state to every page, and each other document that has changed."""
        self._announce("hello", told("hello", **self._bench.hello()))
        for kind, document in self._bench.told.items():
            self._announce(kind, told(kind, **document()))
        self._send_traces(self.pages, self._traced)
        self._send_noise()
        state = self._bench.state()
        for page in self.pages:
            page.tell("state", told("state", **state, frames={"sent": page.sent, "lost": page.lost}))

    def _show_trace(self, page: Page, command: Command) -> None:
        number, touches = command["touch"], self._session.touches
        if not 1 <= number <= len(touches):
            raise Refused(f"trace: got touch {number}, allowed: 1 to {len(touches)}, those that have ended")
        if not page.traces.take():
            raise Refused("trace: too many touches; wait a second")
        page.tell(*self._trace(number, touches[number - 1]))

    def _listen(self, page: Page, command: Command) -> None:
        page.listens = command["on"]
        page.answer(told("done", do="noise", message="" if page.listens else "The noise is no longer computed."))

    def _send_noise(self) -> None:
        listening = [page for page in self.pages if page.listens]
        if listening and (found := self._bench.noise.document()):
            for page in listening:
                page.tell("noise", told("noise", **found))

    def _send_traces(self, pages: Collection[Page], after: int) -> None:
        """Send the courses of the newest completed touches, after the touch of this number."""
        touches = self._session.touches
        for number in range(max(after, len(touches) - _TRACES), len(touches)) if pages else ():
            trace = self._trace(number + 1, touches[number])
            for page in pages:
                page.tell(*trace)
        self._traced = len(touches)

    def _trace(self, number: int, touch: Touch) -> tuple[str, str]:
        """Return the course of a touch: what it replaces, and the message."""
        session, start_s = self._session, touch.start_s
        trace = trace_of(number, start_s, session.ends.get(number, start_s), session.levels)
        return f"trace {number}", told("trace", **trace)

    def _announce(self, kind: str, message: str) -> None:
        if self._told.get(kind) != message:
            self._told[kind] = message
            self._for_all(lambda page: page.tell(kind, message))

    def _look(self) -> None:
        if self._session.number != self._measurement:
            self._measurement, self._traced = self._session.number, 0
            self._announce("hello", told("hello", **self._bench.hello()))
            self._for_all(lambda page: page.begin(self._session.levels))
        self._for_all(Page.wake)
        if self._bench.is_news():
            self.send_state()

    def _for_all(self, do: Callable[[Page], object]) -> None:
        for page in self.pages:
            do(page)
