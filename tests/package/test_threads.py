"""Two threads: what docs/robotics.md says is what happens."""

import re
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from numeric import bank_of
from project import ROOT
from recording_bench import Scripted, sample

PAGE = (ROOT / "docs" / "robotics.md").read_text(encoding="utf-8")
SIZE = 400_000
TIMES = np.arange(SIZE) * 26_000_000
ONES = np.ones(SIZE)


def blocks_of(
    name: str,
) -> tuple[Callable[[], Any], Callable[[Any], Any], dict[str, tuple[Any, ...]]]:
    """Return how an object of a class is made, given a long block, and the arguments of its methods."""
    kind: Any = (
        bank_of(getattr(palpate, name.removesuffix("Bank")))
        if "Bank" in name
        else getattr(palpate, name)
    )
    if name == "Tracker":
        empty: tuple[Any, ...] = (np.zeros(0, np.int64),) * 2 + (np.zeros(0),) * 2
        arguments = {"feed": (0.0, 0.0, 1.0, 1.0), "process": empty, "take": empty}
        since = ("touches_since", "revisions_since", "judgements_since")
        more: dict[str, tuple[Any, ...]] = dict.fromkeys(since, (0,))
        return kind, lambda made: made.process(TIMES, TIMES, ONES, ONES), arguments | more
    bank = "Bank" in name
    block = ONES.astype(np.float32 if "32" in name else float).reshape((-1, 4) if bank else -1)
    pair, none = (block[0], block[0]) if bank else (1.0, 1.0), (block[:0], block[:0])
    arguments = {"update": pair, "process": none, "trace": none, "predict": (1.0,)}
    return (lambda: kind(4)) if bank else kind, lambda made: made.process(block, block), arguments


@contextmanager
def while_busy(work: Callable[[], Any]) -> Iterator[None]:
    """Run blocks in a thread, again and again; the caller is not interrupted, unless it waits."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(10.0)
    ended = threading.Event()

    def run() -> None:
        while not ended.is_set():
            work()
            time.sleep(0)

    worker = threading.Thread(target=run)
    worker.start()
    try:
        yield
    finally:
        ended.set()
        worker.join()
        sys.setswitchinterval(before)


def attempted(made: Any, name: str, arguments: tuple[Any, ...]) -> bool:
    """Return whether a method or attribute is refused, in the words of the page."""
    try:
        found = getattr(made, name)
        if callable(found):
            found(*arguments)
    except RuntimeError as error:
        if re.fullmatch(
            r"this \w+ is processing a block in another thread: give each thread its own",
            str(error),
        ):
            return True
        raise
    return False


def refused_by(name: str) -> set[str]:
    """Return the public names of a class that are refused while a block is in an object of it."""
    make, work, arguments = blocks_of(name)
    made = make()
    names = {each for each in dir(made) if not each.startswith("_")} | {"__repr__"}
    with while_busy(lambda: work(made)):
        return {each for each in names if meanwhile(made, each, arguments)}


def meanwhile(made: Any, name: str, arguments: dict[str, tuple[Any, ...]]) -> bool:
    """Return whether a method or attribute is refused while a block runs: one ran before it and after it.

    The block cannot end in between, as that takes the interpreter's lock; unless the method gives that away, to import.
    """
    while True:
        while not attempted(made, "process", arguments["process"]):
            time.sleep(1e-4)
        refused = attempted(made, name, arguments.get(name, ()))
        if attempted(made, "process", arguments["process"]):
            return refused


def said(name: str) -> set[str]:
    """Return what the page says is refused for a class."""
    rows = [line.strip("|").split("|") for line in PAGE.splitlines()]
    [cell] = [
        cells[1]
        for cells in rows
        if len(cells) == 3 and f"`{'Bank' if 'Bank' in name else name}`" in cells[0]
    ]
    return set(re.findall(r"`(\w+)`", cell))


@pytest.mark.parametrize("name", ["AdaptiveRls32", "HandoverRls", "Tracker", "HandoverRlsBank"])
def test_what_is_refused_while_a_block_runs_is_what_the_page_says(name: str) -> None:
    assert refused_by(name) == said(name)


@pytest.mark.parametrize("name", ["HandoverRls", "Tracker", "RlsBank"])
def test_who_is_refused_changes_nothing(name: str) -> None:
    make, work, arguments = blocks_of(name)
    made, alone, turns, refused = make(), make(), 0, 0
    with ThreadPoolExecutor(1) as other:
        while refused < 3:
            done = other.submit(work, made)
            turns += 1
            while not done.done():
                refused += attempted(made, "process", arguments["process"])
            done.result()
    for _ in range(turns):
        work(alone)
    if name == "Tracker":
        assert (made.readings, made.state, made.touches) == (
            alone.readings,
            alone.state,
            alone.touches,
        )
    else:
        assert made == alone


def test_two_threads_that_iterate_a_stream_share_its_samples() -> None:
    samples: list[palpate.Sample | Exception] = [sample(i) for i in range(3000)]
    together = threading.Barrier(2)

    def read(stream: palpate.Stream) -> list[int]:
        together.wait()
        return [int(seq) for batch in stream.batches() for seq in batch.samples["seq"]]

    with palpate.Stream(Scripted(samples)) as stream, ThreadPoolExecutor(2) as pool:
        seen = list(pool.map(read, [stream, stream]))
    assert sorted(seen[0] + seen[1]) == list(range(3000))
    assert all(part == sorted(part) for part in seen)
    with palpate.Stream(Scripted(samples)) as alone:
        for _ in alone.batches():
            pass
    assert (stream.tracker.readings, stream.tracker.state) == (
        alone.tracker.readings,
        alone.tracker.state,
    )


def recorded_in_turns(stream: palpate.Stream, folder: Path, number: int) -> None:
    """Begin, mark and end recordings, while another one does the same."""
    for turn in range(5):
        try:
            stream.start_recording(folder / f"{number}-{turn}.csv", earlier=True)
            stream.mark(f"{number}")
            stream.note("here")
            assert stream.counters.read >= 0
            stream.tare(force=True)
            stream.stop_recording()
        except ValueError as error:  # the other one records, or the stream has ended
            if not re.search("one recording at a time|a change of a closed recording", str(error)):
                raise


def test_a_stream_is_asked_told_and_closed_from_other_threads(tmp_path: Path) -> None:
    stream = palpate.Stream(
        Scripted([sample(i) for i in range(200_000)], live=True), keep=1024, capacity=1 << 20
    )
    with stream, ThreadPoolExecutor(3) as others:
        meddling = [
            others.submit(recorded_in_turns, stream, tmp_path, number) for number in range(2)
        ]
        closing = threading.Timer(0.3, stream.close)
        closing.start()
        for _ in stream.batches():
            pass
        for each in meddling:
            each.result(60)
        closing.join()
    assert stream.counters.read == stream.counters.delivered + stream.counters.dropped
    for path in tmp_path.glob("*.csv"):
        assert not palpate.check(path).faults
