"""Acceptance over simulated boards: a right one passes, each mistake is named, a fault leaves steps and no exception."""

import math
from collections.abc import Callable
from random import Random

import pytest
from effort import NIGHTLY, draws, random_of
from kit_acceptance import Board, not_done, said, wrong
from kit_bench import Bus
from palpate.ad7746.bus import VirtualClock
from palpate.ad7746.twin.chip import ChipTwin
from palpate.ad7746.twin.kit import FAULTS, Fault
from palpate.kit.acceptance import NAMES, Acceptance
from palpate.kit.bench import open_bench
from tally import Tally

SEEDS = range(100 if NIGHTLY else 5)
FEWER = range(100 if NIGHTLY else 1)

# Wiring, options of the source, and words of the message about it. tests/sources/test_wiring.py has every mistake.
MISTAKES = [
    ("hard-exca", "", ["hard bump: CIN1+", "use excitation=A,B "]),
    ("guide", "?excitation=A", ["hard bump: CIN1+", "on EXCB: use excitation=B "]),
    ("demo", "", ["soft bump: CIN2+", "length sensor, connected until R1 and R2 are removed"]),
    ("hard-minus", "?differential=yes", ["inputs and excitations", "exchange its wires at CIN1+ and CIN1-"]),
    ("excb-shorted", "", ["EXCB (socket P2) is shorted or overloaded", "EXCERR"]),
    ("swapped", "", ["the inputs are swapped, the hard bump is on CIN2", "hard_input=2"]),
    ("exca", "?excitation=A", []),
    ("differential", "?differential=yes", []),
]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_right_board_passes(seed: int, tally: Tally) -> None:
    steps = Board(seed=seed).accept(by_hand=True)
    tally.count("boards accepted")
    assert said(steps) == ""
    assert not_done(steps) == []


@pytest.mark.parametrize("seed", FEWER)
@pytest.mark.parametrize(("wiring", "options", "words"), MISTAKES, ids=[f"{w}{o}" for w, o, _ in MISTAKES])
def test_mistakes_of_the_wiring(wiring: str, options: str, words: list[str], seed: int, tally: Tally) -> None:
    only = ("registers", "inputs", "press") if seed else NAMES  # the rest takes most of the time
    steps = Board(wiring, seed).accept(options, by_hand=True, only=only)
    tally.count("boards with a mistake")
    assert bool(said(steps)) == bool(words)
    for word in words:
        assert word in said(steps), said(steps)


def test_another_board_at_the_same_port_and_a_wrong_capacitor_are_noticed() -> None:
    words = said(Board().accept(by_hand=True, replaced=True))
    assert "another board was plugged in" in words
    assert "check the value and the contacts at CIN1+ and EXCB" in words


@pytest.mark.parametrize(
    ("kind", "amount", "name", "words"),
    [
        ("chip absent", 1, "registers", ["not acknowledged", "link LK2"]),
        ("RDY# stuck high", 1, "voltages", ["RDY#", "stuck high"]),
        ("RDY# stuck low", 1, "voltages", ["RDY#", "stuck low"]),
        ("lost conversion", 1e9, "voltages", ["does not end"]),
        ("unplug", math.inf, "registers", ["unplugged"]),
        ("lock", 1, "registers", []),
    ],
)
def test_a_board_that_fails_is_named(kind: str, amount: float, name: str, words: list[str]) -> None:
    board = Board()
    bench = board.open()
    board.kit.faults.append(Fault(kind, amount))
    steps = list(Acceptance(bench))
    assert name in [step.name for step in wrong(steps)], said(steps)
    for word in words:
        assert word in said(steps)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda kit: setattr(kit.chip, "pace", 1.15), ["conversion times", "+15"]),
        (lambda kit: setattr(kit.chip, "supply_V", 2.2), ["supply of the chip: 2.20 V"]),
        (lambda kit: setattr(kit.chip, "temperature_C", 80.0), ["temperature of the chip: 80.0 C"]),
        (lambda kit: setattr(kit.chip, "_noisy", False), ["almost constant", "not a measurement"]),
        (lambda kit: setattr(kit.chip, "_dac_step_pF", (0.22, 0.22)), ["CAPDAC step at CIN1: 0.22"]),
        (lambda kit: setattr(kit.chip, "disturb", _mains()), ["noise at CIN1, CAPF 0", "shield"]),
    ],
)
def test_a_board_outside_its_data_sheet_is_named(change: object, words: list[str]) -> None:
    board = Board()
    assert callable(change)
    change(board.kit)
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
    assert [step.name for step in steps][-3:] == ["pull and replug", "press", "known capacitor"] or not_done(steps)
    assert all(step.measured.isprintable() for step in steps)


def _fault(random: Random) -> Fault:
    kind = random.choice(FAULTS)
    amount = {"unplug": random.choice([math.inf, 0.5]), "short": 1, "late": 0.25}.get(kind, random.choice([1, 1e9]))
    return Fault(kind, amount, skip=random.randrange(3000), times=random.choice([1, 2, 5, math.inf]))


def test_a_chip_on_an_i2c_bus() -> None:
    clock = VirtualClock()
    bus = Bus(ChipTwin(lambda bump, begin_s, end_s: 5.0), clock)
    bench = open_bench("i2c:/dev/i2c-1", {"open_bus": bus, "clock": clock})
    clock.sleep(0.001)
    steps = list(Acceptance(bench))
    assert said(steps) == ""
    assert "400 kHz" in " ".join(step.measured for step in steps)
    bench.source.close()
