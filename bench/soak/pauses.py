"""Touches around a pause of the computer: it sleeps, the program is stopped, the wall clock is set.

    python -m bench.soak.pauses [--runs 40]

Four sources, and all clocks are virtual: a simulated board, whose driver takes the times; serial lines without times, and
with times of the board; and samples with times of a clock that stands still while the computer sleeps. The pause is
between two touches. Meanwhile both baselines drift, and the board goes on: some of its lines wait in a buffer.

Prints for each source and pause: runs with a touch that was none and has no flag, and runs in which the touch after the
pause is right: without a flag, and within 1 % of the same run without the pause. Both also without the clocks of the
computer. Exit code 1 if one is not as it
must be: no such touch, all right.
"""

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import palpate
from palpate import Stream, Touch
from palpate.clocks import ClockReading, Clocks, ClockWatch, Pause
from palpate.samples import Sample
from palpate.simulation import ConverterModel, Press, Scenario, simulate
from palpate.sources import SampleSource, Source
from palpate.sources.serial import SerialOptions, SerialSource

RUNS = 40
KINDS = {"": 0.0, "sleep": 3600.0, "stop": 30.0, "clock-set": 3600.0}  # s; "": none
FIRST_S = 2.0
SECOND_S = 18.0  # a touch that is none has ended by then
RATIO = 2.5
AFTER_S = 10.0  # from the start of the second press to its revision
PAUSES_S = (9.7, 10.0)  # between the touches; a baseline takes 0.8 s
NEAR_S = 0.5
IDLE = 10  # pairs before a pause that are without contact
WRONG = 0.01
DRIFT_PF_PER_S = (1e-6, 1e-5)  # of the soft channel: of a probe that warms up
HARD_TO_SOFT = (1.5, 4.0)  # of the drifts, as in a contact
BUFFERED_S = {
    "": 0.0,
    "sleep": 1.0,
    "stop": 30.0,
    "clock-set": 0.0,
}  # lines that may wait for the program


class Computer:
    """A computer with virtual clocks."""

    def __init__(self) -> None:
        self.awake_s = self.fine_s = self.utc_s = 0.0

    def go_on(self, seconds: float) -> None:
        """Let time pass."""
        self.awake_s += seconds
        self.fine_s += seconds
        self.utc_s += seconds

    def pause(self, kind: str) -> None:
        """Let it sleep, stand still, or have its wall clock set."""
        seconds = KINDS[kind]
        if kind == "stop":
            self.go_on(seconds)
            return
        self.utc_s += seconds
        if kind == "sleep":
            self.fine_s += seconds

    def read(self) -> ClockReading:
        """Read the clocks."""
        return ClockReading(*(round(1e9 * s) for s in (self.awake_s, self.fine_s, self.utc_s)))


class NoClocks:
    """Clocks that show nothing."""

    def passed(self) -> Pause:
        """Return that nothing happened."""
        return Pause()


class Arrival(NamedTuple):
    """A pair that arrives at the program: its time by the board, and what happened before it."""

    seq: int
    board_s: float
    hard: float
    soft: float
    passed_s: float = 0.0
    pause: str = ""


def arrivals(kind: str, seed: int) -> list[Arrival]:
    """Return the pairs of two touches with a pause between them."""
    random = np.random.default_rng(seed)
    presses = [Press(start_s, [(0.0, RATIO)]) for start_s in (FIRST_S, SECOND_S)]
    together = ConverterModel(together=True, bus_s=0.015)  # a line has one time
    run = simulate(
        Scenario(presses=presses, duration_s=SECOND_S + AFTER_S, converter=together), seed
    )
    last = int(np.searchsorted(run.t_hard_s, random.uniform(*PAUSES_S)))
    step_s = float(np.median(np.diff(run.t_hard_s)))
    paused_s = KINDS[kind] if kind != "clock-set" else 0.0
    waiting = int(random.uniform(0, BUFFERED_S[kind]) / step_s)
    drifts = random.uniform(*DRIFT_PF_PER_S) * np.array([random.uniform(*HARD_TO_SOFT), 1.0])
    found = list[Arrival]()
    pairs = list(zip(run.t_hard_s.tolist(), run.hard.tolist(), run.soft.tolist(), strict=True))
    for seq, (t_s, hard, soft) in enumerate(pairs[:last]):
        found.append(Arrival(seq, t_s, hard, soft, step_s))
    for row in range(waiting):  # without contact, from the start of the pause
        t_s, hard, soft = pairs[last - IDLE + row % IDLE]
        since_s = (row + 1) * step_s
        hard, soft = np.array([hard, soft]) + drifts * since_s
        at_s = pairs[last - 1][0] + since_s
        found.append(Arrival(len(found), at_s, hard, soft, 0.0, "" if row else kind))
    lost = round(paused_s / step_s) - waiting
    for row, (t_s, hard, soft) in enumerate(pairs[last:]):
        hard, soft = np.array([hard, soft]) + drifts * paused_s
        pause = kind if not (row or waiting) else ""
        passed_s = 1e-4 if waiting and not row else step_s
        seq = last + waiting + row + (lost if paused_s else 0)
        found.append(Arrival(seq, t_s + paused_s, hard, soft, passed_s, pause))
    return found


class Played(SerialSource):
    """Serial lines that arrive by the clocks of a virtual computer."""

    def __init__(self, items: list[Arrival], *, timed: bool) -> None:
        self._items = items
        self._timed = timed
        self._computer = Computer()
        self.clocks: Clocks | None = ClockWatch(self._computer.read)
        super().__init__("virtual", SerialOptions.parse("serial", {}))
        self.live = False

    def _open(self) -> Any:
        return None

    def close(self) -> None:
        """Close nothing."""

    def _read_lines(self) -> Iterator[tuple[bytes, int]]:
        for item in self._items:
            self._computer.go_on(item.passed_s)
            if item.pause:
                self._computer.pause(item.pause)
            line = f"hard={item.hard:.7f},soft={item.soft:.7f}"
            if self._timed:
                t_us = round(item.board_s * 1e6) % 2**32
                line += f",t_us={t_us},seq={item.seq}"
            yield line.encode(), round(1e9 * self._computer.fine_s)


class Standing(SampleSource):
    """Samples with times of a clock that stands still while the computer sleeps."""

    live = False

    def __init__(self, items: list[Arrival]) -> None:
        self._items = items
        self._computer = Computer()
        self.clocks = ClockWatch(self._computer.read)

    def samples(self) -> Iterator[Sample]:
        """Yield the samples."""
        for seq, item in enumerate(self._items):
            self._computer.go_on(item.passed_s)
            if item.pause:
                self._computer.pause(item.pause)
            t_ns = round(1e9 * self._computer.awake_s)
            yield Sample(seq, t_ns, t_ns, -1, -1, item.hard, item.soft)

    def describe(self) -> dict[str, Any]:
        """Return that the times are arrivals."""
        return {"name": "standing", "stamps": "host"}


def board(kind: str, seed: int) -> Source:
    """Return the simulated board: two touches of four."""
    at_s = np.random.default_rng(seed).uniform(*PAUSES_S)
    uri = f"sim:four-specimens?seed={seed}"
    if kind:
        uri += f"&fault={kind}:{KINDS[kind]:g}@{at_s:.3f}"
    return palpate.open(uri)


STANDING = "clock that stands"
BOARD = "simulated board"
SECOND_S_OF = {BOARD: 11.0}
SOURCES: dict[str, Callable[[str, int], Source]] = {
    BOARD: board,
    "lines without times": lambda kind, seed: Played(arrivals(kind, seed), timed=False),
    "lines with times": lambda kind, seed: Played(arrivals(kind, seed), timed=True),
    STANDING: lambda kind, seed: Standing(arrivals(kind, seed)),
}


@dataclass
class Outcome:
    """What happened in the runs of one source and pause."""

    phantoms: int = 0
    right: int = 0
    messages: set[str] = field(default_factory=set)


def touches_of(source: Source, end_s: float, paused_s: float, outcome: Outcome) -> list[Touch]:
    """Measure both presses; return the touches, with times without the pause."""
    with Stream(source, notify=outcome.messages.add) as stream:
        for batch in stream.batches():
            if len(batch.samples) and batch.samples["t_hard_ns"][-1] / 1e9 > end_s + paused_s:
                break
    found = list[Touch]()
    for touch in stream.touches:
        if touch.start_s > PAUSES_S[0] + paused_s:
            touch = replace(touch, start_s=touch.start_s - paused_s)
        found.append(touch)
    return found


def nearest(touches: list[Touch], press_s: float) -> Touch | None:
    """Return the touch that begins with a press."""
    for touch in touches:
        if abs(touch.start_s - press_s) < NEAR_S:
            return touch
    return None


@cache
def undisturbed(name: str, seed: int) -> Touch | None:
    """Return the second touch of a run without a pause."""
    second_s = SECOND_S_OF.get(name, SECOND_S)
    touches = touches_of(SOURCES[name]("", seed), second_s + AFTER_S, 0.0, Outcome())
    return nearest(touches, second_s)


def measure(kind: str, name: str, runs: int, *, with_clocks: bool = True) -> Outcome:
    """Measure, and count."""
    outcome = Outcome()
    second_s = SECOND_S_OF.get(name, SECOND_S)
    end_s = second_s + AFTER_S
    paused_s = KINDS[kind]
    if kind == "clock-set" or (kind == "sleep" and name == STANDING):
        paused_s = 0.0
    for seed in range(runs):
        source = SOURCES[name](kind, seed)
        if not with_clocks:
            source.clocks = NoClocks()
        touches = touches_of(source, end_s, paused_s, outcome)
        presses = [nearest(touches, press_s) for press_s in (FIRST_S, second_s)]
        outcome.phantoms += any(not (touch in presses or touch.flags) for touch in touches)
        known = undisturbed(name, seed)
        touch = presses[1]
        if touch and known and not touch.flags:
            outcome.right += abs(touch.ratio / known.ratio - 1) < WRONG
    return outcome


_ROW = "{:20} {:17} {:>17} {:>11} {:>16}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--runs", type=int, default=RUNS)
    runs = parser.parse_args().runs
    print(_ROW.format(f"{runs} runs", "", "touches that are", "next touch", "without clocks:"))
    print(_ROW.format("", "", "none, no flag", "right", "none, right"))
    is_good = True
    for name in SOURCES:
        for kind in filter(None, KINDS):
            now = measure(kind, name, runs)
            before = measure(kind, name, runs, with_clocks=False)
            is_good &= not now.phantoms and now.right == runs
            without = f"{before.phantoms}, {before.right}"
            pause = f"{kind} {KINDS[kind]:g} s"
            print(_ROW.format(name, pause, now.phantoms, now.right, without), flush=True)
    sys.exit(not is_good)


if __name__ == "__main__":
    main()
