"""The live page in a cell: who may show it, and when it ends."""

import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from functools import partial
from http.client import HTTPConnection
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from urllib.parse import urlsplit

import palpate
import pytest
from palpate import notebook
from palpate.live.access.framed import FRAMED_HEADERS
from palpate.live.access.gatekeeper import HEADERS
from project import ROOT

PATIENCE_S = 90
SOURCE = "sim:four-specimens?seed=1&idle=60"
FOUR = ROOT / "tests" / "data" / "four-specimens.csv"


@pytest.fixture
def page() -> Iterator[notebook.LivePage]:
    with notebook.live(SOURCE) as page:
        yield page


def asks(page: notebook.LivePage, path: str, **headers: str) -> tuple[int, dict[str, str]]:
    """Return status and headers of the answer."""
    with closing(HTTPConnection(urlsplit(page.address).netloc, timeout=PATIENCE_S)) as connection:
        connection.request("GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()})
        answer = connection.getresponse()
        return answer.status, dict(answer.headers)


def test_each_request_needs_the_token_in_its_path(page: notebook.LivePage) -> None:
    begin = urlsplit(page.address).path
    assert re.fullmatch(r"/token=[\w-]{32}/", begin)
    wrong = begin.replace(begin[10], "A" if begin[10] != "A" else "B")
    token = begin.strip("/")
    assert [asks(page, path)[0] for path in (begin, f"{begin}page.js", f"{begin}none")] == [200, 200, 404]
    for path in ("/", "/page.js", wrong, f"{wrong}page.js", f"/?{token}", f"/page.js?{token}", begin[:-1]):
        assert asks(page, path)[0] == 403, path
    assert asks(page, "/page.js", Cookie=token)[0] == 403


def test_only_the_page_itself_may_be_framed_by_another(page: notebook.LivePage) -> None:
    begin = urlsplit(page.address).path
    frame = partial(asks, page, Sec_Fetch_Site="cross-site")
    assert frame(begin, Sec_Fetch_Dest="iframe")[0] == 200
    assert frame(begin, Sec_Fetch_Dest="document")[0] == 403
    assert frame(begin, Sec_Fetch_Dest="script")[0] == 403
    assert frame(f"{begin}page.js", Sec_Fetch_Dest="iframe")[0] == 403
    assert frame(f"{begin}ws", Sec_Fetch_Dest="websocket")[0] == 403
    assert asks(page, begin, Host="rebound.example")[0] == 403
    assert asks(page, begin, Origin="http://localhost:8888")[0] == 403


def test_the_other_protections_are_those_of_the_live_page(page: notebook.LivePage) -> None:
    _, headers = asks(page, urlsplit(page.address).path)
    assert {name.lower(): value for name, value in FRAMED_HEADERS.items()}.items() <= {
        name.lower(): value for name, value in headers.items()
    }.items()
    assert "Set-Cookie" not in headers
    policies = [HEADERS["Content-Security-Policy"], FRAMED_HEADERS["Content-Security-Policy"]]
    assert policies[0] == f"{policies[1]}; frame-ancestors 'none'"


def test_the_next_cell_ends_the_one_before() -> None:
    first = notebook.live(SOURCE)
    with notebook.live(SOURCE) as second:
        assert (first.running, second.running) == (False, True)
        assert repr(first) == f"<live page of {SOURCE}: closed>"
        assert "<iframe" not in first._repr_html_()
        with pytest.raises(ConnectionRefusedError):
            asks(first, "/")
        assert asks(second, urlsplit(second.address).path)[0] == 200
    second.close()
    assert not second.running


def test_a_page_that_nobody_sees_ends(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(notebook, "_UNSEEN_S", 0.2)
    page = notebook.live(SOURCE)
    page._thread.join(PATIENCE_S)
    assert not page.running
    with notebook.live(SOURCE, record=tmp_path / "run.csv") as recording:
        recording._thread.join(1.0)
        while not recording._session.counters.recorded:
            time.sleep(0.01)
        assert recording.running
    found = palpate.check(tmp_path / "run.csv")
    assert found.clean
    assert len(palpate.read(tmp_path / "run.csv")) > 0


def test_the_end_of_the_kernel_closes_the_recording(tmp_path: Path) -> None:
    program = (
        "import sys, time; from palpate import notebook; page = notebook.live(sys.argv[1], record=sys.argv[2])\n"
        "while not page._session.counters.recorded: time.sleep(0.05)"
    )
    command = [sys.executable, "-c", program, SOURCE, str(tmp_path / "run.csv")]
    subprocess.run(command, check=True, timeout=PATIENCE_S)
    assert palpate.check(tmp_path / "run.csv").clean


def test_touches_are_there_for_the_next_cell() -> None:
    with notebook.live(f"{FOUR}?speed=100") as page:
        deadline = time.monotonic() + PATIENCE_S
        while len(page.touches) < 4 and time.monotonic() < deadline:
            time.sleep(0.05)
    assert [touch.samples for touch in page.touches] == [250] * 4
    assert page.touches._repr_html_()


def test_a_source_that_does_not_open_leaves_nothing() -> None:
    with pytest.raises(ValueError, match="allowed"):
        notebook.live("sim:nothing")


class Around(BaseHTTPRequestHandler):
    """A notebook's page, at another address than the page in its frame."""

    def __init__(self, content: str, *args: object) -> None:
        self.content = content
        super().__init__(*args)  # type: ignore[arg-type]

    def do_GET(self) -> None:
        """Answer."""
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(self.content.encode())

    def log_message(self, *_: object) -> None:
        """Say nothing."""


def test_a_browser_shows_it_inside_another_page(page: notebook.LivePage, tmp_path: Path) -> None:
    from live_browser import browser

    around = ThreadingHTTPServer(("127.0.0.1", 0), partial(Around, page._repr_html_()))
    Thread(target=around.serve_forever, daemon=True).start()
    try:
        with browser(tmp_path) as window:
            window.driver.get(f"http://localhost:{around.server_port}/")  # another site than 127.0.0.1
            window.driver.switch_to.frame(0)
            window.until(lambda: window.text("word") in {"Wait", "Touch", "Hold", "Lift"})
            window["mark"].click()
            window.until(lambda: window.text("answer").startswith("Marked"))
            page.close()
            window.until(lambda: "No connection" in window.text("says"))
    finally:
        around.shutdown()
        around.server_close()
