"""The web application of the page: its files, the web socket and the downloads."""

import asyncio
import gzip
import os
import threading
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response, StreamingResponse
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from palpate.errors import PalpateError
from palpate.live.access import Gatekeeper
from palpate.live.client import PageClient
from palpate.live.opened_source import OpenedSource
from palpate.live.page_commands import (
    BenchCommand,
    OpenCommand,
    PageCommand,
    RecordCommand,
    StopCommand,
    decode,
)
from palpate.live.protocol import DoneMessage, Message, RefusedMessage, encode

_PAGE = {
    ".html": "text/html",
    ".js": "text/javascript",
    ".css": "text/css",
    ".svg": "image/svg+xml",
}
READ_ONLY = (
    "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'"
)
"""Of a report, whose text comes from files: no script runs in it, it asks for nothing, and it is a stranger to the page."""
FILING = (OpenCommand, RecordCommand, StopCommand)
"""Commands after which there may be another recording."""
_PART = 1 << 16
_STATES_PER_S = 5


class PageFile(NamedTuple):
    """A file of the page: its content, as it is and compressed, and its type."""

    content: bytes
    compressed: bytes
    content_type: str


def page_files() -> dict[str, PageFile]:
    """Return the files of the page by URL path. Requests never open a file by its name."""
    folder = Path(__file__).parent / "page"
    found = {}
    for file in folder.rglob("*.*"):
        kind = _PAGE.get(file.suffix)
        if kind:
            path = f"/{file.relative_to(folder).as_posix()}"
            content = file.read_bytes()
            found[path] = PageFile(content, gzip.compress(content), f"{kind}; charset=utf-8")
    found["/"] = found.pop("/index.html")
    return found


class PageApp:
    """The web application of a source, and its open pages; all of it runs in the event loop of the server."""

    def __init__(self, opened: OpenedSource, first_page: threading.Event | None = None) -> None:
        self.pages: set[PageClient] = set()
        self.was_shown = first_page or threading.Event()
        self._opened = opened
        self._bench = opened.bench
        self._number = self._bench.measurement.number
        self._sent: dict[str, str] = {}  # the newest message of each kind, but state and touches

    def app(self, host: str, port: int, token: str | None = None) -> ASGIApp:
        """Return the application for this address, with access control; see `Gatekeeper`."""
        routes: list[BaseRoute] = [
            Route(path, partial(_send_file, file)) for path, file in page_files().items()
        ]
        routes += [Route("/recording/{name}", self._download), WebSocketRoute("/ws", self._page)]
        return Gatekeeper(Starlette(routes=routes, lifespan=self._life), host, port, token)

    @asynccontextmanager
    async def _life(self, _: Starlette) -> AsyncIterator[None]:
        async with _beside(self._send()):
            yield

    async def _send(self) -> None:
        """Send rows and news when they come, and states, until cancelled."""
        self._opened.on_changed = _in_loop(self._look)
        self._listen()
        self._send_all()
        while True:
            self._look()
            self._send_changing()
            self._bench.look()
            self._send_state()
            await asyncio.sleep(1 / _STATES_PER_S)

    def _listen(self) -> None:
        """Follow the source that is open."""
        self._bench = self._opened.bench
        self._bench.measurement.on_rows = _in_loop(self._look)
        self._bench.on_news = _in_loop(self._send_news)

    def _look(self) -> None:
        """Let the pages look at the rows; send the state at once if word or line have changed."""
        self._follow_measurement()
        for page in self.pages:
            page.wake()
        if self._bench.look():
            self._send_state()

    def _follow_measurement(self) -> None:
        """Greet the pages again if the next measurement has begun, also of another source: they forget the one before."""
        if self._bench is not self._opened.bench:
            self._listen()
        measurement = self._bench.measurement
        if self._number == measurement.number:
            return
        self._number = measurement.number
        self._sent.clear()
        self._send_all()
        for page in self.pages:
            page.begin(measurement.levels)

    def _send_all(self) -> None:
        self._send_changing()
        self._send_news()

    def _send_news(self) -> None:
        """Send the touches, and what else has changed with them."""
        self._follow_measurement()
        for message in self._bench.news():
            self._announce(message)
        touches = self._bench.table.document()
        for page in self.pages:
            page.show_touches(touches)

    def _send_changing(self) -> None:
        for message in self._bench.changing():
            self._announce(message)

    def _send_state(self) -> None:
        state = encode(self._bench.state())
        for page in self.pages:
            page.send_message("state", state)

    def _announce(self, message: Message) -> None:
        """Send a message to every page, if it has changed."""
        kind = message.message_type
        text = encode(message)
        if self._sent.get(kind) != text:
            self._sent[kind] = text
            for page in self.pages:
                page.send_message(kind, text)

    async def _download(self, request: Request) -> Response:
        name = request.path_params["name"]
        path = self._bench.measurement.files.find(name)
        if path is None or not path.is_file():
            return PlainTextResponse("this run has no such recording\n", 404)
        shown = path.suffix.lower() == ".html"
        kind = "text/html; charset=utf-8" if shown else "application/octet-stream"
        disposition = "inline" if shown else "attachment"
        headers = {"Content-Disposition": f"{disposition}; filename*=UTF-8''{quote(name)}"}
        if shown:
            headers["Content-Security-Policy"] = READ_ONLY
        file = path.open("rb")  # now: a sidecar is replaced while its recording runs
        size = os.fstat(file.fileno()).st_size
        headers["Content-Length"] = str(size)
        return StreamingResponse(_parts(file, size), headers=headers, media_type=kind)

    async def _page(self, socket: WebSocket) -> None:
        await socket.accept()
        await self._list_recordings()
        page = PageClient(socket, self._bench.measurement.levels)
        self._announce(self._bench.hello())
        for kind, message in self._sent.items():
            page.send_message(kind, message)
        page.show_touches(self._bench.table.document())
        self.pages.add(page)
        self.was_shown.set()
        try:
            async with _beside(page.send()):
                async for text in socket.iter_text():
                    await self._run(page, text)
        finally:
            self.pages.discard(page)

    async def _run(self, page: PageClient, text: str) -> None:
        """Run the command of a page, and answer it."""
        answer: Message
        try:
            command = decode(text)
            if isinstance(command, PageCommand):
                answer = page.run(command)
            else:
                answer = await self._answer(command)
                self._send_all()
                self._bench.look()
                self._send_state()
        except (ValueError, RuntimeError, PalpateError) as error:
            answer = RefusedMessage(str(error))
        # behind the state, so that the page shows it when the answer arrives
        page.send_answer(encode(answer))

    async def _answer(self, command: BenchCommand | OpenCommand) -> Message:
        """Run a command for all pages; return the answer."""
        answer: Message
        if isinstance(command, OpenCommand):
            message = await asyncio.to_thread(self._opened.open, command.what)
            answer = DoneMessage(command.do, message)
        else:
            answer = await asyncio.to_thread(self._bench.run, command)
        if isinstance(command, FILING):
            await self._list_recordings()
        return answer

    async def _list_recordings(self) -> None:
        """Send the recordings that can be opened, if there are other ones."""
        self._announce(await asyncio.to_thread(self._opened.recordings))


def _in_loop(do: Callable[[], None]) -> Callable[[], None]:
    """Return a function for any thread: the running loop does this."""
    loop = asyncio.get_running_loop()

    def call() -> None:
        with suppress(RuntimeError):  # the server has ended
            loop.call_soon_threadsafe(do)

    return call


@asynccontextmanager
async def _beside(work: Coroutine[Any, Any, None]) -> AsyncIterator[None]:
    """Do this beside what is in the block; the end of the block cancels it."""
    running = asyncio.create_task(work)
    try:
        yield
    finally:
        running.cancel()
        # the page may be gone
        with suppress(asyncio.CancelledError, WebSocketDisconnect, RuntimeError):
            await running


async def _parts(file: BinaryIO, size: int) -> AsyncIterator[bytes]:
    """Yield a file in parts, up to its size at the time of the request: a recording that runs grows."""
    with file:
        while size > 0:
            part = await asyncio.to_thread(file.read, min(size, _PART))
            if not part:
                return
            size -= len(part)
            yield part


async def _send_file(file: PageFile, request: Request) -> Response:
    headers = {"Content-Type": file.content_type, "Vary": "Accept-Encoding"}
    if "gzip" not in request.headers.get("Accept-Encoding", ""):
        return Response(file.content, headers=headers)
    return Response(file.compressed, headers={**headers, "Content-Encoding": "gzip"})
