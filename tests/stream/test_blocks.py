"""Sources that give blocks: any split, into blocks, single samples, or batches of the consumer, gives the same."""

import random
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from effort import NIGHTLY, draws, random_of
from hostile import bad, good
from palpate import ProtocolError, Sample, SampleRing, Status, Stream, check
from palpate.recording.foreign import recorded
from palpate.recording.sidecar import load
from palpate.samples import Block, block_of, samples_of
from palpate.sources.base import Gap
from palpate.sources.blocks import blocks_of
from palpate.sources.files import UNREAD
from palpate.stream import StreamCounters
from palpate.stream import stream as stream_module
from palpate.stream.waiting import Waiting
from palpate.testing import check_source
from recording_bench import Blocks, Scripted, record, sample
from streaming import four
from tally import Tally

Mark = dict[str, Any]


class Singles(Scripted):
    """The same as single samples."""

    def __init__(self, script: list[Any], *, gaps: list[Gap], **described: Any) -> None:
        super().__init__(script, **described)
        self.all_gaps = gaps

    @property
    def gaps(self) -> list[Gap]:
        return self.all_gaps


def session(dice: random.Random) -> tuple[Block, list[Gap]]:
    """Return presses with lost and saturated samples, stretches outside the range, lost numbers; and gaps."""
    samples = [each for each in four(dice.randrange(5)) if isinstance(each, Sample)]
    begin = dice.randrange(1200)
    outside = range(begin, begin + dice.choice([0, 60, 90, 500]))
    lost = {dice.randrange(1400) for _ in range(dice.choice([0, 20]))}
    for k, each in enumerate(samples):
        if k in lost:
            samples[k] = each._replace(hard=float("nan"), hard_raw=-1, status=Status.LOST)
        elif k in outside:
            samples[k] = each._replace(hard=5.0, hard_raw=-1)
    kept = samples[: dice.randrange(2, len(samples))]
    places = sorted(dice.sample(range(1400), dice.choice([0, 1, 3])))
    return block_of(kept), [Gap(seq, f"moved at {seq}") for seq in places]


def split(block: Block, dice: random.Random) -> list[Block]:
    """Return the samples in random parts."""
    cuts = sorted(dice.choices(range(1, len(block)), k=dice.choice([0, 1, 5, 100])))
    return [part for part in np.split(block, cuts) if len(part)]


def result(source: Scripted, path: Path, messages: list[str], **how: Any) -> tuple[Any, ...]:
    """Return all that a measurement leaves: rows, touches, counters, messages, file, and marks."""
    with Stream(source, record=path, notify=messages.append, **how) as stream:
        batches = list(stream.batches())
    rows = np.concatenate([batch.rows for batch in batches])
    ended = [(batch.first + k, touch.as_dict()) for batch in batches for k, touch in enumerate(batch.touches)]
    ended += [(number, touch.as_dict()) for batch in batches for number, touch in batch.revised]
    marks: list[Mark] = (load(path) or {}).get("marks", [])
    touches = [touch.as_dict() for touch in stream.touches]
    return (
        rows.tobytes(),
        touches,
        ended,
        stream.counters,
        sorted(messages),
        stream.out_of_range,
        path.read_bytes(),
        marks,
    )


@pytest.mark.parametrize("live", [False, True])
def test_any_split_gives_the_same(live: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tally: Tally) -> None:
    dice, said = random_of(f"splits {live}"), 0
    for number in range(draws(10, 200, at_least=3)):
        block, gaps = session(dice)
        described: dict[str, Any] = {"period_s": 0.026, "full_scale_pF": 4.0, "live": live, "gaps": gaps}
        monkeypatch.setattr(stream_module, "_BATCH", 1)
        expected = result(Singles(samples_of(block), **described), tmp_path / f"{number}.csv", [])
        monkeypatch.setattr(stream_module, "_BATCH", dice.choice([7, 1024]))
        found = result(Blocks(split(block, dice), **described), tmp_path / f"{number}-blocks.csv", [])
        assert found == expected, f"schedule {number}"
        replayed = palpate.touches(recorded(tmp_path / f"{number}-blocks.csv"))
        assert [touch.as_dict() for touch in replayed] == expected[1]
        said += len(expected[4])
        tally.count("splits of a measurement into blocks")
    assert said > 0


@pytest.mark.parametrize("capacity", [2, 64, 4096])
def test_a_source_of_blocks_that_can_wait_loses_nothing(capacity: int, tmp_path: Path) -> None:
    block = block_of(sample(i) for i in range(20_000))
    with Stream(Blocks(np.split(block, [9000])), record=tmp_path / "run.csv", capacity=capacity) as stream:
        seen = np.concatenate([batch.samples for batch in stream.batches()])
    assert seen.tolist() == block.tolist()
    assert stream.counters.recorded == stream.counters.delivered == 20_000
    assert check(tmp_path / "run.csv").clean


def test_what_has_no_room_is_dropped_and_counted(tmp_path: Path) -> None:
    block = block_of(sample(i) for i in range(1000))
    with Stream(Blocks([block[:1], block[1:]], live=True), record=tmp_path / "run.csv", capacity=64) as stream:
        batches = stream.batches()
        assert len(next(batches).samples) >= 1
        stream._begun().join(30)
        list(batches)
    counters = stream.counters
    assert counters.read == counters.recorded == counters.delivered + counters.dropped == 1000
    assert counters.dropped >= 1000 - 2 * 64 - 1


REFUSED = (
    "seq below 0",
    "code below -1",
    "code above that of the converter",
    "value that is not that of its code",
    "code without a value",
    "status 99",
)
"""Of what no recording can store, what an array can have."""


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_kept_is_refused_as_a_single_sample_is(name: str, tmp_path: Path) -> None:
    wrong = np.zeros(1, SampleRing(2).dtype)
    wrong[0] = tuple(bad(sample(3))[name])
    messages = []
    for source in (
        Blocks([np.concatenate([block_of(good(2)), wrong, block_of(good(2, 4))])]),
        Scripted([*good(2), samples_of(wrong)[0], *good(2, 4)]),
    ):
        path = tmp_path / f"{type(source).__name__}.csv"
        with pytest.raises(ProtocolError) as caught, Stream(source, record=path) as stream:
            list(stream)
        messages.append(str(caught.value))
        assert (stream.counters.read, stream.counters.recorded) == (2, 2)
        assert check(path).findings == (f"the source ended with an error: {caught.value}",)
    assert messages[0] == messages[1]


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (None, "NoneType"),
        ([sample(0)], "list"),
        (np.zeros(3), "dtype float64"),
        (np.zeros((2, 1), SampleRing(2).dtype), r"shape \(2, 1\)"),
    ],
)
def test_what_is_no_block_ends_the_stream(given: Any, told: str) -> None:
    with (
        Stream(Blocks([block_of(good(2)), given])) as stream,
        pytest.raises(ProtocolError, match=f"read_block.*{told}"),
    ):
        list(stream)
    assert stream.counters.delivered == 2


def test_an_error_comes_after_the_samples_before_it() -> None:
    seen = list[Any]()
    with Stream(Blocks([block_of(good(500)), OSError("gone")])) as stream, pytest.raises(OSError, match="gone"):
        seen.extend(stream)
    assert len(seen) == 500


def test_strided_blocks_and_those_that_the_source_uses_again() -> None:
    block = block_of(good(20))

    class Again(Blocks):
        def read_block(self) -> Any:
            block["seq"] += 100
            return block[::2] if block["seq"][0] < 1000 else block[:0]

    with Stream(Again([])) as stream:
        seqs = [estimate.sample.seq for estimate in stream]
    assert seqs == [100 * k + 2 * i for k in range(1, 10) for i in range(10)]


def test_a_class_that_overrides_the_iteration_is_read_by_it() -> None:
    class Doubled(Blocks):
        def __iter__(self) -> Iterator[Sample]:
            return iter([sample(7)])

    assert blocks_of(Doubled([])) is None
    with Stream(Doubled([block_of(good(3))])) as stream:
        assert [estimate.sample.seq for estimate in stream] == [7]


def test_the_conformance_test_reads_blocks() -> None:
    assert check_source(Blocks([block_of(good(30))]), samples=20) == good(20)
    with pytest.raises(AssertionError, match="read_block"):
        check_source(Blocks([None]))


def test_a_file_tells_that_it_was_not_read_to_its_end(tmp_path: Path) -> None:
    path = record(tmp_path / "run.csv", [sample(i) for i in range(30_000)])
    messages: list[str] = []
    with Stream(str(path), notify=messages.append) as stream:
        next(stream.batches())
    assert messages == [f"{path}: {UNREAD}"]
    assert stream.counters.read == stream.counters.delivered < 30_000
    with Stream(str(path), notify=messages.append) as stream:
        list(stream.batches())
    assert len(messages) == 1
    assert stream.counters.read == 30_000


def test_a_file_with_a_pace_gives_what_is_due(tmp_path: Path) -> None:
    path = record(tmp_path / "run.csv", [sample(i) for i in range(400)])
    begun = time.monotonic()
    with Stream(f"{path}?speed=50") as stream:
        assert [estimate.sample.seq for estimate in stream] == list(range(400))
    assert time.monotonic() - begun >= 399 * 0.026 / 50


def test_a_mark_on_a_file_is_at_the_sample_that_the_caller_has(tmp_path: Path) -> None:
    path = record(tmp_path / "run.csv", [sample(i) for i in range(5000)])
    with Stream(str(path), record=tmp_path / "again.csv") as stream:
        for estimate in stream:
            if estimate.sample.seq == 1234:
                stream.mark("here")
    [mark] = (load(tmp_path / "again.csv") or {})["marks"]
    assert (mark["seq"], mark["text"]) == (1234, "here")


@pytest.mark.parametrize("capacity", [2, 16])
def test_no_wake_up_is_missed(capacity: int) -> None:
    """Two threads hand over each sample: a missed wake-up would hang until the limit of the wait, 60 s."""
    waiting, count = Waiting(capacity), 20_000 if NIGHTLY else 2000
    taken: list[int] = []

    def take() -> None:
        while True:
            closed = waiting.ring.closed
            block = waiting.take(3)
            taken.extend(block["seq"].tolist())
            if not len(block) and closed:
                return
            if not len(block):
                waiting.wait_for_samples(60)

    consumer = threading.Thread(target=take)
    consumer.start()
    begun = time.monotonic()
    for number in range(count):
        while waiting.room <= 0:
            waiting.wait_for_room()
        waiting.push(sample(number))
    waiting.close()
    consumer.join(60)
    assert taken == list(range(count))
    assert time.monotonic() - begun < 50


def test_stopping_a_source_that_waits_for_room_ends_at_once() -> None:
    with Stream(Blocks([block_of(good(5000))]), capacity=16) as stream:
        until = time.monotonic() + 30
        while stream.counters.read < 16 and time.monotonic() < until:
            time.sleep(0.001)
        stream.stop()
        assert stream._begun().join(30)
        assert stream.counters == StreamCounters(read=16, waiting=16)
    assert stream.counters == StreamCounters(read=16, delivered=16)


class InTime(Blocks):
    """Blocks of 10 ms, in real time."""

    def __init__(self, rate: int, seconds: float) -> None:
        super().__init__([], live=True, period_s=1 / rate)
        self.size, self.count, self.number = rate // 100, round(100 * seconds), 0
        self.made = block_of(sample(i) for i in range(self.size))
        self.period_ns = 10**9 // rate
        self.stopped = threading.Event()

    def read_block(self) -> Any:
        if not self.number:
            self.begun = time.monotonic()
        due = self.begun + 0.01 * (self.number + 1)
        if self.number == self.count or self.stopped.wait(max(due - time.monotonic(), 0)):
            return self.made[:0]
        block = self.made.copy()
        block["seq"] += self.number * self.size
        for name in ("hard", "soft"):
            block[f"t_{name}_ns"] = block["seq"] * self.period_ns
        self.number += 1
        return block

    def interrupt(self) -> None:
        self.stopped.set()


def test_a_fast_live_source_loses_nothing(tmp_path: Path, tally: Tally) -> None:
    """60 s at 100,000 pairs a second in the nightly run; by default what a machine that is busy carries."""
    rate, seconds = (100_000, 60.0) if NIGHTLY else (20_000, 3.0)
    capacity = None if NIGHTLY else round(rate * seconds)  # the consumer may stand still for all of the time
    with Stream(InTime(rate, seconds), record=tmp_path / "run.csv", capacity=capacity) as stream:
        delivered = sum(len(batch.samples) for batch in stream.batches())
    counters = stream.counters
    assert counters.read == counters.recorded == delivered == round(rate * seconds)
    assert (counters.dropped, counters.unrecorded, counters.lost) == (0, 0, 0)
    report = check(tmp_path / "run.csv")
    assert report.clean
    tally.fault(f"live, {rate} pairs a second in blocks", counters.read, counters.dropped + counters.unrecorded)
