"""The simulated chip on an I2C bus: smbus2's messages, no bus."""

import errno
import itertools
from functools import partial

import pytest
from kit_bench import CENTRED, Bus, pair_of, pins
from palpate.ad7746.bus import VirtualClock
from palpate.ad7746.driver import Ad7746
from palpate.ad7746.i2c import I2cBus
from palpate.ad7746.simulator.chip import SimulatedChip
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError, SourceError, SourceTimeout


@pytest.mark.parametrize(
    ("number", "before", "error", "text"),
    [
        (errno.ENOENT, True, DeviceNotFound, "no such bus"),
        (errno.EACCES, True, DeviceRefused, "usermod -aG i2c"),
        (errno.EREMOTEIO, False, ProtocolError, "not acknowledged"),
        (errno.ETIMEDOUT, False, SourceTimeout, "the bus is blocked"),
        (errno.EIO, False, ProtocolError, "failed"),
    ],
)
def test_a_bus_that_fails(number: int, before: bool, error: type[SourceError], text: str) -> None:
    """When it is opened, or for ever; a single failure is repeated. `test_board_sources.py` reads pairs."""
    bus = Bus(SimulatedChip(pins), VirtualClock())
    bus.clock.sleep(0.001)
    if before:
        bus.failures = [number]
        with pytest.raises(error, match=text):
            I2cBus("/dev/i2c-1", bus.clock, bus)
        return
    driver = Ad7746(I2cBus("/dev/i2c-1", bus.clock, bus), CENTRED, bus.clock)
    bus.deaf_reset = number == errno.EIO  # tolerated: the registers show the reset
    driver.start()
    bus.failures = [number]
    assert pair_of(driver, 0) is not None
    assert (driver.counters.errors, driver.counters.retries, driver.counters.pairs) == (1, 1, 1)
    bus.failures = [number] * 1000
    with pytest.raises(error, match=text):
        list(map(partial(pair_of, driver), itertools.count(1)))
    driver.close()
    driver.close()
    assert bus.opened == 0
    with pytest.raises(DeviceNotFound, match="closed"):
        driver.start()
