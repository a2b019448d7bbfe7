"""A recording that is started later begins with what was kept: its replay has the touches of the measurement."""

import threading
import time
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from palpate import Sample, Stream, check
from palpate.recording.reading import recorded
from palpate.recording.sidecar import BEGUN
from palpate.simulation import scenarios
from palpate.stream.buffers import BEGIN, MAY_DIFFER, WITHIN
from recording_bench import Scripted, document, sample, with_gaps

PERIOD_NS = 26_000_000
KEEP = 65536


def touched(times: int = 1) -> list[Sample]:
    """Return samples of four touches, so many times."""
    runs = [scenarios.run("four-specimens", seed + 1) for seed in range(times)]
    pairs = [
        pair for run in runs for pair in zip(run.hard.tolist(), run.soft.tolist(), strict=True)
    ]
    return [
        Sample(i, i * PERIOD_NS, i * PERIOD_NS + PERIOD_NS // 2, -1, -1, *pair)
        for i, pair in enumerate(pairs)
    ]


class Paced(Scripted):
    """A live source whose samples come when the test lets them go."""

    def __init__(self, samples: list[Sample], **described: Any) -> None:
        super().__init__(samples, live=True, period_s=0.026, **described)
        self.go = threading.Semaphore(0)

    def samples(self) -> Iterator[Any]:
        """Yield the samples that may go."""
        for item in super().samples():
            if isinstance(item, Sample):
                self.go.acquire()
            yield item


def begun(
    source: Paced, path: Path, at: Collection[int], tares: Collection[int] = (), **how: Any
) -> Stream:
    """Measure to the end; record from each of these samples on, in path-1.csv, ...; tare at the other ones."""
    with Stream(source, **how) as stream:
        source.go.release()
        for count, _ in enumerate(stream):
            source.go.release()
            if count in at:
                stream.stop_recording()
                number = sorted(at).index(count) + 1
                stream.start_recording(path.with_name(f"{path.stem}-{number}.csv"), earlier=True)
            if count in tares:
                stream.tare(force=True)
    return stream


def plain(touches: list[palpate.Touch]) -> list[dict[str, Any]]:
    """Return touches but for the number of their first reading, which counts from the begin."""
    return [{**touch.as_dict(), "start": None} for touch in touches]


@pytest.mark.parametrize("at", [1, 150, 1000, 1385])
def test_with_all_that_was_measured_a_replay_is_the_measurement(at: int, tmp_path: Path) -> None:
    """Without contact, in contact, between touches; a gap and a tare before it are in it."""
    source = Paced(with_gaps(touched(), {800: "unplugged"}))
    stream = begun(source, tmp_path / "run.csv", {at}, {300}, keep=KEEP)
    path = tmp_path / "run-1.csv"
    assert [mark["text"] for mark in document(path)["marks"]] == ["tare", "unplugged"]
    assert palpate.touches(recorded(path)) == stream.touches
    found = check(path)
    counters = document(path)["end"]["counters"]
    assert (found.clean, found.faults) == (True, ())
    assert (
        counters["read"]
        == counters["recorded"]
        == counters["delivered"]
        == found.survey.rows
        == len(touched())
    )
    assert not [note for note in document(path)["notes"] if note.startswith(BEGUN)]


@pytest.mark.parametrize("stamps", ["converter", "host"])
def test_with_a_part_it_begins_with_a_tare_mark_and_says_where_a_replay_may_differ(
    stamps: str, tmp_path: Path
) -> None:
    stream = begun(Paced(touched(2), stamps=stamps), tmp_path / "run.csv", {2200}, keep=1024)
    path = tmp_path / "run-1.csv"
    first = int(next(recorded(path).blocks())["seq"][0])
    assert first in (2201 - 1024, 2202 - 1024)
    notes = [f"{BEGUN}{first} pairs: {MAY_DIFFER}{WITHIN if stamps == 'host' else ''}"]
    assert (
        document(path)["notes"]
        == notes
        == [note for note in palpate.read(path).notes if note in notes]
    )
    assert document(path)["marks"] == [
        {"seq": first, "t_s": pytest.approx(first * 0.026), "text": BEGIN, "tare": True}
    ]
    replayed = palpate.touches(recorded(path))
    live = [touch for touch in stream.touches if touch.start_s > replayed[0].start_s + 1]
    if stamps == "converter":  # after the first release the baseline equals the measurement's again
        assert plain(replayed[1:]) == plain(live)
    for one, other in zip(live, replayed[1:], strict=True):
        assert abs(one.ratio - other.ratio) < 3 * np.hypot(one.standard_error, other.standard_error)
    counters = document(path)["end"]["counters"]
    assert (
        counters["read"] == counters["recorded"] == counters["delivered"] == len(palpate.read(path))
    )


def test_no_sample_is_missing_or_twice_while_the_source_runs(tmp_path: Path) -> None:
    source = Paced([sample(number) for number in range(20_000)])
    seen: list[int] = []
    with Stream(source, keep=2048, capacity=65536) as stream:
        source.go.release(2000)
        for number in range(10):
            recorder = stream.start_recording(tmp_path / f"run-{number}.csv", earlier=True)
            source.go.release(500)
            # So fewer samples come until the next recording begins than are kept.
            while recorder.rows < 100 or stream.counters.read < 2000 + 500 * number:
                time.sleep(0.001)
            stream.stop_recording()
        source.go.release(20_000)
        stream.stop()
    for path in (tmp_path / f"run-{number}.csv" for number in range(10)):
        seen += [seq for block in recorded(path).blocks() for seq in block["seq"].tolist()]
        assert check(path).faults == ()
    assert seen == list(range(seen[0], seen[0] + len(seen)))


def test_earlier_needs_samples_that_are_kept(tmp_path: Path) -> None:
    with (
        Stream(Scripted([*touched()])) as stream,
        pytest.raises(ValueError, match=r"with Stream.*keep=65536"),
    ):
        stream.start_recording(tmp_path / "run.csv", earlier=True)
    for keep in (0, 1023, 2**24 + 1):
        with pytest.raises(ValueError, match=f"keep: got {keep}, allowed: 1024 to 16777216"):
            Stream(Scripted([]), keep=keep)


def test_a_measurement_may_outlive_its_recording(tmp_path: Path) -> None:
    """The file is removed while it is written: the stream goes on, and the next recording has all that is kept."""
    path = tmp_path / "run.csv"
    source = Paced(touched())
    with Stream(source, keep=KEEP, outlives_recording=True) as stream:
        recorder = stream.start_recording(path, earlier=True)
        source.go.release(200)
        while not recorder.error:
            path.unlink(missing_ok=True)
        source.go.release(1)
        with pytest.raises(palpate.errors.RecordingError, match="was removed"):
            stream.stop_recording()
        stream.start_recording(tmp_path / "again.csv", earlier=True)
        source.go.release(10_000)
        list(stream)
    assert len(stream.touches) == 4
    assert plain(palpate.touches(recorded(tmp_path / "again.csv"))) == plain(stream.touches)
