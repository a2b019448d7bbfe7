"""The running measurement: what goes in comes out or is counted, and a recording of it is the same again."""

import threading
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from effort import Tally
from palpate import Status, Stream, Tracker, check
from palpate.errors import DeviceNotFound, RecordingError
from palpate.recording.recorder import CAPACITY, Recorder
from palpate.recording.sidecar import load
from palpate.samples import block_of
from palpate.stream import Batch, Listener, StreamCounters
from recording_bench import Liar, Scripted, four, measured, sample, with_gaps


def settled(stream: Stream, path: Path, what: str, tally: Tally) -> StreamCounters:
    """See that every sample is accounted for, in the counters and in the file; note it."""
    counters = stream.counters
    report = check(path)
    assert counters.waiting == 0
    assert (
        counters.read
        == counters.delivered + counters.dropped
        == counters.recorded + counters.unrecorded
    )
    assert (report.clean, report.survey.rows) == (not counters.unrecorded, counters.recorded)
    last = stream._reader.last
    assert counters.read + counters.lost == (last.seq + 1 if last else 0)
    tally.fault(what, counters.read, counters.read - counters.recorded)
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("palpate")]
    return counters


@pytest.mark.parametrize("gap", [2, 10**6])
def test_late_samples_and_those_that_never_came_are_counted(
    tmp_path: Path, gap: int, tally: Tally
) -> None:
    path = tmp_path / "run.csv"
    with Stream(
        Scripted([sample(i * gap) for i in range(200)], live=True, period_s=0.026), record=path
    ) as stream:
        assert len(list(stream)) == 200
    counters = settled(stream, path, "source slower, or with gaps", tally)
    assert (counters.lost, counters.late) == (199 * (gap - 1), 199)


@pytest.mark.parametrize("waiting", [0, 1, 3])
def test_counters_before_the_newest_samples_are_those_of_the_samples_before(waiting: int) -> None:
    """Of the newest three samples one is lost and one number is missing; some wait for the consumer."""
    newest = block_of([sample(5), sample(7, status=Status.LOST), sample(8)])
    now = StreamCounters(
        read=8, lost=1, delivered=8 - waiting, waiting=waiting, refused=int(waiting < 2)
    )
    before = now.without(newest)
    assert before == StreamCounters(read=5, delivered=5)
    later = now.since(before)
    assert (later["read"], later["delivered"], later["lost"]) == (3, 3 - waiting, 1)
    assert later["waiting"] == waiting
    assert now.without(block_of([sample(seq) for seq in range(8)])) == StreamCounters()


@pytest.mark.parametrize("live", [False, True])
def test_without_a_period_no_sample_is_late(live: bool) -> None:
    source = Scripted([sample(seq * 10**6) for seq in range(20)], live=live)
    assert measured(source).counters.late == 0


@pytest.mark.parametrize(("capacity", "slower"), [(2, 2), (64, 2308), (1024, 10)])
def test_a_consumer_that_is_too_slow_loses_estimates_but_no_rows(
    tmp_path: Path, capacity: int, slower: int, tally: Tally
) -> None:
    """So many samples come for each one that is taken: the rest is counted as dropped, and is in the file."""
    path = tmp_path / "run.csv"
    permits = threading.Semaphore(slower)
    source = Scripted([sample(i) for i in range(2308)], live=True, period_s=0.026)
    source.before = lambda _: permits.acquire()
    taken = 0
    with Stream(source, record=path, capacity=capacity) as stream:
        for _ in stream:
            taken += 1
            permits.release(slower)
    counters = settled(stream, path, f"consumer {slower} times slower, room for {capacity}", tally)
    assert (counters.read, counters.delivered, counters.unrecorded) == (2308, taken, 0)


def test_a_source_faster_than_the_disk(
    tmp_path: Path, tally: Tally, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A disk that hangs while three times what may wait for it comes: what has no room is counted, and said."""
    from palpate.recording import writer

    path = tmp_path / "run.csv"
    begin = threading.Event()
    hangs = threading.Event()
    write = writer.write
    source = Scripted([sample(i) for i in range(3 * CAPACITY)], live=True)
    source.before = lambda _: begin.wait()
    stream = Stream(source, record=path)
    stream.__enter__()
    monkeypatch.setattr(writer, "write", lambda file, data: (hangs.wait(), write(file, data))[1])
    begin.set()
    list(stream.batches())
    hangs.set()
    with pytest.raises(RecordingError, match="rows are missing: the disk is too slow"):
        stream.close()
    counters = settled(stream, path, "disk hangs", tally)
    assert counters.unrecorded > 0
    assert (
        f"{counters.unrecorded} samples were read, but are not in the file" in check(path).findings
    )


@pytest.mark.parametrize("count", [0, 500])
@pytest.mark.parametrize(
    "error", [None, DeviceNotFound("unplugged"), SystemExit(3), GeneratorExit()]
)
def test_what_the_source_raises_comes_after_its_last_sample(
    tmp_path: Path, count: int, error: BaseException | None, tally: Tally
) -> None:
    path = tmp_path / "run.csv"
    seen = list[Any]()
    caught = None
    script = [*(sample(i) for i in range(count)), *filter(None, [error])]
    stream = Stream(Liar(script, live=True), record=path)
    try:
        with stream:
            seen.extend(stream)
    except BaseException as raised:  # noqa: BLE001  whatever it is
        caught = raised
    assert (caught, len(seen)) == (error, count)
    told = any("the source ended with an error" in finding for finding in check(path).findings)
    assert told == (error is not None)
    settled(stream, path, "source stops or raises", tally)


def test_notes_and_marks(tmp_path: Path) -> None:
    with Stream(Scripted(four()), record=tmp_path / "run.csv", notes=["one"]) as stream:
        stream.note("two")
        list(stream)
        stream.mark("the end")
    document = load(tmp_path / "run.csv") or {}
    assert document["notes"] == ["one", "two"]
    assert document["marks"] == [{"seq": 1441, "t_s": 37.46776374, "text": "the end"}]
    with Stream(Scripted(four())) as silent:
        silent.note("nobody writes it")
        assert silent.mark("nor that") is None


@pytest.mark.parametrize("name", ["tare", "mark", "note"])
def test_a_recording_is_closed_after_what_is_being_written_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """From one thread, while another one closes the recording."""
    path = tmp_path / "run.csv"
    method = "mark_later" if name == "tare" else name
    with Stream("sim:four-specimens?seed=1&speed=10", record=path) as stream:
        closing = threading.Thread(target=stream.stop_recording)
        written = getattr(Recorder, method)

        def slow(recorder: Recorder, *given: Any, **more: Any) -> Any:
            closing.start()
            closing.join(0.3)
            return written(recorder, *given, **more)

        next(iter(stream))
        monkeypatch.setattr(Recorder, method, slow)
        stream.tare(force=True) if name == "tare" else getattr(stream, name)("x")
        closing.join()
    document = load(path) or {}
    assert document["notes"] == ["x"] if name == "note" else len(document["marks"]) == 1
    assert check(path).clean


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"smallest_shift": -1.0}, "smallest_shift: got -1"),
        ({"scene": "moon"}, "scene: got 'moon'"),
        ({"capacity": 1}, "capacity: got 1"),
        ({"record": "run.txt"}, "run.txt"),
        ({"tracker": Tracker(), "clip": 1.0}, "settings: got clip and a tracker"),
    ],
)
def test_a_stream_that_cannot_be_made_closes_its_source(
    wrong: dict[str, Any], message: str
) -> None:
    source = Scripted([])
    with pytest.raises((ValueError, RecordingError), match=message):
        Stream(source, **wrong)
    assert source.closed == 1
    with pytest.raises(TypeError, match=r"source: got 42, allowed: a name, or a palpate.Source"):
        Stream(42)  # type: ignore[arg-type]


def test_a_source_that_cannot_be_recorded_is_closed(tmp_path: Path) -> None:
    refused = Scripted([])
    (tmp_path / "run.csv").write_text("precious")
    with (
        pytest.raises(RecordingError, match="already exists"),
        Stream(refused, record=tmp_path / "run.csv"),
    ):
        pass
    assert refused.closed == 1


def test_it_begins_once(tmp_path: Path) -> None:
    source = Scripted([sample(0)])
    stream = Stream(source)
    with pytest.raises(ValueError, match="stream: not started"):
        next(iter(stream))
    stream.close()
    stream.close()
    assert source.closed == 1
    with pytest.raises(ValueError, match="stream: got a second `with`, or one after close"), stream:
        pass
    with (
        Stream(Scripted([sample(0)])) as once,
        pytest.raises(ValueError, match="stream: got a second"),
        once,
    ):
        pass


def test_one_recording_at_a_time(tmp_path: Path) -> None:
    with Stream(Scripted(four()), record=tmp_path / "run.csv") as stream:
        with pytest.raises(ValueError, match="record: already recording"):
            stream.start_recording(tmp_path / "run-2.csv")
        list(stream)
        assert stream.stop_recording()
        assert stream.stop_recording() is None
        stream.start_recording(tmp_path / "late.csv")
    assert check(tmp_path / "run.csv").clean
    [note] = (load(tmp_path / "late.csv") or {})["notes"]
    assert "a replay has no baseline from them" in note


def log_of(stream: Stream) -> list[tuple[Any, ...]]:
    """Return the list of all events of a stream, with what came with them."""
    events = list[tuple[Any, ...]]()
    listener = Listener()
    for name in ("begun", "gap", "batch", "touch", "message", "ended"):
        setattr(listener, name, partial(lambda *event: events.append(event), name))
    stream.listen(listener)
    return events


def test_a_listener_gets_each_event_in_its_order(tmp_path: Path) -> None:
    stream = Stream(Scripted(with_gaps(four(), {500: "moved"})), record=tmp_path / "run.csv")
    events = log_of(stream)
    with stream:
        samples = sum(len(batch.samples) for batch in stream.batches())
    kinds = [event[0] for event in events]
    assert (events[0], events[-1]) == (("begun", stream), ("ended", None))
    assert sum(len(event[1].samples) for event in events if event[0] == "batch") == samples
    gap = kinds.index("gap")
    assert (kinds[gap : gap + 2], events[gap][1].text) == (["gap", "message"], "moved")
    after = events[kinds.index("batch", gap)][1]
    assert after.samples["seq"][0] == 500
    touches = [(event[1], event[2].revised) for event in events if event[0] == "touch"]
    assert touches == [
        (1, False),
        (1, True),
        (2, False),
        (3, False),
        (3, True),
        (4, False),
        (4, True),
    ]
    assert kinds.index("touch") > kinds.index("batch")


class Failing(Listener):
    """Takes no event."""

    def batch(self, batch: Batch) -> None:
        raise BrokenPipeError(32, "Broken pipe")

    touch = message = ended = conditions = gap = batch  # type: ignore[assignment]


def test_a_listener_that_fails_ends_nothing_and_is_said_once() -> None:
    """Neither the measurement, nor what the other listeners get."""
    said = list[str]()
    stream = Stream(Scripted(with_gaps(four(), {500: "moved"})), notify=said.append)
    stream.listen(Failing())
    events = log_of(stream)
    with stream:
        samples = sum(len(batch.samples) for batch in stream.batches())
    assert (samples, len(stream.touches)) == (len(four()), 4)
    assert events[-1] == ("ended", None)
    [failed] = [text for text in said if "failed" in text]
    assert (
        failed == "Failing failed: BrokenPipeError: [Errno 32] Broken pipe; the measurement goes on"
    )


def test_a_user_interface_that_cannot_show_messages_ends_nothing() -> None:
    def notify(text: str) -> None:
        raise ValueError("I/O operation on closed file")

    with Stream(Scripted(with_gaps(four(), {500: "moved"})), notify=notify) as stream:
        list(stream)
    assert len(stream.touches) == 4


def test_the_end_names_the_error_that_ended_it() -> None:
    error = ZeroDivisionError("mine")
    stream = Stream(Scripted([*four()[:50], error]))
    events = log_of(stream)
    stream.source.notify("hello: you")
    with stream, pytest.raises(ZeroDivisionError):
        list(stream.batches())
    assert (events[0], events[-1]) == (("message", "hello: you"), ("ended", error))
