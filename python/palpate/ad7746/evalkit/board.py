"""The AD7746 evaluation kit on USB: a register bus over its firmware's vendor requests. Not tried on hardware.

Claiming the interface locks the board against other programs; the requests themselves do not need it.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from palpate.ad7746 import datasheet
from palpate.ad7746.bus import NotReady
from palpate.ad7746.clock import Clock, RealClock
from palpate.ad7746.evalkit.find import PRODUCT, VENDOR, Board, board_of, choose, devices, fresh, system_backend
from palpate.ad7746.evalkit.firmware import read_hex
from palpate.ad7746.evalkit.usberrors import NoFirmware, NotAllowed, translated
from palpate.errors import DeviceNotFound, DeviceRefused, MissingExtra, ProtocolError, SourceError, SourceTimeout

try:
    import usb.util
except ImportError as _missing:  # pragma: no cover
    raise MissingExtra("the evaluation kit needs pyusb: pip install 'palpate[usb]'") from _missing

TIMEOUT_MS = 200
TRANSFER_BYTES = 64
PORTS, I2C_PLAIN, I2C, ERROR_COUNT, RAM = 0xDB, 0xDC, 0xDD, 0xDF, 0xA0
"""Numbers of the vendor requests; RAM is of the FX2 chip itself, without firmware."""
IN, OUT = 0xC0, 0x40
CPUCS = 0xE600
"""Address for the RAM request: 1 keeps the processor of the board in reset, 0 starts it."""
RDY_PIN = 0x08
"""Bit of port A; low: ready."""
LED_PIN = 0x80
"""Bit of port A, an output; low: the red LED is on."""
_SETTLE_S = 2.0  # after the board is plugged in, until the permissions are set
_STARTING_S, _AGAIN_S = 1.0, 0.1  # longest start of the firmware after loading; poll interval
_LOADING_S = 3.0  # when opening: longest time for another program (udev, fxload) to load the firmware


class EvalKit:
    """One evaluation kit on USB, opened.

    Parameters
    ----------
    bus, address : int, optional
        Which board, if there are several.
    firmware : path-like, optional
        Intel HEX file, loaded if the board has no firmware. Default: the file that PALPATE_FIRMWARE names. Without
        one, another program has 3 s to load it.
    backend : usb.backend.IBackend, optional
        Backend of a simulated board. Default: libusb of the system.
    clock : Clock, optional
        Clock of the write times.

    Raises
    ------
    DeviceNotFound
        No such board, or several boards and none was named.
    DeviceRefused
        No permission, used by another program, or no firmware.
    MissingExtra
        No libusb.
    ProtocolError
        The firmware file is not valid Intel HEX.

    Examples
    --------
    >>> from palpate.ad7746.clock import VirtualClock
    >>> from palpate.ad7746.twin.usb import TwinBackend
    >>> from palpate.simulation.board import kit_of
    >>> from palpate.simulation.scenarios import SCENARIOS
    >>> clock = VirtualClock()
    >>> backend = TwinBackend(clock)  # a simulated board; leave it out for a real one
    >>> port = backend.plug(kit_of(SCENARIOS["tremor"], clock))
    >>> kit = EvalKit(backend=backend, clock=clock)
    >>> kit.read(0, 1).hex()
    '07'
    >>> kit.close()
    """

    def __init__(
        self,
        bus: int | None = None,
        address: int | None = None,
        *,
        firmware: str | Path | None = None,
        backend: Any = None,
        clock: Clock | None = None,
    ) -> None:
        self._acknowledged = False  # by the chip, ever
        path = firmware or os.environ.get("PALPATE_FIRMWARE")
        self._firmware = read_hex(Path(path)) if path else None
        self._backend = backend or system_backend()
        self._clock = clock or RealClock()
        self._named = bus is not None or address is not None
        self._refused_ns: int | None = None
        self._unloaded = False
        self._device = choose(self._backend, bus, address)
        self._board = board_of(self._device)
        self._take_when_loaded(lambda: choose(self._backend, bus, address))

    def read(self, register: int, count: int, i2c_address: int = datasheet.I2C_ADDRESS) -> bytes:
        """Return registers. All FF can mean "no answer", so the error counter of the board is read, too."""
        value = _on_bus(i2c_address)
        if not 1 <= count <= TRANSFER_BYTES:
            raise ValueError(f"count: got {count}, allowed: 1 to {TRANSFER_BYTES}")
        data = self._in(I2C, value, register, count)
        self._check_acknowledged(f"reading register 0x{register:02X}")
        return data

    def write(self, register: int, data: bytes, i2c_address: int = datasheet.I2C_ADDRESS) -> int:
        """Write registers; return when they were written, ns of the clock."""
        value = _on_bus(i2c_address)
        datasheet.check_write(register, data)
        self._out(I2C, value, register, data)
        written = self._clock.now_ns()
        self._check_acknowledged(f"writing register 0x{register:02X}")
        return written

    def ready(self) -> bool:
        """Return whether a conversion has ended, from the RDY# pin; without I2C."""
        return not self._in(PORTS, 0, 0, 1)[0] & RDY_PIN

    def reset(self) -> None:
        """Reset the AD7746."""
        self._out(I2C_PLAIN, _on_bus(datasheet.I2C_ADDRESS), 0, bytes([datasheet.RESET_POINTER]))
        self._check_acknowledged("resetting the AD7746")

    def blink(self, seconds: float, half_s: float = 0.125) -> None:
        """Let the red LED blink; then it, and the directions of the pins, are as before. No pin else is changed."""
        before = self._in(PORTS, 0, 0, 2)
        level, outputs = before
        try:
            for count in range(round(seconds / half_s)):
                shown = level | LED_PIN if count % 2 else level & ~LED_PIN
                self._out(PORTS, 0, 0, bytes([shown, outputs | LED_PIN]))
                self._clock.sleep(half_s)
        finally:
            self._out(PORTS, 0, 0, before)

    def reopen(self) -> None:
        """Open the board again: the one at the same ports if it was named, otherwise the only one."""
        self.close()
        self._backend = fresh(self._backend)
        found = [d for d in devices(self._backend) if not self._named or board_of(d)[::2] == self._board[::2]]
        if len(found) != 1:
            raise DeviceNotFound(f"the board at {self._board} was unplugged: plug it in again.")
        self._device, self._board = found[0], board_of(found[0])
        try:
            self._take()
        except NotAllowed as refused:
            now = self._clock.now_ns()
            self._refused_ns = self._refused_ns or now
            if now - self._refused_ns < _SETTLE_S * 1e9:
                raise DeviceNotFound(str(refused)) from refused
            raise
        except NoFirmware as refused:
            raise NotReady(str(refused)) from refused
        self._refused_ns = None

    def close(self) -> None:
        """Close the board."""
        if self._device is not None:
            usb.util.dispose_resources(self._device)
            self._device = None

    @property
    def board(self) -> Board:
        """The place of the board; another one after it was plugged in again."""
        return self._board

    def describe(self) -> dict[str, Any]:
        """Return the identity of the board; it has no serial number."""
        return {
            "name": "AD7746 evaluation kit",
            "usb": f"{VENDOR:04x}:{PRODUCT:04x}",
            "bus": self._board.bus,
            "address": self._board.address,
            "ports": list(self._board.ports),
        }

    def _take_when_loaded(self, find: Callable[[], Any]) -> None:
        deadline = self._clock.now_ns() + _LOADING_S * 1e9
        while True:
            try:
                return self._take()
            except NoFirmware:
                if self._clock.now_ns() > deadline:
                    raise
            self._clock.sleep(_AGAIN_S)
            self._device = find()
            self._board = board_of(self._device)

    def _take(self) -> None:
        try:
            if self._unloaded and not self._runs():  # not claimed: the program that loads it may want to claim it
                raise self._without_firmware()
            with translated(f"the board at {self._board}"):
                usb.util.claim_interface(self._device, 0)
            self._unloaded = not self._runs()
            if self._unloaded:
                self._load()
                self._unloaded = False
        except SourceError:
            self.close()
            raise

    def _runs(self) -> bool:
        """Return whether the firmware runs: only it answers to the error counter. Reading also clears the counter."""
        try:
            self._in(ERROR_COUNT, 0, 0, 1)
        except (SourceTimeout, ProtocolError):
            return False
        return True

    def _load(self) -> None:
        if self._firmware is None:
            raise self._without_firmware()
        self._out(RAM, CPUCS, 0, b"\1")
        for address, data in self._firmware.items():
            self._load_chunk(address, data)
        self._out(RAM, CPUCS, 0, b"\0")
        for _ in range(round(_STARTING_S / _AGAIN_S)):
            if self._runs():
                return
            self._clock.sleep(_AGAIN_S)
        raise DeviceRefused(
            f"the firmware was loaded into the board at {self._board} but does not answer: check the file"
        )

    def _without_firmware(self) -> NoFirmware:
        return NoFirmware(
            f"the board at {self._board} has no firmware (unplugging the board erases it), and no other program has "
            f"loaded it: give the path of Icv_usb.hex, which Analog Devices' software for the kit installs: "
            "--firmware PATH, or PALPATE_FIRMWARE. If it was already loaded, unplug the board for a moment"
        )

    def _load_chunk(self, address: int, data: bytes) -> None:
        for start in range(0, len(data), TRANSFER_BYTES):
            chunk = data[start : start + TRANSFER_BYTES]
            self._out(RAM, address + start, 0, chunk)
            if self._in(RAM, address + start, 0, len(chunk)) != chunk:
                raise ProtocolError(
                    f"firmware: verification failed at 0x{address + start:04X}: the value read back differs"
                )

    def _in(self, request: int, value: int, index: int, count: int) -> bytes:
        with translated(f"usb:{self._board}, request 0x{request:02X}"):
            data = bytes(self._opened.ctrl_transfer(IN, request, value, index, count, TIMEOUT_MS))
        if len(data) != count:
            raise ProtocolError(f"request 0x{request:02X}: got {len(data)} bytes, allowed: {count}: damaged transfer")
        return data

    def _out(self, request: int, value: int, index: int, data: bytes) -> None:
        with translated(f"usb:{self._board}, request 0x{request:02X}"):
            count = self._opened.ctrl_transfer(OUT, request, value, index, data, TIMEOUT_MS)
        if count != len(data):
            raise ProtocolError(
                f"request 0x{request:02X}: the board accepted {count} bytes of {len(data)}: damaged transfer"
            )

    def _check_acknowledged(self, what: str) -> None:
        errors = self._in(ERROR_COUNT, 0, 0, 1)[0]
        if errors and not self._acknowledged:
            raise ProtocolError(
                f"{what}: not acknowledged: the AD7746 has never answered; check the jumpers SDA, SCL and RDY of link "
                "LK2, and link LK1, its supply (5.0 V)"
            )
        if errors:
            raise ProtocolError(
                f"{what}: not acknowledged, errors counted by the board: {errors}; if it happens repeatedly, its "
                "firmware hangs: unplug the board for a moment"
            )
        self._acknowledged = True

    @property
    def _opened(self) -> Any:
        if self._device is None:
            raise DeviceNotFound(f"the board at {self._board} is closed: open it again.")
        return self._device


def _on_bus(i2c_address: int) -> int:
    """Return wValue of a transfer, for the only allowed address."""
    if i2c_address != datasheet.I2C_ADDRESS:
        raise ValueError(
            f"i2c_address: got 0x{i2c_address:02X}, allowed: 0x48; 0x50 to 0x57 is the memory with the board's identity"
        )
    return i2c_address << 1
