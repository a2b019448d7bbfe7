"""Where the earlier baseline is no longer valid: the driver says so, whatever happens while it opens the board again."""

import re
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import pytest
from effort import Tally, draws, random_of
from kit_bench import CENTRED, Bench, pins
from palpate.ad7746.driver import REPLUG_S
from palpate.ad7746.evalkit.usb_bus import ERROR_COUNT, I2C, I2C_PLAIN, OUT, RAM
from palpate.ad7746.simulator.chip import SimulatedChip
from palpate.ad7746.simulator.evalboard import FaultKind, Reply, SimulatedBoard
from palpate.samples import Status
from palpate.source_events import TroubleEnded, TroubleKind

FAULTS = (
    FaultKind.STALL,
    FaultKind.LINE_ERROR,
    FaultKind.NO_ANSWER,
    FaultKind.SHORT,
    FaultKind.NOT_ACKNOWLEDGED,
    FaultKind.UNPLUG,
)
OTHER = bytes([0x61, 0x12, 0x5C, 0x34])


class LoadedByAnother(SimulatedBoard):
    """A board whose firmware another program loads some time after it is plugged in."""

    after_s = 1.5
    _due_ns = 0

    def plugged(self, unplug: Callable[[float], None]) -> None:
        super().plugged(unplug)
        self.loaded, self._due_ns = False, self._clock.now_ns() + round(self.after_s * 1e9)

    def control(self, *request: Any) -> Reply:
        self.loaded = self.loaded or self._clock.now_ns() >= self._due_ns
        return super().control(*request)


def replace(bench: Bench, kit: SimulatedBoard) -> None:
    bench.carrier.unplug(bench.kit)
    bench.kit = kit
    bench.carrier.plug(kit)


def test_another_board_is_told_by_the_gains_of_its_chip() -> None:
    with Bench() as bench:
        driver = bench.open()
        bench.read(driver, 2)
        assert driver.describe()["fingerprint"] == "66 cc 5c 90"
        other = SimulatedBoard(SimulatedChip(pins), bench.carrier.clock)
        other.chip.factory = OTHER
        replace(bench, other)
        bench.read(driver, 2)
        said = "another board: the gains of its chip are 61 12 5c 34, before 66 cc 5c 90"
        assert said in bench.gaps[-1][1]
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
        [(seq, text)] = bench.gaps
        assert seq == lost[0].seq + 1
        assert "0x0F to 0x12) are 67 cc 5c 90, before 66 cc 5c 90: another program" in text
        assert driver.counters.reopened == 1
        bench.check_samples(driver)


def test_readings_at_another_gain_are_named_and_none_comes_after_the_gap() -> None:
    """Another program writes CAP_GAIN: the readings have status OK, and are 20 % too high."""
    with Bench() as bench:
        driver = bench.open()
        bench.read(driver, 60)
        bench.kit.control(OUT, I2C, 0x90, 0x0F, 2, (0xAE8F).to_bytes(2, "big"))
        bench.read(driver, 60)
        [(seq, text)] = bench.gaps
        assert (since := re.search(r"Readings since (\d+\.\d) s may be wrong", text))
        # What the two channels should differ by is constant: both ramps are the same.
        difference_pF = median(sample.hard - sample.soft for sample in bench.samples[:60])
        wrong = [
            s
            for s in bench.samples
            if not s.status and abs(s.hard - s.soft - difference_pF) > 0.001
        ]
        assert wrong
        assert (
            float(since[1]) - 0.05
            <= wrong[0].t_hard_ns / 1e9
            <= wrong[-1].t_hard_ns / 1e9
            < float(since[1]) + 1.1
        )
        assert wrong[-1].seq < seq
        assert driver.describe()["fingerprint"] == "66 cc 5c 90"


def with_image(bench: Bench, tmp_path: Path) -> Bench:
    """Give the bench a firmware of 46 load requests, which the board loses when it is unplugged."""
    bench.firmware = tmp_path / "image.hex"
    records = [bytes([64, *(64 * i).to_bytes(2, "big"), 0, *[i + 1] * 64]) for i in range(22)]
    lines = [f":{(record + bytes([-sum(record) & 0xFF])).hex()}" for record in records]
    bench.firmware.write_text("\n".join([*lines, ":00000001FF"]))
    bench.kit.loaded = bench.kit.keeps_firmware = False
    return bench


@pytest.mark.parametrize(
    "kind", [FaultKind.STALL, FaultKind.LINE_ERROR, FaultKind.NO_ANSWER, FaultKind.UNPLUG]
)
@pytest.mark.parametrize("request_number", [1, 3, 40])
def test_a_fault_while_the_firmware_is_loaded_after_a_replug(
    kind: FaultKind, request_number: int, tmp_path: Path
) -> None:
    with with_image(Bench(), tmp_path) as bench:
        driver = bench.open()
        bench.read(driver, 2)
        bench.fail(FaultKind.UNPLUG, 1.0)
        bench.fail(kind, 1.0, request=RAM, skip=request_number - 1)
        bench.read(driver, 5)
        assert not bench.kit.faults
        assert (bench.samples[-1].status, driver.counters.reconnects, len(bench.gaps)) == (
            Status.OK,
            1,
            1,
        )
        bench.check_samples(driver)


def test_a_firmware_that_does_not_start_is_loaded_again(tmp_path: Path) -> None:
    with with_image(Bench(), tmp_path) as bench:
        driver = bench.open()
        bench.read(driver, 2)
        bench.fail(FaultKind.UNPLUG, 1.0)
        bench.fail(FaultKind.STALL, request=ERROR_COUNT, times=12)
        assert bench.read(driver, 2)[-1].status == Status.OK
        assert not bench.kit.faults


def test_a_board_is_waited_for_two_minutes_counted_down() -> None:
    with Bench() as bench:
        bench.replug_s = REPLUG_S
        driver = bench.open()
        bench.read(driver, 2)
        bench.fail(FaultKind.UNPLUG, 119.0)
        bench.read(driver, 2)
        left = [re.findall(r"Waiting for it: (\d+) s left", note) for note in bench.notes]
        assert [int(number) for [number] in filter(None, left)] == [90, 60, 30, 10]
        assert bench.events[-1] == TroubleEnded(TroubleKind.UNPLUGGED)
        bench.check_samples(driver)


def test_schedules_of_faults_and_replugs(tmp_path: Path, tally: Tally) -> None:
    """No wrong value, and it goes on: the board is back within two minutes in all."""
    for number in range(draws(50, 1000, at_least=50)):
        random = random_of(f"replugs {number}")
        with with_image(Bench(seed=number), tmp_path) as bench:
            bench.replug_s = REPLUG_S
            driver = bench.open()
            for _ in range(random.randint(1, 3)):
                bench.read(driver, random.randint(1, 3))
                bench.fail(FaultKind.UNPLUG, random.uniform(0.0, 60.0), skip=random.randint(0, 20))
                for _ in range(random.randint(0, 4)):
                    request = random.choice([RAM, None])
                    skip = random.randint(0, 60)
                    bench.fail(
                        random.choice(FAULTS), random.uniform(0.0, 12.0), request=request, skip=skip
                    )
                bench.read(driver, 8)
                bench.kit.faults.clear()
            assert bench.read(driver, 3)[-1].status == Status.OK
            assert driver.counters.reconnects > 0
            bench.check_samples(driver)
        tally.count("schedules of faults with replugs")


@pytest.mark.parametrize("kind", [FaultKind.NO_ANSWER, FaultKind.STALL, FaultKind.LINE_ERROR])
@pytest.mark.parametrize("why", [FaultKind.LOST_CONVERSION, FaultKind.UNPLUG])
def test_a_fault_while_it_is_opened_again_does_not_end_it(why: FaultKind, kind: FaultKind) -> None:
    """The reset of the chip fails in all three tries of an access, once."""
    with Bench() as bench:
        driver = bench.open()
        bench.read(driver, 1)
        bench.fail(why, 4 if why == FaultKind.LOST_CONVERSION else 1.0)
        bench.fail(kind, request=I2C_PLAIN, times=3)
        bench.read(driver, 8)
        assert bench.samples[-1].status == Status.OK
        assert driver.counters.reopened + driver.counters.reconnects == 1
        assert len(bench.gaps) == 1
        bench.check_samples(driver)


def test_firmware_that_another_program_loads_is_waited_for() -> None:
    with Bench(plugged=False) as bench:
        bench.kit = LoadedByAnother(SimulatedChip(pins), bench.carrier.clock)
        bench.carrier.plug(bench.kit)
        driver = bench.open()
        bench.read(driver, 2)
        bench.kit.after_s = 5.0
        bench.fail(FaultKind.UNPLUG, 1.0)
        bench.read(driver, 2)
        assert [note for note in bench.notes if "no firmware" in note] == [bench.notes[1]]
        assert bench.notes[1].endswith("unplug the board for a moment. Waiting for it: 7 s left.")
        [(seq, text)] = bench.gaps
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
        assert bench.gaps == []  # it was in the middle
        bench.kit.chip.overload_pF = 40.0
        driver.centre()
        assert bench.read(driver, 1)[-1].status & Status.HARD_SATURATED
        assert "the range could not be set again" in bench.notes[-1]
        assert (bench.gaps, driver.configuration) == ([], CENTRED)
        bench.kit.chip.overload_pF = 6.0
        driver.centre()
        after = bench.read(driver, 2)[-2]
        assert after.status == Status.OK
        [(seq, text)] = bench.gaps
        assert bench.samples[-3].seq < seq <= after.seq
        assert text == f"the range was set again: CAPDAC {driver.auto_capdac()}, before (41, 27)"
        bench.check_samples(driver)
