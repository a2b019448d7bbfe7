"""The evaluation kit's driver over its twin: the same file on each carrier of `usb_carriers`."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from kit_bench import Bench
from kit_faults import ANY, IMAGE, OPENING, RUNNING, Opening, Row, attempt, run
from palpate.ad7746 import datasheet
from palpate.ad7746.configuration import HARD, SOFT, Channel, Configuration
from palpate.ad7746.evalkit.find import boards
from palpate.errors import DeviceNotFound, ProtocolError
from palpate.samples import Status
from tally import Tally


@pytest.fixture
def bench() -> Iterator[Bench]:
    with Bench() as bench:
        yield bench


@pytest.mark.parametrize("row", RUNNING, ids=lambda row: row.name)
def test_a_fault_while_reading(row: Row) -> None:
    outcome = run(row)
    if row.error is None:
        assert outcome.error is None
        known = {name: count for name, count in outcome.counters.items() if row.counters.get(name) != ANY}
        assert known == {name: count for name, count in row.counters.items() if count != ANY}
        assert set(known) | {name for name, count in row.counters.items() if count == ANY} == set(outcome.counters)
    else:
        assert isinstance(outcome.error, row.error)
        assert row.text in str(outcome.error)
    assert outcome.flags == row.flags


@pytest.mark.parametrize("opening", OPENING, ids=lambda opening: opening.name)
def test_a_fault_while_opening(opening: Opening) -> None:
    raised = attempt(opening)
    assert isinstance(raised, opening.error)
    assert opening.text in str(raised)


def test_pairs(bench: Bench) -> None:
    """In turn, each with the time of its own middle, and nothing else touched."""
    driver = bench.open()
    bench.read(driver, 10)
    bench.check_samples(driver)
    assert [sample.seq for sample in bench.samples] == list(range(10))
    assert all(sample.status == Status.OK for sample in bench.samples)
    assert all(sample.t_hard_ns < sample.t_soft_ns for sample in bench.samples)
    assert not bench.kit.eeprom_touched
    starts = [c for c in bench.kit.chip.conversions if not c.lost][-20::2]
    span = starts[-1].begin - starts[0].begin
    assert bench.samples[-1].t_hard_ns - bench.samples[0].t_hard_ns == pytest.approx(span, rel=0.01)


def test_auto_capdac_centres_what_the_chip_really_has(bench: Bench) -> None:
    driver = bench.open(Configuration())
    assert driver.auto_capdac() == (driver.configuration.hard.capdac, driver.configuration.soft.capdac)
    [sample] = bench.read(driver, 1)
    # Half a step, and what the ramp adds until a late reading.
    assert max(abs(sample.hard), abs(sample.soft)) <= datasheet.DAC_STEP_PF
    # 6.92 and 4.69 pF in steps of 0.171 pF, this chip's, within what the ramps and half a step add.
    assert driver.configuration.hard.capdac == pytest.approx(6.92 / 0.171, abs=8.0)
    assert driver.configuration.hard.capdac - driver.configuration.soft.capdac == pytest.approx(13, abs=1)
    assert driver.describe()["registers"].split()[datasheet.CAPDAC_B] == "00"


@pytest.mark.parametrize(
    ("fault", "amount", "message"),
    [
        ("excitation shorted", 100, "EXCERR: the excitation pin is shorted or overloaded"),
        ("overload", 40, "no CAPDAC setting brings the idle signal into the range"),
    ],
)
def test_auto_capdac_says_why_there_is_no_setting(bench: Bench, fault: str, amount: float, message: str) -> None:
    driver = bench.open(Configuration())
    bench.fail(fault, amount)
    with pytest.raises(ProtocolError, match=message):
        driver.auto_capdac()


def test_single_channel_temperature_and_offset(bench: Bench) -> None:
    driver = bench.open(Configuration(capf=2, hard=Channel(offset=0x8100)))
    driver.auto_capdac()
    bench.kit.chip.temperature_C = 31.5
    assert driver.read_temperature() == 31.5
    hard, soft = driver.read_channel(HARD), driver.read_channel(SOFT)
    assert hard.middle.t_ns < soft.middle.t_ns
    assert [c.pin for c in bench.kit.chip.conversions][-2:] == [1, 2]
    assert hard.status == soft.status == Status.OK
    bench.read(driver, 2)
    bench.check_samples(driver)


def test_an_absent_chip_names_the_links_of_the_board(bench: Bench) -> None:
    bench.kit.chip.present = False
    with pytest.raises(
        ProtocolError, match="never answered; check the jumpers SDA, SCL and RDY of link LK2, and link LK1"
    ):
        bench.open()


def test_the_bumps_may_be_connected_the_other_way_round(bench: Bench) -> None:
    driver = bench.open(Configuration(hard_input=2))
    driver.auto_capdac()
    assert driver.configuration.hard.capdac < driver.configuration.soft.capdac
    driver.read_channel(HARD)
    assert bench.kit.chip.conversions[-1].pin == 2


def test_the_firmware_is_loaded(tmp_path: Path) -> None:
    with Bench(loaded=False) as bench:
        bench.firmware = tmp_path / "image.hex"
        bench.firmware.write_text(IMAGE)
        driver = bench.open()
        bench.kit.keeps_firmware = False
        bench.read(driver, 2)
        bench.fail("unplug", 0.1)
        bench.read(driver, 2)  # loaded again
        bench.check_samples(driver)
        assert driver.counters.reconnects == 1
        assert "pairs lost" in bench.notes[-1]


def test_a_firmware_that_locks_is_loaded_again(tmp_path: Path) -> None:
    with Bench() as bench:
        bench.firmware = tmp_path / "image.hex"
        bench.firmware.write_text(IMAGE)
        driver = bench.open()
        bench.fail("lock")
        bench.read(driver, 5)
        bench.check_samples(driver)
        assert driver.counters.reopened == 1
        assert driver.counters.lost == 1


def test_one_of_two_boards(bench: Bench) -> None:
    other = bench.another()
    bench.replug_s = 0.2
    first, second = sorted(boards(bench.carrier.backend()), key=lambda board: board.ports)
    assert first.ports == (1,)
    driver = bench.open(bus=second.bus, address=second.address)
    driver.read_channel(HARD)
    assert other.chip.conversions
    assert not bench.kit.chip.conversions
    bench.carrier.unplug(other)
    with pytest.raises(DeviceNotFound):  # the other board is not taken in its place
        bench.read(driver, 1)


def test_a_read_that_waits_is_interrupted(bench: Bench) -> None:
    bench.replug_s = 1e6
    driver = bench.open()
    bench.read(driver, 1)
    bench.carrier.unplug(bench.kit)
    waiting = threading.Thread(target=lambda: results.append(driver.read_pair(1)))
    results: list[object] = []
    waiting.start()
    while not bench.notes:
        time.sleep(0.001)
    driver.interrupt()
    waiting.join(30)
    assert results == [None]
    assert driver.read_pair(1) is None


def test_what_must_not_be_asked_is_refused_before_it_is_sent(bench: Bench) -> None:
    kit = bench.open_kit()
    with pytest.raises(ValueError, match="i2c_address: got 0x50, allowed: 0x48"):
        kit.read(0, 1, 0x50)
    with pytest.raises(ValueError, match="i2c_address: got 0x57"):
        kit.write(datasheet.CAPDAC_A, b"\0", 0x57)
    for count in (0, 65):
        with pytest.raises(ValueError, match=f"count: got {count}, allowed: 1 to 64"):
            kit.read(0, count)
    with pytest.raises(ValueError, match="in one burst"):
        kit.write(datasheet.CAP_SETUP, bytes([0x80, 0, 0x0B, 2, 0, 0]))
    assert not bench.kit.eeprom_touched
    kit.close()
    with pytest.raises(DeviceNotFound, match="is closed"):
        kit.read(0, 1)


@pytest.mark.parametrize("pairs", [250])
def test_a_touch_is_streamed(bench: Bench, pairs: int, tally: Tally) -> None:
    """None lost; the times are the twin's; the driver leaves the processor to others."""
    driver = bench.open()
    for _ in range(3 if bench.carrier.real else 1):  # in real time a busy machine may be late: then once more
        before, used = (driver.counters.lost, driver.counters.retries), time.thread_time()
        bench.read(driver, pairs)
        used = time.thread_time() - used
        if (driver.counters.lost, driver.counters.retries) == before:
            break
    bench.check_samples(driver)
    assert driver.counters.pairs + driver.counters.lost == len(bench.samples)
    if not bench.carrier.timely:
        return
    assert (driver.counters.lost, driver.counters.retries) == before
    samples = bench.samples[-pairs:]
    hard = [c for c in bench.kit.chip.conversions if not c.lost][-2 * pairs :: 2]
    told = (samples[-1].t_hard_ns - samples[0].t_hard_ns) / (pairs - 1)
    implied = (hard[-1].begin - hard[0].begin) / (pairs - 1)
    assert told == pytest.approx(implied, rel=0.01)
    offsets = [s.t_hard_ns - (c.begin + c.end) / 2 for s, c in zip(samples, hard, strict=True)]
    carrier = type(bench.carrier).__name__
    tally.say(
        f"{carrier}, {pairs} pairs: period {told / 1e6:.2f} ms (twin {implied / 1e6:.2f}), driver {used:.2f} s of processor"
    )
    assert sorted(offsets)[pairs // 2] - min(offsets) < 0.1 * implied
    if bench.carrier.real:
        assert used < 0.15 * told * pairs / 1e9
