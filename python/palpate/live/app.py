"""The web application of the page: its files, the web socket and the downloads."""

import asyncio
import os
import threading
from collections.abc import AsyncIterator, Coroutine
from contextlib import asynccontextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO
from urllib.parse import quote

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response, StreamingResponse
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from palpate.errors import PalpateError
from palpate.live.access import Gatekeeper
from palpate.live.commands import COMMANDS, Workbench, parse
from palpate.live.feed import message_of
from palpate.live.open_page import TOUCHES, Page

_PAGE = {
    ".html": "text/html",
    ".js": "text/javascript",
    ".css": "text/css",
    ".svg": "image/svg+xml",
}
READ_ONLY = (
    "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""Of a report, whose text comes from files: no script runs in it, it asks for nothing, and it is a stranger to the page."""
_PART = 1 << 16
_STATES_PER_S = 5


def page_files() -> dict[str, tuple[bytes, str]]:
    """Return the files of the page: URL path -> content, type. Requests never open a file by its name."""
    page, found = Path(__file__).parent / "page", {}
    for file in page.rglob("*.*"):
        if kind := _PAGE.get(file.suffix):
            found[f"/{file.relative_to(page).as_posix()}"] = (
                file.read_bytes(),
                f"{kind}; charset=utf-8",
            )
    found["/"] = found.pop("/index.html")
    return found


class PageApp:
    """The web application of one workbench, and its open pages; all of it runs in the event loop of the server."""

    def __init__(self, bench: Workbench) -> None:
        self.pages: set[Page] = set()
        self.was_shown = threading.Event()
        self._bench, self._measurement = bench, bench.measurement
        self._number = self._measurement.number
        self._told: dict[str, str] = {}

    def app(self, host: str, port: int, token: str | None = None) -> ASGIApp:
        """Return the application for this address, with access control; see `Gatekeeper`."""
        routes: list[BaseRoute] = [
            Route(path, partial(_file, *content)) for path, content in page_files().items()
        ]
        routes += [Route("/recording/{name}", self._download), WebSocketRoute("/ws", self._page)]
        return Gatekeeper(Starlette(routes=routes, lifespan=self._life), host, port, token)

    @asynccontextmanager
    async def _life(self, _: Starlette) -> AsyncIterator[None]:
        async with _beside(self._send()):
            yield

    async def _send(self) -> None:
        """Send rows when they come, and states, until cancelled."""
        loop = asyncio.get_running_loop()

        def look() -> None:
            with suppress(RuntimeError):  # the server has ended
                loop.call_soon_threadsafe(self._look)

        self._measurement.on_rows = look
        while True:
            self._look()
            self._send_state()
            await asyncio.sleep(1 / _STATES_PER_S)

    def _look(self) -> None:
        if self._number != self._measurement.number:
            self._number = self._measurement.number
            self._send_state()
            for page in self.pages:
                page.begin(self._measurement.levels)
        for page in self.pages:
            page.wake()
        if self._bench.is_news():
            self._send_state()

    def _send_state(self) -> None:
        """Send the state to every page, and each other document that has changed."""
        for kind in self._bench.documents:
            if kind != TOUCHES:
                self._announce(kind)
        touches = self._bench.documents[TOUCHES]()
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

    async def _download(self, request: Request) -> Response:
        name = request.path_params["name"]
        path = self._measurement.files.find(name)
        if path is None or not path.is_file():
            return PlainTextResponse("this run has no such recording\n", 404)
        shown = path.suffix.lower() == ".html"
        kind = "text/html; charset=utf-8" if shown else "application/octet-stream"
        headers = {
            "Content-Disposition": f"{'inline' if shown else 'attachment'}; filename*=UTF-8''{quote(name)}"
        }
        if shown:
            headers["Content-Security-Policy"] = READ_ONLY
        file = path.open("rb")  # now: a sidecar is replaced while its recording runs
        size = os.fstat(file.fileno()).st_size
        headers["Content-Length"] = str(size)
        return StreamingResponse(_parts(file, size), headers=headers, media_type=kind)

    async def _page(self, socket: WebSocket) -> None:
        await socket.accept()
        page = Page(socket, self._measurement.levels)
        self._announce("hello")
        for kind, message in self._told.items():
            page.tell(kind, message)
        page.show_touches(self._bench.documents[TOUCHES]())
        self.pages.add(page)
        self.was_shown.set()
        try:
            async with _beside(page.send()):
                async for message in socket.iter_text():
                    await self._hear(page, message)
        finally:
            self.pages.discard(page)

    async def _hear(self, page: Page, message: str) -> None:
        try:
            do, given = parse(message)
            if COMMANDS[do] == "page":
                answer = {"message": getattr(page, do)(**given)}
            else:
                answer = await asyncio.to_thread(self._bench.do, do, **given)
                self._send_state()
            told = message_of("done", do=do, **answer)
        except (ValueError, RuntimeError, PalpateError) as error:
            told = message_of("refused", message=str(error))
        # behind the state, so that the page shows it when the answer arrives
        page.tell(object(), told)


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
        while size > 0 and (part := await asyncio.to_thread(file.read, min(size, _PART))):
            size -= len(part)
            yield part


async def _file(content: bytes, kind: str, _: Request) -> Response:
    return Response(content, headers={"Content-Type": kind})
