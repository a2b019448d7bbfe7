"""Times of conversions and of pairs, whatever happens: other clocks of bus and chip, a computer that stalls, random faults.

Never a wrong value or time, a number unaccounted for, or no end; and bounds of a time that hold, and that nothing narrower would.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from random import Random
from typing import Any

import palpate
import pytest
from effort import NIGHTLY, Tally, draws, random_of
from hypothesis import given
from hypothesis import strategies as st
from kit_bench import CENTRED, Bench, ProcessCarrier
from palpate.ad7746.bus import VirtualClock
from palpate.ad7746.converter import Pace, Seen
from palpate.ad7746.evalkit.usb_bus import ERROR_COUNT, I2C, PORTS
from palpate.ad7746.simulator.evalboard import BUS_KHZ, Fault, FaultKind
from palpate.ad7746.simulator.usb_backend import SimulatedUsb
from palpate.errors import ProtocolError, SourceError
from palpate.samples import Sample, Status
from recording_bench import SampleReader

LONGEST_S = 0.1
LIMIT_MS = 2.0


@dataclass(frozen=True)
class World:
    """Everything that the data sheet or the operating system leaves open."""

    bus_kHz: float = BUS_KHZ
    pace: float = 1.0  # time of a conversion, relative to the data sheet's
    stalls: float = (
        0.0  # share of transfers and waits that are stopped, for up to `LONGEST_S`, before or after
    )
    capf: int = 0

    def bench(self, seed: int = 0) -> Bench:
        """Return a bench in this world."""
        bench = Bench(seed=seed, carrier=StalledCarrier(self.stalls, seed), bus_kHz=self.bus_kHz)
        bench.configuration = replace(CENTRED, capf=self.capf)
        bench.kit.chip.pace = self.pace
        return bench


class StalledClock(VirtualClock):
    """A clock whose waits may be stopped."""

    def __init__(self, share: float, seed: int) -> None:
        super().__init__()
        self._share, self._random = share, Random(seed)

    def sleep(self, seconds: float) -> None:
        """Wait for this time, or longer."""
        self.advance(seconds)
        self.may_stop(self._share)

    def advance(self, seconds: float) -> None:
        """Let time pass, as on a computer that does not stall."""
        super().sleep(seconds)

    def may_stop(self, share: float) -> None:
        """Stop here, with this probability."""
        if self._random.random() < share:
            self.advance(self._random.uniform(0.0, LONGEST_S))


class SteadyClock:
    """The same clock for the board, which nothing stops."""

    def __init__(self, clock: StalledClock) -> None:
        self.now_ns = clock.now_ns
        self.sleep = clock.advance


class StalledBackend(SimulatedUsb):
    """USB of a computer that stalls: the board goes on by itself."""

    def __init__(self, clock: StalledClock, share: float) -> None:
        super().__init__(SteadyClock(clock))
        self._stalled = clock
        self._share = share

    def ctrl_transfer(self, *request: Any) -> int:
        """Do one control transfer; stopped before it is begun, or after its end."""
        self._stalled.may_stop(self._share / 2)
        try:
            return super().ctrl_transfer(*request)
        finally:
            self._stalled.may_stop(self._share / 2)


class StalledCarrier(ProcessCarrier):
    """Carrier of a computer that stalls, with a virtual clock."""

    def __init__(self, share: float, seed: int) -> None:
        super().__init__()
        self.clock = StalledClock(share, seed)
        self._backend = StalledBackend(self.clock, share)


def stamp_errors_ms(bench: Bench, sample: Sample, start_ns: int) -> list[float]:
    """Return the errors of a sample's two times, ms, from the nearest conversions with its codes; these must exist."""
    readings = ((1, sample.hard_raw, sample.t_hard_ns), (2, sample.soft_raw, sample.t_soft_ns))
    ended = [c for c in bench.kit.chip.conversions if not c.lost]
    middles = [
        [(c.begin + c.end) / 2 for c in ended if (c.pin, c.code) == (pin, code)]
        for pin, code, _ in readings
    ]
    return [
        min(((t_ns + start_ns - middle) / 1e6 for middle in found), key=abs)
        for (_, _, t_ns), found in zip(readings, middles, strict=True)
    ]


def check_stamps(bench: Bench, start_ns: int, *, alike_ms: float = LIMIT_MS) -> float:
    """Return the largest error, ms; each is within `alike_ms`, and both of a pair differ by what it says, or less."""
    worst = 0.0
    for sample in bench.samples:
        if sample.status != Status.LOST:
            hard, soft = stamp_errors_ms(bench, sample, start_ns)
            assert max(abs(hard), abs(soft)) <= alike_ms, sample
            assert abs(soft - hard) <= sample.t_uncertainty_us / 1000 <= LIMIT_MS, sample
            worst = max(worst, abs(hard), abs(soft))
    return worst


QUIET = [
    World(kHz, pace, 0.0, capf)
    for kHz, pace, capf in itertools.product((60, 85, 400), (0.95, 1.0, 1.05), (0, 4, 7))
]


@pytest.mark.parametrize("world", QUIET, ids=str)
def test_a_quiet_computer(world: World, tally: Tally) -> None:
    """Nothing is lost, the times are right to 0.2 ms, and the period is known before the first pair."""
    with world.bench() as bench:
        driver = bench.open()
        start_ns = bench.carrier.clock.now_ns()
        driver.auto_capdac()
        told_s = driver.describe()["period_s"]
        begun_ns = bench.carrier.clock.now_ns()
        bench.read(driver, 60)
        period_s = (bench.carrier.clock.now_ns() - begun_ns) / 60e9
        tally.note("error of a kit stamp, quiet, ms", check_stamps(bench, start_ns))
        assert driver.counters.lost == 0
        assert told_s == pytest.approx(period_s, rel=0.02)
        assert driver.period_s == pytest.approx(period_s, rel=0.01)
        assert driver.fastest_period_s == pytest.approx(period_s, rel=0.03)
        assert (
            max(
                abs(each)
                for sample in bench.samples
                for each in stamp_errors_ms(bench, sample, start_ns)
            )
            < 0.2
        )


@pytest.mark.parametrize("capf", range(8))
def test_a_computer_that_stalls(capf: int, tally: Tally) -> None:
    """5 % of the calls stop for up to 0.1 s: a time is right, or its pair is lost."""
    pairs = 1000 if NIGHTLY else 100  # the simulated chip keeps 4096 conversions
    with World(stalls=0.05, capf=capf).bench(capf) as bench:
        driver = bench.open()
        start_ns = bench.carrier.clock.now_ns()
        bench.read(driver, pairs)
        bench.check_samples(driver)
        worst = check_stamps(bench, start_ns)
        tally.say(
            f"stalls, CAPF {capf}: {driver.counters.lost} of {pairs} pairs lost, worst stamp {worst:.3f} ms off"
        )
        assert driver.counters.lost <= 0.1 * pairs
        assert driver.counters.reopened == 0


def test_a_lost_pair_says_how_uncertain_it_was() -> None:
    """Each transfer and each wait is stopped: then nothing is certain, and the device is not opened again."""
    with World(stalls=1.0, capf=7).bench() as bench:
        driver = bench.open()
        bench.read(driver, 10)
        bench.check_samples(driver)
        lost = [sample for sample in bench.samples if sample.status == Status.LOST]
        quiet_s = 2 * 1.25 * (0.1096 + 0.0047)  # the data sheet's, the kit's bus, and the margin
        assert driver.fastest_period_s == pytest.approx(quiet_s)
        assert driver.period_s > 1.1 * quiet_s
        assert len(lost) > 5
        assert all(sample.t_uncertainty_us > 2000 for sample in lost)
        assert (driver.counters.reopened, driver.counters.lost) == (0, len(lost))


def test_a_chip_that_warms_up() -> None:
    """Its clock changes by 1 % in 1000 conversions: nothing is lost."""
    with World(capf=0).bench() as bench:
        driver = bench.open()
        start_ns = bench.carrier.clock.now_ns()
        for _ in range(500):
            bench.read(driver, 1)
            bench.kit.chip.pace *= 1 + 2e-5
        assert driver.counters.lost == 0
        assert check_stamps(bench, start_ns) < 0.3


def test_the_simulated_board_has_the_bus_clock_that_is_asked_for() -> None:
    """At 85 kHz 31.8 pairs a second, as from the kit's own firmware in an emulator."""
    periods_s = []
    for kHz in (85, 400):
        with palpate.open(f"sim:tremor?bus_kHz={kHz}") as source:
            list(itertools.islice(SampleReader(source), 20))
            periods_s.append(source.describe()["period_s"])
    assert periods_s == pytest.approx([0.0314, 0.0263], rel=0.01)


PAIRS = 6
LIMIT_S = 60.0

# What a number from 0 to 1 means for a kind of fault; 1 to 3 times otherwise.
_AMOUNTS: dict[str, Callable[[float], float]] = {
    FaultKind.LATE: lambda share: 0.4 * share,
    FaultKind.SHORT: lambda share: round(14 * share),
    FaultKind.UNPLUG: lambda share: share,
    FaultKind.OVERLOAD: lambda share: 9.0 if share > 0.5 else -9.0,
    FaultKind.PARTLY_ACKNOWLEDGED: lambda share: round(6 * share),
}
_PARTS, _SCHEDULES = (20, 500) if NIGHTLY else (1, draws(300))


def fault_of(random: Random) -> Fault:
    kind = random.choice(list(FaultKind))
    share = random.random()
    amount = _AMOUNTS[kind](share) if kind in _AMOUNTS else 1 + round(2 * share)
    request = random.choice([None, None, I2C, ERROR_COUNT, PORTS])
    return Fault(kind, amount, random.randint(0, 30), request, random.randint(1, 4))


def world_of(random: Random) -> World:
    stalls = random.choice([0.0, 0.01, 0.05])
    return World(
        random.uniform(60.0, 400.0), random.uniform(0.95, 1.05), stalls, random.randint(0, 7)
    )


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
        tally.fault(
            f"kit, any faults, {world.stalls:.0%} of calls stalled", len(bench.samples), lost
        )
        # A pin that lies first high, then low, in the same conversion shows a wrong duration: both times move alike.
        lies = {fault.kind for fault in faults} >= {"RDY# stuck high", "RDY# stuck low"}
        worst = check_stamps(bench, start_ns, alike_ms=10.0 if lies else LIMIT_MS)
        tally.note("error of a kit stamp under faults and stalls, ms", worst)


LENGTH_NS = 11_000_000
_DELAY = st.integers(0, 3_000_000) | st.integers(0, 100_000_000)


def seen(begin: int, length: int, delays: tuple[int, int, int, int]) -> Seen:
    """Return what a computer sees with these delays before and after the begin, and before and after the end."""
    end = begin + length
    return Seen(
        begin - delays[0],
        begin + delays[1],
        max(end - delays[2], begin - delays[0]),
        end + delays[3],
    )


@given(
    length=st.integers(round(0.95 * LENGTH_NS), round(1.05 * LENGTH_NS)),
    all_delays=st.lists(st.tuples(_DELAY, _DELAY, _DELAY, _DELAY), min_size=1, max_size=5),
)
def test_the_middle_is_within_its_bounds(
    length: int, all_delays: list[tuple[int, int, int, int]]
) -> None:
    pace = Pace(LENGTH_NS / 1e9)
    for number, delays in enumerate(all_delays):
        begin = number * 10**9
        each = seen(begin, length, delays)
        pace.learn(each)
        assert pace.shortest_ns <= length <= pace.longest_ns
        middle = pace.middle(each)
        assert min(middle.early_ns, middle.late_ns) >= 0
        assert -middle.early_ns <= begin + length // 2 - middle.t_ns <= middle.late_ns


@given(st.tuples(_DELAY, _DELAY, _DELAY, _DELAY))
def test_no_narrower_bounds_hold(delays: tuple[int, int, int, int]) -> None:
    """At each bound there is a begin and a duration that the computer would see in the same way."""
    pace = Pace(LENGTH_NS / 1e9)
    each = seen(0, LENGTH_NS, delays)
    pace.learn(each)
    middle = pace.middle(each)
    for bound in (middle.t_ns - middle.early_ns, middle.t_ns + middle.late_ns):
        # Begin B and duration D with B + D/2 = bound: D is in an interval, which is not empty.
        low = max(pace.shortest_ns, 2 * (bound - each.begun), 2 * (each.busy - bound))
        high = min(pace.longest_ns, 2 * (bound - each.asked), 2 * (each.ended - bound))
        assert low <= high + 4  # half a nanosecond in each of them


def test_another_duration_is_refused_and_forgotten() -> None:
    pace = Pace(0.011)
    clean = seen(0, LENGTH_NS, (100_000, 100_000, 100_000, 100_000))
    pace.learn(clean)
    with pytest.raises(
        ProtocolError, match=r"a conversion took 13\.80 to 14\.20 ms, those before it"
    ):
        pace.learn(clean._replace(busy=clean.busy + 3_000_000, ended=clean.ended + 3_000_000))
    pace.learn(clean._replace(busy=clean.busy + 3_000_000, ended=clean.ended + 3_000_000))
    assert pace.shortest_ns == 13_800_000


def test_a_duration_that_is_too_long_is_corrected() -> None:
    """Polls that begin after the end never find a conversion running: the next ones begin earlier."""
    pace = Pace(0.011)
    pace.learn(Seen(0, 100_000, 13_000_000, 13_100_000))  # a pin that was stuck high, then low
    for _ in range(5):
        began = pace.shortest_ns
        pace.learn(Seen(0, 100_000, 0, began + 3_000_000))
        assert pace.shortest_ns == began - 500_000
