"""Steps without the driver: registers, bus, supply, conversion times, inputs, noise."""

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from statistics import mean

from palpate.acceptance.board_under_test import EXCITATIONS, PINS, BoardUnderTest, InputLevel
from palpate.acceptance.report import Step, Verdict
from palpate.ad7746 import registers
from palpate.ad7746.configuration import HARD, SOFT, Channel
from palpate.ad7746.wiring import Wiring

_READS = 20
_FEW = 1  # registers in a short read
_MANY = 15  # registers in a long read
_BUS_KHZ = (55, 450)
_TEMPERATURE_C = (10, 45)
_PACE = 0.06  # the chip's clock: 5 % in the data sheet, and the polling of RDY#
_POLL_S = 0.0015
_REPEATED = 5
_STEP_PF = (0.13, 0.2)
_NOISE_READINGS = {0: 60, registers.MAINS_CAPF: 40}  # CAPF -> readings
_MOST_NOISE = 2.0  # relative to the data sheet
_LEAST_NOISE = 0.3
_FEWEST_CODES = 4
_NO_GAINS = ("0000", "ffff")
_NO_SIGNAL = "no signal: see the inputs"
_AT_END = "the sensor is at the end of the CAPDAC's range"
AGAIN = "run this again without other programs"
_REPLUG = "unplug the board for a moment, and run this again"
_STILL = "keep hands and cables still, the probe in the air, and run this again"


def check_registers(board: BoardUnderTest) -> Iterator[Step]:
    """Read the registers after a reset, and the gains that were set in the factory."""
    board.dump = board.chip.reset()
    settings = slice(registers.CAP_SETUP, registers.CAP_GAIN)
    found = board.dump[settings]
    expected = registers.RESET_VALUES[settings]
    yield Step.judged(
        "registers 07 to 0E after a reset",
        found.hex(" "),
        expected.hex(" "),
        "not an AD7746, or another program uses it: close that, unplug the board for a moment, "
        "run this again",
        right=found == expected,
    )
    gains = board.gains.hex()
    yield Step.judged(
        "fingerprint: CAP_GAIN and VOLT_GAIN",
        gains,
        "set in the factory, neither 0000 nor ffff",
        f"the gains are not those of a working AD7746: {_REPLUG}",
        right=gains[:4] not in _NO_GAINS and gains[4:] not in _NO_GAINS,
        values={"fingerprint": gains},
    )


def check_bus(board: BoardUnderTest) -> Iterator[Step]:
    """Compare reads of 1 and of 15 registers: 14 bytes of 9 bits more."""
    few_ns = _read_ns(board, _FEW)
    many_ns = _read_ns(board, _MANY)
    kHz = (_MANY - _FEW) * 9e6 / max(many_ns - few_ns, 1)
    read_ms = few_ns / 1e6
    low, high = _BUS_KHZ
    yield Step.judged(
        "I2C clock",
        f"{kHz:.0f} kHz; a read of one register takes {read_ms:.2f} ms",
        f"{low} to {high} kHz; about 85, 100 or 400 are usual",
        f"{AGAIN}; a slower bus gives fewer pairs a second",
        right=low < kHz < high,
        values={"bus_kHz": round(kHz, 1), "read_ms": round(read_ms, 3)},
    )


def _read_ns(board: BoardUnderTest, count: int) -> int:
    """Return the shortest time in which registers are read."""
    durations_ns = []
    for _ in range(_READS):
        begun = board.chip.clock.now_ns()
        board.chip.registers(count)
        durations_ns.append(board.chip.clock.now_ns() - begun)
    return min(durations_ns)


def check_voltages(board: BoardUnderTest) -> Iterator[Step]:
    """Measure the temperature and the supply of the chip."""
    temperature_C = registers.temperature_C(board.chip.voltage(registers.VT_TEMPERATURE))
    low, high = _TEMPERATURE_C
    yield Step.judged(
        "temperature of the chip",
        f"{temperature_C:.1f} C",
        f"{low} to {high} C",
        "let the board come to room temperature; if it is there, the chip is damaged",
        right=low < temperature_C < high,
        values={"temperature_C": round(temperature_C, 2)},
    )
    supply_V = registers.supply_V(board.chip.voltage(registers.VT_SUPPLY))
    low_V, high_V = registers.SUPPLY_V
    yield Step.judged(
        "supply of the chip",
        f"{supply_V:.2f} V",
        f"{low_V} to {high_V} V",
        "check the links of the supply, and use another USB port, without a hub",
        right=low_V < supply_V < high_V,
        values={"supply_V": round(supply_V, 3)},
    )


def check_times(board: BoardUnderTest) -> Iterator[Step]:
    """Measure how long a conversion takes at each CAPF, by the pin RDY#."""
    nominal_s = registers.CONVERSION_S
    found_s = []
    values = {}
    right = True
    for capf, expected_s in enumerate(nominal_s):
        base = replace(board.configuration, capf=capf)
        duration_s = board.chip.duration(base, _REPEATED)
        found_s.append(duration_s)
        values[f"conversion_{capf}_ms"] = round(1e3 * duration_s, 2)
        right = right and abs(duration_s - expected_s) <= _PACE * expected_s + _POLL_S
    clock = 100 * (found_s[-1] / nominal_s[-1] - 1)
    yield Step.judged(
        "conversion times, CAPF 0 to 7",
        f"{_milliseconds(found_s)} ms; the chip's clock: {clock:+.1f} %",
        f"{_milliseconds(nominal_s)} ms, within {100 * _PACE:.0f} %",
        f"{AGAIN}; if it stays, the chip's clock is outside its data sheet",
        right=right,
        values=values,
    )


def _milliseconds(durations_s: list[float] | tuple[float, ...]) -> str:
    return " ".join(f"{1e3 * seconds:.1f}" for seconds in durations_s)


def check_inputs(board: BoardUnderTest) -> Iterator[Step]:
    """Find which sensor is connected to which input and excitation."""
    board.scan()
    own = board.configuration
    board.mistakes = Wiring(board.measure_input, own, kit=board.is_kit).mistakes()
    wrong = board.cannot_measure
    measured = []
    values: dict[str, float | None] = {}
    for (pin, name), level in board.levels.items():
        measured.append(f"CIN{pin}/EXC{name} {level}")
        total_pF = None if math.isnan(level.pF) else round(level.total_pF, 4)
        values[f"cin{pin}_exc{name.lower()}_pF"] = total_pF
    for pin in PINS:  # of all that does not prevent a measurement, this is wrong
        wrong = wrong or board.answering(pin) == list(EXCITATIONS)
    yield Step(
        "inputs and excitations (above 4 pF: within 20 %)",
        Verdict.WRONG if wrong else Verdict.OK,
        ", ".join(measured),
        f"hard bump on CIN{own.input(HARD)} and EXC{own.hard.excitation}, "
        f"soft bump on CIN{own.input(SOFT)} and EXC{own.soft.excitation}",
        tuple(map(str, board.mistakes)),
        values,
    )


def check_capdac(board: BoardUnderTest) -> Iterator[Step]:
    """Measure the step of this chip's CAPDAC, which the data sheet gives to 20 %."""
    low_pF, high_pF = _STEP_PF
    for pin in PINS:
        name = f"CAPDAC step at CIN{pin}"
        level = board.level(pin)
        if level is None:
            yield Step.not_done(name, _NO_SIGNAL)
            continue
        excitation = board.excitation(pin)
        step_pF = board.chip.capdac_step(pin, excitation, level, board.configuration)
        if step_pF is None:
            yield Step.not_done(name, _AT_END)
            continue
        yield Step.judged(
            name,
            f"{step_pF:.4f} pF",
            f"{registers.DAC_STEP_PF} pF within 20 %",
            "keep the probe still and run this again; if it stays, the chip is outside its "
            "data sheet",
            right=low_pF < step_pF < high_pF,
            values={f"capdac_step_{pin}_pF": round(step_pF, 5)},
        )


def measure_noise(
    board: BoardUnderTest, pin: int, level: InputLevel, capf: int, count: int
) -> tuple[float, int]:
    """Measure the noise of an input from differences of readings, so without a slow drift.

    Returns
    -------
    (float, int)
        Noise, pF rms; number of different codes.
    """
    base = replace(board.configuration, capf=capf)
    channel = Channel(capdac=level.capdac, excitation=board.excitation(pin))
    codes = [board.chip.capacitance(pin, channel, base).raw for _ in range(count)]
    square = mean((after - before) ** 2 for before, after in pairwise(codes))
    return math.sqrt(square / 2) / registers.CODES_PER_PF, len(set(codes))


def check_noise(board: BoardUnderTest) -> Iterator[Step]:
    """Compare the noise of each input at rest with the data sheet, which is for open inputs."""
    for pin in PINS:
        level = board.level(pin)
        for capf in _NOISE_READINGS:
            if level is None:
                yield Step.not_done(_noise_step(pin, capf), _NO_SIGNAL)
            else:
                yield _judge_noise(board, pin, level, capf)


def _noise_step(pin: int, capf: int) -> str:
    return f"noise at CIN{pin}, CAPF {capf}"


def _judge_noise(board: BoardUnderTest, pin: int, level: InputLevel, capf: int) -> Step:
    rms_pF, codes = measure_noise(board, pin, level, capf, _NOISE_READINGS[capf])
    table_pF = registers.NOISE_PF[capf]
    constant = codes < _FEWEST_CODES or rms_pF < _LEAST_NOISE * table_pF
    measured = f"{1e6 * rms_pF:.1f} aF rms"
    remedy = f"{_STILL}; if it stays: shield and short cables, no mains adapter nearby"
    if constant:
        measured += ", almost constant"
        remedy = f"a reading without noise is not a measurement: {_REPLUG}"
    return Step.judged(
        _noise_step(pin, capf),
        measured,
        f"up to {1e6 * _MOST_NOISE * table_pF:.0f} aF, not constant "
        f"(data sheet, open inputs: {1e6 * table_pF:.1f} aF)",
        remedy,
        right=not constant and rms_pF <= _MOST_NOISE * table_pF,
        values={f"noise_{pin}_capf_{capf}_aF": round(1e6 * rms_pF, 2)},
    )
