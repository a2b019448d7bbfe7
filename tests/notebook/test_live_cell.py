"""The live page in a cell: who may show it, and when it ends."""

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from functools import partial
from http.client import HTTPConnection
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from urllib.parse import urlsplit

import palpate
import pytest
from live_browser import Browser
from palpate import notebook
from palpate.live.access import FRAMED_HEADERS, HEADERS
from project import FOUR

PATIENCE_S = 90
SOURCE = "sim:four-specimens?seed=1&idle=60"


@pytest.fixture
def page() -> Iterator[notebook.LivePage]:
    with notebook.live(SOURCE) as page:
        yield page


def asks(page: notebook.LivePage, path: str, **headers: str) -> tuple[int, dict[str, str]]:
    """Return status and headers of the answer."""
    with closing(HTTPConnection(urlsplit(page.address).netloc, timeout=PATIENCE_S)) as connection:
        connection.request("GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()})
        answer = connection.getresponse()
        return answer.status, {name.title(): value for name, value in answer.headers.items()}


def test_each_request_needs_the_token_in_its_path(page: notebook.LivePage) -> None:
    """A page of another server may only frame it; the other protections are those of the live page."""
    begin = urlsplit(page.address).path
    assert re.fullmatch(r"/token=[\w-]{32}/", begin)
    wrong, token = begin.replace(begin[10], "A" if begin[10] != "A" else "B"), begin.strip("/")
    assert [asks(page, path)[0] for path in (begin, f"{begin}page.js", f"{begin}none")] == [200, 200, 404]
    for path in ("/", wrong, f"{wrong}page.js", f"/?{token}", begin[:-1]):
        assert asks(page, path, Cookie=token)[0] == 403, path
    assert asks(page, begin, Host="rebound.example")[0] == 400
    assert asks(page, begin, Origin="http://localhost:8888")[0] == 403
    status, headers = asks(page, begin, Sec_Fetch_Site="cross-site")
    assert status == 200
    assert {name.title(): value for name, value in FRAMED_HEADERS.items()}.items() <= headers.items()
    assert "Set-Cookie" not in headers
    assert HEADERS["Content-Security-Policy"] == (
        f"{FRAMED_HEADERS['Content-Security-Policy']}; frame-ancestors 'none'"
    )


def test_the_next_cell_ends_the_one_before() -> None:
    first = notebook.live(SOURCE)
    with notebook.live(SOURCE) as second:
        assert (first.running, second.running) == (False, True)
        assert repr(first) == f"<live page of {SOURCE}: closed>"
        assert "<iframe" not in first._repr_html_()
    assert not second.running


def test_a_page_that_nobody_sees_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebook, "_UNSEEN_S", 0.2)
    page = notebook.live(SOURCE)
    page._thread.join(PATIENCE_S)
    assert not page.running


def test_the_end_of_the_kernel_closes_the_recording(tmp_path: Path) -> None:
    program = (
        "import sys, time; from palpate import notebook; page = notebook.live(sys.argv[1], record=sys.argv[2])\n"
        "while len(page.touches) < 2: time.sleep(0.05)"
    )
    command = [sys.executable, "-c", program, f"{FOUR}?speed=100", str(tmp_path / "run.csv")]
    subprocess.run(command, check=True, timeout=PATIENCE_S)
    assert palpate.check(tmp_path / "run.csv").clean


def test_a_browser_shows_it_inside_another_page(page: notebook.LivePage, chromium: Browser, tmp_path: Path) -> None:
    (tmp_path / "index.html").write_text(page._repr_html_())
    window = chromium
    window.reset()
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(SimpleHTTPRequestHandler, directory=tmp_path)) as around:
        Thread(target=around.serve_forever, daemon=True).start()
        window.driver.get(f"http://localhost:{around.server_port}/")  # another site than 127.0.0.1
        window.driver.switch_to.frame(0)
        window.until(lambda: window.text("word") in {"Wait", "Touch", "Hold", "Lift"})
        window["mark"].click()
        window.until(lambda: window["marking"].is_displayed())  # the server has marked it
        page.close()
        window.until(lambda: "No connection" in window.text("says"))
        around.shutdown()
