"""Steps that need a hand: pull and replug, press, a known capacitor. Each can be left out."""

import math
from collections.abc import Iterator, Sequence
from itertools import islice, pairwise
from statistics import mean
from typing import Protocol

from palpate.ad7746 import datasheet
from palpate.ad7746.configuration import HARD, SOFT
from palpate.kit.bench import Bench
from palpate.kit.step import Step, judged, left_out
from palpate.samples import Sample, Status

_WAIT_S = 30.0
_IDLE, _BEGIN, _END = 32, 3, 5  # pairs: at rest, that begin a press, that end it
_NOISES, _LEAST_PF = 10.0, 0.003  # a change is this many times the noise, and at least this
_EQUAL = 0.05  # a ratio nearer to 1 does not show which bump is the hard one
_GAIN = 0.1
_CAPACITOR_PF = (0.5, 8.0)
_BY_HAND = "left out: it needs a hand"


class Prompts(Protocol):
    """Asks the person at the board."""

    def ready(self, text: str) -> bool:
        """Say what to do now, wait; False: the step is to be left out."""

    def value(self, text: str) -> float | None:
        """Ask for a number; None: the step is to be left out."""


def replug(bench: Bench, prompts: Prompts | None) -> Step:
    """Wait until the board was pulled and replugged; compare the fingerprint."""
    if not bench.is_kit:
        return left_out("pull and replug", "not on USB")
    if not prompts or not prompts.ready(f"Pull the board's USB plug within {_WAIT_S:g} s, wait 2 s, plug it in again."):
        return left_out("pull and replug", _BY_HAND)
    before, marked = bench.source.driver.counters.reconnects, len(bench.source.gaps)
    gap_s = 0.0
    for last, sample in pairwise(_for_a_while(bench)):
        if bench.source.driver.counters.reconnects > before:
            gap_s = (sample.t_hard_ns - last.t_hard_ns) / 1e9
            break
    if not gap_s:
        return left_out("pull and replug", f"the board was not pulled within {_WAIT_S:g} s")
    again = bench.chip.registers()[datasheet.CAP_GAIN :]
    marks = [gap.text for gap in bench.source.gaps[marked:]]
    other = "another board was plugged in, or its gains were read wrongly: run this again with one board"
    return judged(
        "pull and replug",
        f"back after {gap_s:.1f} s; fingerprint {again.hex()}; marked: {'; '.join(marks) or 'no gap'}",
        f"back, the same board ({bench.gains.hex()}), the gap marked",
        other if again != bench.gains else "report this: a gap without a mark makes a false touch possible",
        right=again == bench.gains and bool(marks),
        gap_s=round(gap_s, 3),
        fingerprint=again.hex(),
        marks=len(marks),
    )


def press(bench: Bench, prompts: Prompts | None) -> Step:
    """Wait for a press; tell from its ratio which bump is the hard one."""
    text = "Hold the probe still in the air. Then press both bumps on something hard, as a table, for 2 s; lift it."
    if not prompts or not prompts.ready(f"{text} There are {_WAIT_S:g} s."):
        return left_out("press", _BY_HAND)
    pairs = ((sample.hard, sample.soft) for sample in _for_a_while(bench) if sample.status == Status.OK)
    idle = list(islice(pairs, _IDLE))
    changes, limit = _pressed(idle, pairs) if len(idle) == _IDLE else ([], 0.0)
    if not changes:
        return left_out("press", f"no press within {_WAIT_S:g} s: neither bump changed")
    peaks = [max(column, key=abs) for column in zip(*changes, strict=True)]
    squares = sum(soft * soft for _, soft in changes)
    ratio = sum(hard * soft for hard, soft in changes) / squares if squares else math.inf
    do = _doubt(bench, limit, peaks, ratio)
    return judged(
        "press",
        f"hard bump {peaks[HARD]:+.4f} pF, soft bump {peaks[SOFT]:+.4f} pF, ratio {ratio:.2f}",
        "both change, the hard bump more: ratio above 1",
        do,
        right=not do,
        hard_pF=round(peaks[HARD], 6),
        soft_pF=round(peaks[SOFT], 6),
        ratio=round(ratio, 4),
    )


def _pressed(
    idle: Sequence[tuple[float, float]], pairs: Iterator[tuple[float, float]]
) -> tuple[list[tuple[float, float]], float]:
    """Return the changes from the idle values until a press has ended, and what counts as a change, pF."""
    columns = list(zip(*idle, strict=True))
    noise = max(math.sqrt(mean((b - a) ** 2 for a, b in pairwise(column)) / 2) for column in columns)
    limit, (hard_pF, soft_pF) = max(_NOISES * noise, _LEAST_PF), map(mean, columns)
    changes: list[tuple[float, float]] = []
    moved = quiet = 0
    for hard, soft in pairs:
        change = hard - hard_pF, soft - soft_pF
        moved, quiet = (moved + 1, 0) if max(map(abs, change)) > limit else (0, quiet + 1)
        if changes or moved >= _BEGIN:
            changes.append(change)
        if len(changes) > _END and quiet >= _END:
            break
    return changes, limit


def _doubt(bench: Bench, limit: float, peaks: list[float], ratio: float) -> str:
    """Return what to do about a press that does not show the bumps as they should be; empty: it does."""
    for channel, peak in enumerate(peaks):
        if abs(peak) <= limit:
            pin = bench.configuration.input(channel)
            return f"only one bump changes: press again with both; if CIN{pin} does not change, check its wire"
    if ratio < 0:
        return "one bump rises and the other falls: check that both are on CIN+, and not on CIN-"
    if abs(ratio - 1) < _EQUAL:
        return "the bumps change alike: press on something harder, to see which one is the hard bump"
    pin = bench.configuration.input(SOFT)
    swapped = f"add hard_input={pin} to SOURCE, or swap the wires of CIN1 and CIN2"
    return "" if ratio > 1 else f"the inputs are swapped, the hard bump is on CIN{pin}: {swapped}"


def capacitor(bench: Bench, prompts: Prompts | None) -> Step:
    """Compare a capacitor of known value with the change that it makes at the hard bump's input."""
    pin = bench.configuration.input(HARD)
    low, high = _CAPACITOR_PF
    value = prompts.value(f"Value of a known capacitor, {low:g} to {high:g} pF") if prompts else None
    if prompts is None or value is None:
        return left_out("known capacitor", _BY_HAND)
    if not low <= value <= high:
        return left_out("known capacitor", f"got {value:g} pF, allowed: {low:g} to {high:g} pF")
    before = _now(bench, pin)
    where = f"CIN{pin}+ and EXC{bench.excitation(pin)}"
    if not prompts.ready(f"Connect the capacitor between {where}, beside the probe; hands away."):
        return left_out("known capacitor", _BY_HAND)
    found = _now(bench, pin) - before
    return judged(
        "known capacitor",
        f"{found:.3f} pF more; gain {found / value:.3f}",
        f"{value:g} pF within {100 * _GAIN:.0f} % and the capacitor's own tolerance",
        f"check the value and the contacts at {where}; short wires: 1 cm of cable is about 1 pF",
        right=abs(found / value - 1) <= _GAIN,
        capacitor_pF=value,
        measured_pF=None if math.isnan(found) else round(found, 4),
    )


def _now(bench: Bench, pin: int) -> float:
    """Return the capacitance of an input now, pF, by this chip's own CAPDAC step."""
    found = bench.chip.level(pin, bench.excitation(pin), bench.configuration)
    return found.capdac * bench.steps_pF.get(pin, datasheet.DAC_STEP_PF) + found.pF


def _for_a_while(bench: Bench) -> Iterator[Sample]:
    deadline = bench.chip.clock.now_ns() + _WAIT_S * 1e9
    for sample in bench.source:
        yield sample
        if bench.chip.clock.now_ns() > deadline:
            return
