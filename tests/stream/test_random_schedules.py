"""Random measurements: the source fails or waits, a consumer is slow, a second thread presses buttons; the counters add up."""

import math
import os
import random
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from effort import NIGHTLY, Tally, draws
from palpate import PalpateError, Sample, Status, Stream, check
from palpate.recording.sidecar import load
from palpate.stream import StreamCounters
from recording_bench import Liar, sample

WORKERS = 4
COUNT = draws(200, 10_000)
FIRST = int(os.environ.get("PALPATE_SEED", time.time_ns() % 2**40 if NIGHTLY else 0))
ERRORS = (PalpateError, OSError, RuntimeError, ValueError, SystemExit)
"""What a stream of such a source may raise: of the source, or a refused button."""


def bad(good: Sample) -> list[Any]:
    """Return what a source may yield in place of a sample: nothing of it can be stored."""
    return [
        good._replace(t_hard_ns=2**63),
        good._replace(soft=math.nan),
        good._replace(status=99),
        None,
    ]


def unusual(good: Sample) -> list[Any]:
    """Return what can be stored as well as a sample."""
    no_codes: Any = good._replace(hard_raw=-1, soft_raw=-1)
    odd = no_codes._replace(seq=np.int64(good.seq), hard=np.float32(1.5), status=np.uint8(0))
    return [odd, no_codes._replace(hard=1, soft=math.inf), tuple(good)]


class Play:
    """One schedule: a script for the source, and buttons that a second thread presses meanwhile."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.dice = random.Random(seed)
        self.folder = folder
        self.good, self.files, self.unforeseen = 0, 0, list[BaseException]()
        self.live = self.dice.random() < 0.5
        step = self.dice.choice(["enter", "interrupt", "close"])
        lies = {step: OSError("bus")} if self.dice.random() < 0.15 else {}
        self.source = Liar(self._script(), live=self.live, lies=lies)
        self.undisturbed = self.dice.random() < 0.3 and not lies

    def _script(self) -> list[Any]:
        """Return samples, gaps and floods; an error may end them."""
        script: list[Any] = []
        seq = self.dice.randrange(3)
        for _ in range(self.dice.randrange(20)):
            for _ in range(self.dice.choice([1, 1, 1, 2, 5, 100])):
                script.append(sample(seq, status=self.dice.choice([Status.OK] * 9 + [Status.LOST])))
                seq += 1
            if self.dice.random() < 0.2:
                script.append(self.dice.choice(unusual(sample(seq))))
                seq += 1
            if self.dice.random() < 0.2:
                script.append(partial(time.sleep, self.dice.uniform(0, 0.002)))
            seq += self.dice.choice([0] * 9 + [1, 1000])
        self.good = sum(isinstance(item, tuple) for item in script)
        if self.dice.random() < 0.7:
            script.append(self.dice.choice([*bad(sample(seq)), OSError("bus"), SystemExit(3)]))
            script += [sample(seq + k) for k in range(3)]
        return script

    def press(self, stream: Stream) -> None:
        """Press random buttons, and read the counters."""
        buttons: dict[str, Callable[[], object]] = {
            "stop": stream.stop,
            "close": stream.close,
            "tare": lambda: stream.tare(force=True),
            "mark": lambda: stream.mark("here"),
            "note": lambda: stream.note("then"),
            "record": lambda: stream.start_recording(self.file()),
            "end": stream.stop_recording,
            "look": lambda: self.look(stream.counters),
        }
        dice = random.Random(self.dice.random())
        for _ in range(dice.randrange(8)):
            time.sleep(dice.uniform(0, 0.003))
            try:
                buttons[dice.choices(list(buttons), [1, 1, 4, 4, 4, 4, 4, 4])[0]]()
            except ERRORS:
                pass
            except BaseException as error:  # noqa: BLE001  raised again in the thread of the test
                self.unforeseen.append(error)

    def file(self) -> Path:
        """Return the path of the next recording."""
        self.files += 1
        return self.folder / f"{self.files}.csv"

    @staticmethod
    def look(counters: StreamCounters) -> None:
        """Check what is so at any moment."""
        assert min(counters.as_dict().values()) >= 0
        assert counters.read == counters.delivered + counters.dropped + counters.waiting

    def run(self) -> tuple[StreamCounters, int]:
        """Measure until the end; return the counters and how many samples the consumer got."""
        seen = 0
        most = 10**9 if self.undisturbed else self.dice.choice([0, 1, 50, 10**9, 10**9])
        record = self.file() if self.dice.random() < 0.5 else None
        stream = Stream(self.source, record=record, capacity=self.dice.choice([2, 64, 4096]))
        presser = threading.Thread(target=self.press, args=[stream])
        try:
            with stream:
                if not self.undisturbed:
                    presser.start()
                try:
                    for _ in stream:
                        seen += 1
                        if seen >= most:
                            break
                finally:
                    if presser.ident:
                        presser.join()
        except ERRORS:
            pass
        assert self.source.closed == 1
        return stream.counters, seen


def assert_files_are_whole(folder: Path) -> None:
    for path in folder.glob("*.csv"):
        report = check(path)
        end = (load(path) or {})["end"]
        counters = end["counters"]
        assert end["clean"]
        assert end["rows"] == report.survey.rows == counters["recorded"]
        assert counters["read"] == counters["recorded"] + counters["unrecorded"]
    assert {p.stem for p in folder.glob("*.csv")} == {p.stem for p in folder.glob("*.json")}


@pytest.mark.parametrize("worker", range(WORKERS))
def test_the_counters_add_up(worker: int, tmp_path: Path, tally: Tally) -> None:
    for number in range(worker, COUNT, WORKERS):
        folder = tmp_path / str(number)
        folder.mkdir()
        play = Play(FIRST + number, folder)
        counters, seen = play.run()
        told = f"PALPATE_SEED={FIRST + number}: {counters}, {play.unforeseen}"
        assert not play.unforeseen, told
        assert (counters.read, counters.waiting) == (counters.delivered + counters.dropped, 0), told
        if play.undisturbed:
            assert (counters.read, seen) == (play.good, counters.delivered), told
            assert play.live or counters.dropped == 0, told
        assert_files_are_whole(folder)
        tally.count("random schedules of a measurement")
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("palpate")]
