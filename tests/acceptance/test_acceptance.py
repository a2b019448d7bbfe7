"""Acceptance over simulated boards: a right one passes, each mistake is named, a fault leaves steps and no exception; its report."""

import json
import math
from collections.abc import Callable, Collection
from dataclasses import replace
from random import Random

import pytest
from effort import NIGHTLY, Tally, draws, random_of
from kit_bench import IDLE_PF, Bus
from palpate.acceptance.board_under_test import BoardUnderTest, open_board
from palpate.acceptance.report import (
    AcceptanceReport,
    Step,
    Verdict,
    count_verdicts,
    utc_now,
    versions,
    without_path,
)
from palpate.acceptance.steps import NAMES, Acceptance
from palpate.ad7746.bus import VirtualClock
from palpate.ad7746.simulator.chip import WIRINGS, SimulatedChip
from palpate.ad7746.simulator.evalboard import Fault, FaultKind, SimulatedBoard
from palpate.ad7746.simulator.usb_backend import SimulatedUsb

DEPTH_PF = (0.9, 0.3)
_PRESS_S = 2.0


class Board:
    """A simulated board with a probe, other than the data sheet's by the tolerances, drawn by the seed."""

    def __init__(self, wiring: str = "guide", seed: int = 0) -> None:
        random = Random(f"{wiring} {seed}")
        self.clock = VirtualClock()
        self.press_s = math.inf
        self.idle_pF = [pF * random.uniform(0.5, 1.5) for pF in IDLE_PF]
        steps_pF = (0.164 * random.uniform(0.8, 1.2), 0.164 * random.uniform(0.8, 1.2))
        chip = SimulatedChip(self._pF, seed=seed, dac_step_pF=steps_pF, wiring=WIRINGS[wiring])
        chip.pace = random.uniform(0.95, 1.05)
        self.kit = SimulatedBoard(chip, self.clock, bus_kHz=random.uniform(60, 400))
        self.backend = SimulatedUsb(self.clock)
        self.port = self.backend.plug(self.kit)

    def _pF(self, bump: int, begin_s: float, end_s: float) -> float:
        share = ((begin_s + end_s) / 2 - self.press_s) / _PRESS_S
        pressed = math.sin(math.pi * share) if 0 < share < 1 else 0.0
        return self.idle_pF[bump - 1] + DEPTH_PF[bump - 1] * pressed

    def open(self, options: str = "") -> BoardUnderTest:
        """Open it, by `usb:` with these options."""
        return open_board(f"usb:{options}", {"backend": self.backend, "clock": self.clock})

    def accept(
        self,
        options: str = "",
        *,
        by_hand: bool = False,
        replaced: bool = False,
        only: Collection[str] = NAMES,
    ) -> list[Step]:
        """Do steps; `by_hand`: those that are asked for, too; `replaced`: by another board, when it is pulled."""
        bench = self.open(options)
        try:
            person = Person(self, replaced=replaced) if by_hand else None
            return list(Acceptance(bench, person, skip=set(NAMES) - set(only)))
        finally:
            bench.source.close()


class Person:
    """The person at the board: pulls the plug, and presses."""

    def __init__(self, board: Board, *, replaced: bool = False) -> None:
        self._replaced = replaced
        self._board = board

    def __call__(self, text: str) -> bool:
        """Do what is asked for."""
        if "USB plug" in text:
            self._pull()
        else:
            assert "press" in text
            self._board.press_s = self._board.clock.now_ns() / 1e9 + 4
        return True

    def _pull(self) -> None:
        if self._replaced:
            self._board.kit.chip.factory = b"\1\2\3\4"
        self._board.kit.faults.append(Fault(FaultKind.UNPLUG, 2.0, skip=200))


def not_done(steps: list[Step]) -> list[str]:
    """Return the names of the steps that were not done."""
    return [step.name for step in steps if step.verdict == Verdict.NOT_DONE]


def said(steps: list[Step]) -> str:
    """Return all that the wrong steps say, with their names."""
    return "\n".join(
        line for step in steps if step.verdict == Verdict.WRONG for line in step.lines()
    )


SEEDS = range(100 if NIGHTLY else 5)
FEWER = range(100 if NIGHTLY else 1)

# Wiring, options of the source, and words of the message about it. tests/sources/test_wiring.py has every mistake.
MISTAKES = [
    ("hard-exca", "", ["hard bump: CIN1+", "use excitation=A,B "]),
    ("demo", "", ["soft bump: CIN2+", "length sensor, connected until R1 and R2 are removed"]),
    (
        "hard-minus",
        "?differential=yes",
        ["inputs and excitations", "exchange its wires at CIN1+ and CIN1-"],
    ),
    ("swapped", "", ["the inputs are swapped, the hard bump is on CIN2", "hard_input=2"]),
    ("exca", "?excitation=A", []),
]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_right_board_passes(seed: int, tally: Tally) -> None:
    steps = Board(seed=seed).accept(by_hand=True)
    tally.count("boards accepted")
    assert said(steps) == ""
    assert not_done(steps) == []


@pytest.mark.parametrize("seed", FEWER)
@pytest.mark.parametrize(
    ("wiring", "options", "words"), MISTAKES, ids=[f"{w}{o}" for w, o, _ in MISTAKES]
)
def test_mistakes_of_the_wiring(
    wiring: str, options: str, words: list[str], seed: int, tally: Tally
) -> None:
    only = ("registers", "inputs", "press") if seed else NAMES  # the rest takes most of the time
    steps = Board(wiring, seed).accept(options, by_hand=True, only=only)
    tally.count("boards with a mistake")
    assert bool(said(steps)) == bool(words)
    for word in words:
        assert word in said(steps), said(steps)


def test_another_board_at_the_same_port_is_noticed() -> None:
    assert "another board was plugged in" in said(Board().accept(by_hand=True, replaced=True))


@pytest.mark.parametrize(
    ("kind", "amount", "name", "words"),
    [
        (FaultKind.CHIP_ABSENT, 1, "registers", ["not acknowledged", "link LK2"]),
        (FaultKind.RDY_STUCK_HIGH, 1, "voltages", ["RDY#", "stuck high"]),
        (FaultKind.RDY_STUCK_LOW, 1, "voltages", ["RDY#", "stuck low"]),
        (FaultKind.LOST_CONVERSION, 1e9, "voltages", ["did not end"]),
        (FaultKind.UNPLUG, math.inf, "registers", ["unplugged"]),
        (FaultKind.LOCK, 1, "registers", []),
    ],
)
def test_a_board_that_fails_is_named(
    kind: FaultKind, amount: float, name: str, words: list[str]
) -> None:
    board = Board()
    bench = board.open()
    board.kit.faults.append(Fault(kind, amount))
    steps = list(Acceptance(bench))
    assert f"!!  {name}: " in said(steps)
    for word in words:
        assert word in said(steps)


@pytest.mark.parametrize(
    ("fault", "lost", "errors"),
    [
        (Fault(FaultKind.LOST_CONVERSION, skip=100), 1, 0),
        (Fault(FaultKind.STALL, skip=100, times=2), 0, 2),
    ],
    ids=["a lost conversion", "two failed accesses"],
)
def test_what_fails_before_the_driver_reads_is_counted_once(
    fault: Fault, lost: int, errors: int
) -> None:
    board = Board()
    bench = board.open()
    board.kit.faults.append(replace(fault))
    steps = {step.name: step for step in Acceptance(bench, skip=["noise"])}
    losses = steps["losses"]
    assert (losses.values["lost"], losses.values["errors"]) == (lost, errors)
    assert losses.verdict == Verdict.WRONG
    found = [Verdict.OK, Verdict.WRONG, Verdict.OK, Verdict.NOT_DONE]
    counted = count_verdicts(Step("any", verdict, "") for verdict in found)
    assert counted == "2 ok, 1 wrong, 1 not done"


def slow(chip: SimulatedChip) -> None:
    chip.pace = 1.15


@pytest.mark.parametrize("idle_pF", [15.0, 20.0, 22.0, 24.0])
def test_the_step_of_the_capdac_is_measured_with_a_large_sensor(idle_pF: float) -> None:
    """Near the end of the range, where settings that are far apart give saturated codes."""
    board = Board()
    board.kit.chip.dac_step_pF = (0.164, 0.164)
    board.idle_pF = [idle_pF, idle_pF]
    steps = {step.name: step for step in board.accept(only=["inputs", "capdac"])}
    for pin in (1, 2):
        step = steps[f"CAPDAC step at CIN{pin}"]
        assert step.verdict == Verdict.OK, step.lines()
        assert step.values[f"capdac_step_{pin}_pF"] == pytest.approx(0.164, rel=0.01)


def test_a_sensor_above_the_range_is_no_chip_outside_its_data_sheet() -> None:
    board = Board()
    board.kit.chip.dac_step_pF = (0.164, 0.164)
    board.idle_pF = [25.0, 25.0]
    steps = board.accept(only=["inputs", "capdac"])
    assert "a sensor above the range, some 25 pF, needs a capacitor in series" in said(steps)
    assert "outside its data sheet" not in said(steps)


def without_supply(chip: SimulatedChip) -> None:
    chip.supply_V = 2.2


def hot(chip: SimulatedChip) -> None:
    chip.temperature_C = 80.0


def silent(chip: SimulatedChip) -> None:
    chip.noisy = False


def with_large_steps(chip: SimulatedChip) -> None:
    chip.dac_step_pF = (0.22, 0.22)


def beside_mains(chip: SimulatedChip) -> None:
    chip.disturbance = _mains()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (slow, ["conversion times", "+15"]),
        (without_supply, ["supply of the chip: 2.20 V"]),
        (hot, ["temperature of the chip: 80.0 C"]),
        (silent, ["almost constant", "not a measurement"]),
        (with_large_steps, ["CAPDAC step at CIN1: 0.22"]),
        (beside_mains, ["noise at CIN1, CAPF 0", "shield"]),
    ],
)
def test_a_board_outside_its_data_sheet_is_named(
    change: Callable[[SimulatedChip], None], words: list[str]
) -> None:
    board = Board()
    change(board.kit.chip)
    steps = board.accept()
    for word in words:
        assert word in said(steps), said(steps)


def _mains() -> Callable[[], float]:
    random = Random(1)
    return lambda: random.gauss(0.0, 300e-6)


@pytest.mark.parametrize("number", range(draws(25, 1000, at_least=5)))
def test_a_fault_in_the_middle_leaves_steps(number: int, tally: Tally) -> None:
    random = random_of(f"kit faults {number}")
    board = Board(seed=number)
    bench = board.open()
    board.kit.faults.append(_fault(random))
    steps = list(Acceptance(bench))
    tally.count("acceptances with a fault")
    assert len(steps) >= len(NAMES)
    last = [step.name for step in steps][-2:]
    assert last == ["pull and replug", "press"] or not_done(steps)
    assert all(step.measured.isprintable() for step in steps)


def _fault(random: Random) -> Fault:
    kind = random.choice(list(FaultKind))
    amount = {
        FaultKind.UNPLUG: random.choice([math.inf, 0.5]),
        FaultKind.SHORT: 1,
        FaultKind.LATE: 0.25,
    }.get(kind, random.choice([1, 1e9]))
    return Fault(
        kind, amount, skip=random.randrange(3000), times=random.choice([1, 2, 5, math.inf])
    )


def test_a_chip_on_an_i2c_bus() -> None:
    clock = VirtualClock()
    bus = Bus(SimulatedChip(lambda bump, begin_s, end_s: 5.0), clock)
    bench = open_board("i2c:/dev/i2c-1", {"open_bus": bus, "clock": clock})
    clock.sleep(0.001)
    steps = list(Acceptance(bench))
    assert said(steps) == ""
    assert "400 kHz" in " ".join(step.measured for step in steps)
    bench.source.close()


def test_a_report_is_plain_json_without_the_users_path() -> None:
    bench = Board("soft-exca").open()
    steps = list(Acceptance(bench))
    source = without_path("usb:?capf=0&firmware=/home/ann/Icv_usb.hex")
    report = AcceptanceReport(
        utc_now(), source, versions(), bench.source.describe(), bench.dump.hex(" "), steps
    )
    document = json.loads(report.to_json())
    assert document["schema"] == "palpate-kit-report-1"
    assert document["source"] == "usb:?capf=0&firmware=..."
    assert [step["name"] for step in document["steps"]] == [step.name for step in steps]
    assert len(bytes.fromhex(document["registers"])) == 19
    assert "ann" not in report.to_json()
