"""Where the earlier baseline is no longer valid: the driver says so, whatever happens while it opens the board again."""

from typing import Any

import pytest
from kit_bench import CENTRED, Bench, pins
from palpate.ad7746.evalkit.board import I2C_PLAIN
from palpate.ad7746.twin.chip import ChipTwin
from palpate.ad7746.twin.kit import KitTwin, Reply
from palpate.samples import Status

OTHER = bytes([0x61, 0x12, 0x5C, 0x34])


class LoadedByAnother(KitTwin):
    """A board whose firmware another program loads some time after it is plugged in."""

    after_s = 1.5
    _due_ns = 0

    def plugged(self) -> None:
        super().plugged()
        self.loaded, self._due_ns = False, self._clock.now_ns() + round(self.after_s * 1e9)

    def control(self, *request: Any) -> Reply:
        self.loaded = self.loaded or self._clock.now_ns() >= self._due_ns
        return super().control(*request)


def replace(bench: Bench, kit: KitTwin) -> None:
    bench.carrier.unplug(bench.kit)
    bench.kit = kit
    bench.carrier.plug(kit)


def test_another_board_is_told_by_the_gains_of_its_chip() -> None:
    with Bench() as bench:
        driver = bench.open()
        bench.read(driver, 2)
        assert driver.describe()["fingerprint"] == "66 cc 5c 90"
        other = KitTwin(ChipTwin(pins), bench.carrier.clock)
        other.chip.factory = OTHER
        replace(bench, other)
        bench.read(driver, 2)
        said = "another board: the gains of its chip are 61 12 5c 34, before 66 cc 5c 90"
        assert said in driver.gaps[-1][1]
        assert said in bench.notes[-1]
        assert driver.describe()["fingerprint"] == "61 12 5c 34"


def test_gains_that_change_while_it_runs_are_noticed_within_a_second() -> None:
    with Bench() as bench:
        driver = bench.open()
        bench.read(driver, 3)
        bench.kit.chip.registers[0x0F] ^= 1
        bench.read(driver, 50)
        lost = [sample for sample in bench.samples if sample.status == Status.LOST]
        assert len(lost) == 1
        [(seq, text)] = driver.gaps
        assert seq == lost[0].seq + 1
        assert "0x0F to 0x12) are 67 cc 5c 90, before 66 cc 5c 90: another program" in text
        assert driver.counters.reopened == 1
        bench.check_samples(driver)


@pytest.mark.parametrize("kind", ["no answer", "stall", "line error"])
@pytest.mark.parametrize("why", ["lost conversion", "unplug"])
def test_a_fault_while_it_is_opened_again_does_not_end_it(why: str, kind: str) -> None:
    """The reset of the chip fails in all three tries of an access, once."""
    with Bench() as bench:
        driver = bench.open()
        bench.read(driver, 1)
        bench.fail(why, 4 if why == "lost conversion" else 1.0)
        bench.fail(kind, request=I2C_PLAIN, times=3)
        bench.read(driver, 8)
        assert bench.samples[-1].status == Status.OK
        assert driver.counters.reopened + driver.counters.reconnects == 1
        assert len(driver.gaps) == 1
        bench.check_samples(driver)


def test_firmware_that_another_program_loads_is_waited_for() -> None:
    with Bench(plugged=False) as bench:
        bench.kit = LoadedByAnother(ChipTwin(pins), bench.carrier.clock)
        bench.carrier.plug(bench.kit)
        driver = bench.open()
        bench.read(driver, 2)
        bench.kit.after_s = 5.0
        bench.fail("unplug", 1.0)
        bench.read(driver, 2)
        assert [note for note in bench.notes if "no firmware" in note] == [bench.notes[1]]
        assert bench.notes[1].endswith("Waiting until it is ready.")
        [(seq, text)] = driver.gaps
        assert 2 <= seq <= bench.samples[2].seq
        assert text.startswith("the board was unplugged for 6.")
        assert "another" not in text
        bench.check_samples(driver)


def test_a_range_that_is_set_again_is_a_gap_and_one_that_cannot_be_stays() -> None:
    with Bench() as bench:
        driver = bench.open()
        bench.read(driver, 3)
        driver.centre()
        bench.read(driver, 3)
        assert driver.gaps == []  # it was in the middle
        bench.kit.chip.overload_pF = 40.0
        driver.centre()
        assert bench.read(driver, 1)[-1].status & Status.HARD_SATURATED
        assert "the range could not be set again" in bench.notes[-1]
        assert (driver.gaps, driver.configuration) == ([], CENTRED)
        bench.kit.chip.overload_pF = 6.0
        driver.centre()
        after = bench.read(driver, 2)[-2]
        assert after.status == Status.OK
        [(seq, text)] = driver.gaps
        assert bench.samples[-3].seq < seq <= after.seq
        assert text == f"the range was set again: CAPDAC {driver.auto_capdac()}, before (41, 27)"
        bench.check_samples(driver)
