"""Steps that need no probe: registers, fingerprint, I2C clock, temperature, supply, conversion times."""

from collections.abc import Iterator
from dataclasses import replace

from palpate.ad7746 import datasheet
from palpate.ad7746.configuration import Channel
from palpate.kit.bench import Bench
from palpate.kit.step import Step, judged

_READS = 20
_FEW, _MANY = 1, 15  # registers in a read
_BUS_KHZ = (55, 450)
_TEMPERATURE_C = (10, 45)
_PACE = 0.06  # the chip's clock: 5 % in the data sheet, and the polling of RDY#
_POLL_S = 0.0015
_REPEATED = 5


def registers(bench: Bench) -> Iterator[Step]:
    """Read the registers after a reset, and the gains that were set in the factory."""
    bench.dump = bench.chip.reset()
    got, wanted = (dump[datasheet.CAP_SETUP : datasheet.CAP_GAIN] for dump in (bench.dump, datasheet.RESET_VALUES))
    yield judged(
        "registers 07 to 0E after a reset",
        got.hex(" "),
        wanted.hex(" "),
        right=got == wanted,
        do=["not an AD7746, or another program uses it: close that, unplug the board for a moment, run this again"],
    )
    yield judged(
        "fingerprint: CAP_GAIN and VOLT_GAIN",
        bench.gains.hex(),
        "set in the factory, neither 0000 nor ffff",
        right=not {bench.gains[:2], bench.gains[2:]} & {b"\0\0", b"\xff\xff"},
        do=["the gains are not those of a working AD7746: unplug the board for a moment, and run this again"],
        values={"fingerprint": bench.gains.hex()},
    )


def bus_clock(bench: Bench) -> Iterator[Step]:
    """Compare reads of 1 and of 15 registers: 14 bytes of 9 bits more."""
    few, many = (min(_read_ns(bench, count) for _ in range(_READS)) for count in (_FEW, _MANY))
    kHz = (_MANY - _FEW) * 9e6 / max(many - few, 1)
    yield judged(
        "I2C clock",
        f"{kHz:.0f} kHz; a read of one register takes {few / 1e6:.2f} ms",
        f"{_BUS_KHZ[0]} to {_BUS_KHZ[1]} kHz; about 85, 100 or 400 are usual",
        right=_BUS_KHZ[0] < kHz < _BUS_KHZ[1],
        do=["run this again without other programs; a slower bus gives fewer pairs a second"],
        values={"bus_kHz": round(kHz, 1), "read_ms": round(few / 1e6, 3)},
    )


def _read_ns(bench: Bench, count: int) -> int:
    begun = bench.chip.clock.now_ns()
    bench.chip.registers(count)
    return bench.chip.clock.now_ns() - begun


def voltages(bench: Bench) -> Iterator[Step]:
    """Measure the temperature and the supply of the chip."""
    found = datasheet.temperature_C(bench.chip.voltage(0))
    low, high = _TEMPERATURE_C
    yield judged(
        "temperature of the chip",
        f"{found:.1f} C",
        f"{low} to {high} C",
        right=low < found < high,
        do=["let the board come to room temperature; if it is there, the chip is damaged"],
        values={"temperature_C": round(found, 2)},
    )
    found = datasheet.supply_V(bench.chip.voltage(datasheet.VT_SUPPLY))
    low_V, high_V = datasheet.SUPPLY_V
    yield judged(
        "supply of the chip",
        f"{found:.2f} V",
        f"{low_V} to {high_V} V",
        right=low_V < found < high_V,
        do=["check the links of the supply, and use another USB port, without a hub"],
        values={"supply_V": round(found, 3)},
    )


def conversion_times(bench: Bench) -> Iterator[Step]:
    """Measure how long a conversion takes at each CAPF, by the pin RDY#."""
    found = []
    for capf in range(len(datasheet.CONVERSION_S)):
        base = replace(bench.configuration, capf=capf)
        trials = [bench.chip.capacitance(1, Channel(), base) for _ in range(_REPEATED)]
        found.append(min(trials, key=lambda trial: trial.uncertainty_s).seconds)  # a computer that stops is uncertain
    off = [abs(seconds - nominal) > _PACE * nominal + _POLL_S
           for seconds, nominal in zip(found, datasheet.CONVERSION_S, strict=True)]  # fmt: skip
    pace = found[-1] / datasheet.CONVERSION_S[-1]
    yield judged(
        "conversion times, CAPF 0 to 7",
        " ".join(f"{1e3 * seconds:.1f}" for seconds in found) + f" ms; the chip's clock: {100 * (pace - 1):+.1f} %",
        " ".join(f"{1e3 * seconds:.1f}" for seconds in datasheet.CONVERSION_S) + f" ms, within {100 * _PACE:.0f} %",
        right=not any(off),
        do=["run this again without other programs; if it stays, the chip's clock is outside its data sheet"],
        values={f"conversion_{capf}_ms": round(1e3 * seconds, 2) for capf, seconds in enumerate(found)},
    )
