"""The web application of the page: its files, the web socket and the downloads."""

import asyncio
from collections.abc import AsyncIterator, Coroutine
from contextlib import asynccontextmanager, suppress
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any
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
from palpate.live.feed import RefusedCommand, message_of
from palpate.live.hub import PAGES, Hub, Page

_PAGE = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
TYPES = {
    ".csv": "text/csv",
    ".json": "application/json",
    ".toml": "application/toml",
    ".html": "text/html; charset=utf-8",
}
READ_ONLY = (
    "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""Of a report, whose text comes from files: no script runs in it, it asks for nothing, and it is a stranger to the page."""
_PART = 1 << 16


def page_files() -> dict[str, tuple[bytes, str]]:
    """Return the files of the page: URL path -> content, type. Requests never open a file by its name."""
    found = {}
    page = files("palpate.live") / "page"
    for folder, prefix in ((page, "/"), (page / "charts", "/charts/")):
        for file in folder.iterdir():
            kind = _PAGE.get(Path(file.name).suffix)
            if kind:
                found[prefix + file.name] = (file.read_bytes(), f"{kind}; charset=utf-8")
    found["/"] = found.pop("/index.html")
    return found


class PageApp:
    """The web application of one workbench."""

    def __init__(self, bench: Workbench) -> None:
        self._bench = bench
        self.hub: Hub = Hub(bench)

    def app(
        self, host: str, port: int, token: str | None = None, ticket: str | None = None, *, framed: bool = False
    ) -> ASGIApp:
        """Return the application for this address, with access control; see `Gatekeeper`."""
        routes: list[BaseRoute] = [Route(path, partial(_file, *content)) for path, content in page_files().items()]
        routes += [Route("/recording/{name}", self._download), WebSocketRoute("/ws", self._page)]
        return Gatekeeper(Starlette(routes=routes, lifespan=self._life), host, port, token, ticket, framed=framed)

    @asynccontextmanager
    async def _life(self, _: Starlette) -> AsyncIterator[None]:
        async with _beside(self.hub.run()):
            yield

    async def _download(self, request: Request) -> Response:
        name = request.path_params["name"]
        path = self._bench.measurement.files.find(name)
        if path is None or not path.is_file():
            return PlainTextResponse("this run has no such recording\n", 404)
        suffix = path.suffix.lower()
        kind, shown = TYPES.get(suffix, "application/octet-stream"), suffix == ".html"
        headers = {"Content-Disposition": f"{'inline' if shown else 'attachment'}; filename*=UTF-8''{quote(name)}"}
        if suffix == ".json":  # a recording that runs replaces it: size and content are of one file
            return Response(await asyncio.to_thread(path.read_bytes), headers=headers, media_type=kind)
        if shown:
            headers["Content-Security-Policy"] = READ_ONLY
        size = path.stat().st_size
        headers["Content-Length"] = str(size)
        return StreamingResponse(_parts(path, size), headers=headers, media_type=kind)

    async def _page(self, socket: WebSocket) -> None:
        if len(self.hub.pages) >= PAGES:
            await socket.close(1013, f"too many open pages, allowed: {PAGES}; close one")
            return
        await socket.accept()
        page = Page(socket, self._bench)
        self.hub.join(page)
        try:
            async with _beside(page.send()):
                async for message in socket.iter_text():
                    await self._hear(page, message)
        finally:
            self.hub.pages.discard(page)

    async def _hear(self, page: Page, message: str) -> None:
        try:
            do, given = parse(message)
            if COMMANDS[do].obeys.startswith("page."):
                answer = page.do(do, **given)
            else:
                answer = await asyncio.to_thread(self._bench.do, do, **given)
                self.hub.send_state()
            told = message_of("done", do=do, **answer) if answer else ""
        except RefusedCommand as refusal:
            told = message_of("refused", message=str(refusal))
        except (ValueError, PalpateError) as error:
            told = message_of("failed", message=str(error))
        if told:  # behind the state, so that the page shows it when the answer arrives
            page.tell(object(), told)


@asynccontextmanager
async def _beside(work: Coroutine[Any, Any, None]) -> AsyncIterator[None]:
    """Do this beside what is in the block; the end of the block cancels it."""
    running = asyncio.create_task(work)
    try:
        yield
    finally:
        running.cancel()
        with suppress(asyncio.CancelledError, WebSocketDisconnect, RuntimeError):  # the page may be gone
            await running


async def _parts(path: Path, size: int) -> AsyncIterator[bytes]:
    """Yield a file in parts, up to its size at the time of the request: a recording that runs grows."""
    with path.open("rb") as file:
        while size > 0 and (part := await asyncio.to_thread(file.read, min(size, _PART))):
            size -= len(part)
            yield part


async def _file(content: bytes, kind: str, _: Request) -> Response:
    return Response(content, headers={"Content-Type": kind})
