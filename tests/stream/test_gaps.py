"""Where the baseline before does not hold: the tracker measures it again, the recording says it, no touch after it is trusted."""

import dataclasses
import threading
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from command_lines import document, run
from palpate import Tracker, check
from palpate.ad7746.registers import CODES_PER_PF, capacitance_pF
from palpate.ad7746.simulator.evalboard import Fault, FaultKind
from palpate.recording.reading import recorded
from palpate.recording.recorder import Recorder
from palpate.recording.sidecar import load
from palpate.samples import RETAKEN, block_of, feed
from palpate.source_events import Gap
from palpate.sources.sim import Incident
from recording_bench import Scripted, four, measured, sample, with_gaps


def shifted(first: int, shift_pF: float = 0.002, seed: int = 1) -> list[Any]:
    """Return samples whose idle level changes at one of them."""
    samples = four(seed)
    for i, each in enumerate(samples):
        if each.seq >= first:
            hard, soft = (
                code + round(shift_pF * CODES_PER_PF) for code in (each.hard_raw, each.soft_raw)
            )
            values = {"hard": capacitance_pF(hard), "soft": capacitance_pF(soft)}
            samples[i] = each._replace(hard_raw=hard, soft_raw=soft, **values)
    return samples


def replug(shift_pF: float, at_s: float, seed: int = 1) -> Any:
    """Return a simulated board that is unplugged for a second, and has another idle level then."""
    source: Any = palpate.open(f"sim:four-specimens?seed={seed}")
    replugged = Fault(FaultKind.UNPLUG, 1.0)
    moved = Fault(FaultKind.OVERLOAD, shift_pF)  # by the first request after it
    source._incidents = [Incident(at_s, replugged), Incident(at_s, moved)]
    return source


@pytest.mark.parametrize("shift_pF", [0.002, 0.02, -0.02])
def test_an_idle_shift_across_a_replug_is_no_touch(shift_pF: float, tmp_path: Path) -> None:
    """Without the gap it was one: 250 samples, and the next press ran on in it."""
    path = tmp_path / "run.csv"
    messages = list[str]()
    stream = measured(replug(shift_pF, 9.3), record=path, notify=messages.append)
    assert [round(touch.start_s) for touch in stream.touches] == [2, 11, 20, 29]
    assert all("gap" not in touch.flags for touch in stream.touches)  # confirmed by the release
    assert any("the baseline is measured again: touch nothing" in message for message in messages)
    [mark] = (load(path) or {})["marks"]
    text = "the board was unplugged for 1.0 s"
    at_s = pytest.approx(9.3, abs=0.1)
    assert mark == {"seq": mark["seq"], "t_s": at_s, "tare": True, "gap": True, "text": text}
    recording = recorded(path)
    assert recording.gap_marks == [(mark["seq"], text)]
    for again in (recording, palpate.read(path)):
        assert palpate.touches(again) == stream.touches
    repeated = measured(str(path))
    assert repeated.touches == stream.touches


def test_a_loop_of_ones_own_that_takes_each_item_as_samples_fails_at_the_first_event() -> None:
    """Over a gap it would give a touch of 2.15 without a flag."""
    stream = measured(replug(0.02, 9.3))
    wrong = Tracker(**stream.tracker.settings)

    def feed_all() -> None:
        with replug(0.02, 9.3) as source:
            for item in source:
                feed(wrong, item)

    with pytest.raises(TypeError, match="not subscriptable"):
        feed_all()
    assert wrong.touches == []


def test_a_loop_of_ones_own_that_passes_the_gaps_gives_the_touches_of_a_stream() -> None:
    stream = measured(replug(0.02, 9.3))
    right = Tracker(**stream.tracker.settings)
    source = replug(0.02, 9.3)
    with source:
        for item in source:
            if isinstance(item, Gap):
                right.gap()
            elif isinstance(item, np.ndarray):
                feed(right, item)
    right.finish()
    assert right.touches == stream.touches


@pytest.mark.parametrize("scene", ["handheld", "sliding", "paper", "fixed"])
@pytest.mark.parametrize("at", [300, 301, 555])
def test_the_gap_is_exactly_before_its_sample(scene: Any, at: int, tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    block = block_of(shifted(at))
    source = Scripted(with_gaps(shifted(at), {at: "moved"}))
    source.live = True  # so that it comes in large batches
    stream = measured(source, record=path, scene=scene)
    tracker = Tracker(scene, **stream.tracker.settings)
    for name in ("hard", "soft"):
        block[name][block["status"] != 0] = np.nan
    for part in np.split(block, [np.searchsorted(block["seq"], at)]):
        tracker.process(
            *(
                np.ascontiguousarray(part[name])
                for name in ("t_hard_ns", "t_soft_ns", "hard", "soft")
            )
        )
        if part["seq"][0] < at:
            tracker.gap()
    tracker.finish()
    live, fed = (
        [(t.start, t.samples, t.ratio.hex(), t.flags) for t in x.touches] for x in (stream, tracker)
    )
    assert live == fed
    assert palpate.touches(recorded(path), scene=scene) == stream.touches


def test_a_mark_is_in_the_sidecar_before_the_rows_after_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from palpate.recording.writer import Writer

    path = tmp_path / "run.csv"
    seen = list[tuple[int, int]]()
    append = Writer.write

    def noticed(self: Writer, block: Any) -> bool:
        marks = (load(path) or {}).get("marks", [])
        seen.extend((int(seq), len(marks)) for seq in block["seq"])
        return append(self, block)

    monkeypatch.setattr(Writer, "write", noticed)
    recorder = Recorder(path, {}, {}, [])
    for i in range(100):
        if i % 10 == 5:
            recorder.gap(f"gap {i}")
        recorder.push(sample(i))
        threading.Event().wait(0.002)
    recorder.close()
    assert all(marks >= (seq + 5) // 10 for seq, marks in seen)
    assert [mark["seq"] for mark in (load(path) or {})["marks"]] == list(range(4, 100, 10))


def test_replay_check_and_convert_tell_the_gaps(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    script = with_gaps(shifted(500), {500: "the board was unplugged for 1.0 s"})
    stream = measured(Scripted(script), record=path)
    told = (
        "gap after sample 499: the board was unplugged for 1.0 s: the baseline was measured again"
    )
    assert told in check(path).findings
    assert told in document("replay", path)["notes"]
    assert told in run("convert", path, "-o", tmp_path / "copy.csv").stderr
    assert recorded(tmp_path / "copy.csv").gap_marks == recorded(path).gap_marks
    assert palpate.touches(recorded(tmp_path / "copy.csv")) == stream.touches


def test_a_baseline_that_was_wrong_after_a_gap_is_told(tmp_path: Path) -> None:
    """Unplugged while it is pressed: the baseline is wrong, measured in contact, until the release."""
    messages: list[str] = []
    stream = measured(replug(0.0, 4.0), record=tmp_path / "run.csv", notify=messages.append)
    assert RETAKEN in messages
    found = [(round(touch.start_s), "gap" in touch.flags) for touch in stream.touches]
    assert found == [(2, True), (11, False), (20, False), (29, False)]
    assert palpate.touches(recorded(tmp_path / "run.csv")) == stream.touches


def test_afterwards_no_baseline_is_taken_from_the_other_side_of_a_gap(tmp_path: Path) -> None:
    """A shift of 0.4 fF is too small to be seen as a jump. With the gap it changes nothing."""
    found = {}
    for shift_pF in (0.0, 0.0004):
        path = tmp_path / f"{shift_pF}.csv"
        measured(Scripted(with_gaps(shifted(395, shift_pF), {395: "moved"})), record=path)
        marked = palpate.read(path)
        for name, rows in (("gap", marked.gap_rows), ("none", ())):
            known = palpate.offline(dataclasses.replace(marked, gap_rows=rows))
            found[name, shift_pF] = [touch.ratio for touch in known]
        assert found["gap", shift_pF] == [touch.ratio for touch in palpate.offline(recorded(path))]
    assert found["gap", 0.0] == pytest.approx(found["gap", 0.0004], rel=1e-9)
    assert found["none", 0.0] != pytest.approx(found["none", 0.0004], rel=1e-5)


def test_a_long_pause_without_a_mark_is_told(tmp_path: Path) -> None:
    """And only that: the results of an earlier recording stay what they were."""
    given = [each for each in four() if not 400 <= each.seq < 480]
    told = "no sample for 2.1 s after sample 399, and no mark says why"
    texts: dict[int, str]
    for texts, notes in (({}, 1), ({480: "moved"}, 0)):
        path = tmp_path / f"{len(texts)}.csv"
        stream = measured(Scripted(with_gaps(given, texts)), record=path)
        assert sum(told in finding for finding in check(path).findings) == notes
        recording = recorded(path)
        assert palpate.touches(recording) == stream.touches
        assert sum(told in note for note in recording.notes) == notes
    table = recorded(
        tmp_path / "1.csv", columns={"hard": "hard_pF", "soft": "soft_pF", "time": "t_hard_s"}
    )
    palpate.touches(table)
    assert "no sample for 2.1 s" in table.notes[-1]
