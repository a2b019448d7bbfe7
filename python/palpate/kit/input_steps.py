"""Steps at the inputs: what is connected, the CAPDAC's step, the noise."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

from palpate.ad7746 import datasheet
from palpate.ad7746.configuration import HARD, SOFT
from palpate.ad7746.wiring import Wiring
from palpate.kit.bench import EXCITATIONS, Bench
from palpate.kit.chip import Level
from palpate.kit.step import OK, WRONG, Step, judged, left_out

PINS = (1, 2)
_STEP_PF = (0.13, 0.2)
_NOISE = {datasheet.MAINS_CAPF: 40, 0: 60}  # CAPF -> readings
_MOST_NOISE, _LEAST_NOISE = 2.0, 0.3  # relative to the data sheet
_FEWEST_CODES = 4
_NO_SIGNAL = "no signal: see the inputs"


class Noise(NamedTuple):
    """Noise of an input: rms from the differences of readings in succession, pF, and the number of different codes."""

    rms_pF: float
    codes: int


def scan(bench: Bench) -> None:
    """Measure each input with each excitation."""
    for pin in PINS:
        for name in EXCITATIONS:
            bench.levels[pin, name] = bench.chip.level(pin, name, bench.configuration)


def inputs(bench: Bench) -> Iterator[Step]:
    """Find what is connected to which input and excitation."""
    scan(bench)
    bench.mistakes = Wiring(bench.look, bench.configuration, kit=bench.is_kit).mistakes()
    both = any(all(bench.answers(pin, name) for name in EXCITATIONS) for pin in PINS)  # of what is wrong, this is seen
    hard, soft = bench.configuration.hard.excitation, bench.configuration.soft.excitation
    yield Step(
        "inputs and excitations (above 4 pF: within 20 %)",
        WRONG if bench.cannot_measure or both else OK,
        ", ".join(f"CIN{pin}/EXC{name} {level}" for (pin, name), level in bench.levels.items()),
        f"hard bump on CIN{bench.pin(HARD)} and EXC{hard}, soft bump on CIN{bench.pin(SOFT)} and EXC{soft}",
        tuple(map(str, bench.mistakes)),
        {f"cin{pin}_exc{name.lower()}_pF": None if math.isnan(level.pF) else round(level.total_pF, 4)
         for (pin, name), level in bench.levels.items()},
    )  # fmt: skip


def capdac(bench: Bench) -> Iterator[Step]:
    """Measure the step of this chip's CAPDAC, which the data sheet gives to 20 %."""
    for pin, level in _connected(bench):
        name = f"CAPDAC step at CIN{pin}"
        if level is None:
            yield left_out(name, _NO_SIGNAL)
            continue
        found = bench.chip.capdac_step(pin, bench.excitation(pin), level, bench.configuration)
        bench.steps_pF[pin] = found
        yield judged(
            name,
            f"{found:.4f} pF",
            f"{datasheet.DAC_STEP_PF} pF within 20 %",
            right=_STEP_PF[0] < found < _STEP_PF[1],
            do=["keep the probe still and run this again; if it stays, the chip is outside its data sheet"],
            values={f"capdac_step_{pin}_pF": round(found, 5)},
        )


def noise_of(bench: Bench, pin: int, level: Level, capf: int, count: int) -> Noise:
    """Measure the noise of an input; a slow drift does not count."""
    base = replace(bench.configuration, capf=capf)
    codes = [bench.convert(pin, level, base).code for _ in range(count)]
    squares = [(after - before) ** 2 for before, after in pairwise(codes)]
    return Noise(math.sqrt(sum(squares) / (2 * len(squares))) / datasheet.CODES_PER_PF, len(set(codes)))


def noise(bench: Bench) -> Iterator[Step]:
    """Compare the noise of each input at rest with the data sheet, which is for open inputs."""
    for pin, level in _connected(bench):
        for capf, count in sorted(_NOISE.items()):
            name = f"noise at CIN{pin}, CAPF {capf}"
            yield (
                left_out(name, _NO_SIGNAL)
                if level is None
                else _judged_noise(name, noise_of(bench, pin, level, capf, count), capf, f"noise_{pin}_capf_{capf}_aF")
            )


def _judged_noise(name: str, found: Noise, capf: int, key: str) -> Step:
    table = datasheet.NOISE_PF[capf]
    constant = found.codes < _FEWEST_CODES or found.rms_pF < _LEAST_NOISE * table
    still = "keep hands and cables still, the probe in the air, and run this again"
    return judged(
        name,
        f"{1e6 * found.rms_pF:.1f} aF rms" + (", almost constant" if constant else ""),
        f"up to {1e6 * _MOST_NOISE * table:.0f} aF, not constant (data sheet, open inputs: {1e6 * table:.1f} aF)",
        right=not constant and found.rms_pF <= _MOST_NOISE * table,
        do=["a reading without noise is not a measurement: unplug the board for a moment, and run this again"]
        if constant
        else [f"{still}; if it stays: shield and short cables, no mains adapter nearby"],
        values={key: round(1e6 * found.rms_pF, 2)},
    )


def _connected(bench: Bench) -> Iterable[tuple[int, Level | None]]:
    return [(pin, bench.level(pin)) for pin in PINS]
