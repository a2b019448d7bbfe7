"""The page in each of its states: its own files with a web socket that says what it is given."""

import json
from http import HTTPStatus
from threading import Thread
from typing import Any, Self

import msgspec
from live_browser import Browser
from page_data import State
from palpate.live.access import HEADERS
from palpate.live.app import page_files
from palpate.live.multiresolution import MultiresolutionRows
from palpate.live.page_frames import FrameKind, Rows, pack
from palpate.live.plan import TouchPlan
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.sync.server import ServerConnection, serve


class Canned:
    """A server of the page that says what it is given, and keeps what it hears."""

    def __init__(self, state: State, rows: Rows | None = None) -> None:
        self.state = state  # what a page gets when it connects
        self._levels = MultiresolutionRows(whole=True)
        self._levels.add(state.rows if rows is None else rows)  # rows: all, for views
        self.heard: list[dict[str, Any]] = []  # the commands of the pages
        self.answers: dict[str, dict[str, Any]] = {}  # to commands; else they are done
        self._pages: list[ServerConnection] = []
        self._files = page_files()
        self._server = serve(
            self._page, "127.0.0.1", 0, process_request=self._file, compression=None
        )
        self.address = f"http://127.0.0.1:{self._server.socket.getsockname()[1]}/"

    def __enter__(self) -> Self:
        """Serve in a thread."""
        Thread(target=self._server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        """Stop."""
        self._server.shutdown()

    def tell(self, kind: str, /, **document: Any) -> None:
        """Send a message to each page."""
        for page in self._pages:
            page.send(json.dumps({"type": kind, **document}))

    def change(self, state: State) -> None:
        """Send what a new state has to each page."""
        self.state = state
        for page in self._pages:
            self._greet(page)

    def send(self, rows: Rows) -> None:
        """Send rows that follow those of the state."""
        for page in self._pages:
            page.send(pack(2, rows))

    def asked(self, do: str) -> list[dict[str, Any]]:
        """Return the commands of one name."""
        return [command for command in self.heard if command["do"] == do]

    def _file(self, _: ServerConnection, request: Request) -> Response | None:
        path = request.path.partition("?")[0]
        if path == "/ws":
            return None
        status = HTTPStatus.NOT_FOUND
        content, kind = b"", "text/plain"
        if path in self._files:
            status = HTTPStatus.OK
            content = self._files[path].content
            kind = self._files[path].content_type
        headers = {
            **HEADERS,
            "Content-Type": kind,
            "Content-Length": str(len(content)),
        }
        return Response(status, status.phrase, Headers(headers), content)

    def _page(self, page: ServerConnection) -> None:
        self._pages.append(page)
        self._greet(page)
        try:
            while True:
                self._listen(page)
        except ConnectionClosed:
            self._pages.remove(page)

    def _listen(self, page: ServerConnection) -> None:
        """Obey the next command; without one say the state again, since a page takes a silent server for gone."""
        try:
            text = page.recv(timeout=1)
        except TimeoutError:
            page.send(json.dumps({"type": "state", **self.state.told["state"]}))
        else:
            self._hear(page, json.loads(text))

    def _greet(self, page: ServerConnection) -> None:
        for kind, document in self.state.told.items():
            if kind != "state":
                page.send(json.dumps({"type": kind, **document}))
        page.send(pack(1, self.state.rows, FrameKind.ANEW))
        # last: a page that shows it has all
        page.send(json.dumps({"type": "state", **self.state.told["state"]}))

    def _hear(self, page: ServerConnection, command: dict[str, Any]) -> None:
        self.heard.append(command)
        if command["do"] == "view":
            view = self._levels.view(command["from_s"], command["to_s"], command["rows"])
            page.send(pack(command["id"], view, FrameKind.VIEW))
            return
        more: dict[str, Any] = {"id": 9} if command["do"] == "mark" else {}
        more = (
            {"lines": msgspec.to_builtins(TouchPlan.read_list(command["text"], command["unit"]))}
            if command["do"] == "read list"
            else more
        )
        done = {"type": "done", "do": command["do"], "message": f"Done: {command['do']}."} | more
        page.send(json.dumps(self.answers.get(command["do"], done)))


def opened(
    page: Browser, server: Canned, name: str, theme: str = "light", depth: str = "lab"
) -> None:
    """Open the page in a state, and wait until it shows it."""
    page.driver.get(f"{server.address}#{depth}")
    word = server.state.told["state"]["now"]["word"]
    shown = str(len(server.state.told["touches"]["rows"])) if word == "File" else word
    if depth == "explain":
        page.until(lambda: page.text("storytitle") and page.run("return palpate.known.state.now"))
    else:
        place = "verb" if depth == "measure" else "word"
        page.until(lambda: page.text(place) == shown)
    page.theme(theme)
    if name == "review":
        page.press(" ")
