"""Times of conversions, and of pairs: on quiet and on stalled computers, with other clocks of bus and chip."""

import itertools

import palpate
import pytest
from effort import NIGHTLY
from kit_world import World, check_stamps, stamp_errors_ms
from palpate.samples import Status
from tally import Tally

QUIET = [
    World(kHz, pace, 0.0, capf) for kHz, pace, capf in itertools.product((60, 85, 400), (0.95, 1.0, 1.05), (0, 4, 7))
]


@pytest.mark.parametrize("world", QUIET, ids=str)
def test_a_quiet_computer(world: World, tally: Tally) -> None:
    """Nothing is lost, the times are right to 0.2 ms, and the period is known before the first pair."""
    with world.bench() as bench:
        driver = bench.open()
        start_ns = bench.carrier.clock.now_ns()
        driver.auto_capdac()
        told_s, begun_ns = driver.describe()["period_s"], bench.carrier.clock.now_ns()
        bench.read(driver, 60)
        period_s = (bench.carrier.clock.now_ns() - begun_ns) / 60e9
        tally.note("error of a kit stamp, quiet, ms", check_stamps(bench, start_ns))
        assert driver.counters.lost == 0
        assert told_s == pytest.approx(period_s, rel=0.02)
        assert driver.period_s == pytest.approx(period_s, rel=0.01)
        assert max(abs(each) for sample in bench.samples for each in stamp_errors_ms(bench, sample, start_ns)) < 0.2


@pytest.mark.parametrize("capf", range(8))
def test_a_computer_that_stalls(capf: int, tally: Tally) -> None:
    """5 % of the calls stop for up to 0.1 s: a time is right, or its pair is lost."""
    pairs = 1000 if NIGHTLY else 100  # the twin keeps 4096 conversions
    with World(stalls=0.05, capf=capf).bench(capf) as bench:
        driver = bench.open()
        start_ns = bench.carrier.clock.now_ns()
        bench.read(driver, pairs)
        bench.check_samples(driver)
        worst = check_stamps(bench, start_ns)
        tally.say(f"stalls, CAPF {capf}: {driver.counters.lost} of {pairs} pairs lost, worst stamp {worst:.3f} ms off")
        assert driver.counters.lost <= 0.1 * pairs
        assert driver.counters.reopened == 0


def test_a_lost_pair_says_how_uncertain_it_was() -> None:
    """Each transfer and each wait is stopped: then nothing is certain, and the device is not opened again."""
    with World(stalls=1.0, capf=7).bench() as bench:
        driver = bench.open()
        bench.read(driver, 10)
        bench.check_samples(driver)
        lost = [sample for sample in bench.samples if sample.status == Status.LOST]
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
            list(itertools.islice(source, 20))
            periods_s.append(source.describe()["period_s"])
    assert periods_s == pytest.approx([0.0314, 0.0263], rel=0.01)
