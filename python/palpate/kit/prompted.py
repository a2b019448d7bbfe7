"""Steps that need a hand: pull and replug, press, a known capacitor. Each can be left out."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from statistics import mean
from typing import Protocol

from palpate.ad7746 import datasheet
from palpate.ad7746.configuration import HARD, SOFT
from palpate.kit.bench import Bench
from palpate.kit.chip import Level
from palpate.kit.step import Step, judged, left_out
from palpate.samples import Sample, Status

_WAIT_S = 30.0
_IDLE, _BEGIN, _END = 32, 3, 5  # pairs: at rest, that begin a press, that end it
_NOISES, _LEAST_PF = 10.0, 0.003  # a change is this many times the noise, and at least this
_EQUAL = 0.05  # a ratio nearer to 1 does not show which bump is the hard one
_GAIN = 0.1
_CAPACITOR_PF = (0.5, 8.0)
_STEPS = {"replug": "pull and replug", "press": "press", "capacitor": "known capacitor"}


class Prompts(Protocol):
    """Asks the person at the board."""

    def ready(self, text: str) -> bool:
        """Say what to do now, wait; False: the step is to be left out."""
        ...

    def value(self, text: str) -> float | None:
        """Ask for a number; None: the step is to be left out."""
        ...


class Nobody:
    """Nobody is at the board: every prompted step is left out."""

    def ready(self, text: str) -> bool:
        """Return False."""
        return False

    def value(self, text: str) -> float | None:
        """Return None."""
        return None


def _skipped(name: str) -> Step:
    return left_out(_STEPS[name], "left out: it needs a hand")


def replug(bench: Bench, prompts: Prompts) -> Iterator[Step]:
    """Wait until the board was pulled and replugged; compare the fingerprint."""
    if not bench.is_kit:
        yield left_out(_STEPS["replug"], "not on USB")
        return
    if not prompts.ready(f"Pull the board's USB plug within {_WAIT_S:g} s, wait 2 s, plug it in again."):
        yield _skipped("replug")
        return
    before, marked = bench.source.driver.counters.reconnects, len(bench.source.gaps)
    last, gap_s = None, 0.0
    for sample in _for_a_while(bench):
        if last and bench.source.driver.counters.reconnects > before:
            gap_s = (sample.t_hard_ns - last.t_hard_ns) / 1e9
            break
        last = sample
    if not gap_s:
        yield left_out(_STEPS["replug"], f"the board was not pulled within {_WAIT_S:g} s")
        return
    again = bench.chip.registers()[datasheet.CAP_GAIN :]
    marks = [gap.text for gap in bench.source.gaps[marked:]]
    yield judged(
        _STEPS["replug"],
        f"back after {gap_s:.1f} s; fingerprint {again.hex()}; marked: {'; '.join(marks) or 'no gap'}",
        f"back, the same board ({bench.gains.hex()}), the gap marked",
        right=again == bench.gains and bool(marks),
        do=["another board was plugged in, or its gains were read wrongly: run this again with one board"]
        if again != bench.gains
        else ["report this: a gap without a mark makes a false touch possible"],
        values={"gap_s": round(gap_s, 3), "fingerprint": again.hex(), "marks": len(marks)},
    )


@dataclass
class _Press:
    """Follows the changes from the idle values until a press has ended."""

    idle: tuple[float, float]
    limit: float
    changes: list[tuple[float, float]] = field(default_factory=list)
    _quiet: int = 0
    _moved: int = 0

    def ended(self, sample: Sample) -> bool:
        """Take the next sample; return whether a press has ended with it."""
        change = sample.hard - self.idle[HARD], sample.soft - self.idle[SOFT]
        moved = max(map(abs, change)) > self.limit
        self._moved = self._moved + 1 if moved else 0
        self._quiet = 0 if moved else self._quiet + 1
        if self.changes or self._moved >= _BEGIN:
            self.changes.append(change)
        return len(self.changes) > _END and self._quiet >= _END


def press(bench: Bench, prompts: Prompts) -> Iterator[Step]:
    """Wait for a press; tell from its ratio which bump is the hard one."""
    if not prompts.ready("Hold the probe still in the air. Then press both bumps on something hard, as a table, for 2 s; "
                         f"lift it. There are {_WAIT_S:g} s."):  # fmt: skip
        yield _skipped("press")
        return
    idle: list[Sample] = []
    found: _Press | None = None
    for sample in _for_a_while(bench):
        if sample.status != Status.OK:
            continue
        if len(idle) < _IDLE:
            idle.append(sample)
            continue
        found = found or _at_rest(idle)
        if found.ended(sample):
            break
    if found is None or not found.changes:
        yield left_out(_STEPS["press"], f"no press within {_WAIT_S:g} s: neither bump changed")
        return
    yield _judged_press(bench, found)


def _at_rest(idle: list[Sample]) -> _Press:
    columns = [sample.hard for sample in idle], [sample.soft for sample in idle]
    noise = [math.sqrt(mean((b - a) ** 2 for a, b in pairwise(c)) / 2) for c in columns]
    return _Press((mean(columns[HARD]), mean(columns[SOFT])), max(_NOISES * max(noise), _LEAST_PF))


def _judged_press(bench: Bench, found: _Press) -> Step:
    hard, soft = ([change[channel] for change in found.changes] for channel in (HARD, SOFT))
    peaks = [max(column, key=abs) for column in (hard, soft)]
    squares = sum(value * value for value in soft)
    ratio = sum(h * s for h, s in zip(hard, soft, strict=True)) / squares if squares else math.inf
    right, do = _of_press(bench, found.limit, peaks, ratio)
    return judged(
        _STEPS["press"],
        f"hard bump {peaks[HARD]:+.4f} pF, soft bump {peaks[SOFT]:+.4f} pF, ratio {ratio:.2f}",
        "both change, the hard bump more: ratio above 1",
        right=right,
        do=do,
        values={"hard_pF": round(peaks[HARD], 6), "soft_pF": round(peaks[SOFT], 6), "ratio": round(ratio, 4)},
    )


def _of_press(bench: Bench, limit: float, peaks: list[float], ratio: float) -> tuple[bool, list[str]]:
    still = [channel for channel in (HARD, SOFT) if abs(peaks[channel]) <= limit]
    if still:
        pin = bench.pin(still[0])
        return False, [f"only one bump changes: press again with both; if CIN{pin} does not change, check its wire"]
    if ratio < 0:
        return False, ["one bump rises and the other falls: check that both are on CIN+, and not on CIN-"]
    if abs(ratio - 1) < _EQUAL:
        return False, ["the bumps change alike: press on something harder, to see which one is the hard bump"]
    swapped = f"add hard_input={bench.pin(SOFT)} to SOURCE, or swap the wires of CIN1 and CIN2"
    return ratio > 1, [f"the inputs are swapped, the hard bump is on CIN{bench.pin(SOFT)}: {swapped}"]


def capacitor(bench: Bench, prompts: Prompts) -> Iterator[Step]:
    """Compare a capacitor of known value with the change that it makes at the hard bump's input."""
    pin = bench.pin(HARD)
    low, high = _CAPACITOR_PF
    value = prompts.value(f"Value of a known capacitor, {low:g} to {high:g} pF")
    level = bench.level(pin) or bench.levels.get((pin, bench.excitation(pin)))
    if value is None or level is None:
        yield _skipped("capacitor")
        return
    if not low <= value <= high:
        yield left_out(_STEPS["capacitor"], f"got {value:g} pF, allowed: {low:g} to {high:g} pF")
        return
    before = _now(bench, pin, level)
    where = f"CIN{pin}+ and EXC{bench.excitation(pin)}"
    if not prompts.ready(f"Connect the capacitor between {where}, beside the probe; hands away."):
        yield _skipped("capacitor")
        return
    found = _now(bench, pin, level) - before
    yield judged(
        _STEPS["capacitor"],
        f"{found:.3f} pF more; gain {found / value:.3f}",
        f"{value:g} pF within {100 * _GAIN:.0f} % and the capacitor's own tolerance",
        right=abs(found / value - 1) <= _GAIN,
        do=[f"check the value and the contacts at {where}; short wires: 1 cm of cable is about 1 pF"],
        values={"capacitor_pF": value, "measured_pF": None if math.isnan(found) else round(found, 4)},
    )


def _now(bench: Bench, pin: int, level: Level) -> float:
    """Return the capacitance of an input now, pF, by this chip's own CAPDAC step."""
    found = bench.chip.level(pin, bench.excitation(pin), bench.configuration)
    return found.capdac * bench.steps_pF.get(pin, datasheet.DAC_STEP_PF) + found.pF


def _for_a_while(bench: Bench) -> Iterator[Sample]:
    deadline = bench.chip.clock.now_ns() + _WAIT_S * 1e9
    for sample in bench.source:
        yield sample
        if bench.chip.clock.now_ns() > deadline:
            return
