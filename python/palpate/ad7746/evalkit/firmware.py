"""Intel HEX files, checked completely before they are written to the board.

The licence of the firmware (`Icv_usb.hex`) does not allow to distribute it: it comes with the software of Analog
Devices for the kit, and the user gives its path.
"""

from pathlib import Path

from palpate.errors import ProtocolError
from palpate.files import read_bytes

RAM_BYTES = 0x4000
"""Size of the program and data RAM of the FX2LP, from address 0."""
LARGEST = 1_000_000
"""Bytes of a firmware file, at most: the whole RAM in records of one byte is a quarter of this."""
_DATA, _END = 0, 1


def read_hex(path: Path) -> dict[int, bytes]:
    """Read a firmware image.

    Parameters
    ----------
    path : pathlib.Path

    Returns
    -------
    dict of int to bytes
        Address -> bytes, in the order of the file.

    Raises
    ------
    ProtocolError
        The file is not valid Intel HEX, or does not fit the board.
    """
    try:
        text = read_bytes(path, LARGEST).decode("ascii")
    except OSError as error:
        raise ProtocolError(f"firmware {path}: {error.strerror}: check the path") from error
    except UnicodeDecodeError as error:
        raise ProtocolError(f"firmware {path}: not a text file, so not Intel HEX") from error
    try:
        return parse_hex(text)
    except ValueError as error:
        raise ProtocolError(f"firmware {path}: {error}; the file is damaged or for another board") from error


def parse_hex(text: str) -> dict[int, bytes]:
    """Parse Intel HEX: records of type 0 (data) and 1 (end).

    Parameters
    ----------
    text : str

    Returns
    -------
    dict of int to bytes
        Address -> bytes, in the order of the text.

    Raises
    ------
    ValueError
        The text is not valid Intel HEX; the message names the line.

    Examples
    --------
    >>> parse_hex(":03000000020100FA" + chr(10) + ":00000001FF")[0].hex()
    '020100'
    """
    image: dict[int, bytes] = {}
    used: set[int] = set()
    ended = False
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip():
            continue
        if ended:
            raise ValueError(f"line {number}: got a record after the end record, allowed: none")
        kind, address, data = _record(line.strip(), number)
        ended = kind == _END
        if data:
            _check_room(range(address, address + len(data)), used, number)
            image[address] = data
    if not ended:
        raise ValueError("no end record: the file is incomplete")
    if 0 not in used:
        raise ValueError("no data at address 0, where the processor starts")
    return image


def _check_room(span: range, used: set[int], number: int) -> None:
    if span.stop > RAM_BYTES:
        raise ValueError(f"line {number}: address: got 0x{span.stop - 1:X}, allowed: 0 to 0x{RAM_BYTES - 1:X}")
    if not used.isdisjoint(span):
        raise ValueError(f"line {number}: got address 0x{span.start:X} a second time, allowed: once")
    used.update(span)


def _record(line: str, number: int) -> tuple[int, int, bytes]:
    try:
        raw = bytes.fromhex(line.removeprefix(":"))
    except ValueError:
        raw = b""
    if not line.startswith(":") or len(raw) < 5 or len(raw) != raw[0] + 5:
        raise ValueError(
            f"line {number}: got {line[:20]!r}, allowed: a colon and the number of hex digits that the record gives"
        )
    if sum(raw) & 0xFF:
        wanted = -sum(raw[:-1]) & 0xFF
        raise ValueError(f"line {number}: checksum: got 0x{raw[-1]:02X}, allowed: 0x{wanted:02X}")
    kind = raw[3]
    if kind not in (_DATA, _END) or (kind == _END and raw[0]):
        raise ValueError(f"line {number}: record type: got {kind} of {raw[0]} bytes, allowed: 0, and 1 without data")
    return kind, int.from_bytes(raw[1:3], "big"), raw[4:-1]
