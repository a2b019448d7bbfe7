"""Sources that give blocks: any split, into blocks, single samples, or batches of the consumer, gives the same."""

import random
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from effort import NIGHTLY, Tally, draws, random_of
from palpate import Status, Stream
from palpate.recording.reading import recorded
from palpate.recording.sidecar import load
from palpate.samples import Block, block_of, samples_of
from palpate.source_events import Gap, GapCause
from palpate.stream import stream as stream_module
from palpate.stream.buffers import SampleQueue
from recording_bench import Blocks, Scripted, four, sample, with_gaps


def session(dice: random.Random) -> tuple[Block, dict[int, str]]:
    """Return presses with lost and saturated samples, stretches outside the range, lost numbers; and gaps."""
    samples = four(dice.randrange(5))
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
    return block_of(kept), {seq: f"moved at {seq}" for seq in places}


def split(block: Block, texts: dict[int, str], dice: random.Random) -> list[Any]:
    """Return the samples in random parts, with the gaps between them."""
    gaps: dict[int, list[Gap]] = {}
    for seq, text in sorted(texts.items()):
        place = int(np.searchsorted(block["seq"], seq))
        gaps.setdefault(place, []).append(Gap(GapCause.OTHER, text))
    cuts = dice.choices(range(1, len(block)), k=dice.choice([0, 1, 5, 100]))
    items: list[Any] = []
    begin = 0
    for cut in sorted({*cuts, *gaps, len(block)}):
        items += [block[begin:cut]] if cut > begin else []
        items += gaps.get(cut, [])
        begin = cut
    return items


def result(source: Scripted, path: Path, messages: list[str], **how: Any) -> tuple[Any, ...]:
    """Return all that a measurement leaves: rows, touches, counters, messages, file, and marks."""
    with Stream(source, record=path, notify=messages.append, **how) as stream:
        batches = list(stream.batches())
    rows = np.concatenate([batch.rows for batch in batches]).tobytes()
    ended = [(batch.first + k, touch) for batch in batches for k, touch in enumerate(batch.touches)]
    ended += [revised for batch in batches for revised in batch.revised]
    said = (sorted(messages), stream.out_of_range)
    marks = (load(path) or {}).get("marks", [])
    return rows, stream.touches, ended, stream.counters, said, path.read_bytes(), marks


@pytest.mark.parametrize("live", [False, True])
def test_any_split_gives_the_same(
    live: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tally: Tally
) -> None:
    dice = random_of(f"splits {live}")
    said = 0
    for number in range(draws(10, 200, at_least=3)):
        block, gaps = session(dice)
        described: dict[str, Any] = {
            "period_s": 0.026,
            "full_scale_pF": 4.0,
            "live": live,
        }
        monkeypatch.setattr(stream_module, "_BATCH", 1)
        script = with_gaps(samples_of(block), gaps)
        expected = result(Scripted(script, **described), tmp_path / f"{number}.csv", [])
        monkeypatch.setattr(stream_module, "_BATCH", dice.choice([7, 1024]))
        found = result(
            Blocks(split(block, gaps, dice), **described), tmp_path / f"{number}-blocks.csv", []
        )
        assert found == expected, f"schedule {number}"
        assert palpate.touches(recorded(tmp_path / f"{number}-blocks.csv")) == expected[1]
        said += len(expected[4][0])
        tally.count("splits of a measurement into blocks")
    assert said > 0


@pytest.mark.parametrize("capacity", [2, 16])
def test_no_wake_up_is_missed(capacity: int) -> None:
    """Two threads hand over each sample: a missed wake-up would hang until the limit of the wait, 60 s."""
    queue = SampleQueue(capacity)
    count = 20_000 if NIGHTLY else 2000
    taken: list[int] = []

    def take() -> None:
        while True:
            closed = queue.ring.closed
            block = queue.take(3)
            if isinstance(block, np.ndarray):
                taken.extend(block["seq"].tolist())
            elif closed:
                return
            else:
                queue.wait_for_samples(60)

    consumer = threading.Thread(target=take)
    begun = time.monotonic()
    consumer.start()
    for number in range(count):
        while queue.room <= 0:
            queue.wait_for_room()
        queue.push_many(block_of([sample(number)]))
    queue.close()
    consumer.join(60)
    assert taken == list(range(count))
    assert time.monotonic() - begun < 50
