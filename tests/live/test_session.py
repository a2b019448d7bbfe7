"""The measurement behind the live page: what the buttons do, what is recorded, what its touches say."""

import json
import time
from pathlib import Path
from typing import Any

import palpate
import pytest
from live_bench import ORIGIN, OWN, begun, client, obey
from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from palpate.live.protocol import Refused
from palpate.live.recordings import Recordings
from palpate.live.session import Session
from palpate.live.summary import Summary


def heard(socket: Any, kind: str) -> dict[str, Any]:
    """Return the next message of a kind."""
    for _ in range(500):
        message = socket.receive()
        if message.get("text") and (told := json.loads(message["text"]))["type"] == kind:
            return dict(told)
    raise AssertionError(f"no {kind} among 500 messages")


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
        obey(session, "again")
    obey(session, "stop")
    with pytest.raises(Refused, match="stop: no recording is running"):
        obey(session, "stop")
    assert "run-3.csv" in obey(session, "record")
    session.close()
    for name in ("tare", "tare anyway", "record", "mark"):
        with pytest.raises(Refused, match=f"{name.removesuffix(' anyway')}: the measurement has ended"):
            obey(session, name)
    assert (tmp_path / "run-2.csv").read_text() == "precious"


def test_a_recording_that_cannot_begin_takes_no_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(path: Path) -> None:
        raise palpate.RecordingError(path, "disk full")

    session = begun(tmp_path)
    obey(session, "stop")
    with monkeypatch.context() as patch:
        patch.setattr(session.stream, "start_recording", fail)
        with pytest.raises(palpate.RecordingError, match="disk full"):
            obey(session, "record")
    assert obey(session, "record").endswith("run-2.csv")
    session.close()


def test_buttons_in_contact_warn(tmp_path: Path) -> None:
    session = begun(tmp_path)
    assert obey(session, "tare").endswith("do not touch anything.")
    obey(session, "stop")
    assert obey(session, "record").endswith("run-2.csv")
    obey(session, "stop")
    while session.moment.state not in ("contact", "adapting", "done"):
        time.sleep(0.005)
    assert obey(session, "record").endswith("it starts during contact, so a replay has no baseline for this touch")
    with pytest.raises(Refused, match="tare: the probe is in contact; lift it first"):
        obey(session, "tare")
    assert obey(session, "tare anyway").endswith("do not touch anything.")
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
    assert calibrated.instrument("")["scatter"].startswith("scatter from touch to touch (4.")
    session.touches = [first, first]
    together = calibrated.touches()["together"]
    assert together["text"].startswith("mean of 2 touches: ")
    assert together["modulus"]["low_MPa"] < together["modulus"]["value_MPa"] < together["modulus"]["high_MPa"]
    session.touches = [first]
    assert (plain.touches()["most_reliable"], plain.touches()["together"]) == (1, None)
    session.close()


def test_a_recording_that_is_removed_is_said_on_the_page(tmp_path: Path) -> None:
    """The measurement ends with the error, as for a full disk, and the rows are in the rescue recording."""
    session = begun(tmp_path)
    (tmp_path / "run.csv").unlink()
    until = time.monotonic() + 60
    while session.running:
        assert time.monotonic() < until
        time.sleep(0.02)
    rescued = tmp_path / "run.rescued.csv"
    assert (
        session.error
        == f"{tmp_path / 'run.csv'}: was removed while it was recorded; what could be saved is in {rescued}"
    )
    session.close()
    assert palpate.check(rescued).clean
