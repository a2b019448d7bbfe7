"""Sources and consumers out of step: everything is counted, nothing waits for ever. Times are the samples', not ours."""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from palpate import Sample, SourceTimeout, Stream, check
from palpate.recording.recorder import CAPACITY
from palpate.stream.estimate import StreamCounters
from recording_bench import Scripted, sample
from tally import Tally

MINUTE = round(60 / 0.026)  # pairs


def settled(stream: Stream, path: Path, what: str, tally: Tally) -> StreamCounters:
    """See that every sample is accounted for, in the counters and in the file; note it."""
    counters = stream.counters
    assert counters.waiting == 0
    assert counters.read == counters.delivered + counters.dropped == counters.recorded + counters.unrecorded
    report = check(path)
    assert report.clean
    assert report.survey.rows == counters.recorded
    last = stream._begun().intake.last
    assert counters.read + counters.lost == (last.seq + 1 if last else 0)
    tally.fault(what, counters.read, counters.read - counters.recorded)
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("palpate")]
    return counters


@pytest.mark.parametrize("capacity", [2, 64, 1024])
@pytest.mark.parametrize("slower", [2, 10, MINUTE])
def test_a_consumer_slower_than_the_source_for_a_minute(
    tmp_path: Path, capacity: int, slower: int, tally: Tally
) -> None:
    """So many samples come for each one that is taken: the rest is counted as dropped, and is in the file."""
    path, permits = tmp_path / "run.csv", threading.Semaphore(slower)
    source = Scripted([sample(i) for i in range(MINUTE)], live=True, period_s=0.026)
    source.before = lambda _: permits.acquire()
    taken = 0
    with Stream(source, record=path, capacity=capacity) as stream:
        for _ in stream:
            taken += 1
            permits.release(slower)
    counters = settled(stream, path, f"consumer {slower} times slower, room for {capacity}", tally)
    assert (counters.read, counters.delivered, counters.unrecorded) == (MINUTE, taken, 0)


def test_a_source_that_can_wait_waits_for_a_slow_consumer(tmp_path: Path, tally: Tally) -> None:
    path = tmp_path / "run.csv"
    with Stream(Scripted([sample(i) for i in range(MINUTE)]), record=path, capacity=4) as stream:
        assert [estimate.sample.seq for estimate in stream] == list(range(MINUTE))
    assert settled(stream, path, "source that can wait", tally).dropped == 0


def test_a_source_faster_than_the_disk(tmp_path: Path, tally: Tally, monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that hangs while three times what may wait for it comes: what has no room is counted, and said."""
    from palpate.recording import row_file

    path, begin, hangs = tmp_path / "run.csv", threading.Event(), threading.Event()
    write = row_file.write
    source = Scripted([sample(i) for i in range(3 * CAPACITY)], live=True)
    source.before = lambda _: begin.wait()
    with Stream(source, record=path) as stream:
        monkeypatch.setattr(row_file, "write", lambda file, data: (hangs.wait(), write(file, data))[1])
        begin.set()
        for _ in stream:
            pass
        hangs.set()
    counters = stream.counters
    assert counters.unrecorded > 0
    assert counters.read == counters.recorded + counters.unrecorded == 3 * CAPACITY
    report = check(path)
    assert report.survey.rows == counters.recorded
    assert any(
        f"{counters.unrecorded} samples were read, but are not in the file" in finding for finding in report.findings
    )
    tally.fault("disk hangs", counters.recorded, counters.recorded - report.survey.rows)


@pytest.mark.parametrize("gap", [2, 100, 10**6])
def test_a_source_slower_than_it_should_be(tmp_path: Path, gap: int, tally: Tally) -> None:
    """Late samples, and those that never came, are counted; the consumer waits meanwhile."""
    path = tmp_path / "run.csv"
    source = Scripted([sample(i * gap) for i in range(200)], live=True, period_s=0.026)
    with Stream(source, record=path) as stream:
        assert len(list(stream)) == 200
    counters = settled(stream, path, "source slower, or with gaps", tally)
    assert (counters.lost, counters.late) == (199 * (gap - 1), 199)


@pytest.mark.parametrize("count", [0, 1, 63, 500])
@pytest.mark.parametrize("error", [None, OSError("gone"), SystemExit(3), MemoryError(), GeneratorExit()])
def test_a_source_that_stops_or_raises(tmp_path: Path, count: int, error: BaseException | None, tally: Tally) -> None:
    """Whatever it raises, an exit included, reaches the consumer after the last sample."""
    path, seen = tmp_path / "run.csv", 0

    class Ending(Scripted):
        def __iter__(self) -> Iterator[Sample]:
            yield from super().__iter__()
            if error is not None:
                raise error

    def consume(stream: Stream) -> None:
        nonlocal seen
        for _ in stream:
            seen += 1

    stream = Stream(Ending([sample(i) for i in range(count)], live=True), record=path)
    if error is None:
        with stream:
            consume(stream)
    else:
        with pytest.raises(type(error)) as caught, stream:
            consume(stream)
        assert caught.value is error
        assert any("the source ended with an error" in finding for finding in check(path).findings)
    assert seen == count
    settled(stream, path, "source stops or raises", tally)


@pytest.mark.parametrize("at", [0, 1, 50])
def test_a_source_that_returns_late(tmp_path: Path, at: int, tally: Tally) -> None:
    """It is left behind and said; what it gives afterwards goes nowhere, and hurts nothing."""
    path, hangs, release, done = tmp_path / "run.csv", threading.Event(), threading.Event(), threading.Event()

    class Late(Scripted):
        def __iter__(self) -> Iterator[Sample]:
            yield from super().__iter__()
            hangs.set()
            release.wait()
            yield from (sample(i) for i in range(at, at + 5))
            done.set()

        def close(self) -> None:
            super().close()

    source: Any = Late([sample(i) for i in range(at)], live=True)
    stream = Stream(source, record=path)
    stream.__enter__()
    assert hangs.wait(60)
    while stream.counters.recorded < at:
        threading.Event().wait(0.01)
    with pytest.raises(SourceTimeout, match="still runs"):
        stream.close()
    rows = check(path)
    assert rows.clean
    assert rows.survey.rows == at
    assert any("the source ended with an error: the source did not stop" in finding for finding in rows.findings)
    release.set()
    stream._begun().join(60)
    assert check(path) == rows
    tally.fault("source returns late", at, at - rows.survey.rows)


def test_stopped_from_anywhere_at_any_moment(tmp_path: Path, tally: Tally) -> None:
    """At the n-th sample, by the source's own thread, by the consumer's, or by a third one."""
    for number in range(30):
        path = tmp_path / f"{number}.csv"
        source = Scripted([sample(i) for i in range(2000)], live=bool(number % 2))
        stream = Stream(source, record=path, capacity=[2, 4096][number % 5 == 0])
        stops: list[Callable[[Sample], object]] = [
            lambda each, at=number * 3, stream=stream: stream.stop() if each.seq == at else None,  # type: ignore[misc]
            lambda each, at=number, stream=stream: (  # type: ignore[misc]
                threading.Thread(target=stream.stop).start() if each.seq == at else None
            ),
            lambda _: None,
        ]
        source.before = stops[number % 3]
        with stream:
            for each in stream:
                if number % 3 == 2 and each.sample.seq >= number:
                    stream.stop()
        settled(stream, path, "stopped at any moment", tally)
