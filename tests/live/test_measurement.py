"""A measurement behind the page: what the buttons do, what is recorded, what its touches say; and a recording instead."""

import errno
import json
import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import palpate
import pytest
from live_bench import OWN_FILE, SOURCE, Bench, begun, client, done
from palpate import Source, Uncertainty
from palpate.ad7746.registers import linearity_pF
from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from palpate.live import multiresolution
from palpate.live.commands import FileWorkbench
from palpate.live.file_review import RecordedMeasurement
from palpate.live.page_frames import HEADER, FrameKind
from palpate.live.plan import TouchPlan
from palpate.live.protocol import RefusedCommand, ShownScatter, TouchCount
from palpate.live.touch_rows import TouchTable
from palpate.recording.reading import recorded
from palpate.recording.session import Entry, Plan, Specimen, plan_of
from palpate.uncertainty import Scatter, hold_ratio
from project import copied
from recording_bench import soon
from report_session import change


def fast() -> Source:
    """Return a source with four touches that waits for nothing."""
    return palpate.open(str(OWN_FILE))


def heard(socket: Any, kind: str) -> dict[str, Any]:
    """Return the next message of a kind."""
    for _ in range(500):
        message = socket.receive()
        if message.get("text") and (told := json.loads(message["text"]))["type"] == kind:
            return dict(told)
    raise AssertionError(f"no {kind} among 500 messages")


def ended(bench: Bench) -> Bench:
    soon(lambda: not bench.measurement.running)
    return bench


def test_a_refusal_is_answered_and_a_tare_is_marked(tmp_path: Path) -> None:
    bench = begun(SOURCE, tmp_path)
    with client(bench) as page, page.websocket_connect("/ws") as socket:
        for message, words in (
            ("nonsense", "allowed: a command as a JSON object"),
            ('{"do": "record"}', "already recording"),
        ):
            socket.send_text(message)
            assert words in heard(socket, "refused")["message"]
    soon(lambda: bench.measurement.last)
    assert "do not touch anything" in bench.obey("tare")
    soon(lambda: bench.annotations.document().tares)
    tares = bench.annotations.document().tares
    assert "closed" in bench.obey("stop")
    assert bench.obey("mark") == "Marked; nothing is recorded yet."
    state = bench.state()
    assert (state.recording, state.proposed) == (None, "run-2.csv")
    assert [file.kind for file in state.files] == ["recording", "settings"]
    bench.measurement.close()
    document = json.loads((tmp_path / "run.json").read_text())
    assert [mark["t_s"] for mark in document["marks"] if mark["tare"]] == pytest.approx(tares)
    assert "session" not in document


def test_a_level_calibration_measures_on_with_its_settings_and_never_shows_the_hold(
    tmp_path: Path,
) -> None:
    calibration = palpate.Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5])
    domes = (replace(calibration.exponent_fits[0], contact_exponent=1.5),)
    calibration = replace(
        calibration, ratio="level", contact_exponent=1.5, age_s=0.8, exponent_fits=domes
    )
    bench = ended(begun(fast, tmp_path, record=False))
    guided: Any = bench.guided
    guided.use(calibration, tmp_path / "probe.toml")
    [row, *_] = bench.table.document().rows
    assert (math.isnan(row.ratio), row.kept, row.modulus and row.modulus.text) == (
        True,
        False,
        "no modulus",
    )
    assert row.why.startswith(
        "measured with age 0 and contact_exponent 1, but calibrated with age 0.8"
    )
    bench.obey("again")
    soon(lambda: len(bench.table.document().rows) == 4)
    assert {(touch.age_s, touch.contact_exponent) for touch in bench.measurement.touches} == {
        (0.8, 1.5)
    }
    rows, touches = bench.table.document().rows, bench.measurement.touches
    assert [row.ratio for row in rows] == [touch.level_ratio for touch in touches]
    plan: Any = bench.plan
    assert plan_of({"session": plan._within(-math.inf).as_dict()}).ratio == "level"


def test_buttons_at_the_wrong_moment(tmp_path: Path) -> None:
    bench = begun(SOURCE, tmp_path)
    (tmp_path / "run-2.csv").write_text("precious")
    with pytest.raises(RefusedCommand, match="again: the measurement still runs"):
        bench.obey("again")
    bench.obey("stop")
    with pytest.raises(RefusedCommand, match="stop: no recording is running"):
        bench.obey("stop")
    with pytest.raises(ValueError, match="such a file"):
        bench.obey("record", name="run-2.csv")
    assert "run-3.csv" in bench.obey("record")
    bench.measurement.close()
    for name in ("tare", "record", "mark"):
        with pytest.raises(RefusedCommand, match=f"{name}: the measurement has ended"):
            bench.obey(name)
    with pytest.raises(RefusedCommand, match="id: got 7, allowed: one of the newest 500 marks"):
        bench.obey("mark text", id=7, text="x")
    assert (tmp_path / "run-2.csv").read_text() == "precious"


def test_a_recording_that_is_begun_in_a_touch_has_the_whole_touch(tmp_path: Path) -> None:
    """Marks that were stamped before are in it, too, and so are notes and the specimen of the touch."""
    bench = begun(f"{OWN_FILE}?speed=4", tmp_path, record=False)
    measurement = bench.measurement
    assert list(tmp_path.iterdir()) == []  # nothing is recorded before Record is pressed
    bench.obey("plan", text="30 OO; 0.143", wanted=2)
    soon(lambda: measurement.last is not None)
    marked = done(bench, "mark").id
    bench.obey("note", text="warm")
    soon(lambda: measurement.state in ("contact", "adapting", "done"))
    with pytest.raises(RefusedCommand, match="tare: the probe is in contact; lift it first"):
        bench.obey("tare")
    assert re.fullmatch(
        r"Recording to one\.csv; it begins \d+ s ago", bench.obey("record", name="one.csv")
    )
    bench.obey("mark text", id=marked, text="before the touch")
    soon(lambda: len(measurement.touches) == 1)
    recording = bench.state().recording
    assert recording
    assert recording.name == "one.csv"
    assert recording.seconds == pytest.approx(measurement.last_s, abs=2)
    bench.obey("stop")
    assert bench.obey("mark text", id=marked, text="too late").endswith(
        "is closed, and keeps the text it had."
    )
    live = measurement.touches[0]
    soon(lambda: measurement.state in ("contact", "adapting", "done"))
    assert bench.obey("tare anyway").endswith("do not touch anything.")
    soon(lambda: measurement.tracker_state.state == "baseline")
    measurement.close()
    [touch] = palpate.touches(palpate.read(tmp_path / "one.csv"))
    assert touch.ratio.hex() == live.ratio.hex()
    document = json.loads((tmp_path / "one.json").read_text())
    assert [mark["text"] for mark in document["marks"]] == ["before the touch"]
    plan = plan_of(document)
    assert [entry and entry.specimen for entry in plan.matched([touch])] == ["30 OO"]
    assert [note.text for note in plan.notes] == ["warm"]


def test_touches_that_differ_have_no_mean_and_no_best(tmp_path: Path) -> None:
    specimens = list(SORBOTHANE_MPA.values())
    ratios = [Elasticity().ratio(E) * factor for E in specimens for factor in (0.97, 1.03)]
    calibration = palpate.Calibration.fit(ratios, [E for E in specimens for _ in range(2)])
    bench = ended(begun(fast, tmp_path, record=False))
    measurement = bench.measurement
    plan: Any = bench.plan
    flags = bench.annotations.document().flags
    assert [(flag.touch, flag.name) for flag in flags] == [
        (number, name)
        for number, touch in enumerate(measurement.touches, 1)
        for name in touch.flags
    ]
    by_calibration = TouchPlan(measurement, calibration)
    for number, touch in enumerate(measurement.touches, 1):
        by_calibration.touch(number, touch)
    plain, calibrated = TouchTable(measurement, plan), TouchTable(measurement, by_calibration)
    for table in (plain, calibrated):
        together = table.document().together
        assert together
        assert (table.document().most_reliable, together.agree, together.ratio) == (
            None,
            False,
            None,
        )
    assert TouchTable(measurement, plan, scatter=1.0).document().most_reliable in (1, 2, 3, 4)
    first = measurement.touches[0]
    linear = linearity_pF(measurement.tracker.settings["full_scale"])
    for table, scatter, ratio_of in (
        (plain, Scatter(), hold_ratio),
        (calibrated, calibration.touch_scatter, calibration.ratio_of),
    ):
        known = Uncertainty.of(first, scatter, linear, ratio_of)
        told = table.document()
        assert told.scatter == ShownScatter(scatter.share, known.source)
        error = math.hypot(told.rows[0].own_error, scatter.share * first.ratio)
        assert error == pytest.approx(known.uncertainty, rel=1e-15)
        assert table.result(first).startswith(f"ratio {known}")
    measurement.touches = [first, first]
    by_calibration.touch(1, first)
    together = calibrated.document().together
    assert together
    assert together.text.startswith("mean of 2 touches: ")
    assert together.modulus
    assert together.modulus.low_MPa < together.modulus.value_MPa < together.modulus.high_MPa
    measurement.close()


def test_the_measurement_goes_on_without_a_recording_that_is_removed(tmp_path: Path) -> None:
    bench = begun(SOURCE, tmp_path)
    measurement = bench.measurement
    (tmp_path / "run.csv").unlink()
    assert (
        "was removed, renamed or moved while it was recorded" in bench.waited("recording").line.text
    )
    soon(lambda: measurement.failed)
    assert (measurement.running, measurement.recorder, measurement.error) == (True, None, "")
    assert "run-2.csv" in bench.obey("record")
    measurement.close()
    assert palpate.check(tmp_path / "run-2.csv").clean


def test_a_sidecar_that_is_held_ends_no_measurement_and_gets_all_marks_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An editor or a sync program holds it while the user and the page tare, mark and note."""
    bench = begun(SOURCE, tmp_path)
    measurement = bench.measurement
    soon(lambda: measurement.last)
    with monkeypatch.context() as held:
        busy = Mock(side_effect=PermissionError(errno.EACCES, "Permission denied", "run.json"))
        held.setattr("palpate.files.replace", busy)
        measurement.stream.tare(force=True)
        bench.obey("tare anyway")
        soon(lambda: measurement.tares)
        answer = bench.obey("mark")
        assert answer.startswith(
            "Marked. run.json: cannot be written: Permission denied; notes, marks"
        )
        assert "run.json: cannot be written" in bench.obey("note", text="left hand")
        line = bench.waited("notes wait").line
        assert (line.title, line.level) == ("Notes wait.", "caution")
        assert measurement.running
    recorder: Any = measurement.recorder
    soon(lambda: not recorder.sidecar_trouble)
    measurement.close()
    document = json.loads((tmp_path / "run.json").read_text())
    assert sorted(mark["text"] for mark in document["marks"]) == ["", "tare", "tare"]
    assert [note["text"] for note in document["session"]["notes"]] == ["left hand"]
    assert (measurement.error, measurement.failed) == ("", False)
    assert palpate.check(tmp_path / "run.csv").clean


def test_a_full_disk_ends_no_measurement(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The page says that rows wait; when there is room again, they are written."""
    bench = begun(SOURCE, tmp_path)
    measurement = bench.measurement
    with monkeypatch.context() as full:
        full.setattr(
            "palpate.recording.writer.write",
            Mock(side_effect=OSError(errno.ENOSPC, "No space left on device")),
        )
        line = bench.waited("rows wait").line
        assert line.text.startswith("run.csv: cannot be written: No space left on device; ")
        assert measurement.running
    recorder: Any = measurement.recorder
    soon(lambda: not recorder.rows_trouble)
    measurement.close()
    assert (measurement.error, measurement.failed) == ("", False)
    report = palpate.check(tmp_path / "run.csv")
    assert (report.clean, report.survey.lost) == (True, 0)


@contextmanager
def opened(
    path: Path, how: dict[str, Any] | None = None, said: list[str] | None = None, **asked: Any
) -> Iterator[tuple[RecordedMeasurement, FileWorkbench]]:
    """Open a file and wait until it is read."""
    found = RecordedMeasurement(
        str(path), asked, how or {}, (said if said is not None else []).append
    )
    bench = FileWorkbench(found, str(path))
    found.start()
    soon(lambda: not found.running)
    yield found, bench
    found.close()


def test_the_touches_of_a_recording_are_those_of_a_replay(tmp_path: Path) -> None:
    recording = palpate.read(OWN_FILE)
    table = tmp_path / "table.csv"
    columns = zip(recording.t_hard_s, recording.hard, recording.soft, strict=True)
    table.write_text(
        "\n".join(
            ["time (s),a (pF),b (pF)", *(f"{t},{hard},{soft}" for t, hard, soft in columns), ""]
        )
    )
    columns_of: dict[str, Any] = {"columns": {"hard": "a (pF)", "soft": "b (pF)"}}
    for path, asked in [(OWN_FILE, {}), (table, columns_of)]:
        with opened(path, **asked) as (found, _):
            replayed = palpate.touches(recorded(path, **asked))
            assert len(replayed) == 4
            assert found.touches == replayed
            view = found.levels.view(-1, 1e9, 4096)
            assert view["t_s"] == pytest.approx(recording.t_hard_s, rel=1e-15)
    with opened(OWN_FILE, {"scene": "sliding", "samples": 100, "seconds": None}) as (found, _):
        assert found.tracker.scene == "sliding"
        assert found.touches == palpate.touches(
            recorded(OWN_FILE), scene="sliding", samples=100, seconds=None
        )


def test_a_part_of_a_recording_is_estimated_as_a_touch() -> None:
    with opened(OWN_FILE) as (_, bench):
        [touch] = palpate.touches(recorded(OWN_FILE), windows=[(3.0, 7.0)])
        told = f"A to B: ratio {Uncertainty.of(touch)}, {touch.samples} samples"
        assert done(bench, "cut", from_s=3.0, to_s=7.0).message == told
        told = done(bench, "cut", from_s=8.9, to_s=9.9).message
        assert told.startswith(
            "windows: got 8.9 to 9.9 s: nothing rises above the baseline before it, or the window"
        )


def test_what_a_page_is_told_of_a_recording(tmp_path: Path) -> None:
    """The session, marks, tares and gaps of its sidecar; what is left out there is left out here."""
    touches, times = palpate.touches(palpate.read(OWN_FILE)), palpate.read(OWN_FILE).t_hard_s
    plan = Plan("rehearsal", "A. B.", (Specimen("soft", 0.3, 2), Specimen("hard", 3.0, 2)),
                (Entry(touches[0].start_s, "soft"), Entry(touches[1].start_s, "soft", "slipped")))  # fmt: skip
    marks = [{"seq": 200, "t_s": 5.2, "text": "tare", "tare": True}, {"seq": 300, "t_s": 7.8, "text": "here"},
             {"seq": 1400, "t_s": 36.4, "text": "plugged in again", "tare": True, "gap": True}]  # fmt: skip
    path = copied(tmp_path / OWN_FILE.name)
    change(path, {"session": plan.as_dict(), "marks": marks})
    with opened(path) as (found, bench):
        hello = bench.hello()
        assert hello.file
        assert (hello.kind, hello.file.rows, hello.file.end) == (
            "file",
            1411,
            "complete, clean end",
        )
        rows = bench.table.document().rows
        assert [(row.specimen, row.kept, row.why) for row in rows[:3]] == [
            ("soft", True, ""), ("soft", False, "slipped"), (None, True, "")]  # fmt: skip
        assert bench.table.document().means == {"soft": found.touches[0].ratio}
        session = bench.plan.document
        assert (session.title, session.specimens[0].kept, session.next) == (
            "rehearsal",
            1,
            None,
        )
        assert session.count == TouchCount(3, 4)
        events = bench.annotations.document()
        assert [(mark.t_s, mark.text) for mark in events.marks][1] == (7.8, "here")
        assert events.tares == pytest.approx([times[200]], rel=1e-15)
        [gap] = events.gaps
        assert (gap.from_s, gap.to_s) == pytest.approx((times[1400], times[1401]), rel=1e-15)
        assert (gap.lost, gap.text) == (0, "plugged in again")
        assert found.touches == palpate.touches(recorded(path))
        for do in ("tare", "record", "again", "mark"):
            with pytest.raises(
                RefusedCommand, match=f"{do}: this is a recording, nothing is measured"
            ):
                done(bench, do)


def test_a_file_without_a_sidecar_is_not_changed(tmp_path: Path) -> None:
    path = copied(tmp_path / OWN_FILE.name)
    path.with_suffix(".json").unlink()
    said = f"{path.name}: cannot be changed: it has no sidecar with an end"
    with opened(path) as (_, bench), pytest.raises(RefusedCommand, match=said):
        done(bench, "name", touches=[1], text="gel")
    assert not path.with_suffix(".json").exists()


def test_a_damaged_recording_is_shown_as_far_as_it_can_be_read(tmp_path: Path) -> None:
    path = copied(tmp_path / OWN_FILE.name)
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([*lines[:700], b"\0" * 40 + b"\n", *lines[701:]]))
    said: list[str] = []
    with opened(path, said=said) as (found, bench):
        assert (found.file.rows, found.file.end) == (1410, "not complete")
        assert bench.state().line.title == "This recording is not complete."
        assert any("damaged: line 701" in line for line in said)
        assert len(found.levels.view(-1, 1e9, 4096)) == 1410
        assert found.touches
    path.write_text("nothing\n")
    with pytest.raises(palpate.errors.RecordingError):
        RecordedMeasurement(str(path), {}, {})


def test_a_recording_that_still_runs_or_is_very_long_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, said = tmp_path / "run.csv", list[str]()
    with palpate.Stream(f"{SOURCE}&speed=1", record=path) as stream:
        soon(lambda: stream.recorder and stream.recorder.rows > 20)
        with opened(path, said=said) as (found, _):
            assert found.file.end == "still being recorded"
    monkeypatch.setattr(multiresolution, "WHOLE", 500)
    with opened(OWN_FILE, said=said) as (found, _):
        assert not found.levels.has_all
        assert found.touches == palpate.touches(recorded(OWN_FILE))
    for words in ("still being recorded", "too long to show every sample"):
        assert any(words in line for line in said)


def test_a_view_over_a_web_socket() -> None:
    with (
        opened(OWN_FILE) as (_, bench),
        client(bench) as page,
        page.websocket_connect("/ws") as socket,
    ):
        socket.send_text('{"do": "view", "id": 77, "from_s": 5, "to_s": 30, "rows": 200}')
        frame = b""
        while not frame or HEADER.unpack_from(frame)[3] != FrameKind.VIEW:
            frame = socket.receive().get("bytes") or frame
    version, number, size, _ = HEADER.unpack_from(frame)
    assert (version, number) == (3, 77)
    times = np.frombuffer(frame, "<f8", size, HEADER.size)
    assert (100 <= size <= 200, times[0] <= 5, times[-1] >= 30) == (True, True, True)
