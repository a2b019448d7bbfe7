"""A recording that is opened in the page: all of it at once, with the touches of a replay."""

import json
import math
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from live_bench import HOST, ORIGIN, OWN, PORT
from palpate.live import levels
from palpate.live.feed import HEADER, Flag, Kind
from palpate.live.opening import is_file, review
from palpate.live.protocol import Command, Refused
from palpate.live.review import Review
from palpate.live.server import Server
from palpate.live.workbench import Workbench
from palpate.recording import sidecar
from palpate.recording.foreign import recorded
from palpate.recording.session import Entry, Plan, Specimen
from starlette.testclient import TestClient

OWN_FILE = Path("tests/data/four-specimens.csv")


@contextmanager
def opened(path: Path, how: dict[str, Any] | None = None, **asked: Any) -> Iterator[Review]:
    """Open a file and wait until it is read."""
    found = review(str(path), asked, how or {}, lambda _: None)
    found.start()
    until = time.monotonic() + 60
    while found.running:
        assert time.monotonic() < until
        time.sleep(0.01)
    yield found
    found.close()


def copied(folder: Path) -> Path:
    """Return a copy of the recording, with its sidecar."""
    for name in (OWN_FILE, OWN_FILE.with_suffix(".json")):
        shutil.copy(name, folder)
    return folder / OWN_FILE.name


def same(one: list[palpate.Touch], other: list[palpate.Touch]) -> bool:
    return [repr(touch.__getstate__()) for touch in one] == [repr(touch.__getstate__()) for touch in other]  # nan too


def test_the_touches_are_those_of_a_replay(tmp_path: Path) -> None:
    recording = palpate.read(OWN_FILE)
    table = tmp_path / "table.csv"
    lines = [
        f"{t},{hard},{soft}" for t, hard, soft in zip(recording.t_hard_s, recording.hard, recording.soft, strict=True)
    ]
    table.write_text("\n".join(["time (s),a (pF),b (pF)", *lines, ""]))
    kinds: list[tuple[Path, dict[str, Any]]] = [
        (OWN_FILE, {}),
        (table, {"columns": {"hard": "a (pF)", "soft": "b (pF)"}}),
    ]
    for path, asked in kinds:
        with opened(path, **asked) as found:
            replayed = palpate.touches(recorded(path, **asked))
            assert len(replayed) == 4
            assert same(found.touches, replayed)
            view = found.levels.view(-1, 1e9, 4096)
            assert view["t_s"] == pytest.approx(recording.t_hard_s, rel=1e-15)
            measured = view["t_s"][view["flags"] & int(Flag.MEASURED) > 0]
            for number, touch in enumerate(found.touches, 1):
                later = next((t.start_s for t in found.touches[number:]), math.inf)
                assert found.ends[number] == measured[measured < later - 1e-6][-1]
                assert found.ends[number] > touch.start_s + 249 * 0.0259


def test_other_settings_replace_those_of_the_recording() -> None:
    with opened(OWN_FILE, {"scene": "sliding", "samples": 100, "seconds": None}) as found:
        assert found.stream.tracker.scene == "sliding"
        assert same(found.touches, palpate.touches(recorded(OWN_FILE), scene="sliding", samples=100, seconds=None))


def test_what_a_page_is_told(tmp_path: Path) -> None:
    path = copied(tmp_path)
    touches = palpate.touches(palpate.read(path))
    document = sidecar.load(path)
    assert document
    plan = Plan("rehearsal", "A. B.", (Specimen("soft", 0.3, 2), Specimen("hard", 3.0, 2)),
                (Entry(touches[0].start_s, "soft"), Entry(touches[1].start_s, "soft", "slipped")))  # fmt: skip
    document["session"] = plan.as_dict()
    document["marks"] = [{"seq": 300, "t_s": 7.8, "text": "here"}]
    sidecar.save(sidecar.sidecar_path(path), document)
    with opened(path) as found:
        bench = Workbench(found, str(path))
        hello = bench.hello()
        assert (hello["kind"], hello["file"]["rows"], hello["file"]["end"]) == ("file", 1411, "complete, clean end")
        assert (hello["version"], hello["origin_s"]) == (palpate.__version__, palpate.read(path).t_hard_s[0])
        rows = bench.told["touches"]()["rows"]
        assert [(row["specimen"], row["kept"], row["why"]) for row in rows[:3]] == [
            ("soft", True, ""), ("soft", False, "slipped"), (None, True, "")]  # fmt: skip
        assert (rows[0]["deviation"], rows[1]["deviation"]) == (0, touches[1].ratio / touches[0].ratio - 1)
        assert all(row["start_s"] < row["end_s"] for row in rows)
        session = bench.told["session"]()
        assert (session["title"], session["specimens"][0]["kept"], session["next"]) == ("rehearsal", 1, None)
        assert bench.told["events"]()["marks"] == [{"id": 1, "t_s": 7.8, "text": "here"}]
        assert bench.state()["end_s"] == pytest.approx(palpate.read(path).t_hard_s[-1], rel=1e-15)
        for do in ("tare", "record", "again", "mark"):
            with pytest.raises(Refused, match=f"{do}: this is a recording, nothing is measured"):
                bench.do(Command(do))


def test_a_damaged_recording_is_shown_as_far_as_it_can_be_read(tmp_path: Path) -> None:
    path = copied(tmp_path)
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([*lines[:700], b"\0" * 40 + b"\n", *lines[701:]]))
    with opened(path) as found:
        assert found.file["rows"] == 1410
        assert found.file["end"] == "not complete"
        assert any("damaged: line 701" in line for line in found.messages)
        assert len(found.levels.view(-1, 1e9, 4096)) == 1410
        assert found.touches


def test_a_recording_that_still_runs_says_so(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    with palpate.Stream("sim:four-specimens?seed=1&speed=1", record=path) as stream:
        for batch in stream.batches():
            if stream.recorder and stream.recorder.rows > 20:
                break
            assert len(batch.samples)
        with opened(path) as found:
            assert found.file["end"] == "still being recorded"
            assert any("still being recorded" in line for line in found.messages)


def test_a_file_that_is_no_recording_ends_with_words(tmp_path: Path) -> None:
    path = copied(tmp_path)
    path.write_text("nothing\n")
    with pytest.raises(palpate.RecordingError):
        review(str(path), {}, {}, lambda _: None)


def test_a_very_long_one_says_what_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in {"WHOLE": 500, "_SPLIT": 200, "_AT_ONCE": 100}.items():
        monkeypatch.setattr(levels, name, value)
    with opened(OWN_FILE) as found:
        assert found.levels.finest_s > 0
        assert any("too long to show every sample" in line for line in found.messages)
        assert same(found.touches, palpate.touches(recorded(OWN_FILE)))
        assert len(found.levels.view(-1, 1e9, 4096)) < 1411


def test_tares_and_gaps_of_the_sidecar(tmp_path: Path) -> None:
    path = copied(tmp_path)
    document = sidecar.load(path)
    assert document
    document["marks"] = [{"seq": 200, "t_s": 5.2, "text": "tare", "tare": True},
                         {"seq": 700, "t_s": 18.2, "text": "plugged in again", "tare": True, "gap": True}]  # fmt: skip
    sidecar.save(sidecar.sidecar_path(path), document)
    times = palpate.read(path).t_hard_s
    with opened(path) as found:
        assert found.tares == pytest.approx([times[200]], rel=1e-15)
        [(from_s, to_s, lost, text)] = found.gaps
        assert (from_s, to_s) == pytest.approx((times[700], times[701]), rel=1e-15)
        assert (lost, text) == (0, "plugged in again")
        assert same(found.touches, palpate.touches(recorded(path)))


def test_views_and_courses_over_a_web_socket() -> None:
    with opened(OWN_FILE) as found:
        client = TestClient(Server(Workbench(found, "")).app(HOST, PORT), base_url=ORIGIN)
        headers = {"host": OWN, "origin": ORIGIN}
        with client as page, page.websocket_connect("/ws", headers=headers) as socket:
            socket.send_text(json.dumps({"do": "view", "id": 77, "from_s": 5, "to_s": 30, "rows": 200}))
            socket.send_text(json.dumps({"do": "trace", "touch": 2}))
            socket.send_text(json.dumps({"do": "trace", "touch": 9}))
            traces: list[dict[str, Any]] = []
            frame, refused = b"", ""
            while not (frame and refused and len(traces) >= 5):
                message = socket.receive()
                told = json.loads(message.get("text") or '{"type": ""}')
                if told["type"] == "trace":
                    traces.append(told)
                refused = told["message"] if told["type"] == "refused" else refused
                if (data := message.get("bytes")) and HEADER.unpack_from(data)[3] == Kind.VIEW:
                    frame = data
        assert "got touch 9, allowed: 1 to 4" in refused
        version, number, size, _ = HEADER.unpack_from(frame)
        assert (version, number) == (3, 77)
        assert 100 <= size <= 200
        times = np.frombuffer(frame, "<f8", size, HEADER.size)
        assert times[0] <= 5
        assert times[-1] >= 30
        for trace in traces:
            touch = found.touches[trace["touch"] - 1]
            assert 80 <= len(trace["t"]) <= 160
            assert trace["ratio"][-1] == pytest.approx(touch.first_ratio, rel=1e-3)
            assert trace["t"] == sorted(trace["t"])
            assert trace["t"][-1] == pytest.approx(found.ends[trace["touch"]] - touch.start_s, abs=1e-6)


def test_what_is_opened_and_what_is_played() -> None:
    assert is_file(str(OWN_FILE))
    assert not is_file(f"{OWN_FILE}?speed=1")
    assert not is_file("sim:four-specimens")
    assert not is_file("usb:")
