"""The live page without a browser: what is refused, what a slow page costs, what the buttons do."""

import asyncio
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from click.testing import CliRunner
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from palpate.cli import main
from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from palpate.live.feed import HEADER, KEPT, ROW, History, pack
from palpate.live.hub import AHEAD, WAITING, Page
from palpate.live.protocol import Command, Refused, parse
from palpate.live.recordings import Recordings
from palpate.live.server import Server, page_files
from palpate.live.session import Session
from palpate.live.summary import Summary
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

HOST, PORT, TOKEN = "127.0.0.1", 8746, "a-token"
OWN = f"{HOST}:{PORT}"
ORIGIN = f"http://{OWN}"


def begun(folder: Path, *, speed: float | None = 4, record: bool = True) -> Session:
    recordings = Recordings(folder / "run.csv" if record else None)
    pace = {"speed": speed} if speed else {}
    session = Session(lambda: palpate.open("sim:four-specimens?seed=1", **pace), recordings, {"scene": "handheld"})
    session.start()
    return session


@pytest.fixture
def session(tmp_path: Path) -> Iterator[Session]:
    session = begun(tmp_path)
    yield session
    session.close()


def client(session: Session, host: str = HOST, token: str | None = None) -> TestClient:
    app = Server(session, Summary(session), "sim:four-specimens").app(host, PORT, token)
    return TestClient(app, base_url=ORIGIN, follow_redirects=False)


def heard(socket: Any, kind: str) -> dict[str, Any]:
    """Return the next message of a kind."""
    for _ in range(500):
        message = socket.receive()
        if message.get("text") and (told := json.loads(message["text"]))["type"] == kind:
            return dict(told)
    raise AssertionError(f"no {kind} among 500 messages")


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
        {"do": st.sampled_from(["tare", "tare anyway", "mark", "seen", "record", "stop", "again", "", 1])},
        optional={"text": st.text() | st.integers(), "frame": st.integers() | st.floats(), "more": st.none()},
    )
)
def test_what_looks_like_a_command(message: dict[str, Any]) -> None:
    try:
        command = parse(json.dumps(message))
    except Refused:
        return
    assert command.do == message["do"]
    assert 0 <= command.frame < 2**32
    assert len(command.text) <= 200


def test_deep_and_long_messages_are_refused() -> None:
    for message in ("[" * 4000, "9" * 4000, '{"do": "mark", "text": "' + "x" * 5000 + '"}', '{"do": "tare", "do2": 1}'):
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
    app = Server(_Nothing(), _Nothing(), "").app(HOST, PORT, token)  # type: ignore[arg-type]
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
    number = 1
    recordings = Recordings(None)


@pytest.mark.parametrize("path", ["/page.py", "/../server.py", "/uplot/../../server.py", "/recording/..%2Fsecret.csv",
                                  "/recording/secret.csv", "/uplot/", "/index.html", "/recording/"])  # fmt: skip
def test_nothing_else_is_served(session: Session, tmp_path: Path, path: str) -> None:
    (tmp_path / "secret.csv").write_text("not yours")
    assert client(session).get(path).status_code == 404


def test_the_page_names_nothing_but_itself(session: Session) -> None:
    page = client(session)
    for path in page_files():
        got = page.get(path)
        assert got.status_code == 200
        assert "default-src 'none'" in got.headers["content-security-policy"]
        own = got.text.replace("http://www.w3.org/2000/svg", "").replace("https://github.com/leeoniya/uPlot", "")
        assert "http://" not in own
        assert "https://" not in own


def test_the_buttons_over_a_web_socket(tmp_path: Path) -> None:
    session = begun(tmp_path)
    with client(session) as page, page.websocket_connect("/ws", headers={"host": OWN, "origin": ORIGIN}) as socket:
        assert heard(socket, "hello")["source"] == "sim:four-specimens"
        while heard(socket, "state")["counters"]["delivered"] < 20:
            pass
        socket.send_text("nonsense")
        assert "allowed: JSON" in heard(socket, "refused")["message"]
        socket.send_text('{"do": "record"}')
        assert "already running" in heard(socket, "refused")["message"]
        socket.send_text('{"do": "mark", "text": "here"}')
        assert heard(socket, "marks")["rows"][0]["text"] == "here"
        assert heard(socket, "done")["message"] == "Marked: here"
        socket.send_text('{"do": "tare"}')
        assert "do not touch anything" in heard(socket, "done")["message"]
        socket.send_text('{"do": "stop"}')
        assert "closed" in heard(socket, "done")["message"]
        socket.send_text('{"do": "mark", "text": "nowhere"}')
        assert "no recording is running" in heard(socket, "refused")["message"]
        socket.send_text('{"do": "record"}')
        assert "run-2.csv" in heard(socket, "done")["message"]
        got = page.get("/recording/run.csv")
    session.close()
    assert got.content == (tmp_path / "run.csv").read_bytes()
    for name in ("run.csv", "run-2.csv"):
        report = palpate.check(tmp_path / name)
        assert (report.clean, report.faults) == (True, ())
    [mark] = [m for m in json.loads((tmp_path / "run.json").read_text())["marks"] if m["text"] == "here"]
    assert 0 <= mark["seq"] < palpate.check(tmp_path / "run.csv").survey.rows


def test_buttons_at_the_wrong_moment(tmp_path: Path) -> None:
    session = begun(tmp_path)
    (tmp_path / "run-2.csv").write_text("precious")
    with pytest.raises(Refused, match="again: the measurement still runs"):
        session.do(Command("again"))
    session.do(Command("stop"))
    with pytest.raises(Refused, match="stop: no recording is running"):
        session.do(Command("stop"))
    assert "run-3.csv" in session.do(Command("record"))
    session.close()
    for name in ("tare", "tare anyway", "record", "mark"):
        with pytest.raises(Refused, match=f"{name.removesuffix(' anyway')}: the measurement has ended"):
            session.do(Command(name, text="late"))
    assert (tmp_path / "run-2.csv").read_text() == "precious"


def test_a_recording_that_cannot_begin_takes_no_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(path: Path) -> None:
        raise palpate.RecordingError(path, "disk full")

    session = begun(tmp_path)
    session.do(Command("stop"))
    with monkeypatch.context() as patch:
        patch.setattr(session.stream, "start_recording", fail)
        with pytest.raises(palpate.RecordingError, match="disk full"):
            session.do(Command("record"))
    assert session.do(Command("record")).endswith("run-2.csv")
    session.close()


def test_buttons_in_contact_warn(tmp_path: Path) -> None:
    session = begun(tmp_path)
    assert session.do(Command("tare")).endswith("do not touch anything.")
    session.do(Command("stop"))
    assert session.do(Command("record")).endswith("run-2.csv")
    session.do(Command("stop"))
    while session.moment.state not in ("contact", "adapting", "done"):
        time.sleep(0.005)
    assert session.do(Command("record")).endswith(
        "it starts during contact, so a replay has no baseline for this touch"
    )
    with pytest.raises(Refused, match="tare: the probe is in contact; lift it first"):
        session.do(Command("tare"))
    assert session.do(Command("tare anyway")).endswith("do not touch anything.")
    while session.moment.state != "baseline":
        time.sleep(0.005)
    session.close()


def test_a_measurement_that_cannot_begin_takes_no_name(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("precious")
    recordings = Recordings(tmp_path / "run.csv")
    session = Session(lambda: palpate.open("sim:four-specimens?seed=1"), recordings, {"scene": "handheld"})
    with pytest.raises(palpate.RecordingError, match="already exists"):
        session.start()
    assert recordings.next() == tmp_path / "run.csv"
    assert (tmp_path / "run.csv").read_text() == "precious"


def test_nothing_is_recorded_where_the_user_named_no_file(tmp_path: Path) -> None:
    session = begun(tmp_path, record=False)
    with pytest.raises(ValueError, match="--record"):
        session.do(Command("record"))
    session.close()
    assert list(tmp_path.iterdir()) == []


def test_it_measures_what_the_stream_measures_and_again(tmp_path: Path) -> None:
    session = begun(tmp_path, speed=None)
    for _ in range(2):
        while session.running:
            time.sleep(0.01)
        found = session.touches
        session.do(Command("again"))
    session.close()
    replayed = palpate.touches(palpate.read(tmp_path / "run.csv"))
    assert [t.ratio.hex() for t in found] == [
        t.ratio.hex() for t in palpate.touches(palpate.read(tmp_path / "run-2.csv"))
    ]
    assert len(replayed) == 4


class Slow:
    """A web socket that takes nothing until it may."""

    def __init__(self) -> None:
        self.may = asyncio.Event()
        self.got: list[int] = []

    async def send_text(self, data: str) -> None:
        await self.may.wait()

    async def send_bytes(self, data: bytes) -> None:
        await self.may.wait()
        self.got.append(HEADER.unpack_from(data)[1])


def test_a_slow_page_loses_whole_frames_and_is_told() -> None:
    async def run() -> tuple[Page, list[int]]:
        socket = Slow()
        page = Page(socket)
        sending = asyncio.create_task(page.send())
        for number in range(200):
            page.offer(number, pack(number, np.zeros(1, ROW)))
            await asyncio.sleep(0)
        socket.may.set()
        for _ in range(400):
            await asyncio.sleep(0)
        page.seen(199)
        for _ in range(400):
            await asyncio.sleep(0)
        sending.cancel()
        return page, socket.got

    page, got = asyncio.run(run())
    assert page.sent + page.lost == 200
    assert len(got) == page.sent <= WAITING + AHEAD + 1
    assert got == sorted(got)
    assert got[-1] == 199


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
    assert np.array_equal(history.rows["t_s"], t[-KEPT:])


def test_the_line_that_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "uvicorn", None)
    result = CliRunner().invoke(main, ["live", "sim:four-specimens"])
    assert result.exit_code == 6
    assert "pip install 'palpate[live]'" in result.stderr


def test_a_port_that_is_not_free() -> None:
    from palpate.live.serve import listen

    with listen(HOST, 0) as taken:
        port = str(taken.getsockname()[1])
        result = CliRunner().invoke(main, ["live", "sim:four-specimens", "--no-open", "--port", port])
    assert result.exit_code == 2
    assert "not free" in result.stderr or "in use" in result.stderr


def test_touches_that_differ_have_no_mean_and_no_best(tmp_path: Path) -> None:
    specimens = list(SORBOTHANE_MPA.values())
    ratios = [Elasticity().ratio(E) * factor for E in specimens for factor in (0.97, 1.03)]
    calibration = palpate.Calibration.fit(ratios, [E for E in specimens for _ in range(2)])
    session = begun(tmp_path, speed=None, record=False)
    while session.running:
        time.sleep(0.01)
    plain, calibrated = Summary(session), Summary(session, calibration)
    for summary in (plain, calibrated):
        several = summary.touches()
        assert several["most_reliable"] is None
        assert several["together"]["agree"] is False
        assert "differ" in several["together"]["text"]
        assert (several["together"]["ratio"], several["together"]["modulus"]) == (None, None)
    assert Summary(session, scatter=1.0).touches()["most_reliable"] in (1, 2, 3, 4)
    first = session.touches[0]
    assert plain.touches()["rows"][0]["uncertainty"] == first.standard_error
    assert calibrated.touches()["rows"][0]["uncertainty"] == calibration.uncertainty(first.ratio, first.standard_error)
    assert calibrated.instrument("")["scatter"].startswith("scatter from touch to touch (4.")
    session.touches = [first, first]
    together = calibrated.touches()["together"]
    assert together["text"].startswith("mean of 2 touches: ")
    assert together["modulus"]["low_MPa"] < together["modulus"]["value_MPa"] < together["modulus"]["high_MPa"]
    session.touches = [first]
    assert (plain.touches()["most_reliable"], plain.touches()["together"]) == (1, None)
    session.close()
