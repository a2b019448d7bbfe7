"""The page in each of its states: its own files with a web socket that plays canned messages.

python tests/tools/page_states.py FOLDER              screenshots of every state, at every size, light and dark
python tests/tools/page_states.py FOLDER contact idle     of these states
python tests/tools/page_states.py --serve contact     serves one state until Ctrl-C; the address is printed
"""

import json
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from http import HTTPStatus
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
from live_browser import Browser, browser
from page_cases import CASES
from page_data import State
from palpate.live.access.gatekeeper import HEADERS
from palpate.live.feed import FIELDS, HEADER, Rows
from palpate.live.server import page_files
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.sync.server import Server, ServerConnection, serve

VERSION = 3
NEXT, FIRST, VIEW = 0, 1, 2
"""Kinds of a frame."""
SIZES = {"desk": (1280, 800), "phone": (390, 844), "wall": (2560, 1440), "lying": (844, 390), "tablet": (768, 1024)}


class Canned:
    """A server of the page that says what it is given, and keeps what it hears.

    Attributes
    ----------
    state : State
        What a page that connects is told.
    heard : list of dict
        The commands of the pages, without "seen".
    """

    def __init__(self, state: State) -> None:
        self.state = state
        self.heard: list[dict[str, Any]] = []
        self._pages: list[ServerConnection] = []
        self._files = page_files()
        self._server: Server = serve(self._page, "127.0.0.1", 0, process_request=self._file, compression=None)

    @property
    def address(self) -> str:
        """Address of the page."""
        return f"http://127.0.0.1:{self._server.socket.getsockname()[1]}/"

    def run(self) -> None:
        """Serve until `close`."""
        self._server.serve_forever()

    def close(self) -> None:
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
            page.send(framed(2, rows, NEXT))

    def asked(self, do: str) -> list[dict[str, Any]]:
        """Return the commands of one name."""
        return [command for command in self.heard if command["do"] == do]

    def _file(self, _: ServerConnection, request: Request) -> Response | None:
        path = request.path.partition("?")[0]
        if path == "/ws":
            return None
        if path.startswith("/recording/"):
            return answer(HTTPStatus.OK, b"canned\n", "text/plain")
        content, kind = self._files.get(path, (b"", ""))
        return answer(HTTPStatus.OK if kind else HTTPStatus.NOT_FOUND, content, kind or "text/plain")

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
            if kind not in ("noise", "state"):
                page.send(json.dumps({"type": kind, **document}))
        for trace in self.state.traces:
            page.send(json.dumps({"type": "trace", **trace}))
        page.send(framed(1, self.state.rows, FIRST))
        page.send(json.dumps({"type": "state", **self.state.told["state"]}))  # last: a page that shows it has all

    def _hear(self, page: ServerConnection, command: dict[str, Any]) -> None:
        if command["do"] == "seen":
            return
        self.heard.append(command)
        if command["do"] == "view":
            page.send(framed(command["id"], view_of(self.state.rows, **command), VIEW))
            return
        if command["do"] == "trace":
            self._send_trace(page, command["touch"])
        if command["do"] == "noise" and command["on"]:
            page.send(json.dumps({"type": "noise", **self.state.told["noise"]}))
        more = {"id": 9} if command["do"] == "mark" else {}
        page.send(json.dumps({"type": "done", "do": command["do"], "message": f"Done: {command['do']}.", **more}))

    def _send_trace(self, page: ServerConnection, touch: int) -> None:
        for trace in self.state.traces:
            if trace["touch"] == touch:
                page.send(json.dumps({"type": "trace", **trace}))


def answer(status: HTTPStatus, content: bytes, kind: str) -> Response:
    """Return an answer with the headers of the real server."""
    headers = Headers({**HEADERS, "Content-Type": kind, "Content-Length": str(len(content))})
    return Response(status, status.phrase, headers, content)


def framed(number: int, rows: Rows, kind: int) -> bytes:
    """Return a binary frame."""
    columns = (np.ascontiguousarray(rows[name]).tobytes() for name in (*FIELDS, "flags"))
    return HEADER.pack(VERSION, number, len(rows), kind) + b"".join(columns)


def view_of(all_rows: Rows, *, from_s: float, to_s: float, rows: int, **_: Any) -> Rows:
    """Return at most so many rows of a window: two for each bin, with its lowest and highest values."""
    first, last = np.searchsorted(all_rows["t_s"], (from_s, to_s), "right")
    inside = all_rows[first:last]
    bins = rows // 2
    if len(inside) <= rows:
        return inside
    numbers = ((inside["t_s"] - from_s) / (to_s - from_s) * bins).astype(int).clip(0, bins - 1)
    begins = np.flatnonzero(np.diff(numbers, prepend=-1))
    view = np.repeat(inside[begins], 2)
    view["t_s"][1::2] = inside["t_s"][np.append(begins[1:], len(inside)) - 1]
    for name in FIELDS[1:]:
        view[name][::2] = np.fmin.reduceat(inside[name], begins)
        view[name][1::2] = np.fmax.reduceat(inside[name], begins)
    view["flags"] = np.repeat(np.bitwise_or.reduceat(inside["flags"], begins), 2)
    return view


@contextmanager
def serving(server: Canned) -> Iterator[Canned]:
    """Run a canned server in a thread."""
    thread = Thread(target=server.run, daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.close()
        thread.join(10)


@contextmanager
def canned(name: str) -> Iterator[Canned]:
    """Serve a state in a thread."""
    with serving(Canned(CASES[name]())) as server:
        yield server


def opened(page: Browser, server: Canned, name: str, theme: str = "light") -> None:
    """Open the page in a state, and wait until it shows it."""
    page.driver.get(server.address)
    word = server.state.told["state"]["now"]["word"]
    page.until(lambda: page.text("word") == word)
    while page["theme"].get_attribute("aria-label") != f"Colours: {theme}":
        page.driver.execute_script("document.getElementById('theme').click()")
    if name == "review":
        page.driver.find_element("css selector", "body").send_keys(" ")


def sized(page: Browser, width: int, height: int) -> None:
    """Give the window's inside a size, also one that a window cannot have."""
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 900}
    page.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)


def shoot(folder: Path, names: list[str]) -> None:
    """Take the screenshots."""
    folder.mkdir(parents=True, exist_ok=True)
    with browser(folder) as page:
        for name in names:
            with canned(name) as server:
                for size, (width, height) in SIZES.items():
                    sized(page, width, height)
                    for theme in ("light", "dark"):
                        opened(page, server, name, theme)
                        page.shoot(folder / f"{name}-{size}-{theme}.png")


def main() -> int:
    """Run from the command line."""
    if len(sys.argv) == 3 and sys.argv[1] == "--serve":
        server = Canned(CASES[sys.argv[2]]())
        print(server.address, flush=True)
        server.run()
        return 0
    if len(sys.argv) < 2 or not re.match(r"[^-]", sys.argv[1]):
        print(__doc__)
        return 2
    shoot(Path(sys.argv[1]), sys.argv[2:] or list(CASES))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
