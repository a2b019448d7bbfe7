"""The measurement behind the live page: what the buttons do, what is recorded, what its touches say."""

import json
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import palpate
import pytest
from live_bench import ORIGIN, OWN, answer, begun, bench_of, client, obey
from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from palpate.live.protocol import Refused
from palpate.live.recordings import Recordings
from palpate.live.session import Session
from palpate.live.summary import Summary
from palpate.recording.session import plan_of


def heard(socket: Any, kind: str) -> dict[str, Any]:
    """Return the next message of a kind."""
    for _ in range(500):
        message = socket.receive()
        if message.get("text") and (told := json.loads(message["text"]))["type"] == kind:
            return dict(told)
    raise AssertionError(f"no {kind} among 500 messages")


def until(holds: Callable[[], object]) -> None:
    """Wait for it."""
    end = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.005)


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
        socket.send_text('{"do": "mark"}')
        while not (marks := heard(socket, "events")["marks"]):
            pass
        assert marks[0]["text"] == ""
        number = heard(socket, "done")["id"]
        socket.send_text(json.dumps({"do": "mark text", "id": number, "text": "here"}))
        while heard(socket, "events")["marks"][0]["text"] != "here":
            pass
        assert heard(socket, "done")["message"] == "Marked: here"
        socket.send_text('{"do": "tare"}')
        assert "do not touch anything" in heard(socket, "done")["message"]
        while not (tares := heard(socket, "events")["tares"]):
            pass
        socket.send_text('{"do": "stop"}')
        assert "closed" in heard(socket, "done")["message"]
        socket.send_text('{"do": "mark"}')
        assert heard(socket, "done")["message"] == "Marked; nothing is recorded yet."
        state = heard(socket, "state")
        assert (state["recording"], state["proposed"]) == (None, "run-2.csv")
        assert state["files"] == [
            {"name": "run.csv", "kind": "recording"},
            {"name": "run.json", "kind": "settings"},
        ]
        socket.send_text('{"do": "record"}')
        assert "run-2.csv" in heard(socket, "done")["message"]
        got = page.get("/recording/run.csv")
    session.close()
    assert got.content == (tmp_path / "run.csv").read_bytes()
    for name in ("run.csv", "run-2.csv"):
        report = palpate.check(tmp_path / name)
        assert (report.clean, report.faults) == (True, ())
    marks = json.loads((tmp_path / "run.json").read_text())["marks"]
    [mark] = [m for m in marks if m["text"] == "here"]
    assert 0 <= mark["seq"] < palpate.check(tmp_path / "run.csv").survey.rows
    assert [m["t_s"] for m in marks if m.get("tare")] == pytest.approx(tares)
    assert "session" not in json.loads((tmp_path / "run.json").read_text())


def test_buttons_at_the_wrong_moment(tmp_path: Path) -> None:
    session = begun(tmp_path)
    (tmp_path / "run-2.csv").write_text("precious")
    with pytest.raises(Refused, match="again: the measurement still runs"):
        obey(session, "again")
    obey(session, "stop")
    with pytest.raises(Refused, match="stop: no recording is running"):
        obey(session, "stop")
    with pytest.raises(ValueError, match="such a file"):
        obey(session, "record", name="run-2.csv")
    assert "run-3.csv" in obey(session, "record")
    session.close()
    for name in ("tare", "tare anyway", "record", "mark"):
        with pytest.raises(Refused, match=f"{name.removesuffix(' anyway')}: the measurement has ended"):
            obey(session, name)
    assert (tmp_path / "run-2.csv").read_text() == "precious"


def test_a_recording_that_cannot_begin_takes_no_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(path: Path, *, earlier: bool) -> None:
        raise palpate.RecordingError(path, "disk full")

    session = begun(tmp_path)
    obey(session, "stop")
    with monkeypatch.context() as patch:
        patch.setattr(session.stream, "start_recording", fail)
        with pytest.raises(palpate.RecordingError, match="disk full"):
            obey(session, "record")
    assert "run-2.csv" in obey(session, "record")
    assert session.running
    session.close()


def test_a_recording_that_is_begun_in_a_touch_has_the_whole_touch(tmp_path: Path) -> None:
    """Marks that were stamped before are in it, too, and so are notes and the specimen of the touch."""
    session = begun(tmp_path, record=False)
    assert bench_of(session).state()["proposed"].startswith("palpate-")
    obey(session, "plan", text="30 OO; 0.143", wanted=2)
    until(lambda: session.last is not None)
    marked = answer(session, "mark")["id"]
    obey(session, "note", text="warm")
    until(lambda: session.moment.state in ("contact", "adapting", "done"))
    with pytest.raises(Refused, match="tare: the probe is in contact; lift it first"):
        obey(session, "tare")
    assert re.fullmatch(r"Recording to one\.csv; it begins \d+ s ago", obey(session, "record", name="one.csv"))
    obey(session, "mark text", id=marked, text="before the touch")
    until(lambda: len(session.touches) == 1)
    recording = bench_of(session).state()["recording"]
    assert recording["name"] == "one.csv"
    assert recording["seconds"] == pytest.approx(session.last_s, abs=2)
    obey(session, "stop")
    assert obey(session, "mark text", id=marked, text="too late").endswith("is closed, and keeps the text it had.")
    live = session.touches[0]
    session.close()
    replayed = palpate.read(tmp_path / "one.csv")
    [touch] = palpate.touches(replayed)
    assert touch.ratio.hex() == live.ratio.hex()
    document = json.loads((tmp_path / "one.json").read_text())
    assert [mark["text"] for mark in document["marks"]] == ["before the touch"]
    plan = plan_of(document)
    assert [entry and entry.specimen for entry in plan.matched([touch])] == ["30 OO"]
    assert [note.text for note in plan.notes] == ["warm"]


def test_tare_anyway_in_contact(tmp_path: Path) -> None:
    session = begun(tmp_path)
    assert obey(session, "tare").endswith("do not touch anything.")
    until(lambda: session.moment.state in ("contact", "adapting", "done"))
    assert obey(session, "tare anyway").endswith("do not touch anything.")
    until(lambda: session.moment.state == "baseline")
    session.close()


def test_a_measurement_that_cannot_begin_takes_no_name(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("precious")
    recordings = Recordings(tmp_path / "run.csv")
    session = Session(lambda: palpate.open("sim:four-specimens?seed=1"), recordings, {"scene": "handheld"})
    with pytest.raises(palpate.RecordingError, match="already exists"):
        session.start()
    assert recordings.next() == tmp_path / "run.csv"
    assert (tmp_path / "run.csv").read_text() == "precious"


def test_nothing_is_recorded_before_record_is_pressed(tmp_path: Path) -> None:
    session = begun(tmp_path, record=False)
    until(lambda: session.last is not None)
    session.close()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "name", ["../out.csv", "/tmp/out.csv", ".hidden.csv", "a/b.csv", "run.txt", "a\\b.csv", "x" * 200 + ".csv"]
)
def test_a_page_writes_in_one_folder_only(tmp_path: Path, name: str) -> None:
    session = begun(tmp_path, record=False)
    with pytest.raises(ValueError, match="allowed: "):
        obey(session, "record", name=name)
    assert session.running
    session.close()
    assert list(tmp_path.iterdir()) == []


def test_it_measures_what_the_stream_measures_and_again(tmp_path: Path) -> None:
    session = begun(tmp_path, speed=None)
    for _ in range(2):
        while session.running:
            time.sleep(0.01)
        found = session.touches
        obey(session, "again")
    session.close()
    replayed = palpate.touches(palpate.read(tmp_path / "run.csv"))
    assert [t.ratio.hex() for t in found] == [
        t.ratio.hex() for t in palpate.touches(palpate.read(tmp_path / "run-2.csv"))
    ]
    assert len(replayed) == 4


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
    assert calibrated.instrument("")["scatter"] == calibration.touch_spread
    session.touches = [first, first]
    together = calibrated.touches()["together"]
    assert together["text"].startswith("mean of 2 touches: ")
    assert together["modulus"]["low_MPa"] < together["modulus"]["value_MPa"] < together["modulus"]["high_MPa"]
    session.touches = [first]
    assert (plain.touches()["most_reliable"], plain.touches()["together"]) == (1, None)
    session.close()


def test_the_measurement_goes_on_without_a_recording_that_is_removed(tmp_path: Path) -> None:
    """The rows so far are in the rescue recording; another recording can begin."""
    session = begun(tmp_path)
    bench_of(session)
    (tmp_path / "run.csv").unlink()
    until(lambda: session.failed and session.messages)
    rescued = tmp_path / "run.rescued.csv"
    assert session.messages[-1] == (
        f"Error: {tmp_path / 'run.csv'}: was removed while it was recorded; what could be saved is in {rescued}"
    )
    assert (session.running, session.recorder, session.error) == (True, None, "")
    assert palpate.check(rescued).clean
    assert session.recordings.find("run.rescued.csv") == rescued
    assert "run-3.csv" in obey(session, "record")
    session.close()
    assert palpate.check(tmp_path / "run-3.csv").clean


def test_another_measurement_is_recorded_as_the_one_before(tmp_path: Path) -> None:
    session = begun(tmp_path, speed=None, record=False)
    until(lambda: not session.running)
    obey(session, "again")
    until(lambda: not session.running)
    assert session.recordings.files == []
    session.records = True
    obey(session, "again")
    until(lambda: not session.running)
    session.close()
    assert [file["kind"] for file in session.recordings.files] == ["recording", "settings"]


def test_marks_of_this_measurement_only_and_so_many(tmp_path: Path) -> None:
    session = begun(tmp_path, speed=None)
    bench = bench_of(session)
    until(lambda: not session.running)
    with pytest.raises(Refused, match="mark: the measurement has ended"):
        obey(session, "mark")
    with pytest.raises(Refused, match="id: got 7, allowed: one of the newest 500 marks"):
        obey(session, "mark text", id=7, text="x")
    events = bench.told["events"]()
    assert {flag["name"] for flag in events["flags"]} == {flag for touch in session.touches for flag in touch.flags}
    session.close()
