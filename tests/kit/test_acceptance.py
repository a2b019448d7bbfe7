"""Acceptance over simulated boards: a right one passes, each mistake is named, a fault leaves steps and no exception."""

import math
from collections.abc import Callable
from random import Random

import pytest
from effort import NIGHTLY, draws, random_of
from i2c_bus import Bus
from kit_acceptance import Board, not_done, said, wrong
from palpate.ad7746.clock import VirtualClock
from palpate.ad7746.twin.chip import ChipTwin
from palpate.ad7746.twin.kit import Fault, KitTwin
from palpate.ad7746.twin.wiring import WIRINGS
from palpate.errors import DeviceNotFound
from palpate.kit.acceptance import NAMES, Acceptance
from palpate.kit.bench import open_bench
from palpate.kit.step import OK
from tally import Tally

SEEDS = range(100 if NIGHTLY else 5)
FEWER = range(100 if NIGHTLY else 1)

# Wiring, options of the source, and words of what is said about it: pin, and what to add or to do.
MISTAKES = [
    ("exca", "", ["hard bump: CIN1+", "soft bump: CIN2+", "on EXCA: use excitation=A "]),
    ("hard-exca", "", ["hard bump: CIN1+", "use excitation=A,B "]),
    ("soft-exca", "", ["soft bump: CIN2+", "use excitation=B,A ", "R1 and R2"]),
    ("guide", "?excitation=A", ["hard bump: CIN1+", "on EXCB: use excitation=B "]),
    ("demo", "", ["soft bump: CIN2+", "length sensor, connected until R1 and R2 are removed"]),
    ("demo-exca", "", ["hard bump: CIN1+", "use excitation=A ", "R1 and R2"]),
    ("demo-alone", "", ["soft bump: CIN2+", "R1 and R2 are removed"]),
    ("hard-minus", "", ["its wire is at CIN1-", "move it to CIN1+"]),
    (
        "hard-minus",
        "?differential=yes",
        ["inputs and excitations", "at CIN1-", "exchange its wires at CIN1+ and CIN1-"],
    ),
    ("hard-open", "", ["hard bump: CIN1+", "nothing is connected", "one to CIN1+, the other to EXCB"]),
    ("soft-open", "", ["soft bump: CIN2+", "nothing is connected", "one to CIN2+, the other to EXCB"]),
    ("open", "", ["no probe is connected", "CIN1+ and EXCB", "CIN2+ and EXCB"]),
    ("hard-shorted", "", ["hard bump: CIN1+", "more than 17 pF", "short between CIN1+ and EXCB"]),
    ("soft-shorted", "", ["soft bump: CIN2+", "more than 17 pF", "short between CIN2+ and EXCB"]),
    ("excb-shorted", "", ["EXCB (socket P2) is shorted or overloaded", "EXCERR"]),
    ("swapped", "", ["the inputs are swapped, the hard bump is on CIN2", "hard_input=2"]),
]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_right_board_passes(seed: int, tally: Tally) -> None:
    steps = Board(seed=seed).accept(by_hand=True)
    tally.count("boards accepted")
    assert said(steps) == ""
    assert not_done(steps) == []


@pytest.mark.parametrize("seed", FEWER)
@pytest.mark.parametrize(("wiring", "options", "words"), MISTAKES, ids=[f"{w}{o}" for w, o, _ in MISTAKES])
def test_a_mistake_of_the_wiring_is_named(wiring: str, options: str, words: list[str], seed: int, tally: Tally) -> None:
    only = ("registers", "inputs", "press") if seed else NAMES  # the others take most of the time
    steps = Board(wiring, seed).accept(options, by_hand=True, only=only)
    tally.count("boards with a mistake")
    for word in words:
        assert word in said(steps), said(steps)


@pytest.mark.parametrize(
    ("wiring", "options"),
    [
        ("exca", "?excitation=A"),
        ("hard-exca", "?excitation=A,B"),
        ("soft-exca", "?excitation=B,A"),
        ("swapped", "?hard_input=2"),
        ("guide", "?excitation=AB"),
        ("exca-shorted", ""),
        ("differential", ""),
        ("differential", "?differential=yes"),
    ],
)
def test_what_is_said_to_add_makes_it_right(wiring: str, options: str) -> None:
    assert said(Board(wiring).accept(options, by_hand=True)) == ""


def test_every_wiring_is_tried() -> None:
    right = {"guide", "exca-shorted", "differential"}
    assert {wiring for wiring, _, _ in MISTAKES} | right == set(WIRINGS)


def test_another_board_at_the_same_port_is_noticed() -> None:
    board = Board()
    steps = board.accept(by_hand=True, replaced=True)
    assert "another board was plugged in" in said(steps)


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


def test_of_two_boards_one_has_to_be_chosen() -> None:
    board = Board()
    board.backend.plug(KitTwin(board.kit.chip, board.clock), 2)
    with pytest.raises(DeviceNotFound, match="found 2 boards: choose one of usb:1/2, usb:1/3"):
        board.open()


KINDS = ("no answer", "stall", "line error", "short", "not acknowledged", "lock", "unplug", "chip absent",
         "brown-out", "lost conversion", "other input", "excitation shorted", "late")  # fmt: skip


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
    for step in steps:
        assert step.measured
        assert step.verdict == OK or step.measured.isprintable()


def _fault(random: Random) -> Fault:
    kind = random.choice(KINDS)
    amount = {"unplug": random.choice([math.inf, 0.5]), "short": 1, "late": 0.25}.get(kind, random.choice([1, 1e9]))
    return Fault(kind, amount, skip=random.randrange(3000), times=random.choice([1, 2, 5, math.inf]))


def test_a_chip_on_an_i2c_bus() -> None:
    clock = VirtualClock()
    bus = Bus(ChipTwin(lambda bump, begin_s, end_s: 5.0), clock)
    bench = open_bench("i2c:/dev/i2c-1", {"open_bus": bus, "clock": clock})
    clock.sleep(0.001)
    steps = list(Acceptance(bench))
    assert said(steps) == ""
    assert "I2C clock: 400 kHz" in "\n".join(line for step in steps for line in step.lines())
    bench.source.close()
