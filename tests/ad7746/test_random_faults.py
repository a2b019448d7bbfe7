"""Random faults at the driver: never a wrong value or time, a number unaccounted for, or no end."""

from collections.abc import Callable
from random import Random

import pytest
from effort import NIGHTLY, draws, random_of
from kit_world import LIMIT_MS, World, check_stamps
from palpate.ad7746.evalkit.board import ERROR_COUNT, I2C, PORTS
from palpate.ad7746.twin.kit import FAULTS, Fault
from palpate.errors import SourceError
from palpate.samples import Status
from tally import Tally

PAIRS = 6
LIMIT_S = 60.0

# What a number from 0 to 1 means for a kind of fault; 1 to 3 times otherwise.
_AMOUNTS: dict[str, Callable[[float], float]] = {
    "late": lambda share: 0.4 * share,
    "short": lambda share: round(14 * share),
    "unplug": lambda share: share,
    "overload": lambda share: 9.0 if share > 0.5 else -9.0,
    "not acknowledged in mid-write": lambda share: round(6 * share),
}
_PARTS, _SCHEDULES = (20, 500) if NIGHTLY else (1, draws(300))


def fault_of(random: Random) -> Fault:
    kind, share = random.choice(FAULTS), random.random()
    amount = _AMOUNTS[kind](share) if kind in _AMOUNTS else 1 + round(2 * share)
    request = random.choice([None, None, I2C, ERROR_COUNT, PORTS])
    return Fault(kind, amount, random.randint(0, 30), request, random.randint(1, 4))


def world_of(random: Random) -> World:
    stalls = random.choice([0.0, 0.01, 0.05])
    return World(random.uniform(60.0, 400.0), random.uniform(0.95, 1.05), stalls, random.randint(0, 7))


@pytest.mark.parametrize("part", range(_PARTS))
def test_any_faults_in_any_world(part: int, tally: Tally) -> None:
    """The clocks of bus and chip differ from what the driver knows, the computer stalls, and up to four faults happen."""
    random = random_of(f"kit faults {part}")
    for seed in range(part * _SCHEDULES, (part + 1) * _SCHEDULES):
        faults = [fault_of(random) for _ in range(random.randint(0, 4))]
        play(seed, world_of(random), faults, tally)


def play(seed: int, world: World, faults: list[Fault], tally: Tally) -> None:
    """Read pairs under these faults, and check all of them."""
    tally.count("kit faults")
    with world.bench(seed) as bench:
        driver = bench.open()
        start_ns = bench.carrier.clock.now_ns()
        bench.kit.faults.extend(faults)
        ended = False
        try:
            bench.read(driver, PAIRS)
        except SourceError:
            ended = True
            tally.count("kit faults that ended in an error")
        assert bench.carrier.clock.now_ns() < LIMIT_S * 1e9
        if bench.samples:
            bench.check_samples(driver, failed=ended)
        lost = sum(sample.status == Status.LOST for sample in bench.samples)
        tally.fault(f"kit, any faults, {world.stalls:.0%} of calls stalled", len(bench.samples), lost)
        # A pin that lies first high, then low, in the same conversion shows a wrong duration: both times move alike.
        lies = {fault.kind for fault in faults} >= {"RDY# stuck high", "RDY# stuck low"}
        worst = check_stamps(bench, start_ns, alike_ms=10.0 if lies else LIMIT_MS)
        tally.note("error of a kit stamp under faults and stalls, ms", worst)
