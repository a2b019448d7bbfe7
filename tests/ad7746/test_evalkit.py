"""The simulated evaluation kit: the driver, the board itself, and boards that come and go. On each carrier of `kit_bench`."""

import gc
import math
import re
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from functools import reduce
from operator import or_
from pathlib import Path
from typing import Any

import pytest
from effort import Tally
from kit_bench import CENTRED, Bench, pair_of
from palpate.ad7746 import registers
from palpate.ad7746.configuration import HARD, Configuration
from palpate.ad7746.driver import Ad7746
from palpate.ad7746.evalkit.discovery import VENDOR, list_boards, usb_devices
from palpate.ad7746.evalkit.usb_bus import ERROR_COUNT, I2C, I2C_PLAIN, PORTS
from palpate.ad7746.simulator.evalboard import Fault, FaultKind
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError, SourceError, SourceTimeout
from palpate.samples import Status
from palpate.sources.board import BoardSource, ConverterOptions
from recording_bench import SampleReader, soon

FOREVER = math.inf
# pairs to read after a fault: if the driver must continue, and at most until it must raise
PAIRS = 2
ENOUGH = 20
ANY = -1  # any count: it depends on the timing
IMAGE = ":03000000020100FA\n:00000001FF\n"

_ONCE = {"errors": 1, "retries": 1}
_OUT = Status.HARD_SATURATED | Status.SOFT_SATURATED
# A fault while reading, and what it leads to: counters without zeros, and the flags of all samples.
SURVIVED: dict[str, tuple[Fault, dict[str, int], Status]] = {
    "a request is not answered, once": (Fault(FaultKind.NO_ANSWER), _ONCE, Status.OK),
    "a request is refused (stall), once": (Fault(FaultKind.STALL), _ONCE, Status.OK),
    "fewer bytes than asked for, once": (Fault(FaultKind.SHORT, 2, skip=2, request=I2C), _ONCE | {"lost": 1}, Status.OK),
    "an answer comes too late, once": (Fault(FaultKind.LATE, 0.25), _ONCE, Status.OK),
    "the AD7746 does not acknowledge, once: all data are FF": (Fault(FaultKind.NOT_ACKNOWLEDGED), _ONCE, Status.OK),
    "one access fails three times": (
        Fault(FaultKind.STALL, request=I2C, times=3), {"errors": 3, "retries": 2, "lost": 1}, Status.OK),
    "a conversion is lost": (Fault(FaultKind.LOST_CONVERSION), {"lost": 1}, Status.OK),
    "the AD7746's supply fails for a moment": (Fault(FaultKind.BROWN_OUT, request=PORTS), {"lost": 1}, Status.OK),
    "the excitation is shorted": (Fault(FaultKind.EXCITATION_SHORTED, 2), {}, Status.EXCITATION),
    "the input leaves the range": (Fault(FaultKind.OVERLOAD, 9.0), {}, _OUT),
    "unplugged, and back a moment later": (Fault(FaultKind.UNPLUG, 0.2), {"reconnects": 1, "lost": ANY}, Status.OK),
}  # fmt: skip
# A fault while reading, and the error: its class and a part of its text.
FATAL: dict[str, tuple[Fault, type[SourceError], str]] = {
    "RDY# is stuck high": (
        Fault(FaultKind.RDY_STUCK_HIGH),
        ProtocolError,
        "stuck high: STATUS shows another state",
    ),
    "RDY# is stuck low, on a slow chip": (
        Fault(FaultKind.RDY_STUCK_LOW),
        ProtocolError,
        "check the jumper RDY of link LK2",
    ),
    "unplugged": (
        Fault(FaultKind.UNPLUG, FOREVER),
        DeviceNotFound,
        "was unplugged: plug it in again",
    ),
    "the firmware has locked": (
        Fault(FaultKind.LOCK),
        DeviceRefused,
        "unplug the board for a moment",
    ),
    "every request is refused": (
        Fault(FaultKind.STALL, times=FOREVER),
        DeviceRefused,
        "has no firmware",
    ),
    "every transfer is damaged": (
        Fault(FaultKind.LINE_ERROR, 1, 0, I2C, FOREVER),
        ProtocolError,
        "another cable or port",
    ),
    "the AD7746 is gone": (Fault(FaultKind.CHIP_ABSENT), ProtocolError, "not acknowledged"),
    "no conversion ends": (Fault(FaultKind.LOST_CONVERSION, 1e9), SourceTimeout, "not clocked"),
    "another program switches the input": (
        Fault(FaultKind.OTHER_INPUT, 1e9),
        ProtocolError,
        "another program uses the board",
    ),
}


def _dead_image(bench: Bench) -> None:
    assert bench.firmware
    bench.firmware.write_text(IMAGE)
    bench.fail(FaultKind.STALL, request=ERROR_COUNT, times=FOREVER)


BARE = {"loaded": False}
# What the bench is made with, what happens before the board is opened, and the error: its class and a part of its text.
OPENING: dict[str, tuple[dict[str, Any], Callable[[Bench], object], type[SourceError], str]] = {
    "no board": ({"plugged": False}, id, DeviceNotFound, "found: check the cable"),
    "two boards, none named": ({}, Bench.another, DeviceNotFound, "choose one of usb:1/"),
    "used by another program": (
        {},
        Bench.open_kit,
        DeviceRefused,
        "another program uses the board",
    ),
    "no firmware": (BARE, id, DeviceRefused, "no other program has loaded it: give"),
    "a firmware that does not run": (BARE, _dead_image, DeviceRefused, "does not answer"),
}


def counted(driver: Ad7746) -> dict[str, int]:
    """Return the counters without zeros and pairs."""
    return {
        name: count for name, count in asdict(driver.counters).items() if count and name != "pairs"
    }


@pytest.fixture
def bench() -> Iterator[Bench]:
    with Bench() as bench:
        yield bench


def begun(bench: Bench, fault: Fault) -> Ad7746:
    """Return the driver after a pair, with a fault to come; the chip is slow."""
    bench.replug_s = 1.0
    bench.kit.chip.pace = 1.05
    driver = bench.open(CENTRED)
    bench.read(driver, 1)
    bench.kit.faults.append(replace(fault))
    return driver


@pytest.mark.parametrize("name", SURVIVED)
def test_a_fault_that_reading_survives(name: str, bench: Bench) -> None:
    fault, counters, flags = SURVIVED[name]
    driver = begun(bench, fault)
    bench.read(driver, PAIRS)
    any_count = {name: ANY for name in counted(driver) if counters.get(name) == ANY}
    assert counted(driver) | any_count == counters
    bench.check_samples(driver)
    assert reduce(or_, (Status(sample.status) for sample in bench.samples)) & ~Status.LOST == flags


@pytest.mark.parametrize("name", FATAL)
def test_a_fault_that_ends_reading(name: str, bench: Bench) -> None:
    fault, error, text = FATAL[name]
    driver = begun(bench, fault)
    with pytest.raises(error, match=re.escape(text)):
        bench.read(driver, ENOUGH)
    bench.check_samples(driver)
    assert {sample.status for sample in bench.samples} <= {Status.OK, Status.LOST}


@pytest.mark.parametrize("name", OPENING)
def test_a_fault_while_opening(name: str, tmp_path: Path) -> None:
    made, prepare, error, text = OPENING[name]
    with Bench(**made) as bench:
        bench.firmware = tmp_path / "image.hex" if prepare is _dead_image else None
        prepare(bench)
        with pytest.raises(error, match=text):
            bench.open_kit()


def test_another_address_and_no_permission(bench: Bench) -> None:
    with pytest.raises(DeviceNotFound, match="found: usb:1/"):
        bench.open_kit(bus=1, address=99)
    with (
        bench.carrier.denied(bench.kit),
        pytest.raises(DeviceRefused, match="doctor --install-udev"),
    ):
        bench.open_kit()


def test_auto_capdac_centres_what_the_chip_really_has(bench: Bench) -> None:
    driver = bench.open(Configuration())
    assert driver.auto_capdac() == (
        driver.configuration.hard.capdac,
        driver.configuration.soft.capdac,
    )
    [sample] = bench.read(driver, 1)
    # half a step, and what the ramp adds
    assert max(abs(sample.hard), abs(sample.soft)) <= registers.DAC_STEP_PF
    # 6.92 and 4.69 pF in steps of 0.171 pF, this chip's, within what the ramps and half a step add.
    assert driver.configuration.hard.capdac == pytest.approx(6.92 / 0.171, abs=8.0)
    assert driver.configuration.hard.capdac - driver.configuration.soft.capdac == pytest.approx(
        13, abs=1
    )


def test_auto_capdac_says_why_there_is_no_setting(bench: Bench) -> None:
    driver = bench.open(Configuration())
    bench.fail(FaultKind.EXCITATION_SHORTED, 100)
    with pytest.raises(ProtocolError, match="EXCERR: the excitation pin is shorted or overloaded"):
        driver.auto_capdac()


def test_a_chip_that_does_not_acknowledge_its_reset_byte(bench: Bench) -> None:
    """Tolerated for this byte alone: what follows is acknowledged, and shows the reset."""
    bench.fail(FaultKind.PARTLY_ACKNOWLEDGED, 1, request=I2C_PLAIN)  # the byte arrives
    driver = bench.open()
    assert bench.read(driver, 1)[-1].status == Status.OK
    assert counted(driver) == {}
    for kind, tries, request in (
        (FaultKind.NOT_ACKNOWLEDGED, 9, I2C_PLAIN),
        (FaultKind.NOT_ACKNOWLEDGED, 3, I2C),
    ):
        # the byte does not arrive; the next access fails, too
        bench.fail(kind, request=request, times=tries)
        with pytest.raises(ProtocolError, match="not acknowledged"):
            driver.start()
        bench.kit.faults.clear()


@pytest.mark.parametrize("fault", [FaultKind.UNPLUG, FaultKind.LOCK])
def test_the_firmware_is_loaded_at_the_begin_and_again(fault: FaultKind, tmp_path: Path) -> None:
    with Bench(loaded=False) as bench:
        bench.firmware = tmp_path / "image.hex"
        bench.firmware.write_text(IMAGE)
        driver = bench.open()
        bench.kit.keeps_firmware = False
        bench.read(driver, 2)
        bench.fail(fault, 0.1)
        bench.read(driver, 3)
        bench.check_samples(driver)
        assert (driver.counters.reconnects, driver.counters.reopened) == (
            (1, 0) if fault == FaultKind.UNPLUG else (0, 1)
        )


def test_one_of_two_boards(bench: Bench) -> None:
    other = bench.another()
    bench.replug_s = 0.2
    first, second = sorted(list_boards(bench.carrier.backend()), key=lambda board: board.ports)
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
    waiting = threading.Thread(target=lambda: results.append(pair_of(driver, 1)))
    results: list[object] = []
    waiting.start()
    while not bench.notes:
        time.sleep(0.001)
    driver.interrupt()
    waiting.join(30)
    assert results == [None]
    assert pair_of(driver, 1) is None


def test_a_touch_is_streamed(bench: Bench, tally: Tally) -> None:
    """No pair is lost; the period is that of the simulated board; the driver leaves the processor to other threads."""
    driver = bench.open()
    pairs = 250
    # in real time a busy machine may be late: then once more
    for _ in range(3 if bench.carrier.real else 1):
        before = (driver.counters.lost, driver.counters.retries)
        used = time.thread_time()
        samples = bench.read(driver, pairs)[-pairs:]
        used = time.thread_time() - used
        if (driver.counters.lost, driver.counters.retries) == before:
            break
    bench.check_samples(driver)
    assert (driver.counters.lost, driver.counters.retries) == before
    hard = [c for c in bench.kit.chip.conversions if not c.lost][-2 * pairs :: 2]
    period_ns = (samples[-1].t_hard_ns - samples[0].t_hard_ns) / (pairs - 1)
    assert period_ns == pytest.approx((hard[-1].begin - hard[0].begin) / (pairs - 1), rel=0.01)
    tally.say(
        f"{type(bench.carrier).__name__}, {pairs} pairs: {period_ns / 1e6:.2f} ms a pair, {used:.2f} s of processor"
    )
    assert not bench.carrier.real or used < 0.15 * period_ns * pairs / 1e9


def test_a_device_may_outlive_its_context(bench: Bench) -> None:
    """Or else libusb ends the process."""
    [device] = usb_devices(bench.carrier.backend())
    gc.collect()
    assert device.idVendor == VENDOR


def test_a_second_board_disturbs_nothing(bench: Bench) -> None:
    source = BoardSource(bench.open_kit(), ConverterOptions(), bench.carrier.clock)
    with source:
        samples = SampleReader(source)
        next(samples)
        other = bench.another()
        next(samples)
        bench.carrier.unplug(other)
        next(samples)
        assert not other.chip.conversions
        if not bench.carrier.real:  # in real time a busy machine may lose a pair itself
            assert (source.counters["lost"], source.counters["errors"]) == (0, 0)
            assert bench.carrier.backend().opened == 1


def test_the_board_that_measures_is_unplugged_and_comes_back(bench: Bench) -> None:
    """The driver reports that it is gone, once, with its name, and that it is back."""
    kit = bench.open_kit()
    source = BoardSource(kit, ConverterOptions(replug=1e6), bench.carrier.clock)
    notes: list[str] = []
    source.notify = notes.append
    with source:
        first = kit.board
        samples = SampleReader(source)
        next(samples)
        bench.carrier.unplug(bench.kit)
        reading = threading.Thread(target=lambda: next(samples))
        reading.start()
        soon(lambda: notes)
        bench.carrier.plug(bench.kit)
        reading.join(30)
        assert kit.board != first
    gone = notes[0]
    assert gone.startswith(f"usb:{first}, ")
    assert "was unplugged" in gone
    assert sum("was unplugged" in note for note in notes) == 1
    assert sum("is back after" in note for note in notes) == 1
