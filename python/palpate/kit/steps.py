"""What each step measures that needs no hand: the board without the driver, the inputs, and pairs with the driver."""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import reduce
from itertools import islice, pairwise
from operator import or_

from palpate.ad7746 import datasheet
from palpate.ad7746.configuration import HARD, SOFT, Channel
from palpate.ad7746.wiring import Wiring
from palpate.errors import SourceError
from palpate.kit.bench import EXCITATIONS, PINS, Bench
from palpate.kit.chip import InputLevel
from palpate.kit.step import OK, WRONG, Step, judged, left_out, one_line
from palpate.samples import Sample, Status

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


def registers(bench: Bench) -> Iterator[Step]:
    """Read the registers after a reset, and the gains that were set in the factory."""
    bench.dump = bench.chip.reset()
    got, wanted = (dump[datasheet.CAP_SETUP : datasheet.CAP_GAIN] for dump in (bench.dump, datasheet.RESET_VALUES))
    other = "not an AD7746, or another program uses it: close that, unplug the board for a moment, run this again"
    yield judged("registers 07 to 0E after a reset", got.hex(" "), wanted.hex(" "), other, right=got == wanted)
    yield judged(
        "fingerprint: CAP_GAIN and VOLT_GAIN",
        bench.gains.hex(),
        "set in the factory, neither 0000 nor ffff",
        f"the gains are not those of a working AD7746: {_REPLUG}",
        right=not {bench.gains[:2], bench.gains[2:]} & {b"\0\0", b"\xff\xff"},
        fingerprint=bench.gains.hex(),
    )


def bus(bench: Bench) -> Iterator[Step]:
    """Compare reads of 1 and of 15 registers: 14 bytes of 9 bits more."""
    few, many = (min(_read_ns(bench, count) for _ in range(_READS)) for count in (_FEW, _MANY))
    kHz = (_MANY - _FEW) * 9e6 / max(many - few, 1)
    yield judged(
        "I2C clock",
        f"{kHz:.0f} kHz; a read of one register takes {few / 1e6:.2f} ms",
        f"{_BUS_KHZ[0]} to {_BUS_KHZ[1]} kHz; about 85, 100 or 400 are usual",
        f"{_AGAIN}; a slower bus gives fewer pairs a second",
        right=_BUS_KHZ[0] < kHz < _BUS_KHZ[1],
        bus_kHz=round(kHz, 1),
        read_ms=round(few / 1e6, 3),
    )


def _read_ns(bench: Bench, count: int) -> int:
    begun = bench.chip.clock.now_ns()
    bench.chip.registers(count)
    return bench.chip.clock.now_ns() - begun


def voltages(bench: Bench) -> Iterator[Step]:
    """Measure the temperature and the supply of the chip."""
    found, (low, high) = datasheet.temperature_C(bench.chip.voltage(datasheet.VT_TEMPERATURE)), _TEMPERATURE_C
    remedy = "let the board come to room temperature; if it is there, the chip is damaged"
    name, right = "temperature of the chip", low < found < high
    yield judged(name, f"{found:.1f} C", f"{low} to {high} C", remedy, right=right, temperature_C=round(found, 2))
    found, (low_V, high_V) = datasheet.supply_V(bench.chip.voltage(datasheet.VT_SUPPLY)), datasheet.SUPPLY_V
    remedy = "check the links of the supply, and use another USB port, without a hub"
    name, right = "supply of the chip", low_V < found < high_V
    yield judged(name, f"{found:.2f} V", f"{low_V} to {high_V} V", remedy, right=right, supply_V=round(found, 3))


def times(bench: Bench) -> Iterator[Step]:
    """Measure how long a conversion takes at each CAPF, by the pin RDY#."""
    found = []
    for capf in range(len(datasheet.CONVERSION_S)):
        base = replace(bench.configuration, capf=capf)
        trials = [bench.chip.capacitance(1, Channel(), base) for _ in range(_REPEATED)]
        found.append(min(trials, key=lambda trial: trial.uncertainty_s).seconds)  # a computer that stops is uncertain
    pace = found[-1] / datasheet.CONVERSION_S[-1]
    yield judged(
        "conversion times, CAPF 0 to 7",
        " ".join(f"{1e3 * seconds:.1f}" for seconds in found) + f" ms; the chip's clock: {100 * (pace - 1):+.1f} %",
        " ".join(f"{1e3 * seconds:.1f}" for seconds in datasheet.CONVERSION_S) + f" ms, within {100 * _PACE:.0f} %",
        f"{_AGAIN}; if it stays, the chip's clock is outside its data sheet",
        right=all(abs(seconds - nominal) <= _PACE * nominal + _POLL_S
                  for seconds, nominal in zip(found, datasheet.CONVERSION_S, strict=True)),
        **{f"conversion_{capf}_ms": round(1e3 * seconds, 2) for capf, seconds in enumerate(found)},
    )  # fmt: skip


def inputs(bench: Bench) -> Iterator[Step]:
    """Find what is connected to which input and excitation."""
    bench.scan()
    bench.mistakes = Wiring(bench.look, bench.configuration, kit=bench.is_kit).mistakes()
    both = any(all(bench.answers(pin, name) for name in EXCITATIONS) for pin in PINS)  # of what is wrong, this is seen
    own = bench.configuration
    yield Step(
        "inputs and excitations (above 4 pF: within 20 %)",
        WRONG if bench.cannot_measure or both else OK,
        ", ".join(f"CIN{pin}/EXC{name} {level}" for (pin, name), level in bench.levels.items()),
        f"hard bump on CIN{own.input(HARD)} and EXC{own.hard.excitation}, "
        f"soft bump on CIN{own.input(SOFT)} and EXC{own.soft.excitation}",
        tuple(map(str, bench.mistakes)),
        {f"cin{pin}_exc{name.lower()}_pF": None if math.isnan(level.pF) else round(level.total_pF, 4)
         for (pin, name), level in bench.levels.items()},
    )  # fmt: skip


def capdac(bench: Bench) -> Iterator[Step]:
    """Measure the step of this chip's CAPDAC, which the data sheet gives to 20 %."""
    for pin, level in _levels(bench):
        name = f"CAPDAC step at CIN{pin}"
        if level is None:
            yield _no_signal(name)
            continue
        found = bench.steps_pF[pin] = bench.chip.capdac_step(pin, bench.excitation(pin), level, bench.configuration)
        expected = f"{datasheet.DAC_STEP_PF} pF within 20 %"
        remedy = "keep the probe still and run this again; if it stays, the chip is outside its data sheet"
        right, values = _STEP_PF[0] < found < _STEP_PF[1], {f"capdac_step_{pin}_pF": round(found, 5)}
        yield judged(name, f"{found:.4f} pF", expected, remedy, right=right, **values)


def noise_of(bench: Bench, pin: int, level: InputLevel, capf: int, count: int) -> tuple[float, int]:
    """Measure the noise of an input, pF rms, a slow drift does not count; and the number of different codes."""
    base = replace(bench.configuration, capf=capf)
    channel = Channel(capdac=level.capdac, excitation=bench.excitation(pin))
    codes = [bench.chip.capacitance(pin, channel, base).code for _ in range(count)]
    squares = [(after - before) ** 2 for before, after in pairwise(codes)]
    return math.sqrt(sum(squares) / (2 * len(squares))) / datasheet.CODES_PER_PF, len(set(codes))


def noise(bench: Bench) -> Iterator[Step]:
    """Compare the noise of each input at rest with the data sheet, which is for open inputs."""
    for pin, level in _levels(bench):
        for capf, count in _NOISE.items():
            name = f"noise at CIN{pin}, CAPF {capf}"
            if level is None:
                yield _no_signal(name)
                continue
            rms_pF, codes = noise_of(bench, pin, level, capf, count)
            most, table = _MOST_NOISE * datasheet.NOISE_PF[capf], datasheet.NOISE_PF[capf]
            constant = codes < _FEWEST_CODES or rms_pF < _LEAST_NOISE * table
            still = "keep hands and cables still, the probe in the air, and run this again"
            yield judged(
                name,
                f"{1e6 * rms_pF:.1f} aF rms" + (", almost constant" if constant else ""),
                f"up to {1e6 * most:.0f} aF, not constant (data sheet, open inputs: {1e6 * table:.1f} aF)",
                f"a reading without noise is not a measurement: {_REPLUG}"
                if constant
                else f"{still}; if it stays: shield and short cables, no mains adapter nearby",
                right=not constant and rms_pF <= most,
                **{f"noise_{pin}_capf_{capf}_aF": round(1e6 * rms_pF, 2)},
            )


def _levels(bench: Bench) -> list[tuple[int, InputLevel | None]]:
    return [(pin, bench.level(pin)) for pin in PINS]


def _no_signal(name: str) -> Step:
    return left_out(name, "no signal: see the inputs")


def pairs(bench: Bench) -> Iterator[Step]:
    """Read pairs as a measurement does."""
    found = list(islice(bench.source, _PAIRS + 1))  # it centres the CAPDACs first
    if len(found) < 2:
        yield left_out("pairs a second", "the source ended")
        return
    described = float(bench.source.describe()["period_s"])
    period = (found[-1].t_hard_ns - found[0].t_hard_ns) / 1e9 / (found[-1].seq - found[0].seq)
    yield judged(
        "pairs a second",
        f"{1 / period:.1f}",
        f"{1 / described:.1f}, as described",
        f"{_AGAIN}, and without a hub",
        right=abs(period / described - 1) <= _RATE,
        pairs_per_s=round(1 / period, 3),
        described_per_s=round(1 / described, 3),
    )
    yield _losses(bench)
    bad = sum(sample.status != Status.OK for sample in found)
    measured, causes = f"{len(found) - bad} of {len(found)} OK", _causes(bench, found)
    yield judged("status of the pairs", measured, "all OK", *causes, right=not bad, not_ok=bad)
    most_us = max(sample.t_uncertainty_us for sample in found)
    name = "uncertainty of the times"
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
    return judged(
        "losses",
        f"{counted.pairs} pairs read; lost: {lost}, failed accesses: {errors}{unplugged}",
        "none lost, none failed",
        do,
        right=not (lost or errors),
        pairs=counted.pairs,
        lost=lost,
        errors=errors,
        reconnects=counted.reconnects,
    )


def _causes(bench: Bench, found: list[Sample]) -> list[str]:
    """Return why pairs are not OK: the inputs are measured again, because they were right before."""
    status = reduce(or_, (sample.status for sample in found))
    do = ["lost: see the losses"] if status & Status.LOST else []
    try:
        do += [_level_now(bench, channel) for channel in (HARD, SOFT) if status & _OF_CHANNEL[channel]]
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
