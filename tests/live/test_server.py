"""The live page without a browser: what is refused, what a slow page costs."""

import asyncio
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from live_bench import HOST, ORIGIN, OWN, PORT, begun, client
from palpate.live.feed import HEADER, KEPT, ROW, History
from palpate.live.hub import AHEAD, ROWS, Page
from palpate.live.protocol import COMMANDS, Command, Refused, parse
from palpate.live.recordings import Recordings
from palpate.live.server import Server, page_files
from palpate.live.session import Session
from starlette.websockets import WebSocketDisconnect

TOKEN = "a-token"


@pytest.fixture
def session(tmp_path: Path) -> Iterator[Session]:
    session = begun(tmp_path, speed=None)
    yield session
    session.close()


@given(st.one_of(st.text(), st.binary(), st.recursive(st.none() | st.booleans() | st.floats() | st.text(),
                 lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner)).map(json.dumps)))  # fmt: skip
@examples(400)
def test_any_message_is_a_command_or_refused(message: str | bytes) -> None:
    try:
        said: Command | str = parse(message)
    except Refused as refusal:
        said = str(refusal)
    assert isinstance(said, Command) or (", allowed: " in said and len(said) < 300)


@given(
    st.fixed_dictionaries(
        {"do": st.sampled_from([*COMMANDS, "", 1])},
        optional={
            **dict.fromkeys(("text", "name", "title", "excitation"), st.text() | st.integers()),
            **dict.fromkeys(("frame", "id", "touch", "rows", "from_s", "to_s", "capf"), st.integers() | st.floats()),
            "on": st.booleans() | st.none(),
            "more": st.none(),
        },
    )
)
def test_what_looks_like_a_command(message: dict[str, Any]) -> None:
    try:
        command = parse(json.dumps(message))
    except Refused:
        return
    assert command.do == message["do"]
    assert command.given == {name: _stripped(value) for name, value in message.items() if name != "do"}


def _stripped(value: Any) -> Any:
    return value.strip() if isinstance(value, str) else value


def test_every_command_is_parsed() -> None:
    values = {"rows": 10, "wanted": 4, "capf": 1, "on": True, "from_s": 0.5, "to_s": 2, "text": "a", "name": "b"}
    for do, names in COMMANDS.items():
        whole = {
            name.rstrip("?"): values.get(name.rstrip("?"), 0 if name in ("id", "touch", "frame") else "c")
            for name in names
        }
        assert parse(json.dumps({"do": do, **whole})).given == whole
        needed = {name: value for name, value in whole.items() if name in names}
        assert parse(json.dumps({"do": do, **needed})).given == needed
        for name in needed:
            with pytest.raises(Refused, match=f"{name}: got None, allowed: "):
                parse(json.dumps({"do": do, **{other: value for other, value in needed.items() if other != name}}))


def test_deep_and_long_messages_are_refused() -> None:
    for message in ("[" * 4000, "9" * 4000, '{"do": "mark", "text": "' + "x" * 9000 + '"}', '{"do": "tare", "do2": 1}'):
        with pytest.raises(Refused):
            parse(message)


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 200),
        ({"origin": ORIGIN}, 200),
        ({"host": f"localhost:{PORT}"}, 200),
        ({"host": f"[::1]:{PORT}"}, 200),
        ({"host": "127.0.0.1:1"}, 403),
        ({"host": f"evil.example:{PORT}"}, 403),
        ({"host": "evil.example"}, 403),
        ({"origin": "http://evil.example"}, 403),
        ({"origin": "null"}, 403),
        ({"origin": "http://127.0.0.1:1"}, 403),
    ],
)
def test_only_the_page_itself_may_ask(session: Session, headers: dict[str, str], status: int) -> None:
    assert client(session).get("/", headers=headers).status_code == status


@pytest.mark.parametrize(
    "headers", [{}, {"origin": "http://evil.example"}, {"origin": ORIGIN, "host": "evil.example:8746"}]
)
def test_a_web_socket_of_another_page_is_refused(session: Session, headers: dict[str, str]) -> None:
    with (
        client(session) as page,
        pytest.raises(WebSocketDisconnect) as refused,
        page.websocket_connect("/ws", headers={"host": OWN, **headers}),
    ):
        pass
    assert refused.value.code == 1008


def test_from_elsewhere_a_token_is_needed_once(session: Session) -> None:
    page = client(session, "192.0.2.7", TOKEN)
    page.base_url = f"http://192.0.2.7:{PORT}"
    assert page.get("/").status_code == 403
    assert page.get("/?token=wrong").status_code == 403
    let_in = page.get(f"/?token={TOKEN}")
    assert (let_in.status_code, let_in.headers["location"]) == (303, "/")
    assert {"HttpOnly", "SameSite=strict"} <= set(let_in.headers["set-cookie"].split("; "))
    assert page.get("/").status_code == 200


def status_of(token: str | None, path: str, query: bytes, headers: list[tuple[bytes, bytes]]) -> int:
    """Ask the application as a server would that lets any bytes through."""
    app = Server(_Nothing()).app(HOST, PORT, token)  # type: ignore[arg-type]
    scope = {"type": "http", "method": "GET", "path": path, "raw_path": b"", "query_string": query, "headers": headers}
    told: list[Any] = []

    async def receive() -> dict[str, Any]:
        return {"type": "http.request"}

    async def send(message: Any) -> None:
        told.append(message)

    async def run() -> None:
        await app({**scope, "root_path": "", "http_version": "1.1", "scheme": "http"}, receive, send)

    asyncio.run(run())
    return int(told[0]["status"])


@given(st.text(), st.binary(), st.lists(st.tuples(st.sampled_from([b"cookie", b"origin", b"accept"]), st.binary())))
@examples(150)
def test_any_request_is_answered(path: str, query: bytes, headers: list[tuple[bytes, bytes]]) -> None:
    own = (b"host", OWN.encode())
    assert status_of(TOKEN, f"/{path}", query, [own, *headers]) == 403
    assert status_of(TOKEN, "/", b"token=" + TOKEN.encode() + b"&" + query, [own]) == 303
    assert status_of(None, f"/{path}", query, headers) == 403
    assert status_of(None, f"/recording/{path}", query, [own]) == 404
    assert (status_of(None, f"/{path}", query, [own]) == 200) == (f"/{path}" in page_files())


class _Nothing:
    class session:
        number = 1
        recordings = Recordings(None)


@pytest.mark.parametrize("path", ["/page.py", "/../server.py", "/page/../server.py", "/recording/..%2Fsecret.csv",
                                  "/recording/secret.csv", "/page/", "/index.html", "/recording/"])  # fmt: skip
def test_nothing_else_is_served(session: Session, tmp_path: Path, path: str) -> None:
    (tmp_path / "secret.csv").write_text("not yours")
    assert client(session).get(path).status_code == 404


def test_the_page_names_nothing_but_itself(session: Session) -> None:
    page = client(session)
    for path in page_files():
        got = page.get(path)
        assert got.status_code == 200
        assert "default-src 'none'" in got.headers["content-security-policy"]
        own = got.text.replace("http://www.w3.org/2000/svg", "")
        assert "http://" not in own
        assert "https://" not in own


class Slow:
    """A web socket that takes nothing until it may."""

    def __init__(self) -> None:
        self.may = asyncio.Event()
        self.frames: list[bytes] = []

    async def send_text(self, data: str) -> None:
        await self.may.wait()

    async def send_bytes(self, data: bytes) -> None:
        await self.may.wait()
        self.frames.append(data)


async def turns() -> None:
    for _ in range(400):
        await asyncio.sleep(0)


def asleep(missed: int) -> tuple[Page, list[tuple[int, np.ndarray[Any, Any]]]]:
    """Return a page that confirmed nothing while so many rows came, and its frames: whether it begins again, times."""

    async def run() -> tuple[Page, list[bytes]]:
        socket, history = Slow(), History()
        page = Page(socket)
        page.begin(history)
        socket.may.set()
        sending = asyncio.create_task(page.send())
        for begin in range(0, missed, 50):
            rows = np.zeros(50, ROW)
            rows["t_s"] = np.arange(begin, begin + 50)
            history.add(rows)
            page.wake()
            if begin < 50 * 2 * AHEAD:
                await turns()
        assert page.sent == AHEAD
        before = 0
        while page.sent > before:
            before = page.sent
            page.seen(page.sent)
            await turns()
        sending.cancel()
        return page, socket.frames

    page, frames = asyncio.run(run())
    found = []
    for number, frame in enumerate(frames, 1):
        _, told, size, past = HEADER.unpack_from(frame)
        assert told == number
        assert size <= ROWS
        found.append((past, np.frombuffer(frame, "<f8", size, HEADER.size)))
    return page, found


def test_a_page_that_was_asleep_gets_what_it_missed() -> None:
    page, frames = asleep(KEPT)
    assert [past for past, _ in frames] == [1] + [0] * (len(frames) - 1)
    assert np.array_equal(np.concatenate([t for _, t in frames]), np.arange(KEPT // 50 * 50 + 50))
    assert page.lost == 0


def test_a_page_that_slept_too_long_begins_again() -> None:
    page, frames = asleep(2 * KEPT)
    again = [i for i, (past, _) in enumerate(frames) if past]
    assert again == [0, AHEAD]
    rows = np.concatenate([t for _, t in frames[AHEAD:]])
    assert np.array_equal(rows, np.arange(rows[-1] + 1 - KEPT, rows[-1] + 1))
    assert page.lost == rows[0] - sum(len(t) for _, t in frames[:AHEAD])


def test_the_state_comes_before_the_answer_that_speaks_of_it() -> None:
    class Heard(Slow):
        async def send_text(self, data: str) -> None:
            told.append(data)

    async def run() -> None:
        page = Page(Heard())
        page.tell("state", "recording: none")
        page.answer("closed")
        sending = asyncio.create_task(page.send())
        for _ in range(10):
            await asyncio.sleep(0)
        sending.cancel()

    told: list[str] = []
    asyncio.run(run())
    assert told == ["recording: none", "closed"]


@given(st.lists(st.integers(0, 3 * KEPT), max_size=8))
@examples(30)
def test_the_history_is_the_newest_rows(sizes: list[int]) -> None:
    history, t = History(), np.empty(0)
    for size in sizes:
        rows = np.zeros(size, ROW)
        rows["t_s"] = np.arange(size) + len(t)
        t = np.append(t, rows["t_s"])
        history.add(rows)
    assert (history.begin, history.end) == (max(len(t) - KEPT, 0), len(t))
    assert np.array_equal(history.rows(history.begin, KEPT)["t_s"], t[-KEPT:])
    assert np.array_equal(history.rows(history.begin + 3, 5)["t_s"], t[-KEPT:][3:8])
