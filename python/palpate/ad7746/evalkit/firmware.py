"""The firmware of the board: Intel HEX files, checked completely before they are written to it, and the transfer.

The licence of the firmware (`Icv_usb.hex`) does not allow to distribute it: it comes with the software of Analog
Devices for the kit, and the user gives its path.
"""

from collections.abc import Callable
from pathlib import Path

from palpate.errors import ProtocolError
from palpate.files import read_bytes

RAM_BYTES = 0x4000  # Size of the program and data RAM of the FX2LP, from address 0.
LARGEST = 1_000_000  # Bytes of a firmware file, at most: the whole RAM in records of one byte is a quarter of this.
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
        raise ProtocolError(f"firmware {path}: {error}; the file is damaged or for another board") from error


def parse_hex(text: str) -> dict[int, bytes]:
    """Parse Intel HEX, as address -> data: records of type 0 (data), then one of type 1 (end)."""
    *lines, last = text.split() or [""]
    if last.upper() != _END:
        raise ValueError(f"no end record: the last line is not {_END}, the file is incomplete")
    image = dict(_data(line, number) for number, line in enumerate(lines, 1))
    if 0 not in image:
        raise ValueError("no data at address 0, where the processor starts")
    return image


def _data(line: str, number: int) -> tuple[int, bytes]:
    try:
        raw = bytes.fromhex(line.removeprefix(":"))
    except ValueError:
        raw = b""
    if not line.startswith(":") or len(raw) < 5 or len(raw) != raw[0] + 5 or raw[3] != 0:
        raise ValueError(f"line {number}: got {line[:20]!r}, allowed: a data record, as long as it says")
    if sum(raw) & 0xFF:
        raise ValueError(f"line {number}: checksum: got 0x{raw[-1]:02X}, allowed: 0x{-sum(raw[:-1]) & 0xFF:02X}")
    address = int.from_bytes(raw[1:3], "big")
    if address + raw[0] > RAM_BYTES:
        raise ValueError(f"line {number}: address: got 0x{address:X}, allowed: all data below 0x{RAM_BYTES:X}")
    return address, raw[4:-1]


def transfer(image: dict[int, bytes], write: Callable[[int, bytes], None], read: Callable[[int, int], bytes]) -> None:
    """Write an image into the RAM of the board (`write(address, data)`), verify it (`read(address, count)`), start it."""
    write(CPUCS, b"\1")
    for begin, data in image.items():
        for address in range(begin, begin + len(data), _CHUNK):
            chunk = data[address - begin :][:_CHUNK]
            write(address, chunk)
            if read(address, len(chunk)) != chunk:
                raise ProtocolError(f"firmware: verification failed at 0x{address:04X}: the value read back differs")
    write(CPUCS, b"\0")
