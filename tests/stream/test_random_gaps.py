"""Random unplugging, replacing and moving of the board: no touch after a gap is wrong without a flag.

10,000 schedules in the nightly run; 300 by default.
"""

import math
import os
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import palpate
import pytest
from effort import SEED, Tally, draws
from palpate import Sample, Touch
from palpate.ad7746.bus import VirtualClock
from palpate.ad7746.evalkit.usb_bus import EvalKit
from palpate.ad7746.simulator.chip import FACTORY, SimulatedChip
from palpate.ad7746.simulator.evalboard import Fault, FaultKind, SimulatedBoard
from palpate.ad7746.simulator.usb_backend import SimulatedUsb
from palpate.recording.reading import recorded
from palpate.source_events import SourceEvent
from palpate.sources.board import BoardSource, ConverterOptions
from recording_bench import measured

IDLE_PF = (6.92, 4.69)
# times of a press, and the length of a touch in it
RISE_S = 0.3
HOLD_S = 2.2
TOUCH_S = 1.5
_SHIFTS_PF = (0.0, 0.002, -0.002, 0.02, -0.02, 0.3, -0.3, 3.0, -3.0)


_EVENTS: list[str] = [
    *[FaultKind.UNPLUG] * 5,
    "gains",
    "centre",
    FaultKind.LOST_CONVERSION,
    FaultKind.NO_ANSWER,
    FaultKind.BROWN_OUT,
]


class Press(NamedTuple):
    """One press: its begin, ratio and depth in the soft channel."""

    start_s: float
    ratio: float
    depth_pF: float

    def profile(self, t_s: float) -> float:
        """Return the depth at a time, 0 to 1."""
        since = t_s - self.start_s
        part = min(since / RISE_S, (2 * RISE_S + HOLD_S - since) / RISE_S, 1.0)
        return 0.5 * (1 - math.cos(math.pi * part)) if part > 0 else 0.0

    @property
    def stop_s(self) -> float:
        """End of the release."""
        return self.start_s + 2 * RISE_S + HOLD_S


class ChangingBoard(SimulatedBoard):
    """A board that may be another one each time it is plugged in again."""

    change: Callable[[], None] = staticmethod(lambda: None)

    def plugged(self, unplug: Callable[[float], None]) -> None:
        self.change()
        super().plugged(unplug)


class Play(BoardSource):
    """One schedule, as a source."""

    live = False

    def __init__(self, seed: int) -> None:
        self.dice = dice = random.Random(seed)
        self.presses = [
            Press(
                2.0 + 5.0 * k + dice.uniform(0, 1.0),
                dice.uniform(1.2, 7.0),
                dice.uniform(0.05, 0.35),
            )
            for k in range(dice.randint(1, 3))
        ]
        self.end_s = self.presses[-1].stop_s + dice.uniform(0.0, 3.0)
        self.shift_pF = [0.0, 0.0]
        self.clock = VirtualClock()
        self.board = ChangingBoard(SimulatedChip(self._pins, seed=seed), self.clock)
        backend = SimulatedUsb(self.clock)
        backend.plug(self.board)
        self.board.change = self._change
        super().__init__(EvalKit(backend=backend, clock=self.clock), ConverterOptions(), self.clock)
        self._events = sorted(
            (dice.uniform(0.0, self.end_s), self._event()) for _ in range(dice.randint(1, 3))
        )

    def samples(self) -> Iterator[Sample | SourceEvent]:
        """Yield the pairs; between them what the schedule says happens."""
        for item in super().samples():
            yield item
            if not isinstance(item, Sample):
                continue
            while self._events and self.now_s >= self._events[0][0]:
                self._do(self._events.pop(0)[1])
            if self.now_s >= self.end_s:
                return

    @property
    def now_s(self) -> float:
        return self.clock.now_ns() / 1e9

    def is_right(self, touch: Touch) -> bool:
        """Return whether a touch belongs to a press, with its ratio, to 1 % and six standard errors.

        The begin of a touch may be dated back by a second, where the baseline is a little off.
        """
        return any(
            press.start_s - 1.5 < touch.start_s < press.stop_s
            and abs(touch.ratio - press.ratio) <= 0.01 * press.ratio + 6 * touch.standard_error
            for press in self.presses
        )

    def _pins(self, pin: int, begin_s: float, end_s: float) -> float:
        t_s = (begin_s + end_s) / 2
        changes = (
            press.profile(t_s) * press.depth_pF * (press.ratio if pin == 1 else 1.0)
            for press in self.presses
        )
        return IDLE_PF[pin - 1] + self.shift_pF[pin - 1] + sum(changes)

    def _change(self) -> None:
        """Move the idle levels; the board may be another one, or not answer for a while."""
        dice = self.dice
        self.shift_pF = [shift + dice.choice(_SHIFTS_PF) for shift in self.shift_pF]
        if dice.random() < 0.3:
            self.board.chip.factory = bytes(dice.randrange(256) for _ in FACTORY)
            self.board.chip.dac_step_pF = (dice.uniform(0.14, 0.19), 0.158)
        if dice.random() < 0.2:
            skip = dice.randrange(20)
            times = dice.randint(1, 4)
            self.board.faults.append(Fault(FaultKind.NO_ANSWER, skip=skip, times=times))

    def _event(self) -> str:
        return self.dice.choice(_EVENTS)

    def _do(self, event: str) -> None:
        if event == "gains":
            self.board.chip.registers[0x0F + self.dice.randrange(4)] ^= 1 << self.dice.randrange(8)
        elif event == "centre":
            self.centre()
        else:
            gone_s = self.dice.uniform(0.05, 3.0)
            kind = FaultKind(event)
            amount = {FaultKind.UNPLUG: gone_s, FaultKind.LOST_CONVERSION: 2.0}.get(kind, 1.0)
            times = 3 if event == FaultKind.NO_ANSWER else 1
            self.board.faults.append(Fault(kind, amount, times=times))


COUNT = int(os.environ.get("PALPATE_GAPS", draws(120, 10_000)))
WORKERS = 6


@pytest.mark.parametrize("worker", range(WORKERS))
def test_a_touch_after_a_gap_is_right_or_has_a_flag(
    worker: int, tmp_path: Path, tally: Tally
) -> None:
    for number in range(worker, COUNT, WORKERS):
        play = Play(SEED + number)
        path = tmp_path / f"{number}.csv"
        stream = measured(play, record=path, seconds=TOUCH_S)
        assert play.now_s < play.end_s + 60, f"schedule {number}: it hangs"
        counters = stream.counters
        driver = play.driver.counters
        assert counters.read == counters.delivered == counters.recorded
        last = stream._pipeline.last
        assert last is not None
        assert counters.read + counters.lost == last.seq + 1 <= driver.pairs + driver.lost
        recording = recorded(path)
        for again in (recording, palpate.read(path)):
            assert palpate.touches(again, seconds=TOUCH_S) == stream.touches, f"schedule {number}"
        tally.count("schedules with gaps")
        for touch in stream.touches if recording.gap_marks else ():
            tally.count(
                "touches beside gaps, " + ("with a flag" if touch.flags else "without a flag")
            )
            assert touch.flags or play.is_right(touch), f"schedule {number}: {touch}"
