"""What the driver counts agrees with the time that passed, and with the faults that happened."""

from dataclasses import asdict

import pytest
from kit_bench import Bench
from palpate.ad7746.driver import STREAK, Ad7746
from palpate.ad7746.evalkit.usb_bus import I2C
from palpate.ad7746.simulator.evalboard import FaultKind
from palpate.samples import Status


def check_numbers(bench: Bench, driver: Ad7746) -> None:
    """Check that the numbers of the samples went on by the pairs that the time between them had room for."""
    bench.check_samples(driver)
    for before, after in zip(bench.samples, bench.samples[1:], strict=False):
        periods = (after.t_hard_ns - before.t_hard_ns) / 1e9 / driver.period_s
        # A pair that is begun when the board goes, and the rest of one when it is back, are no pairs.
        assert abs(after.seq - before.seq - periods) <= 2, (before, after, periods)


@pytest.mark.parametrize("away_s", [0.2, 3.0, 9.0])
def test_the_pairs_of_a_replug_are_lost_once(away_s: float) -> None:
    with Bench() as bench:
        driver = bench.open()
        bench.read(driver, 20)
        bench.fail(FaultKind.UNPLUG, away_s)
        bench.read(driver, 5)
        check_numbers(bench, driver)
        jump = bench.samples[20].seq - bench.samples[19].seq - 1
        assert driver.counters.lost == jump
        assert jump == pytest.approx(away_s / driver.period_s, abs=3)
        assert driver.counters.reconnects == 1


@pytest.mark.parametrize("skip", range(0, 40, 4))
def test_the_pairs_of_two_replugs_in_a_row_are_lost_once(skip: int) -> None:
    """The second one comes while the board is opened again, or the first pair after that is read."""
    with Bench() as bench:
        driver = bench.open()
        bench.read(driver, 20)
        bench.fail(FaultKind.UNPLUG, 2.0)
        bench.fail(FaultKind.UNPLUG, 3.0, skip=skip)
        bench.read(driver, 5)
        assert not bench.kit.faults
        assert driver.counters.reconnects in (1, 2)  # one, if it came while the board was opened
        check_numbers(bench, driver)


@pytest.mark.parametrize("skip", range(0, 300, 60))
def test_the_pairs_of_a_range_that_is_set_again_are_lost_once(skip: int) -> None:
    """Also if the board is unplugged during it, or right after it."""
    with Bench() as bench:
        driver = bench.open()
        bench.read(driver, 20)
        bench.kit.chip.overload_pF = 6.0
        driver.centre()
        bench.read(driver, 3)
        centred = driver.counters.lost
        assert centred > 0
        check_numbers(bench, driver)
        bench.kit.chip.overload_pF = 0.0
        driver.centre()
        bench.fail(FaultKind.UNPLUG, 2.0, skip=skip)
        bench.read(driver, 10)
        assert driver.counters.reconnects == 1
        check_numbers(bench, driver)


@pytest.mark.parametrize("lost", [1, STREAK - 1, STREAK, STREAK + 2])
def test_conversions_that_are_lost_in_a_row_are_lost_pairs_once_each(lost: int) -> None:
    with Bench() as bench:
        driver = bench.open()
        bench.read(driver, 20)
        bench.fail(FaultKind.LOST_CONVERSION, lost)
        bench.read(driver, 10)
        assert driver.counters.lost == lost
        assert sum(sample.status == Status.LOST for sample in bench.samples) == lost
        assert driver.counters.reopened == (lost >= STREAK)
        assert (driver.counters.errors, driver.counters.retries) == (0, 0)
        check_numbers(bench, driver)


@pytest.mark.parametrize("times", [1, 2, 3, 4, 6, 7])
def test_each_failed_access_is_an_error_and_each_repetition_a_retry(times: int) -> None:
    """An access has three tries: two of them are repetitions, and the third failure loses the pair."""
    with Bench() as bench:
        driver = bench.open()
        bench.read(driver, 3)
        bench.fail(FaultKind.STALL, request=I2C, times=times)
        bench.read(driver, 5)
        given_up, _ = divmod(times, 3)
        counted = asdict(driver.counters)
        assert counted["errors"] == times
        assert counted["retries"] == times - given_up
        assert counted["lost"] == given_up
        assert (counted["reopened"], counted["reconnects"]) == (0, 0)
        bench.check_samples(driver)
