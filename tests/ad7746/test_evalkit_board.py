"""What the board itself does, and what pyusb makes of it: on each carrier of `usb_carriers`, as `test_evalkit.py`."""

import errno
import gc
from collections.abc import Iterator
from typing import Any

import pytest
import usb.core
import usb.util
from kit_bench import Bench
from palpate.ad7746 import datasheet
from palpate.ad7746.evalkit.board import ERROR_COUNT, I2C, I2C_PLAIN, IN, LED_PIN, OUT, PORTS, RDY_PIN
from palpate.ad7746.evalkit.find import PRODUCT, VENDOR, devices
from palpate.ad7746.twin.kit import Reply
from palpate.errors import DeviceRefused, ProtocolError

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
    del device
    gc.collect()


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


def test_what_the_board_does_with_a_wrong_length(raw: Raw) -> None:
    assert raw.read(I2C, _ADDRESS, 0, 0) == b""
    assert raw.errors() == 1
    assert raw.write(I2C, _ADDRESS, datasheet.CAP_SETUP, b"") == 0
    assert raw.errors() == 1
    raw.read(I2C, _ADDRESS, 0, 256)
    assert raw.errors() == 1


@pytest.mark.parametrize(("kind", "request_number"), [(IN, 0x55), (0xC1, I2C)])
def test_what_the_board_does_not_know_it_does_not_answer(raw: Raw, kind: int, request_number: int) -> None:
    with pytest.raises(usb.core.USBTimeoutError):
        raw.read(request_number, 0, 0, 1, kind)
    assert raw.errors() == 0


def test_the_pin_and_the_led(raw: Raw, bench: Bench) -> None:
    assert raw.read(PORTS, 0, 0, 1)[0] & RDY_PIN
    raw.write(I2C, _ADDRESS, datasheet.CAP_SETUP, bytes([datasheet.CAPEN, 0, 0x23, datasheet.SINGLE]))
    bench.carrier.clock.sleep(0.02)
    assert not raw.read(PORTS, 0, 0, 1)[0] & RDY_PIN
    assert raw.read(I2C, _ADDRESS, 0, 4)[0] & datasheet.RDYCAP == 0
    assert raw.read(PORTS, 0, 0, 1)[0] & RDY_PIN  # reading the data made it high
    raw.write(PORTS, 0, 0, bytes([0x00]))
    assert not raw.read(PORTS, 0, 0, 1)[0] & 0x80


@pytest.mark.parametrize("outputs", [0x80, 0x90, 0x00])
def test_the_led_blinks_and_nothing_else_changes(
    raw: Raw, bench: Bench, outputs: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other pins, all directions, and RDY#; a board that measures is refused."""
    raw.write(PORTS, 0, 0, bytes([0x90, outputs, 0x5A, 0x0F, 0x01, 0x00]))
    before, control, written = raw.read(PORTS, 0, 0, 6), bench.kit.control, []

    def noted(kind: int, request: int, value: int, index: int, length: int, data: bytes = b"") -> Reply:
        if (kind, request) == (OUT, PORTS):
            written.append(bytes(data))
        return control(kind, request, value, index, length, data)

    monkeypatch.setattr(bench.kit, "control", noted)
    kit = bench.open_kit()
    kit.blink(0.4, 0.1)
    assert written == [bytes([level, outputs | LED_PIN]) for level in (0x18, 0x98, 0x18, 0x98)] + [before[:2]]
    assert raw.read(PORTS, 0, 0, 6) == before
    bench.fail("stall", request=PORTS, skip=2)
    with pytest.raises(ProtocolError, match="refused the request"):
        kit.blink(0.4, 0.1)
    assert raw.read(PORTS, 0, 0, 6) == before  # also after an error
    with pytest.raises(DeviceRefused, match="another program uses the board"):
        bench.open_kit()


@pytest.mark.parametrize(
    ("kind", "number", "error"),
    [
        ("stall", errno.EPIPE, usb.core.USBError),
        ("line error", errno.EIO, usb.core.USBError),
        ("babble", errno.EOVERFLOW, usb.core.USBError),
        ("no answer", errno.ETIMEDOUT, usb.core.USBTimeoutError),
        ("unplug", errno.ENODEV, usb.core.USBError),
    ],
)
def test_what_pyusb_makes_of_a_fault(raw: Raw, bench: Bench, kind: str, number: int, error: Any) -> None:
    bench.fail(kind, float("inf"))
    with pytest.raises(usb.core.USBError) as raised:
        raw.read(I2C, _ADDRESS, 0, 4)
    assert type(raised.value) is error
    assert raised.value.errno == number
    if kind == "unplug":
        with pytest.raises(usb.core.USBError, match=r"[Nn]o such device"):
            raw.errors()  # the old one stays dead
    else:
        assert raw.errors() == 0  # not sticky


def test_a_late_answer_is_not_the_next_ones(raw: Raw, bench: Bench) -> None:
    bench.kit.chip.registers[datasheet.CAPDAC_A] = 0xAA
    bench.fail("late", 0.15)
    with pytest.raises(usb.core.USBTimeoutError):
        raw.read(I2C, _ADDRESS, datasheet.CAPDAC_A, 1, timeout=50)
    bench.kit.chip.registers[datasheet.CAPDAC_A] = 0x55
    bench.carrier.clock.sleep(0.2)
    assert raw.read(I2C, _ADDRESS, datasheet.CAPDAC_A, 1) == b"\x55"


def test_a_claim_keeps_others_from_claiming_only(raw: Raw, bench: Bench) -> None:
    other = Raw(bench)
    usb.util.claim_interface(raw.device, 0)
    with pytest.raises(usb.core.USBError) as raised:
        usb.util.claim_interface(other.device, 0)
    assert raised.value.errno == errno.EBUSY
    assert other.errors() == 0  # a request goes through
    usb.util.dispose_resources(raw.device)
    usb.util.claim_interface(other.device, 0)
    usb.util.dispose_resources(other.device)


def test_capdacs_in_the_configuration_burst_would_come_too_late(raw: Raw, bench: Bench) -> None:
    """Why `check_write` refuses it: the twin begins the conversion with the CAPDACs as they were."""
    raw.write(I2C, _ADDRESS, datasheet.CAP_SETUP, bytes([datasheet.CAPEN, 0, 0x23, datasheet.SINGLE, 0x80 | 41, 0]))
    bench.carrier.clock.sleep(0.02)
    code = int.from_bytes(raw.read(I2C, _ADDRESS, 0, 4)[1:], "big")
    assert datasheet.saturated(code)  # 6.92 pF, nothing taken away


def test_a_conversion_that_ends_while_data_are_read_is_lost(raw: Raw, bench: Bench) -> None:
    clock = bench.carrier.clock
    now = clock.now_ns()
    bench.kit.chip.write(bytes([datasheet.CAP_SETUP, datasheet.CAPEN, 0, 0x23, datasheet.SINGLE]), now)
    bench.kit.chip.write(b"\0", now)
    bench.kit.chip.read(4, now + 10_900_000, 200_000)
    assert bench.kit.chip.rdy_pin(now + 20_000_000)
    assert bench.kit.chip.conversions[-1].lost
