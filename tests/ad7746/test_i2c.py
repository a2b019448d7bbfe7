"""The chip's twin on an I2C bus: smbus2's messages, no bus."""

import errno
import itertools

import pytest
from i2c_bus import Bus
from kit_bench import CENTRED, pins
from palpate.ad7746.clock import VirtualClock
from palpate.ad7746.driver import Ad7746
from palpate.ad7746.i2c import I2cBus
from palpate.ad7746.twin.chip import ChipTwin
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError, SourceError, SourceTimeout
from palpate.samples import Status
from smbus2 import i2c_msg


@pytest.fixture
def bus() -> Bus:
    clock = VirtualClock()
    return Bus(ChipTwin(pins), clock)


def open_driver(bus: Bus) -> Ad7746:
    return Ad7746(I2cBus("/dev/i2c-1", bus.clock, bus), CENTRED, bus.clock)


def test_pairs(bus: Bus) -> None:
    bus.clock.sleep(0.001)
    driver = open_driver(bus)
    driver.start()
    driver.auto_capdac()
    bus.failures = [errno.EREMOTEIO]
    samples = [driver.read_pair(number) for number in range(10)]
    codes = {(c.pin, c.code) for c in bus.chip.conversions}
    for sample in samples:
        assert sample is not None
        assert sample.status == Status.OK
        assert {(1, sample.hard_raw), (2, sample.soft_raw)} <= codes
    assert (driver.counters.errors, driver.counters.retries) == (1, 1)
    assert driver.read_temperature() == 25.0
    assert driver.describe()["device"] == {"name": "AD7746 on an I2C bus", "bus": "/dev/i2c-1", "address": 0x48}
    driver.close()
    driver.close()
    assert bus.opened == 0


@pytest.mark.parametrize(
    ("number", "error", "text"),
    [
        (errno.ENOENT, DeviceNotFound, "no such bus"),
        (errno.EACCES, DeviceRefused, "usermod -aG i2c"),
    ],
)
def test_a_bus_that_cannot_be_opened(bus: Bus, number: int, error: type[SourceError], text: str) -> None:
    bus.failures = [number]
    with pytest.raises(error, match=text):
        open_driver(bus)


@pytest.mark.parametrize(
    ("number", "error", "text"),
    [
        (errno.EREMOTEIO, ProtocolError, "not acknowledged"),
        (errno.ETIMEDOUT, SourceTimeout, "the bus is blocked"),
        (errno.EIO, ProtocolError, "failed"),
    ],
)
def test_a_bus_that_fails(bus: Bus, number: int, error: type[SourceError], text: str) -> None:
    bus.clock.sleep(0.001)
    driver = open_driver(bus)
    driver.start()
    bus.failures = [number] * 1000
    with pytest.raises(error, match=text):
        list(map(driver.read_pair, itertools.count()))


def test_a_closed_bus_is_not_used(bus: Bus) -> None:
    i2c = I2cBus("/dev/i2c-1", bus.clock, bus)
    with pytest.raises(ValueError, match="count: got 0, allowed: 1 to 19"):
        i2c.read(0, 0)
    i2c.close()
    with pytest.raises(DeviceNotFound, match="closed"):
        i2c.read(0, 1)


def test_smbus2_makes_these_messages() -> None:
    assert bytes(i2c_msg.write(0x48, [7, 0x80])) == b"\x07\x80"
