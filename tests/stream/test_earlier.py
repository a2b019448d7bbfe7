"""A recording that is started later begins with what was kept: its replay has the touches of the measurement, bit for bit."""

import threading
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import palpate
import pytest
from effort import draws, random_of
from palpate import Sample, Status, Stream, check
from palpate.recording.foreign import recorded
from palpate.recording.sidecar import BEGUN, load
from palpate.samples import Block, block_of
from palpate.simulation import scenarios
from palpate.sources.base import Gap
from palpate.stream.beginning import NEAR, NO_BASELINE, SAME
from recording_bench import Scripted, sample
from tally import Tally

PERIOD_NS = 26_000_000
KEEP = 65536
SCENES: list[Any] = ["handheld", "sliding", "paper", "fixed"]


def touched(times: int, *, seed: int = 1, period_ns: int = PERIOD_NS, idle: int = 0) -> list[Sample]:
    """Return samples of four touches, so many times, after some without contact."""
    runs = [scenarios.run("four-specimens", seed + number) for number in range(times)]
    samples: list[Sample] = []
    for run in runs:
        hard, soft = run.hard, run.soft
        if not samples and idle:  # of the idle readings at its begin, in another order
            order = np.random.default_rng(seed).integers(0, 60, idle)
            hard, soft = np.concatenate([hard[order], hard]), np.concatenate([soft[order], soft])
        for h, s in zip(hard.tolist(), soft.tolist(), strict=True):
            at = len(samples) * period_ns
            samples.append(Sample(len(samples), at, at + period_ns // 2, -1, -1, h, s))
    return samples


class Gapped(Scripted):
    """A source with gaps, which gives blocks if it has a size for them."""

    def __init__(self, samples: list[Sample], gaps: list[Gap], size: int = 0, **described: Any) -> None:
        super().__init__([*samples], period_s=PERIOD_NS / 1e9, **described)
        self._gaps, self._size, self._at = gaps, size, 0
        if size:
            self._block = block_of(samples)
            self.read_block = self._next

    @property
    def gaps(self) -> list[Gap]:
        return self._gaps

    def _next(self) -> Block:
        begin, self._at = self._at, self._at + self._size
        return self._block[begin : self._at]


class Paced(Scripted):
    """A live source whose samples come when the test lets them go."""

    def __init__(self, samples: list[Sample], gaps: list[Gap] | None = None, **described: Any) -> None:
        super().__init__([*samples], live=True, period_s=0.026, **described)
        self.go = threading.Semaphore(0)
        self._gaps = gaps or []

    @property
    def gaps(self) -> list[Gap]:
        return self._gaps

    def __iter__(self) -> Iterator[Sample]:
        """Return the samples that may go."""
        for each in super().__iter__():
            self.go.acquire()
            yield each


def plain(touches: list[palpate.Touch], since_s: float = -1.0) -> list[dict[str, Any]]:
    """Return touches from a time on, but for the number of their first reading, which counts from the begin."""
    return [{**touch.as_dict(), "start": None} for touch in touches if touch.start_s >= since_s]


def begun(stream: Stream, path: Path, at: set[int], tares: set[int] = frozenset()) -> None:  # type: ignore[assignment]
    """Measure to the end; record from each of these samples on, in path-1.csv, ...; tare at others."""
    number = 0
    source = stream.source
    gate = source.go if isinstance(source, Paced) else threading.Semaphore()
    gate.release()
    for count, _ in enumerate(stream):
        gate.release()
        if count in at:
            number += 1
            stream.stop_recording()
            stream.start_recording(path.with_name(f"{path.stem}-{number}.csv"), earlier=True)
        if count in tares:
            stream.tare(force=True)


def notes_of(path: Path) -> list[str]:
    return [note for note in (load(path) or {})["notes"] if note.startswith(BEGUN)]


def require_same(path: Path, stream: Stream, **settings: Any) -> None:
    """Require that a replay has the touches of the stream since the recording began."""
    recording = recorded(path)
    replayed = palpate.touches(recording, scene=stream.tracker.scene, **settings)
    first_s = palpate.read(path).t_hard_s[0]
    assert plain(replayed) == plain(stream.touches, first_s)


@pytest.mark.parametrize("at", [1, 40, 150, 400, 1000, 1385])
def test_with_all_that_was_measured_a_replay_is_the_measurement(at: int, tmp_path: Path) -> None:
    """Without contact, in contact, between touches: also the numbers of the readings are the same."""
    with Stream(Scripted([*touched(1)], period_s=0.026), keep=KEEP) as stream:
        begun(stream, tmp_path / "run.csv", {at})
    path = tmp_path / "run-1.csv"
    assert notes_of(path) == []
    assert len(stream.touches) == 4
    replayed = palpate.touches(recorded(path))
    assert [t.as_dict() for t in replayed] == [t.as_dict() for t in stream.touches]
    found = check(path)
    assert (found.clean, found.faults, found.survey.rows) == (True, (), len(touched(1)))
    end = (load(path) or {})["end"]
    assert end["counters"]["read"] == end["counters"]["recorded"] == end["counters"]["delivered"] == found.survey.rows


def test_the_kept_rows_begin_after_the_release_that_is_in_them(tmp_path: Path) -> None:
    samples = touched(2)
    with Stream(Paced(samples), keep=1024) as stream:
        begun(stream, tmp_path / "run.csv", {2200})
    path = tmp_path / "run-1.csv"
    [note] = notes_of(path)
    recording = palpate.read(path)
    assert note == f"{BEGUN}{len(samples) - len(recording)} pairs, after a release: {SAME}"
    assert 2200 - 1024 < len(samples) - len(recording) < 2200 - 32
    assert len([touch for touch in stream.touches if touch.start_s > recording.t_hard_s[0]]) == 4
    require_same(path, stream)
    counters = (load(path) or {})["end"]["counters"]
    assert counters["read"] == counters["recorded"] == counters["delivered"] == len(recording)


def test_a_gap_that_is_kept_is_marked(tmp_path: Path) -> None:
    """From the gap on: the flag "gap" is in the replay, too."""
    source = Paced(touched(1), [Gap(800, "unplugged")])
    with Stream(source, keep=1024) as stream:
        begun(stream, tmp_path / "run.csv", {1100})
    path = tmp_path / "run-1.csv"
    assert (load(path) or {})["marks"] == [{"seq": 799, "t_s": 20.774, "text": "unplugged", "tare": True, "gap": True}]
    require_same(path, stream)
    with Stream(str(path)) as again:
        flags = [estimate.ended.flags for estimate in again if estimate.ended and estimate.ended.start_s > 20.8]
    assert "gap" in flags[0]  # until its release has shown that the baseline was measured without contact


@pytest.mark.parametrize("tare", [300, 700, 1000])
def test_a_tare_that_is_kept_is_a_tare_of_the_replay(tare: int, tmp_path: Path) -> None:
    with Stream(Paced(touched(1)), keep=KEEP) as stream:
        begun(stream, tmp_path / "run.csv", {1200}, {tare})
    path = tmp_path / "run-1.csv"
    [mark] = (load(path) or {})["marks"]
    assert (mark["seq"], mark["text"], mark["tare"]) == (tare, "tare", True)
    assert [t.as_dict() for t in palpate.touches(recorded(path))] == [t.as_dict() for t in stream.touches]


def test_after_a_tare_alone_it_begins_behind_it(tmp_path: Path) -> None:
    samples = touched(1, idle=1200)[:1900]
    with Stream(Paced(samples), keep=1024) as stream:
        begun(stream, tmp_path / "run.csv", {1600}, {1100})
    path = tmp_path / "run-1.csv"
    assert notes_of(path) == [f"{BEGUN}1101 pairs, after a tare: {SAME}"]
    assert (load(path) or {})["marks"] == []
    assert len(stream.touches) == 2
    require_same(path, stream)


def test_without_a_place_it_begins_without_contact_and_says_so(tmp_path: Path) -> None:
    """The first touch runs when it is started, and its baseline is older than what is kept."""
    samples = touched(1, idle=3000)
    with Stream(Paced(samples), keep=1024) as stream:
        begun(stream, tmp_path / "run.csv", {3250})
    path = tmp_path / "run-1.csv"
    [note] = notes_of(path)
    assert note.endswith(f" pairs, without contact: {NEAR}")
    live, replayed = stream.touches, palpate.touches(recorded(path))
    assert len(live) == len(replayed) == 4
    for one, other in zip(live, replayed, strict=True):
        assert abs(one.ratio - other.ratio) < 3 * np.hypot(one.standard_error, other.standard_error)


def test_times_of_the_computer_are_smoothed_from_the_begin_on(tmp_path: Path) -> None:
    """So only a recording that begins with the measurement has the same bits."""
    with Stream(Paced(touched(2), stamps="host"), keep=1400) as stream:
        begun(stream, tmp_path / "run.csv", {1000, 2400})
    assert notes_of(tmp_path / "run-1.csv") == []
    [note] = notes_of(tmp_path / "run-2.csv")
    assert note.endswith(f" pairs, after a release: {NEAR}")
    replayed = palpate.touches(recorded(tmp_path / "run-2.csv"))
    live = [touch for touch in stream.touches if touch.start_s > palpate.read(tmp_path / "run-2.csv").t_hard_s[0]]
    assert len(live) == len(replayed) == 2
    for one, other in zip(live, replayed, strict=True):
        assert abs(one.ratio - other.ratio) < 3 * np.hypot(one.standard_error, other.standard_error)


def test_in_contact_for_longer_than_is_kept_it_begins_with_the_next_sample(tmp_path: Path) -> None:
    samples = touched(1)[:300]
    held = [samples[250]._replace(seq=300 + n, t_hard_ns=(300 + n) * PERIOD_NS, t_soft_ns=(300 + n) * PERIOD_NS + 1)
            for n in range(2000)]  # fmt: skip
    with Stream(Paced([*samples, *held]), keep=1024) as stream:
        begun(stream, tmp_path / "run.csv", {2000})
    [note] = notes_of(tmp_path / "run-1.csv")
    assert note.endswith(NO_BASELINE)


def test_the_next_recording_leaves_out_no_sample(tmp_path: Path) -> None:
    """It begins at the last place before the end of the first one: a touch that was cut there is whole in it."""
    with Stream(Paced(touched(2)), keep=KEEP) as stream:
        begun(stream, tmp_path / "run.csv", {500, 1280})
    first, second = palpate.read(tmp_path / "run-1.csv"), palpate.read(tmp_path / "run-2.csv")
    running = [t for t in stream.touches if t.start_s < first.t_hard_s[-1] < t.start_s + 6.5]
    assert running
    assert second.t_hard_s[0] < running[0].start_s
    assert second.t_hard_s[0] > first.t_hard_s[-1] - 15
    require_same(tmp_path / "run-2.csv", stream)


@pytest.mark.parametrize("size", [1, 7, 400, 3000])
def test_blocks_at_10_kHz(size: int, tmp_path: Path) -> None:
    """The same touches in a 260th of the time: the length of a touch is in samples."""
    samples = touched(3, period_ns=100_000)
    how: dict[str, Any] = {"samples": 250, "seconds": None}
    with Stream(Gapped(samples, [], size), keep=4096, **how) as stream:
        for count, _ in enumerate(stream.batches()):
            if count == 1:
                stream.start_recording(tmp_path / "run-1.csv", earlier=True)
    assert len(palpate.read(tmp_path / "run-1.csv")) >= 3072
    require_same(tmp_path / "run-1.csv", stream, **how)


def test_no_sample_is_missing_or_twice_while_the_source_runs(tmp_path: Path) -> None:
    samples = [sample(number) for number in range(20_000)]
    source = Paced(samples)
    with Stream(source, keep=2048, capacity=65536) as stream:
        source.go.release(3000)
        for number in range(20):
            recorder = stream.start_recording(tmp_path / f"run-{number}.csv", earlier=True)
            source.go.release(500)
            while recorder.rows < 100:
                pass
            stream.stop_recording()
        source.go.release(20_000)
        stream.stop()
    for number in range(20):
        seqs = np.concatenate([block["seq"] for block in recorded(tmp_path / f"run-{number}.csv").blocks()])
        assert (np.diff(seqs) == 1).all()
        assert check(tmp_path / f"run-{number}.csv").faults == ()


def test_earlier_needs_samples_that_are_kept(tmp_path: Path) -> None:
    with Stream(Scripted([*touched(1)])) as stream, pytest.raises(ValueError, match=r"with Stream.*keep=65536"):
        stream.start_recording(tmp_path / "run.csv", earlier=True)
    for keep in (0, 1023, 2**24 + 1):
        with pytest.raises(ValueError, match=f"keep: got {keep}, allowed: 1024 to 16777216"):
            Stream(Scripted([]), keep=keep)


def disturbed(samples: list[Sample], random: Random) -> list[Sample]:
    """Return samples of which some are lost before they are read, and some have no value or are saturated."""
    flags = [Status.LOST, Status.EXCITATION, Status.HARD_SATURATED, Status.SOFT_SATURATED]
    share = random.choice([0.0, 0.002, 0.01])
    kept = (each for each in samples if random.random() >= share)
    return [each._replace(status=random.choice(flags)) if random.random() < share else each for each in kept]


@pytest.mark.parametrize("worker", range(4))
def test_random_measurements(worker: int, tmp_path: Path, tally: Tally) -> None:
    """Random scene, faults, gaps, tares and begins: a note that promises the same bits keeps it."""
    for number in range(worker, draws(40, 4000), 4):
        random = random_of(f"earlier {number}")
        scene = random.choice(["handheld", "handheld", *SCENES])
        samples = disturbed(touched(random.choice([1, 2, 3]), seed=number), random)
        gaps = [
            Gap(samples[at].seq, "unplugged")
            for at in sorted(random.sample(range(len(samples)), random.choice([0, 0, 1, 3])))
        ]
        tares = set(random.sample(range(len(samples)), random.choice([0, 0, 1, 3])))
        begins = set(random.sample(range(len(samples)), random.choice([1, 2])))
        source = Gapped(samples, gaps, random.choice([0, 0, 1, 50, 1000]))
        path = tmp_path / f"{number}.csv"
        with Stream(source, scene=scene, keep=random.choice([1024, 1400, 2000, KEEP])) as stream:
            begun(stream, path, begins, tares)
        for place in range(1, len(begins) + 1):
            one = tmp_path / f"{number}-{place}.csv"
            told = notes_of(one)
            what = told[0].partition(" pairs")[2] if told else "with the measurement"
            tally.count(f"recordings begun {what}")
            if place == len(begins) and (not told or SAME in told[0]):
                require_same(one, stream)


def test_a_measurement_may_outlive_its_recording(tmp_path: Path) -> None:
    """The file is removed while it is written: the stream goes on, and the next recording has all that is kept."""
    path = tmp_path / "run.csv"
    source = Paced(touched(1))
    with Stream(source, keep=KEEP, outlives_recording=True) as stream:
        recorder = stream.start_recording(path, earlier=True)
        source.go.release(200)
        while not recorder.error:
            path.unlink(missing_ok=True)
        source.go.release(1)
        with pytest.raises(palpate.RecordingError, match="what could be saved"):
            stream.stop_recording()
        begun(stream, path, {300})
        source.go.release(10_000)
    assert len(stream.touches) == 4
    assert [t.as_dict() for t in palpate.touches(recorded(tmp_path / "run-1.csv"))] == [
        t.as_dict() for t in stream.touches
    ]
