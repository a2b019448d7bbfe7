"""Where the baseline before does not hold: the tracker measures it again, the recording says it, no touch after it is trusted."""

import dataclasses
import json
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from click.testing import CliRunner
from palpate import ProtocolError, Sample, Stream, Tracker, check
from palpate.ad7746.datasheet import CODES_PER_PF, capacitance_pF
from palpate.ad7746.twin.kit import Fault
from palpate.cli import main
from palpate.recording.foreign import recorded
from palpate.recording.recorder import Recorder
from palpate.recording.sidecar import load
from palpate.samples import RETAKEN
from palpate.sources.base import Gap
from palpate.sources.sim import Incident, SimSource
from recording_bench import Scripted, sample
from streaming import four


class Gapped(Scripted):
    """A script with gaps."""

    def __init__(self, script: list[Any], gaps: Any, **described: Any) -> None:
        super().__init__(script, **described)
        self._gaps = gaps

    @property
    def gaps(self) -> Any:
        return self._gaps


def shifted(first: int, shift_pF: float = 0.002, seed: int = 1) -> list[Any]:
    """Return samples whose idle level changes at one of them."""
    codes = round(shift_pF * CODES_PER_PF)
    return [
        each._replace(**{f"{name}_raw": getattr(each, f"{name}_raw") + codes for name in ("hard", "soft")})._replace(
            hard=capacitance_pF(each.hard_raw + codes), soft=capacitance_pF(each.soft_raw + codes)
        )
        if isinstance(each, Sample) and each.seq >= first
        else each
        for each in four(seed)
    ]


def plain(touches: list[palpate.Touch]) -> list[dict[str, Any]]:
    return [touch.as_dict() for touch in touches]


def replug(shift_pF: float, at_s: float, seed: int = 1) -> SimSource:
    """Return a simulated board that is unplugged for a second, and has another idle level then."""
    source = palpate.open(f"sim:four-specimens?seed={seed}")
    assert isinstance(source, SimSource)
    plugged = source.kit.plugged

    def moved() -> None:
        plugged()
        source.kit.chip.overload_pF = shift_pF

    source.kit.plugged = moved  # type: ignore[method-assign]
    source._incidents = [Incident(at_s, Fault("unplug", 1.0))]
    return source


@pytest.mark.parametrize("shift_pF", [0.002, 0.02, -0.02])
def test_an_idle_shift_across_a_replug_is_no_touch(shift_pF: float, tmp_path: Path) -> None:
    """Without the gap it was one: 250 samples, and the next press ran on in it."""
    path, messages = tmp_path / "run.csv", list[str]()
    with Stream(replug(shift_pF, 9.3), record=path, notify=messages.append) as stream:
        list(stream.batches())
    assert [round(touch.start_s) for touch in stream.touches] == [2, 11, 20, 29]
    assert all("gap" not in touch.flags for touch in stream.touches)  # confirmed by the release
    assert any("the baseline is measured again: touch nothing" in message for message in messages)
    [mark] = (load(path) or {})["marks"]
    assert mark == {"seq": mark["seq"], "t_s": pytest.approx(9.3, abs=0.1), "tare": True, "gap": True} | {
        "text": "the board was unplugged for 1.0 s"
    }
    recording = recorded(path)
    assert recording.gap_marks == [(mark["seq"], mark["text"])]
    for again in (recording, palpate.read(path)):
        assert plain(palpate.touches(again)) == plain(stream.touches)
    with Stream(str(path)) as repeated:
        list(repeated.batches())
    assert plain(repeated.touches) == plain(stream.touches)


@pytest.mark.parametrize("scene", ["handheld", "sliding", "paper", "fixed"])
@pytest.mark.parametrize("at", [300, 301, 555])
def test_the_gap_is_exactly_before_its_sample(scene: Any, at: int, tmp_path: Path) -> None:
    path, rows = tmp_path / "run.csv", shifted(at)
    given = [each for each in rows if isinstance(each, Sample)]
    source = Gapped(rows, [Gap(at, "moved")])
    source.live = True  # so that it comes in large batches
    with Stream(source, record=path, scene=scene) as stream:
        list(stream.batches())
    tracker = Tracker(scene, **stream.tracker.settings)
    for begin, end in ((0, at), (at, 10**6)):
        part = [each for each in given if begin <= each.seq < end]
        columns = np.array([(s.t_hard_ns, s.t_soft_ns) for s in part]), np.array([(s.hard, s.soft) for s in part])
        bad = np.array([bool(s.status) for s in part])
        columns[1][bad] = np.nan
        tracker.process(*columns[0].T, *columns[1].T)
        if not begin:
            tracker.gap()
    tracker.finish()
    assert [(t.start, t.samples, t.ratio.hex(), t.flags) for t in stream.touches] == [
        (t.start, t.samples, t.ratio.hex(), t.flags) for t in tracker.touches
    ]
    assert plain(palpate.touches(recorded(path), scene=scene)) == plain(stream.touches)


def press(ends: int, height: float = 0.25, begin: int = 60, size: int = 700) -> tuple[np.ndarray, ...]:
    """Return times and readings of a press from row `begin` to row `ends`."""
    rows = np.arange(size)
    depth = height * np.clip(np.minimum(rows - begin, ends - rows) / 10, 0, 1)
    noise = np.random.default_rng(5).normal(0, 4e-5, (2, size))
    return rows * 0.026, rows * 0.026 + 0.013, 9 + 2.5 * depth + noise[0], 8 + depth + noise[1]


def run(tracker: Tracker, columns: tuple[np.ndarray, ...], begin: int, end: int | None = None) -> None:
    tracker.process(*(column[begin:end] for column in columns))


def test_a_touch_that_runs_at_a_gap_ends_there_with_the_flag() -> None:
    tracker, columns = Tracker(), press(400)
    run(tracker, columns, 0, 200)
    tracker.gap()
    [touch] = tracker.touches
    assert touch.flags[0] == "short"
    assert touch.flags[-1] == "gap"
    assert abs(touch.ratio - 2.5) < 0.01
    assert "lift the probe, and touch again" in palpate.advice(touch)[-1]
    assert tracker.state == "baseline"


def test_a_baseline_of_a_contact_is_flagged_until_the_release_shows_it() -> None:
    """Held at the gap, then pressed deeper: the touch is flagged; lifted: the baseline was that of the contact."""
    tracker = Tracker(seconds=2.0)
    hold, deeper = press(600, 0.2), press(400, 0.1, begin=250)
    columns = *hold[:2], hold[2] + deeper[2] - 9, hold[3] + deeper[3] - 8
    run(tracker, columns, 0, 200)
    tracker.gap()
    run(tracker, columns, 200, 390)
    assert [("gap" in touch.flags) for touch in tracker.touches] == [False, True]  # one before, one after
    tracker = Tracker(seconds=2.0)
    columns = *hold[:2], hold[2] + press(605, 0.1, begin=250)[2] - 9, hold[3] + press(605, 0.1, begin=250)[3] - 8
    run(tracker, columns, 0, 200)
    tracker.gap()
    run(tracker, columns, 200, 590)
    assert "gap" in tracker.touches[-1].flags
    run(tracker, columns, 590)
    assert tracker.touches[-1].revised
    assert tracker.touches[-1].flags[-1] == "baseline"


@pytest.mark.parametrize("scene", ["handheld", "sliding", "paper"])
def test_a_release_confirms_the_baseline_and_a_tare_does(scene: Any) -> None:
    columns = press(300)
    tracker = Tracker(scene)
    tracker.gap()
    run(tracker, columns, 0, 290 if scene != "sliding" else 302)
    tracker.finish()
    assert tracker.touches[-1].flags[-1] == "gap"
    tracker = Tracker(scene)
    tracker.gap()
    run(tracker, columns, 0)
    run(tracker, columns, 0)
    first, second = tracker.touches
    assert ("gap" in first.flags) == (scene == "paper")  # it has no revised result
    assert "gap" not in second.flags
    tracker = Tracker(scene)
    tracker.gap()
    tracker.tare()
    run(tracker, columns, 0, 290)
    tracker.finish()
    assert "gap" not in tracker.touches[-1].flags


def test_the_next_touch_before_a_new_baseline_is_measured_has_the_flag_too() -> None:
    """It uses the old baseline, which may be that of the contact."""
    tracker, (t_hard, t_soft, hard, soft) = Tracker(seconds=1.0), press(150, size=165)
    tracker.gap()
    again = press(180, begin=25, size=400)
    tracker.process(t_hard, t_soft, hard, soft)
    tracker.process(again[0] + t_hard[-1] + 0.026, again[1] + t_hard[-1] + 0.026, *again[2:])
    first = tracker.touches[0]
    assert "gap" in first.flags or first.revised
    assert len(tracker.touches) == 2


def test_a_gap_before_the_first_sample_is_none() -> None:
    with Stream(Gapped([sample(i) for i in range(5, 9)], [Gap(0, "opened late"), Gap(5, "too")])) as stream:
        list(stream)
    assert stream.counters.read == 4


@pytest.mark.parametrize("gaps", [None, [3], [("a", "b")], [Gap(2, None)], 7, [Gap(1, "a"), (2,)]])  # type: ignore[arg-type]
def test_gaps_that_are_none_end_the_stream(gaps: Any) -> None:
    with Stream(Gapped([sample(i) for i in range(9)], gaps)) as stream, pytest.raises(ProtocolError, match="its gaps"):
        list(stream)


def test_a_mark_is_in_the_sidecar_before_the_rows_after_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from palpate.recording.row_file import RowFile

    path, seen = tmp_path / "run.csv", list[tuple[int, int]]()
    append: Callable[..., None] = RowFile.append

    def noticed(self: RowFile, block: Any) -> None:
        marks = (load(path) or {}).get("marks", [])
        seen.extend((int(seq), len(marks)) for seq in block["seq"])
        append(self, block)

    monkeypatch.setattr(RowFile, "append", noticed)
    recorder = Recorder(path, {}, {}, [])
    for i in range(100):
        if i % 10 == 5:
            recorder.gap(f"gap {i}")
        recorder.push(sample(i))
        threading.Event().wait(0.002)
    recorder.close()
    assert all(marks >= (seq + 5) // 10 for seq, marks in seen)
    assert [mark["seq"] for mark in (load(path) or {})["marks"]] == list(range(4, 100, 10))


def test_without_room_for_a_mark_no_row_after_it_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from palpate.recording import sidecar_file

    monkeypatch.setitem(sidecar_file._MOST, "marks", 2)
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [])
    for i in range(3):
        recorder.push(sample(i))
        recorder.gap("again")
        while (load(path) or {})["marks"][i : i + 1] == [] and recorder.error is None:
            threading.Event().wait(0.01)
    recorder.push(sample(3))
    recorder.close()
    assert recorder.rows <= 3
    assert "marks: got 3, allowed: 2" in str(recorder.error)
    assert not check(path).clean


def test_replay_check_and_convert_tell_the_gaps(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    with Stream(Gapped(shifted(500), [Gap(500, "the board was unplugged for 1.0 s")]), record=path) as stream:
        list(stream.batches())
    told = "gap after sample 499: the board was unplugged for 1.0 s: the baseline was measured again"
    assert told in check(path).findings
    replayed = CliRunner().invoke(main, ["replay", str(path), "--json"])
    assert told in json.loads(replayed.stdout)["notes"]
    converted = CliRunner().invoke(main, ["convert", str(path), "-o", str(tmp_path / "copy.csv")])
    assert told in converted.stderr
    assert recorded(tmp_path / "copy.csv").gap_marks == recorded(path).gap_marks
    assert plain(palpate.touches(recorded(tmp_path / "copy.csv"))) == plain(stream.touches)


def jumped(jump_pF: float, at: int = 400) -> list[Any]:
    """Return idle samples of which the hard channel is saturated from one on."""
    idle = [each for each in four() if isinstance(each, Sample)][:60]
    period = 26_000_000
    rows = [idle[i % 60]._replace(seq=i, t_hard_ns=i * period, t_soft_ns=i * period + 13_000_000) for i in range(800)]
    return [row._replace(hard=row.hard + jump_pF) if row.seq >= at else row for row in rows]


def test_a_channel_that_leaves_the_range_without_a_touch_is_told_once() -> None:
    messages: list[str] = []
    with Stream(Scripted(jumped(6.0), full_scale_pF=4.0), notify=messages.append) as stream:
        outside = [stream.out_of_range for _ in stream.batches()]
    assert outside[0] == ()
    assert outside[-1] == ("hard",)
    assert [message[:50] for message in messages] == ["hard: outside the range of the converter for 2 s, "]
    with Stream(Scripted(jumped(6.0, at=750), full_scale_pF=4.0), notify=messages.append) as stream:
        list(stream.batches())
    assert (stream.out_of_range, len(messages)) == ((), 1)  # 1.3 s


def test_a_deep_press_is_not_out_of_range() -> None:
    messages: list[str] = []
    with Stream("sim:four-specimens?seed=1", notify=messages.append, full_scale=0.9) as stream:
        list(stream.batches())
    assert any("saturated" in touch.flags for touch in stream.touches)
    assert not any("outside the range" in message for message in messages)


def test_the_range_is_set_again_on_request(tmp_path: Path) -> None:
    """`record --recentre` does it by itself; without, the signal is outside to the end, and that is told."""
    path = tmp_path / "run.csv"
    fault = "sim:four-specimens?seed=1&fault=overload:5@9.5"
    result = CliRunner().invoke(main, ["record", fault, "-o", str(path), "--recentre"])
    assert result.exit_code == 0
    assert "outside the range of the converter for 2 s" in result.stderr
    [(_, text)] = recorded(path).gap_marks
    assert text.startswith("the range was set again: CAPDAC (7")
    assert text.endswith(", before (41, 27)")
    found = palpate.touches(recorded(path))
    assert [round(touch.start_s) for touch in found][-2:] == [20, 29]
    left = CliRunner().invoke(main, ["record", fault, "-o", str(tmp_path / "left.csv")])
    assert "record --recentre" in left.stderr
    assert len(palpate.touches(recorded(tmp_path / "left.csv"))) == 1


def test_centring_is_refused_in_contact_and_where_there_is_no_range() -> None:
    with Stream(Scripted(four())) as stream:
        for estimate in stream:
            if estimate.touch:
                break
        with pytest.raises(RuntimeError, match="in contact, allowed: without contact"):
            stream.centre()
        with pytest.raises(RuntimeError, match="a source that cannot set its range"):
            stream.centre(force=True)


def test_a_baseline_that_was_wrong_after_a_gap_is_told(tmp_path: Path) -> None:
    """Unplugged while it is pressed: the baseline is that of the contact until the release."""
    messages: list[str] = []
    with Stream(replug(0.0, 4.0), record=tmp_path / "run.csv", notify=messages.append) as stream:
        list(stream.batches())
    assert RETAKEN in messages
    assert [(round(touch.start_s), "gap" in touch.flags) for touch in stream.touches] == [
        (2, True),
        (11, False),
        (20, False),
        (29, False),
    ]
    assert plain(palpate.touches(recorded(tmp_path / "run.csv"))) == plain(stream.touches)


def test_afterwards_no_baseline_is_taken_from_the_other_side_of_a_gap(tmp_path: Path) -> None:
    """A shift of 0.4 fF is too small to be seen as a jump. With the gap it changes nothing."""
    found = {}
    for shift_pF in (0.0, 0.0004):
        path = tmp_path / f"{shift_pF}.csv"
        with Stream(Gapped(shifted(395, shift_pF), [Gap(395, "moved")]), record=path) as stream:
            list(stream.batches())
        marked = palpate.read(path)
        for name, rows in (("gap", marked.gap_rows), ("none", ())):
            known = palpate.offline(dataclasses.replace(marked, gap_rows=rows))
            found[name, shift_pF] = [touch.ratio for touch in known]
        assert found["gap", shift_pF] == [touch.ratio for touch in palpate.offline(recorded(path))]
    assert found["gap", 0.0] == pytest.approx(found["gap", 0.0004], rel=1e-9)
    assert found["none", 0.0] != pytest.approx(found["none", 0.0004], rel=1e-5)


def test_a_long_pause_without_a_mark_is_told(tmp_path: Path) -> None:
    """And only that: the results of an earlier recording stay what they were."""
    given = [each for each in four() if isinstance(each, Sample) and not 400 <= each.seq < 480]
    told = "no sample for 2.1 s after sample 399, and no mark says why"
    for gaps, notes in (([], 1), ([Gap(480, "moved")], 0)):
        path = tmp_path / f"{len(gaps)}.csv"
        with Stream(Gapped(list(given), gaps), record=path) as stream:
            list(stream.batches())
        assert sum(told in finding for finding in check(path).findings) == notes
        recording = recorded(path)
        assert plain(palpate.touches(recording)) == plain(stream.touches)
        assert sum(told in note for note in recording.notes) == notes
    table = recorded(tmp_path / "1.csv", columns={"hard": "hard_pF", "soft": "soft_pF", "time": "t_hard_s"})
    palpate.touches(table)
    assert "no sample for 2.1 s" in table.notes[-1]
