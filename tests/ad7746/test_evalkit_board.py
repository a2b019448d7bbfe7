"""What the board itself does, and what pyusb makes of it: on each carrier of `usb_carriers`, as `test_evalkit.py`."""

import gc
from collections.abc import Iterator
from typing import Any

import pytest
import usb.core
import usb.util
from kit_bench import Bench
from palpate.ad7746 import datasheet
from palpate.ad7746.evalkit.board import ERROR_COUNT, I2C, I2C_PLAIN, IN, LED_PIN, OUT, PORTS
from palpate.ad7746.evalkit.find import PRODUCT, VENDOR, devices
from palpate.ad7746.twin.kit import Reply
from palpate.errors import ProtocolError

_ADDRESS = datasheet.I2C_ADDRESS << 1


@pytest.fixture
def bench() -> Iterator[Bench]:
    with Bench() as bench:
        yield bench


def test_a_device_may_outlive_its_context(bench: Bench) -> None:
    """Or else libusb ends the process."""
    [device] = devices(bench.carrier.backend())
    gc.collect()
    assert device.idVendor == VENDOR


class Raw:
    """The board without the driver: every request of the table of what it does."""

    def __init__(self, bench: Bench) -> None:
        self.device = usb.core.find(idVendor=VENDOR, idProduct=PRODUCT, backend=bench.carrier.backend())

    def read(self, request: int, value: int, index: int, count: int, kind: int = IN, timeout: int = 200) -> bytes:
        return bytes(self.device.ctrl_transfer(kind, request, value, index, count, timeout))

    def write(self, request: int, value: int, index: int, data: bytes) -> int:
        return int(self.device.ctrl_transfer(OUT, request, value, index, data, 200))

    def errors(self) -> int:
        return self.read(ERROR_COUNT, 0, 0, 1)[0]


@pytest.fixture
def raw(bench: Bench) -> Iterator[Raw]:
    bench.carrier.clock.sleep(0.001)  # the chip is silent right after it is supplied
    raw = Raw(bench)
    yield raw
    usb.util.dispose_resources(raw.device)


def test_what_the_board_does_with_a_read(raw: Raw) -> None:
    reset = datasheet.RESET_VALUES[:7]
    assert raw.read(I2C, _ADDRESS, 0, 7) == reset
    assert raw.read(I2C, _ADDRESS | 1, 0, 7) == reset  # bit 0 is ignored
    assert raw.errors() == 0
    for nobody in (datasheet.I2C_ADDRESS, 0x42):
        assert raw.read(I2C, nobody, 0, 3) == b"\xff" * 3  # and the transfer succeeds
        assert raw.errors() == 1
        assert raw.errors() == 0  # reading clears it


def test_what_the_board_does_with_a_write(raw: Raw, bench: Bench) -> None:
    assert raw.write(I2C, _ADDRESS, datasheet.CAP_SETUP, bytes([0x80, 0x00, 0x63])) == 3
    assert raw.read(I2C, _ADDRESS, datasheet.CAP_SETUP, 3) == bytes([0x80, 0x00, 0x63])
    bench.fail("not acknowledged in mid-write", 2)
    raw.write(I2C, _ADDRESS, datasheet.CAPDAC_A, bytes([0x85, 0x86]))
    assert raw.errors() == 1
    assert raw.read(I2C, _ADDRESS, datasheet.CAPDAC_A, 2) == bytes([0x85, 0x00])  # what came before is written
    raw.write(I2C_PLAIN, _ADDRESS, 0, bytes([datasheet.RESET_POINTER]))
    bench.carrier.clock.sleep(0.001)
    assert raw.read(I2C, _ADDRESS, datasheet.CAP_SETUP, 8) == datasheet.RESET_VALUES[7:]
    assert raw.errors() == 0


def test_the_led_blinks_and_nothing_else_changes(raw: Raw, bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """The other pins, all directions, and RDY#, also after an error."""
    raw.write(PORTS, 0, 0, bytes([0x90, 0x10, 0x5A, 0x0F, 0x01, 0x00]))
    before, control, written = raw.read(PORTS, 0, 0, 6), bench.kit.control, []

    def noted(kind: int, request: int, *rest: Any) -> Reply:
        if (kind, request) == (OUT, PORTS):
            written.append(bytes(rest[-1]))
        return control(kind, request, *rest)

    monkeypatch.setattr(bench.kit, "control", noted)
    kit = bench.open_kit()
    kit.blink(0.4, 0.1)
    assert written == [bytes([level, 0x10 | LED_PIN]) for level in (0x18, 0x98, 0x18, 0x98)] + [before[:2]]
    bench.fail("stall", request=PORTS, skip=2)
    with pytest.raises(ProtocolError, match="refused the request"):
        kit.blink(0.4, 0.1)
    assert raw.read(PORTS, 0, 0, 6) == before
