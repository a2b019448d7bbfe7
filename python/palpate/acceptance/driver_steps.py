"""Steps with the driver: pairs as a measurement reads them, a replug, and a press."""

import math
from collections.abc import Iterator, Sequence
from functools import reduce
from itertools import islice, pairwise
from operator import or_
from statistics import mean
from typing import NamedTuple

import numpy as np

from palpate.acceptance.board_under_test import BoardUnderTest
from palpate.acceptance.chip_steps import AGAIN
from palpate.acceptance.report import Step, error_line
from palpate.ad7746 import registers
from palpate.ad7746.configuration import HARD, SOFT
from palpate.errors import SourceError
from palpate.samples import Sample, Status, samples_of
from palpate.source_events import Gap

_PAIRS = 60
_RATE = 0.05  # relative difference of the measured and the described period
_MOST_US = 2000
_FAULTS = (Status.HARD_SATURATED | Status.EXCITATION, Status.SOFT_SATURATED | Status.EXCITATION)
_CABLE = "use another cable, or another USB port without a hub"

_WAIT_S = 30.0
_IDLE_PAIRS = 32
_BEGIN_PAIRS = 3  # changed pairs in a row that begin a press
_END_PAIRS = 5  # idle pairs in a row that end it
_NOISES = 10.0  # a change is larger than this many times the noise,
_LEAST_PF = 0.003  # and than this
_EQUAL = 0.05  # a ratio nearer to 1 does not show which bump is the hard one
_BY_HAND = "left out: it needs a hand"

Pair = tuple[float, float]  # Capacitances of the hard and the soft bump, pF.


def check_pairs(board: BoardUnderTest) -> Iterator[Step]:
    """Read pairs as a measurement does."""
    # The first pair follows the setting of the CAPDACs.
    samples = list(islice(_samples(board, math.inf), _PAIRS + 1))
    if len(samples) < 2:
        yield Step.not_done("pairs a second", "the source ended")
        return
    yield _judge_rate(board, samples[0], samples[-1])
    yield _judge_losses(board)
    statuses = [sample.status for sample in samples]
    bad = len(samples) - statuses.count(Status.OK)
    yield Step.judged(
        "status of the pairs",
        f"{len(samples) - bad} of {len(samples)} OK",
        "all OK",
        *_causes(board, reduce(or_, statuses)),
        right=not bad,
        values={"not_ok": bad},
    )
    yield _judge_uncertainty(max(sample.t_uncertainty_us for sample in samples))


def _judge_rate(board: BoardUnderTest, first: Sample, last: Sample) -> Step:
    described = 1 / float(board.source.describe()["period_s"])
    rate = 1e9 * (last.seq - first.seq) / (last.t_hard_ns - first.t_hard_ns)
    return Step.judged(
        "pairs a second",
        f"{rate:.1f}",
        f"{described:.1f}, as described",
        f"{AGAIN}, and without a hub",
        right=abs(described / rate - 1) <= _RATE,
        values={"pairs_per_s": round(rate, 3), "described_per_s": round(described, 3)},
    )


def _judge_losses(board: BoardUnderTest) -> Step:
    of_driver = board.source.driver.counters
    of_chip = board.chip.counters
    lost = of_driver.lost + of_chip.lost
    errors = of_driver.errors + of_chip.errors
    measured = f"{of_driver.pairs} pairs read; lost: {lost}, failed accesses: {errors}"
    if of_driver.reconnects:
        measured += f", unplugged: {of_driver.reconnects} times"
        remedy = (
            "the board was unplugged and came back: keep cable and plug still; "
            f"if nobody pulled it, {_CABLE}"
        )
    elif errors:
        remedy = _CABLE
    else:
        remedy = f"no access failed: the computer was too busy: {AGAIN}"
    return Step.judged(
        "losses",
        measured,
        "none lost, none failed",
        remedy,
        right=not lost and not errors,
        values={
            "pairs": of_driver.pairs,
            "lost": lost,
            "errors": errors,
            "reconnects": of_driver.reconnects,
        },
    )


def _judge_uncertainty(most_us: int) -> Step:
    name = "uncertainty of the times"
    if most_us < 0:
        return Step.not_done(name, "unknown")
    return Step.judged(
        name,
        f"up to {most_us / 1000:.2f} ms between the two readings of a pair",
        f"up to {_MOST_US / 1000:g} ms",
        AGAIN,
        right=most_us <= _MOST_US,
        values={"t_uncertainty_us": most_us},
    )


def _causes(board: BoardUnderTest, status: int) -> list[str]:
    """Return why pairs are not OK. The inputs were right before: they are measured again."""
    causes = []
    if status & Status.LOST:
        causes.append("lost: see the losses")
    try:
        for channel in (HARD, SOFT):
            if status & _FAULTS[channel]:
                causes.append(_level_now(board, channel))
    except SourceError as error:
        causes.append(f"the inputs cannot be measured again: {error_line(error)}")
    return causes


def _level_now(board: BoardUnderTest, channel: int) -> str:
    pin = board.configuration.input(channel)
    excitation = board.configuration.channel(channel).excitation
    level = board.chip.level(pin, excitation, board.configuration)
    where = f"CIN{pin}+ and EXC{' and EXC'.join(excitation)}"
    if level.error:
        return (
            f"{where}: an excitation pin was shorted after the inputs were measured: "
            "look at the wire and the plug"
        )
    if level.capacitance.is_empty:
        return (
            f"{where}: a wire came off after the inputs were measured ({level} now): "
            "look at both wires"
        )
    return (
        f"{where}: the capacitance left the range ({level} now): keep the probe still in the air, "
        "and run this again"
    )


def check_replug(board: BoardUnderTest) -> Iterator[Step]:
    """Wait until the board was pulled and replugged; compare the fingerprint."""
    name = "pull and replug"
    if not board.is_kit:
        yield Step.not_done(name, "not on USB")
        return
    request = f"Pull the board's USB plug within {_WAIT_S:g} s, wait 2 s, plug it in again."
    if not (board.ask and board.ask(request)):
        yield Step.not_done(name, _BY_HAND)
        return
    gaps: list[Gap] = []
    gap_s = _gap_of_replug_s(board, gaps)
    if gap_s is None:
        yield Step.not_done(name, f"the board was not pulled within {_WAIT_S:g} s")
        return
    gains = board.chip.registers()[registers.CAP_GAIN :]
    marks = [gap.text for gap in gaps]
    remedy = "report this: a gap without a mark makes a false touch possible"
    if gains != board.gains:
        remedy = (
            "another board was plugged in, or its gains were read wrongly: "
            "run this again with one board"
        )
    yield Step.judged(
        name,
        f"back after {gap_s:.1f} s; fingerprint {gains.hex()}; "
        f"marked: {'; '.join(marks) or 'no gap'}",
        f"back, the same board ({board.gains.hex()}), the gap marked",
        remedy,
        right=gains == board.gains and bool(marks),
        values={"gap_s": round(gap_s, 3), "fingerprint": gains.hex(), "marks": len(marks)},
    )


def _gap_of_replug_s(board: BoardUnderTest, gaps: list[Gap]) -> float | None:
    """Return the time between the samples around a reconnection, s; None: there was none.

    The gaps that the driver reports are added to `gaps`.
    """
    counters = board.source.driver.counters
    reconnects = counters.reconnects
    for before, after in pairwise(_samples(board, _WAIT_S, gaps)):
        if counters.reconnects > reconnects:
            return (after.t_hard_ns - before.t_hard_ns) / 1e9
    return None


class _Press(NamedTuple):
    """Changes of both bumps from their idle values during a press; smallest change, pF."""

    changes: list[Pair]
    limit_pF: float

    @property
    def peaks(self) -> Pair:
        """Largest change of each bump."""
        hard, soft = zip(*self.changes, strict=True)
        return max(hard, key=abs), max(soft, key=abs)

    @property
    def ratio(self) -> float:
        """Ratio of the changes, by least squares."""
        products = 0.0
        squares = 0.0
        for hard, soft in self.changes:
            products += hard * soft
            squares += soft * soft
        return products / squares if squares else math.inf


def check_press(board: BoardUnderTest) -> Iterator[Step]:
    """Wait for a press; its ratio shows which bump is the hard one."""
    request = (
        "Hold the probe still in the air. Then press both bumps on something hard, as a table, "
        f"for 2 s; lift it. There are {_WAIT_S:g} s."
    )
    if not (board.ask and board.ask(request)):
        yield Step.not_done("press", _BY_HAND)
        return
    press = _wait_for_press(board)
    if press is None:
        yield Step.not_done("press", f"no press within {_WAIT_S:g} s: neither bump changed")
        return
    hard_pF, soft_pF = press.peaks
    ratio = press.ratio
    remedy = _doubt(board, press)
    yield Step.judged(
        "press",
        f"hard bump {hard_pF:+.4f} pF, soft bump {soft_pF:+.4f} pF, ratio {ratio:.2f}",
        "both change, the hard bump more: ratio above 1",
        remedy,
        right=not remedy,
        values={
            "hard_pF": round(hard_pF, 6),
            "soft_pF": round(soft_pF, 6),
            "ratio": round(ratio, 4),
        },
    )


def _wait_for_press(board: BoardUnderTest) -> _Press | None:
    """Return the next press, when it has ended; None: there was none in time."""
    samples = _samples(board, _WAIT_S)
    pairs = ((sample.hard, sample.soft) for sample in samples if sample.status == Status.OK)
    idle = list(islice(pairs, _IDLE_PAIRS))
    if len(idle) < _IDLE_PAIRS:
        return None
    hard_idle, soft_idle = zip(*idle, strict=True)
    noise_pF = max(_noise_pF(hard_idle), _noise_pF(soft_idle))
    limit_pF = max(_NOISES * noise_pF, _LEAST_PF)
    changes = _changes(pairs, (mean(hard_idle), mean(soft_idle)), limit_pF)
    return _Press(changes, limit_pF) if changes else None


def _noise_pF(values: Sequence[float]) -> float:
    return math.sqrt(mean((after - before) ** 2 for before, after in pairwise(values)) / 2)


def _changes(pairs: Iterator[Pair], idle: Pair, limit_pF: float) -> list[Pair]:
    """Return the changes from the idle values during one press."""
    changes: list[Pair] = []
    moved = 0
    quiet = 0
    for hard, soft in pairs:
        change = (hard - idle[HARD], soft - idle[SOFT])
        if max(map(abs, change)) > limit_pF:
            moved += 1
            quiet = 0
        else:
            moved = 0
            quiet += 1
        if changes or moved >= _BEGIN_PAIRS:
            changes.append(change)
        if len(changes) > _END_PAIRS and quiet >= _END_PAIRS:
            break
    return changes


def _doubt(board: BoardUnderTest, press: _Press) -> str:
    """Return what to do about a press that does not show the bumps as expected; empty: it does."""
    for channel, peak in enumerate(press.peaks):
        if abs(peak) <= press.limit_pF:
            pin = board.configuration.input(channel)
            return (
                "only one bump changes: press again with both; "
                f"if CIN{pin} does not change, check its wire"
            )
    ratio = press.ratio
    if ratio < 0:
        return "one bump rises and the other falls: check that both are on CIN+, and not on CIN-"
    if abs(ratio - 1) < _EQUAL:
        return (
            "the bumps change alike: press on something harder, to see which one is the hard bump"
        )
    if ratio > 1:
        return ""
    pin = board.configuration.input(SOFT)
    return (
        f"the inputs are swapped, the hard bump is on CIN{pin}: "
        f"add hard_input={pin} to SOURCE, or swap the wires of CIN1 and CIN2"
    )


def _samples(
    board: BoardUnderTest, most_s: float, gaps: list[Gap] | None = None
) -> Iterator[Sample]:
    """Yield the samples of the driver for this time; its gaps are added to `gaps`."""
    deadline = board.chip.clock.now_ns() + most_s * 1e9
    for item in board.source:
        if isinstance(item, Gap) and gaps is not None:
            gaps.append(item)
        if isinstance(item, np.ndarray):
            yield from samples_of(item)
        if board.chip.clock.now_ns() > deadline:
            return
