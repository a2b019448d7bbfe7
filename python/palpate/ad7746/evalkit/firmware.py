"""Intel HEX files, checked before a byte reaches the board.

The board's firmware (`Icv_usb.hex`) has no licence that lets anyone pass it on: it comes with Analog
Devices' own software for the kit, and the user names its path.
"""

from pathlib import Path

from palpate.errors import ProtocolError

RAM_BYTES = 0x4000
"""FX2LP: program and data RAM from address 0."""
_DATA, _END = 0, 1


def read_hex(path: Path) -> dict[int, bytes]:
    """Read a firmware image.

    Parameters
    ----------
    path : pathlib.Path

    Returns
    -------
    dict of int to bytes
        Address to what stands there, in the file's order.

    Raises
    ------
    ProtocolError
        Not an Intel HEX file, or one that does not fit the board.
    """
    try:
        text = path.read_text(encoding="ascii")
    except OSError as error:
        raise ProtocolError(f"firmware {path}: {error.strerror}: check the path") from error
    except UnicodeDecodeError as error:
        raise ProtocolError(f"firmware {path}: not a text, so no Intel HEX file") from error
    try:
        return parse_hex(text)
    except ValueError as error:
        raise ProtocolError(f"firmware {path}: {error}; the file is damaged or for another board") from error


def parse_hex(text: str) -> dict[int, bytes]:
    """Parse Intel HEX: records of type 0 (data) and 1 (end).

    Raises
    ------
    ValueError
        What is wrong, and in which line.

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
        raise ValueError("got no end record, allowed: one (the file was cut off)")
    if 0 not in used:
        raise ValueError("got nothing at address 0, allowed: an image that starts there, where the processor does")
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
            f"line {number}: got {line[:20]!r}, allowed: a colon and as many hex digits as the record says"
        )
    if sum(raw) & 0xFF:
        wanted = -sum(raw[:-1]) & 0xFF
        raise ValueError(f"line {number}: checksum: got 0x{raw[-1]:02X}, allowed: 0x{wanted:02X}")
    kind = raw[3]
    if kind not in (_DATA, _END) or (kind == _END and raw[0]):
        raise ValueError(f"line {number}: record type: got {kind} of {raw[0]} bytes, allowed: 0, and 1 without data")
    return kind, int.from_bytes(raw[1:3], "big"), raw[4:-1]
