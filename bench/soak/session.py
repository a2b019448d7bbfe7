"""A session that a campaign disturbs: the live measurement behind the page, with a recording, notes, marks and a plan.

    python -m bench.soak.session SOURCE FOLDER [--speed 20]

It records to FOLDER/run.csv. Each order that was answered is one line of JSON on the descriptor ANSWERS; the last line there is
the result: the touches, what was shown, and the error that ended the measurement. Without faults each run has the same samples,
and so the same touches.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import palpate
from palpate.files import Json
from palpate.live.commands import LiveWorkbench
from palpate.live.measurement import LiveMeasurement
from palpate.live.page_commands import MarkTextCommand, NoteCommand, PlanCommand
from palpate.live.run_files import RunFiles
from palpate.samples import DTYPE, Block
from palpate.source_events import SourceEvent
from palpate.sources import Source
from palpate.stream import Batch, Listener, Stream

ANSWERS = 3
PAIRS = 32  # in a block
ORDERS = 24  # notes, marks and changes of the plan, evenly over the session
SPECIMENS = "30 OO; 0.143\n50 OO; 0.29\n70 OO; 0.74\n70 A; 8.68"


class Paced(Source):
    """The samples of a source that can wait, as those of a board: they come when they come."""

    real_time = False

    def __init__(self, uri: str, speed: float) -> None:
        self.position = 0.0  # part of the samples that were yielded
        self.goes_on = Event()  # after the first block
        self.may_end = Event()  # all orders were given
        self._source = palpate.open(uri)
        self._speed = speed
        self._stopped = False

    def __iter__(self) -> Iterator[Block | SourceEvent]:
        """Yield the items, in blocks of some samples."""
        items = list(_in_blocks(self._source))
        begun_s = time.monotonic()
        for number, item in enumerate(items):
            if self._stopped:
                return
            if isinstance(item, np.ndarray):
                wait_s = item["t_hard_ns"][-1] / 1e9 / self._speed + begun_s - time.monotonic()
                time.sleep(max(wait_s, 0.0))
            yield item
            self.position = number / len(items)
            if isinstance(item, np.ndarray):
                self.goes_on.wait()
        self.position = 1.0
        self.may_end.wait()

    def describe(self) -> Json:
        """Return the description of the source."""
        return self._source.describe()

    @property
    def counters(self) -> Mapping[str, int]:
        """Errors and reconnections."""
        return self._source.counters

    def interrupt(self) -> None:
        """End after this block."""
        self._stopped = True
        self.goes_on.set()

    def close(self) -> None:
        """Close the source."""
        self._source.close()


def _in_blocks(source: Source) -> Iterator[Block | SourceEvent]:
    """Yield samples in blocks of `PAIRS`, and events in their place."""
    waiting = np.empty(0, DTYPE)
    for item in source:
        if not isinstance(item, np.ndarray):
            if len(waiting):
                yield waiting
            waiting = np.empty(0, DTYPE)
            yield item
            continue
        waiting = np.concatenate([waiting, item])
        while len(waiting) >= PAIRS:
            yield waiting[:PAIRS]
            waiting = waiting[PAIRS:]
    if len(waiting):
        yield waiting


def answer(entry: Json) -> None:
    """Tell the campaign that this was answered."""
    os.write(ANSWERS, (json.dumps(entry) + "\n").encode())


class FirstTare(Listener):
    """Measures the baseline again after the first block, always at the same sample."""

    def __init__(self, source: Paced) -> None:
        self._source = source

    def begun(self, stream: Stream) -> None:
        """Keep the stream."""
        self._stream = stream

    def batch(self, batch: Batch) -> None:
        """Tare once."""
        if not self._source.goes_on.is_set():
            self._stream.tare(force=True)
            self._source.goes_on.set()


def give_orders(bench: LiveWorkbench, source: Paced) -> None:
    """Give orders as a user does until the measurement ends; note which were answered."""
    measurement = bench.live
    bench.run(PlanCommand(SPECIMENS, 1))
    while measurement.running and measurement.last is None:
        time.sleep(0.002)
    for number in range(ORDERS):
        while measurement.running and source.position < number / ORDERS:
            time.sleep(0.002)
        if not measurement.running:
            return
        text = f"order {number}"
        if number % 3 == 0:
            bench.run(NoteCommand(text))
        elif number % 3 == 1:
            mark = measurement.mark()
            bench.run(MarkTextCommand(mark.id, text))
        else:
            bench.run(PlanCommand(SPECIMENS, 1, title=text))
        answer({"order": number})


def main() -> None:
    """Run the session to its end."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("source")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--speed", type=float, default=20.0)
    given = parser.parse_args()
    source = Paced(given.source, given.speed)
    said = list[str]()
    files = RunFiles(given.folder / "run.csv", given.folder)
    measurement = LiveMeasurement(lambda: source, files, {"scene": "handheld"}, said.append)
    bench = LiveWorkbench(measurement, given.source)
    measurement.listeners.append(FirstTare(source))
    try:
        measurement.start()
    except palpate.PalpateError as error:
        answer({"refused": str(error)})
        sys.exit(4)
    give_orders(bench, source)
    source.may_end.set()
    while measurement.running:
        time.sleep(0.01)
    measurement.close()
    recorder: Any = measurement.newest_recorder
    touches = [
        [touch.start_s, touch.samples, touch.ratio, touch.standard_error, list(touch.flags)]
        for touch in measurement.touches
    ]
    counts = {"failures": recorder.failures, "dropped": recorder.dropped}
    answer({"touches": touches, "said": said, "error": measurement.error, **counts})


if __name__ == "__main__":
    main()
