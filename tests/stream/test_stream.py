"""The running measurement: what goes in comes out or is counted, and a recording of it is the same again."""

import asyncio
import threading
import time
from pathlib import Path
from typing import Any, Self

import numpy as np
import palpate
import pytest
from palpate import (
    DeviceNotFound,
    ProtocolError,
    RecordingError,
    Sample,
    SourceTimeout,
    Status,
    Stream,
    Tracker,
    check,
)
from palpate.recording.foreign import recorded
from palpate.samples import block_of
from palpate.stream.estimate import Estimate
from recording_bench import Scripted, sample
from streaming import four


def test_counters(tmp_path: Path) -> None:
    given = four()
    source = Scripted(given, period_s=0.026)
    with Stream(source, record=tmp_path / "run.csv") as stream:
        estimates = list(stream)
    counters = stream.counters
    assert [estimate.sample for estimate in estimates] == given
    assert counters.read == counters.delivered == counters.recorded == len(given)
    assert counters.read + counters.lost == estimates[-1].sample.seq + 1
    assert counters.lost == counters.late == sum(i % 97 == 5 for i in range(1411))
    assert (counters.refused, counters.saturated) == (
        sum(e.sample.status == Status.EXCITATION for e in estimates),
        sum(e.sample.status == Status.HARD_SATURATED for e in estimates),
    )
    assert (counters.dropped, counters.waiting, counters.unrecorded) == (0, 0, 0)
    assert source.closed == 1


def test_a_consumer_that_is_too_slow_loses_estimates_but_no_rows(tmp_path: Path) -> None:
    source = Scripted([sample(i) for i in range(5000)], live=True)
    all_read = threading.Event()
    source.before = lambda each: all_read.set() if each.seq == 4999 else None
    with Stream(source, record=tmp_path / "run.csv", capacity=64) as stream:
        for number, _ in enumerate(stream):
            if number == 0:
                all_read.wait()
    counters = stream.counters
    assert counters.read == counters.recorded == 5000
    assert counters.dropped > 0
    assert counters.read == counters.delivered + counters.dropped
    assert check(tmp_path / "run.csv").findings == ()


def test_a_source_that_can_wait_loses_nothing_in_the_smallest_ring() -> None:
    with Stream(Scripted([sample(i) for i in range(3000)]), capacity=2) as stream:
        assert [estimate.sample.seq for estimate in stream] == list(range(3000))
    assert stream.counters.dropped == 0


def test_a_batch_is_its_estimates() -> None:
    revised: list[int] = []
    with Stream(Scripted(four())) as stream:
        for batch in stream.batches():
            rows = list(batch.estimates())
            assert np.array_equal([row.ratio for row in rows], batch.rows["ratio"])
            assert block_of(row.sample for row in rows).tobytes() == batch.samples.tobytes()
            assert [row.ended for row in rows if row.ended] == list(batch.touches)[: len(rows)]
            assert [row.revised for row in rows if row.revised] == [touch for _, touch in batch.revised]
            revised += [number for number, _ in batch.revised]
    assert len(stream.touches) == 4
    assert revised == [1, 2, 3, 4]


@pytest.mark.parametrize("error", [DeviceNotFound("unplugged"), ProtocolError("nonsense"), ZeroDivisionError("bug")])
def test_what_the_source_raises_comes_after_its_last_sample(tmp_path: Path, error: Exception) -> None:
    path = tmp_path / "run.csv"
    seen: list[Estimate] = []
    source = Scripted([*(sample(i) for i in range(500)), error])
    with pytest.raises(type(error)) as caught, Stream(source, record=path) as stream:
        seen.extend(stream)
    assert caught.value is error
    assert len(seen) == 500
    assert stream.counters.delivered == stream.counters.recorded == 500
    assert check(path).findings == (f"the source ended with an error: {error}",)
    assert source.closed == 1


def test_who_does_not_iterate_is_not_told_but_the_recording_is(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    with Stream(Scripted([sample(0), DeviceNotFound("unplugged")]), record=path) as stream:
        assert stream._begun().join(60)  # until it has failed
    assert check(path).findings == ("the source ended with an error: unplugged",)


def test_stopping_from_another_thread_ends_the_iteration() -> None:
    with Stream("sim:sliding?speed=1") as stream:
        threading.Timer(0.3, stream.stop).start()
        seqs = [estimate.sample.seq for estimate in stream]
    assert seqs == list(range(len(seqs)))
    assert stream.counters.read == len(seqs) < 700


@pytest.mark.parametrize("source", ["sim:sliding?speed=1", "sim:sliding?speed=1&capf=7", "sim:all"])
def test_it_stops_within_half_a_second(source: str) -> None:
    """Twenty times that here, where the machine is shared; the wait for the thread itself is limited to it."""
    with Stream(source) as stream:
        next(iter(stream))
        begun = time.monotonic()
    assert time.monotonic() - begun < 10
    assert not [t for t in threading.enumerate() if t.name.startswith("palpate")]


def test_a_source_that_does_not_stop_is_left_behind(tmp_path: Path) -> None:
    source = Scripted([sample(i) for i in range(3)], live=True)
    hangs, release = threading.Event(), threading.Event()

    def before(each: Sample) -> None:
        if each.seq == 2:
            hangs.set()
            release.wait()

    source.before = before
    with (
        pytest.raises(SourceTimeout, match=r"did not stop within 0.5 s"),
        Stream(source, record=tmp_path / "run.csv") as stream,
    ):
        assert all((next(iter(stream)), hangs.wait(60)))
    assert check(tmp_path / "run.csv").survey.rows == 2
    assert check(tmp_path / "run.csv").clean
    release.set()
    assert source.closed == 0


def test_notes_and_marks(tmp_path: Path) -> None:
    with Stream(Scripted(four()), record=tmp_path / "run.csv", notes=["one"]) as stream:
        stream.note("two")
        list(stream)
        stream.mark("the end")
    document = recorded(tmp_path / "run.csv").document
    assert document
    assert document["notes"] == ["one", "two"]
    assert document["marks"] == [{"seq": 1441, "t_s": 37.46776374, "text": "the end"}]
    with Stream(Scripted(four())) as silent:
        silent.note("nobody writes it")
        silent.mark("nor that")


def test_arguments(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="settings: got drift and a tracker"):
        Stream("sim:", Tracker(), drift=1.0)
    with pytest.raises(ValueError, match="scene: got 'moon'"):
        Stream("sim:", scene="moon")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="capacity: got 1"):
        Stream("sim:", capacity=1)
    with pytest.raises(TypeError, match=r"source: got 42, allowed: a name, or a palpate.Source"):
        Stream(42)  # type: ignore[arg-type]
    stream = Stream("sim:")
    assert stream.counters.read == 0
    with pytest.raises(ValueError, match="stream: not started"):
        next(iter(stream))
    stream.close()
    (tmp_path / "run.csv").write_text("precious")
    source = Scripted([])
    with pytest.raises(RecordingError, match="already exists"), Stream(source, record=tmp_path / "run.csv"):
        pass
    assert source.closed == 1


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"drift": -1.0}, "drift: got -1"),
        ({"scene": "moon"}, "scene: got 'moon'"),
        ({"capacity": 1}, "capacity: got 1"),
        ({"record": "run.txt"}, "run.txt"),
        ({"tracker": Tracker(), "drift": 1.0}, "settings: got drift and a tracker"),
    ],
)
def test_a_stream_that_cannot_be_made_closes_its_source(wrong: dict[str, Any], message: str) -> None:
    source = Scripted([])
    with pytest.raises((ValueError, RecordingError), match=message):
        Stream(source, **wrong)
    assert source.closed == 1


def test_a_source_that_cannot_describe_itself_or_begin_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    class Mute(Scripted):
        def describe(self) -> dict[str, Any]:
            raise ProtocolError("mute")

    class Stuck(Scripted):
        def __enter__(self) -> Self:
            raise ProtocolError("stuck")

    mute, stuck = Mute([]), Stuck([])
    with pytest.raises(ProtocolError, match="mute"):
        Stream(mute)
    assert mute.closed == 1
    with monkeypatch.context() as patch:
        patch.setattr("palpate.stream.stream.open_source", lambda _: mute)
        with pytest.raises(ProtocolError, match="mute"):
            Stream("mute:")
    assert mute.closed == 2
    with pytest.raises(ProtocolError, match="stuck"), Stream(stuck):
        pass
    assert stuck.closed == 1


def test_closed_before_it_began_a_stream_closes_its_source_and_does_not_begin() -> None:
    source = Scripted([sample(0)])
    stream = Stream(source)
    stream.close()
    stream.close()
    assert source.closed == 1
    with pytest.raises(ValueError, match="stream: got a second `with`, or one after close"), stream:
        pass
    with Stream(Scripted([sample(0)])) as once, pytest.raises(ValueError, match="stream: got a second"), once:
        pass


def test_one_recording_at_a_time(tmp_path: Path) -> None:
    with Stream(Scripted(four()), record=tmp_path / "run.csv") as stream:
        with pytest.raises(ValueError, match="record: already recording"):
            stream.start_recording(tmp_path / "run-2.csv")
        list(stream)
        assert stream.stop_recording()
        assert stream.stop_recording() is None
    assert [p.name for p in sorted(tmp_path.iterdir())] == ["run.csv", "run.json"]
    assert palpate.check(tmp_path / "run.csv").clean


def test_ones_own_tracker() -> None:
    tracker = Tracker("paper", full_scale=4.0)
    with Stream(Scripted(four()), tracker) as stream:
        list(stream)
    assert stream.tracker is tracker
    assert len(tracker.touches) == 4


def test_asynchronous_use() -> None:
    async def measure() -> int:
        ticks = 0

        async def tick() -> None:
            nonlocal ticks
            while True:
                await asyncio.sleep(0)
                ticks += 1

        with Stream("sim:stiff-steady") as stream:
            beside = asyncio.create_task(tick())
            batches = stream.batches()
            while await asyncio.to_thread(next, batches, None):
                pass
            beside.cancel()
        assert ticks > 0
        return len(stream.touches)

    assert asyncio.run(measure()) == 1


def test_a_recording_that_began_later_says_so(tmp_path: Path) -> None:
    with palpate.Stream("sim:four-specimens?seed=3") as stream:
        for k, _ in enumerate(stream):
            if k == 50:
                stream.start_recording(tmp_path / "late.csv")
            if k == 60:
                break
    [note] = recorded(tmp_path / "late.csv").notes
    assert "a replay has no baseline from them" in note
