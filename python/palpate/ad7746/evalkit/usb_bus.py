"""The AD7746 evaluation kit on USB: a register bus over its firmware's vendor requests.

Not tried on hardware. The licence of the firmware (`Icv_usb.hex`) does not allow to distribute it:
it is a part of the software of Analog Devices for the kit, and the user gives its path. The file is
checked completely before it is written to the board. Claiming the interface locks the board against
other programs; the requests themselves do not need it.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from palpate.ad7746 import registers
from palpate.ad7746.bus import BusIdentity, Clock, NotAcknowledged, NotReady, RealClock
from palpate.ad7746.evalkit import discovery
from palpate.ad7746.evalkit.discovery import REPLUG, Board, board_of, translated
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError, SourceError, SourceTimeout
from palpate.files import read_bytes

RAM_BYTES = 0x4000  # Size of the program and data RAM of the FX2LP, from address 0.
# Bytes of a firmware file, at most: the whole RAM in records of one byte is a quarter of this.
LARGEST = 1_000_000
CPUCS = 0xE600  # 1 at this address keeps the processor of the board in reset, 0 starts it.
_CHUNK = 64  # bytes of a transfer
_END = ":00000001FF"


def read_hex(path: Path) -> dict[int, bytes]:
    """Read a firmware image."""
    try:
        return parse_hex(read_bytes(path, LARGEST).decode("ascii"))
    except OSError as error:
        raise ProtocolError(f"firmware {path}: {error.strerror}: check the path") from error
    except ValueError as error:
        raise ProtocolError(
            f"firmware {path}: {error}; the file is damaged or for another board"
        ) from error


def parse_hex(text: str) -> dict[int, bytes]:
    """Parse Intel HEX, as address -> data: records of type 0 (data), then one of type 1 (end)."""
    lines = text.split()
    if not lines or lines[-1].upper() != _END:
        raise ValueError(f"no end record: the last line is not {_END}, the file is incomplete")
    image = {}
    for number, line in enumerate(lines[:-1], 1):
        address, data = _data_record(line, number)
        image[address] = data
    if 0 not in image:
        raise ValueError("no data at address 0, where the processor starts")
    return image


def _data_record(line: str, number: int) -> tuple[int, bytes]:
    """Return address and data of a record: length, address (2 bytes), type, data, checksum."""
    try:
        raw = bytes.fromhex(line.removeprefix(":"))
    except ValueError:
        raw = b""
    if not line.startswith(":") or len(raw) < 5 or len(raw) != raw[0] + 5 or raw[3] != 0:
        allowed = "a data record, as long as it says"
        raise ValueError(f"line {number}: got {line[:20]!r}, allowed: {allowed}")
    if sum(raw) & 0xFF:
        right = -sum(raw[:-1]) & 0xFF
        raise ValueError(f"line {number}: checksum: got 0x{raw[-1]:02X}, allowed: 0x{right:02X}")
    address = int.from_bytes(raw[1:3], "big")
    if address + raw[0] > RAM_BYTES:
        allowed = f"all data below 0x{RAM_BYTES:X}"
        raise ValueError(f"line {number}: address: got 0x{address:X}, allowed: {allowed}")
    return address, raw[4:-1]


def transfer(
    image: dict[int, bytes], write: Callable[[int, bytes], None], read: Callable[[int, int], bytes]
) -> None:
    """Write an image into the RAM of the board, verify it, and start it.

    `write(address, data)` and `read(address, count)` access the RAM.
    """
    write(CPUCS, b"\1")
    for begin, data in image.items():
        for offset in range(0, len(data), _CHUNK):
            address = begin + offset
            chunk = data[offset : offset + _CHUNK]
            write(address, chunk)
            if read(address, len(chunk)) != chunk:
                why = "the value read back differs"
                raise ProtocolError(f"firmware: verification failed at 0x{address:04X}: {why}")
    write(CPUCS, b"\0")


TIMEOUT_MS = 200
# Numbers of the vendor requests; RAM is of the FX2 chip itself, without firmware.
PORTS = 0xDB
I2C_PLAIN = 0xDC
I2C = 0xDD
ERROR_COUNT = 0xDF
RAM = 0xA0
IN = 0xC0
OUT = 0x40
# wValue of a transfer. 0x50 to 0x57 is the memory with the board's identity: never use it.
_ON_BUS = registers.I2C_ADDRESS << 1
RDY_PIN = 0x08  # Bit of port A; low: ready.
_STARTING_S = 1.0  # longest start of the firmware after loading
_POLL_S = 0.1
# When the board is opened: longest time for other programs (udev, fxload) to set permissions and
# load the firmware.
_READY_S = 3.0


class EvalKit:
    """One evaluation kit on USB, opened.

    Parameters
    ----------
    bus, address : int, optional
        Which board, if there are several.
    firmware : path-like, optional
        Intel HEX file, loaded if the board has no firmware. Default: the file that PALPATE_FIRMWARE
        names. Without one, another program has 3 s to load it.
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
    >>> from palpate.ad7746.bus import VirtualClock
    >>> from palpate.ad7746.simulator.usb_backend import SimulatedUsb
    >>> from palpate.simulation.board_input import simulated_board
    >>> from palpate.simulation.scenarios import SCENARIOS
    >>> clock = VirtualClock()
    >>> backend = SimulatedUsb(clock)  # leave the backend out for a real board
    >>> port = backend.plug(simulated_board(SCENARIOS["tremor"], clock))
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
        path = firmware or os.environ.get("PALPATE_FIRMWARE")
        self._firmware = read_hex(Path(path)) if path else None
        self._backend = backend or discovery.system_backend()
        self._clock = clock or RealClock()
        self._named = bus is not None or address is not None
        self.board: Board  # its place; another one after it was plugged in again
        self._acknowledged = False  # by the chip, ever
        self._unloaded = False  # the firmware, when it was looked for last
        self._device: Any = None
        deadline = self._clock.now_ns() + _READY_S * 1e9
        while self._device is None:
            try:
                self._take(discovery.choose_device(self._backend, bus, address))
            except NotReady:
                if self._clock.now_ns() > deadline:
                    raise
                self._clock.sleep(_POLL_S)

    def read(self, register: int, count: int) -> bytes:
        """Return registers. All FF can mean "no answer": the board's error counter is read, too."""
        data = self._in(I2C, _ON_BUS, register, count)
        self._check_acknowledged(f"reading register 0x{register:02X}")
        return data

    def write(self, register: int, data: bytes) -> int:
        """Write registers; return when they were written, ns of the clock."""
        registers.check_write(register, data)
        self._out(I2C, _ON_BUS, register, data)
        written = self._clock.now_ns()
        self._check_acknowledged(f"writing register 0x{register:02X}")
        return written

    def ready(self) -> bool:
        """Return whether a conversion has ended, from the RDY# pin; without I2C."""
        return not self._in(PORTS, 0, 0, 1)[0] & RDY_PIN

    def reset(self) -> None:
        """Reset the AD7746."""
        self._out(I2C_PLAIN, _ON_BUS, 0, bytes([registers.RESET_POINTER]))
        self._check_acknowledged("resetting the AD7746")

    def reopen(self) -> None:
        """Open the board again: at the same ports if it was named, otherwise the only one."""
        self.close()
        self._backend = discovery.new_context(self._backend)
        found = discovery.usb_devices(self._backend)
        if self._named:
            found = [device for device in found if board_of(device).is_at(self.board)]
        if len(found) != 1:
            raise DeviceNotFound(f"the board at {self.board} was unplugged: plug it in again.")
        self._take(found[0])

    def close(self) -> None:
        """Close the board."""
        if self._device is not None:
            discovery.util.dispose_resources(self._device)
            self._device = None

    def describe(self) -> BusIdentity:
        """Return the identity of the board."""
        return {
            "name": "AD7746 evaluation kit",
            "usb": f"{discovery.VENDOR:04x}:{discovery.PRODUCT:04x}",
            "bus": self.board.bus,
            "address": self.board.address,
            "ports": list(self.board.ports),
        }

    def _take(self, device: Any) -> None:
        """Claim a device, and load its firmware."""
        self._device = device
        self.board = board_of(device)
        try:
            if self._unloaded and not self._firmware and not self._runs():
                # Not claimed: the program that loads the firmware may want to claim it.
                raise self._no_firmware()
            with translated(f"the board at {self.board}"):
                discovery.util.claim_interface(device, 0)
            self._unloaded = not self._runs()
            if self._unloaded:
                self._load()
                self._unloaded = False
        except SourceError:
            self.close()
            raise

    def _runs(self) -> bool:
        """Return whether the firmware runs. Only it answers this request, which clears the count."""
        try:
            self._in(ERROR_COUNT, 0, 0, 1)
        except (SourceTimeout, ProtocolError):
            return False
        return True

    def _load(self) -> None:
        if self._firmware is None:
            raise self._no_firmware()
        transfer(
            self._firmware,
            lambda address, data: self._out(RAM, address, 0, data),
            lambda address, count: self._in(RAM, address, 0, count),
        )
        for _ in range(round(_STARTING_S / _POLL_S)):
            if self._runs():
                return
            self._clock.sleep(_POLL_S)
        place = f"the board at {self.board}"
        raise DeviceRefused(
            f"the firmware was loaded into {place} but does not answer: check the file"
        )

    def _no_firmware(self) -> NotReady:
        return NotReady(
            f"the board at {self.board} has no firmware (unplugging the board erases it), and no "
            "other program has loaded it: give the path of Icv_usb.hex, which Analog Devices' "
            "software for the kit installs: --firmware PATH, or PALPATE_FIRMWARE. If it was already "
            "loaded, unplug the board for a moment"
        )

    def _in(self, request: int, value: int, index: int, count: int) -> bytes:
        with translated(f"usb:{self.board}, request 0x{request:02X}"):
            data = bytes(self._opened.ctrl_transfer(IN, request, value, index, count, TIMEOUT_MS))
        if len(data) != count:
            got = f"got {len(data)} bytes, allowed: {count}"
            raise ProtocolError(f"request 0x{request:02X}: {got}: damaged transfer")
        return data

    def _out(self, request: int, value: int, index: int, data: bytes) -> None:
        with translated(f"usb:{self.board}, request 0x{request:02X}"):
            count = self._opened.ctrl_transfer(OUT, request, value, index, data, TIMEOUT_MS)
        if count != len(data):
            part = f"{count} bytes of {len(data)}"
            raise ProtocolError(f"request 0x{request:02X}: {part} were accepted: damaged transfer")

    def _check_acknowledged(self, what: str) -> None:
        errors = self._in(ERROR_COUNT, 0, 0, 1)[0]
        if not errors:
            self._acknowledged = True
            return
        if self._acknowledged:
            why = (
                f"errors counted by the board: {errors}; if it happens repeatedly, "
                f"its firmware hangs: {REPLUG}"
            )
        else:
            why = (
                "the AD7746 has never answered; check the jumpers SDA, SCL and RDY of link LK2, "
                "and link LK1, its supply (5.0 V)"
            )
        raise NotAcknowledged(f"{what}: not acknowledged: {why}")

    @property
    def _opened(self) -> Any:
        if self._device is None:
            raise DeviceNotFound(f"the board at {self.board} is closed: open it again.")
        return self._device
