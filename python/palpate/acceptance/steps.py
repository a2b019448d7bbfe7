"""What each step measures: the board without the driver, its inputs, pairs with the driver, and what needs a hand; all in order, whatever happens."""

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from functools import reduce
from itertools import islice, pairwise
from operator import or_
from statistics import mean
from typing import Protocol

import numpy as np

from palpate.acceptance.board_under_test import EXCITATIONS, PINS, Bench, InputLevel
from palpate.acceptance.report import OK, WRONG, Step, Value, judged, left_out, one_line
from palpate.ad7746 import registers as datasheet
from palpate.ad7746.configuration import HARD, SOFT, Channel
from palpate.ad7746.wiring import Wiring
from palpate.errors import DeviceNotFound, SourceError
from palpate.messages import unlike
from palpate.samples import Sample, Status, samples_of
from palpate.source_events import Gap

_READS = 20
_FEW, _MANY = 1, 15  # registers in a read
_BUS_KHZ = (55, 450)
_TEMPERATURE_C = (10, 45)
_PACE = 0.06  # the chip's clock: 5 % in the data sheet, and the polling of RDY#
_POLL_S = 0.0015
_REPEATED = 5
_STEP_PF = (0.13, 0.2)
_NOISE = {0: 60, datasheet.MAINS_CAPF: 40}  # CAPF -> readings
_MOST_NOISE, _LEAST_NOISE = 2.0, 0.3  # relative to the data sheet
_FEWEST_CODES = 4
_PAIRS = 60
_RATE = 0.05  # relative difference of the measured and the described period
_MOST_US = 2000
_OF_CHANNEL = (Status.HARD_SATURATED | Status.EXCITATION, Status.SOFT_SATURATED | Status.EXCITATION)
_AGAIN = "run this again without other programs"
_REPLUG = "unplug the board for a moment, and run this again"
_STILL = "keep hands and cables still, the probe in the air, and run this again"


def registers(bench: Bench) -> Iterator[Step]:
    """Read the registers after a reset, and the gains that were set in the factory."""
    bench.dump = bench.chip.reset()
    got, wanted = (
        dump[datasheet.CAP_SETUP : datasheet.CAP_GAIN]
        for dump in (bench.dump, datasheet.RESET_VALUES)
    )
    other = "not an AD7746, or another program uses it: close that, unplug the board for a moment, run this again"
    yield judged(
        "registers 07 to 0E after a reset",
        got.hex(" "),
        wanted.hex(" "),
        other,
        right=got == wanted,
    )
    gains, expected = bench.gains.hex(), "set in the factory, neither 0000 nor ffff"
    do = f"the gains are not those of a working AD7746: {_REPLUG}"
    right = not {gains[:4], gains[4:]} & {"0000", "ffff"}
    yield judged(
        "fingerprint: CAP_GAIN and VOLT_GAIN", gains, expected, do, right=right, fingerprint=gains
    )


def bus(bench: Bench) -> Iterator[Step]:
    """Compare reads of 1 and of 15 registers: 14 bytes of 9 bits more."""
    few, many = (min(_read_ns(bench, count) for _ in range(_READS)) for count in (_FEW, _MANY))
    kHz, (low, high) = (_MANY - _FEW) * 9e6 / max(many - few, 1), _BUS_KHZ
    measured = f"{kHz:.0f} kHz; a read of one register takes {few / 1e6:.2f} ms"
    expected = f"{low} to {high} kHz; about 85, 100 or 400 are usual"
    do = f"{_AGAIN}; a slower bus gives fewer pairs a second"
    values = {"bus_kHz": round(kHz, 1), "read_ms": round(few / 1e6, 3)}
    yield judged("I2C clock", measured, expected, do, right=low < kHz < high, **values)


def _read_ns(bench: Bench, count: int) -> int:
    begun = bench.chip.clock.now_ns()
    bench.chip.registers(count)
    return bench.chip.clock.now_ns() - begun


def voltages(bench: Bench) -> Iterator[Step]:
    """Measure the temperature and the supply of the chip."""
    found, (low, high) = (
        datasheet.temperature_C(bench.chip.voltage(datasheet.VT_TEMPERATURE)),
        _TEMPERATURE_C,
    )
    remedy = "let the board come to room temperature; if it is there, the chip is damaged"
    name, right = "temperature of the chip", low < found < high
    yield judged(
        name,
        f"{found:.1f} C",
        f"{low} to {high} C",
        remedy,
        right=right,
        temperature_C=round(found, 2),
    )
    found, (low_V, high_V) = (
        datasheet.supply_V(bench.chip.voltage(datasheet.VT_SUPPLY)),
        datasheet.SUPPLY_V,
    )
    remedy = "check the links of the supply, and use another USB port, without a hub"
    name, right = "supply of the chip", low_V < found < high_V
    yield judged(
        name,
        f"{found:.2f} V",
        f"{low_V} to {high_V} V",
        remedy,
        right=right,
        supply_V=round(found, 3),
    )


def times(bench: Bench) -> Iterator[Step]:
    """Measure how long a conversion takes at each CAPF, by the pin RDY#."""
    nominal, own = datasheet.CONVERSION_S, bench.configuration
    found = [
        bench.chip.duration(replace(own, capf=capf), _REPEATED) for capf in range(len(nominal))
    ]
    measured, expected = (
        " ".join(f"{1e3 * seconds:.1f}" for seconds in each) for each in (found, nominal)
    )
    measured += f" ms; the chip's clock: {100 * (found[-1] / nominal[-1] - 1):+.1f} %"
    expected += f" ms, within {100 * _PACE:.0f} %"
    do = f"{_AGAIN}; if it stays, the chip's clock is outside its data sheet"
    right = all(
        abs(took - should) <= _PACE * should + _POLL_S
        for took, should in zip(found, nominal, strict=True)
    )
    values = {
        f"conversion_{capf}_ms": round(1e3 * seconds, 2) for capf, seconds in enumerate(found)
    }
    yield judged("conversion times, CAPF 0 to 7", measured, expected, do, right=right, **values)


def inputs(bench: Bench) -> Iterator[Step]:
    """Find what is connected to which input and excitation."""
    bench.scan()
    own, levels = bench.configuration, bench.levels
    bench.mistakes = Wiring(bench.look, own, kit=bench.is_kit).mistakes()
    both = any(
        all(bench.answers(pin, name) for name in EXCITATIONS) for pin in PINS
    )  # of what is wrong, this is seen
    verdict = WRONG if bench.cannot_measure or both else OK
    measured = ", ".join(f"CIN{pin}/EXC{name} {level}" for (pin, name), level in levels.items())
    expected = f"hard bump on CIN{own.input(HARD)} and EXC{own.hard.excitation}, "
    expected += f"soft bump on CIN{own.input(SOFT)} and EXC{own.soft.excitation}"
    pF = {
        place: None if math.isnan(level.pF) else round(level.total_pF, 4)
        for place, level in levels.items()
    }
    values = {f"cin{pin}_exc{name.lower()}_pF": found for (pin, name), found in pF.items()}
    name, do = "inputs and excitations (above 4 pF: within 20 %)", tuple(map(str, bench.mistakes))
    yield Step(name, verdict, measured, expected, do, values)


def capdac(bench: Bench) -> Iterator[Step]:
    """Measure the step of this chip's CAPDAC, which the data sheet gives to 20 %."""
    for pin in PINS:
        name, level = f"CAPDAC step at CIN{pin}", bench.level(pin)
        if level is None:
            yield left_out(name, _NO_SIGNAL)
            continue
        found = bench.steps_pF[pin] = bench.chip.capdac_step(
            pin, bench.excitation(pin), level, bench.configuration
        )
        expected = f"{datasheet.DAC_STEP_PF} pF within 20 %"
        remedy = "keep the probe still and run this again; if it stays, the chip is outside its data sheet"
        right, values = (
            _STEP_PF[0] < found < _STEP_PF[1],
            {f"capdac_step_{pin}_pF": round(found, 5)},
        )
        yield judged(name, f"{found:.4f} pF", expected, remedy, right=right, **values)


_NO_SIGNAL = "no signal: see the inputs"


def noise_of(bench: Bench, pin: int, level: InputLevel, capf: int, count: int) -> tuple[float, int]:
    """Measure the noise of an input, pF rms, a slow drift does not count; and the number of different codes."""
    base = replace(bench.configuration, capf=capf)
    channel = Channel(capdac=level.capdac, excitation=bench.excitation(pin))
    codes = [bench.chip.capacitance(pin, channel, base).raw for _ in range(count)]
    squares = mean((after - before) ** 2 for before, after in pairwise(codes))
    return math.sqrt(squares / 2) / datasheet.CODES_PER_PF, len(set(codes))


def noise(bench: Bench) -> Iterator[Step]:
    """Compare the noise of each input at rest with the data sheet, which is for open inputs."""
    for pin in PINS:
        level = bench.level(pin)
        for capf, count in _NOISE.items():
            name = f"noise at CIN{pin}, CAPF {capf}"
            yield (
                _noise(bench, name, pin, level, capf, count)
                if level
                else left_out(name, _NO_SIGNAL)
            )


def _noise(bench: Bench, name: str, pin: int, level: InputLevel, capf: int, count: int) -> Step:
    rms_pF, codes = noise_of(bench, pin, level, capf, count)
    table = datasheet.NOISE_PF[capf]
    constant = codes < _FEWEST_CODES or rms_pF < _LEAST_NOISE * table
    measured = f"{1e6 * rms_pF:.1f} aF rms" + ", almost constant" * constant
    expected = f"up to {1e6 * _MOST_NOISE * table:.0f} aF, not constant (data sheet, open inputs: {1e6 * table:.1f} aF)"
    do = f"{_STILL}; if it stays: shield and short cables, no mains adapter nearby"
    if constant:
        do = f"a reading without noise is not a measurement: {_REPLUG}"
    right = not constant and rms_pF <= _MOST_NOISE * table
    values = {f"noise_{pin}_capf_{capf}_aF": round(1e6 * rms_pF, 2)}
    return judged(name, measured, expected, do, right=right, **values)


def pairs(bench: Bench) -> Iterator[Step]:
    """Read pairs as a measurement does."""
    found = list(islice(_for_a_while(bench, math.inf), _PAIRS + 1))  # it centres the CAPDACs first
    if len(found) < 2:
        yield left_out("pairs a second", "the source ended")
        return
    described = 1 / float(bench.source.describe()["period_s"])
    rate = 1e9 * (found[-1].seq - found[0].seq) / (found[-1].t_hard_ns - found[0].t_hard_ns)
    expected, do = f"{described:.1f}, as described", f"{_AGAIN}, and without a hub"
    right = abs(described / rate - 1) <= _RATE
    values = {"pairs_per_s": round(rate, 3), "described_per_s": round(described, 3)}
    yield judged("pairs a second", f"{rate:.1f}", expected, do, right=right, **values)
    yield _losses(bench)
    bad = sum(sample.status != Status.OK for sample in found)
    measured, causes = f"{len(found) - bad} of {len(found)} OK", _causes(bench, found)
    yield judged("status of the pairs", measured, "all OK", *causes, right=not bad, not_ok=bad)
    name, most_us = "uncertainty of the times", max(sample.t_uncertainty_us for sample in found)
    if most_us < 0:
        yield left_out(name, "unknown")
        return
    measured = f"up to {most_us / 1000:.2f} ms between the two readings of a pair"
    expected, right = f"up to {_MOST_US / 1000:g} ms", most_us <= _MOST_US
    yield judged(name, measured, expected, _AGAIN, right=right, t_uncertainty_us=most_us)


def _losses(bench: Bench) -> Step:
    counted, direct = bench.source.driver.counters, bench.chip.counters
    lost, errors = counted.lost + direct.lost, counted.errors + direct.errors
    unplugged = f", unplugged: {counted.reconnects} times" if counted.reconnects else ""
    do = "use another cable, or another USB port without a hub"
    if unplugged:
        do = f"the board was unplugged and came back: keep cable and plug still; if nobody pulled it, {do}"
    elif not errors:
        do = f"no access failed: the computer was too busy: {_AGAIN}"
    measured = f"{counted.pairs} pairs read; lost: {lost}, failed accesses: {errors}{unplugged}"
    values = {
        "pairs": counted.pairs,
        "lost": lost,
        "errors": errors,
        "reconnects": counted.reconnects,
    }
    return judged(
        "losses", measured, "none lost, none failed", do, right=not (lost or errors), **values
    )


def _causes(bench: Bench, found: list[Sample]) -> list[str]:
    """Return why pairs are not OK: the inputs are measured again, because they were right before."""
    status = reduce(or_, (sample.status for sample in found))
    do = ["lost: see the losses"] if status & Status.LOST else []
    try:
        do += [
            _level_now(bench, channel) for channel in (HARD, SOFT) if status & _OF_CHANNEL[channel]
        ]
    except SourceError as error:
        do.append(f"the inputs cannot be measured again: {one_line(error)}")
    return do


def _level_now(bench: Bench, channel: int) -> str:
    pin, name = bench.configuration.input(channel), bench.configuration.channel(channel).excitation
    level = bench.chip.level(pin, name, bench.configuration)
    where = f"CIN{pin}+ and EXC{' and EXC'.join(name)}"
    if level.error:
        return f"{where}: an excitation pin was shorted after the inputs were measured: look at the wire and the plug"
    if level.look.is_empty:
        return f"{where}: a wire came off after the inputs were measured ({level} now): look at both wires"
    return f"{where}: the capacitance left the range ({level} now): keep the probe still in the air, and run this again"


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
    name, driver = "pull and replug", bench.source.driver
    if not bench.is_kit:
        return left_out(name, "not on USB")
    if not prompts or not prompts.ready(
        f"Pull the board's USB plug within {_WAIT_S:g} s, wait 2 s, plug it in again."
    ):
        return left_out(name, _BY_HAND)
    reconnects, gaps = driver.counters.reconnects, list[Gap]()
    times = (
        (last.t_hard_ns, sample.t_hard_ns)
        for last, sample in pairwise(_for_a_while(bench, gaps=gaps))
    )
    gaps_ns = (after - before for before, after in times if driver.counters.reconnects > reconnects)
    if not (gap_s := next(gaps_ns, 0) / 1e9):
        return left_out(name, f"the board was not pulled within {_WAIT_S:g} s")
    again, marks = (
        bench.chip.registers()[datasheet.CAP_GAIN :],
        [gap.text for gap in gaps],
    )
    measured = f"back after {gap_s:.1f} s; fingerprint {again.hex()}; marked: {'; '.join(marks) or 'no gap'}"
    expected = f"back, the same board ({bench.gains.hex()}), the gap marked"
    do = "report this: a gap without a mark makes a false touch possible"
    if again != bench.gains:
        do = "another board was plugged in, or its gains were read wrongly: run this again with one board"
    values: dict[str, Value] = {
        "gap_s": round(gap_s, 3),
        "fingerprint": again.hex(),
        "marks": len(marks),
    }
    return judged(
        name, measured, expected, do, right=again == bench.gains and bool(marks), **values
    )


def press(bench: Bench, prompts: Prompts | None) -> Step:
    """Wait for a press; tell from its ratio which bump is the hard one."""
    text = "Hold the probe still in the air. Then press both bumps on something hard, as a table, for 2 s; lift it."
    if not prompts or not prompts.ready(f"{text} There are {_WAIT_S:g} s."):
        return left_out("press", _BY_HAND)
    pairs = (
        (sample.hard, sample.soft) for sample in _for_a_while(bench) if sample.status == Status.OK
    )
    idle = list(islice(pairs, _IDLE))
    changes, limit = _pressed(idle, pairs) if len(idle) == _IDLE else ([], 0.0)
    if not changes:
        return left_out("press", f"no press within {_WAIT_S:g} s: neither bump changed")
    peaks = [max(column, key=abs) for column in zip(*changes, strict=True)]
    squares = sum(soft * soft for _, soft in changes)
    ratio = sum(hard * soft for hard, soft in changes) / squares if squares else math.inf
    do = _doubt(bench, limit, peaks, ratio)
    measured = (
        f"hard bump {peaks[HARD]:+.4f} pF, soft bump {peaks[SOFT]:+.4f} pF, ratio {ratio:.2f}"
    )
    values = {
        "hard_pF": round(peaks[HARD], 6),
        "soft_pF": round(peaks[SOFT], 6),
        "ratio": round(ratio, 4),
    }
    return judged(
        "press",
        measured,
        "both change, the hard bump more: ratio above 1",
        do,
        right=not do,
        **values,
    )


def _pressed(
    idle: Sequence[tuple[float, float]], pairs: Iterator[tuple[float, float]]
) -> tuple[list[tuple[float, float]], float]:
    """Return the changes from the idle values until a press has ended, and what counts as a change, pF."""
    columns = list(zip(*idle, strict=True))
    noise = max(
        math.sqrt(mean((b - a) ** 2 for a, b in pairwise(column)) / 2) for column in columns
    )
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
        return (
            "the bumps change alike: press on something harder, to see which one is the hard bump"
        )
    pin = bench.configuration.input(SOFT)
    swapped = f"add hard_input={pin} to SOURCE, or swap the wires of CIN1 and CIN2"
    return "" if ratio > 1 else f"the inputs are swapped, the hard bump is on CIN{pin}: {swapped}"


def capacitor(bench: Bench, prompts: Prompts | None) -> Step:
    """Compare a capacitor of known value with the change that it makes at the hard bump's input."""
    name, pin = "known capacitor", bench.configuration.input(HARD)
    low, high = _CAPACITOR_PF
    value = (
        prompts.value(f"Value of a known capacitor, {low:g} to {high:g} pF") if prompts else None
    )
    if prompts is None or value is None:
        return left_out(name, _BY_HAND)
    if not low <= value <= high:
        return left_out(name, f"got {value:g} pF, allowed: {low:g} to {high:g} pF")
    before = _now(bench, pin)
    where = f"CIN{pin}+ and EXC{bench.excitation(pin)}"
    if not prompts.ready(f"Connect the capacitor between {where}, beside the probe; hands away."):
        return left_out(name, _BY_HAND)
    found = _now(bench, pin) - before
    measured = f"{found:.3f} pF more; gain {found / value:.3f}"
    expected = f"{value:g} pF within {100 * _GAIN:.0f} % and the capacitor's own tolerance"
    do = f"check the value and the contacts at {where}; short wires: 1 cm of cable is about 1 pF"
    values = {"capacitor_pF": value, "measured_pF": None if math.isnan(found) else round(found, 4)}
    return judged(name, measured, expected, do, right=abs(found / value - 1) <= _GAIN, **values)


def _now(bench: Bench, pin: int) -> float:
    """Return the capacitance of an input now, pF, by this chip's own CAPDAC step."""
    found = bench.chip.level(pin, bench.excitation(pin), bench.configuration)
    return found.capdac * bench.steps_pF.get(pin, datasheet.DAC_STEP_PF) + found.pF


def _for_a_while(
    bench: Bench, most_s: float = _WAIT_S, gaps: list[Gap] | None = None
) -> Iterator[Sample]:
    """Yield the samples; add the gaps to a list. No step needs a baseline."""
    deadline = bench.chip.clock.now_ns() + most_s * 1e9
    for item in bench.source:
        if isinstance(item, Gap) and gaps is not None:
            gaps.append(item)
        if not isinstance(item, np.ndarray):
            continue
        yield from samples_of(item)
        if bench.chip.clock.now_ns() > deadline:
            return


_ACTS: dict[str, Callable[[Bench], Iterator[Step]]] = {
    act.__name__: act for act in (registers, bus, voltages, times, inputs, capdac, noise, pairs)
}
_PROMPTED = {act.__name__: act for act in (replug, press, capacitor)}
_NEED_INPUTS = ("capdac", "noise", "press", "capacitor")
_BY_DRIVER = ("pairs", "replug", "press")
_FIRST = "registers"
_CHECK = "check link LK2 and the supply of the board, then the cable; unplug the board for a moment"
NAMES = (*_ACTS, *_PROMPTED)  # Names of the steps, in order.


class Acceptance:
    """Measures a board step by step: iterate over it. Without `prompts` the steps that need a hand are left out."""

    def __init__(
        self, bench: Bench, prompts: Prompts | None = None, *, skip: Collection[str] = ()
    ) -> None:
        if unknown := set(skip) - set(NAMES):
            raise ValueError(f"skip: {unlike(min(unknown), NAMES)}")
        self.stopped: str = ""
        self._bench, self._prompts, self._skip = bench, prompts, skip
        self._done: set[str] = set()

    def __iter__(self) -> Iterator[Step]:
        """Do the steps."""
        for name in NAMES:
            if why := self._left_out(name):
                yield left_out(name, why)
                continue
            try:
                if name in _ACTS:
                    yield from _ACTS[name](self._bench)
                else:
                    yield _PROMPTED[name](self._bench, self._prompts)
                self._done.add(name)
            except SourceError as error:
                gone = isinstance(error, DeviceNotFound)  # the error says what to do
                check = _CHECK if name == _FIRST else f"the chip stopped answering: {_CHECK}"
                yield Step(name, WRONG, one_line(error), "", () if gone else (check,))
                if gone or name == _FIRST:
                    self.stopped = one_line(error)

    def _left_out(self, name: str) -> str:
        if name in self._skip:
            return "left out"
        if self.stopped:
            return "the board cannot be used any more"
        if self._bench.cannot_measure and name in _BY_DRIVER:
            return "needs right inputs"
        return (
            "needs the step inputs" if name in _NEED_INPUTS and "inputs" not in self._done else ""
        )
