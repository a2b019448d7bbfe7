"""Samples as text, one line for each sample, and back: without any loss of digits."""

import re
from codecs import BOM_UTF8
from contextlib import suppress
from decimal import Decimal, InvalidOperation

import numpy as np
from numpy.typing import NDArray

from palpate._core import OwnRows
from palpate.errors import quoted
from palpate.recording.codes import MOST, Codes
from palpate.samples import DTYPE, Block, Status

COLUMNS = ("seq", "t_hard_s", "t_soft_s", "hard_raw", "soft_raw", "hard_pF", "soft_pF", "t_uncertainty_us", "status")
EARLIER = tuple(name for name in COLUMNS if name != "t_uncertainty_us")
"""Columns of recordings that were made before the uncertainty of the times was known; they are still read."""
HEADER = ",".join(COLUMNS) + "\n"
LARGEST_CODE, LARGEST_STATUS = MOST, int(Status.LOST)
"""The status is the last column and has one digit: so an incomplete line is always recognised."""

_AD7746 = Codes()
_OWN = OwnRows()
# Two roundings of 2**-53 each: below this time rounding to the nearest ns is exact.
_EXACT_S = 2**51 / 1e9
_LATEST_S = 1e10  # a little more than 64-bit nanoseconds can hold (292 years)
_LONGEST = 31  # characters of a time; numpy would silently truncate longer text

_TEXT = [
    ("seq", "i8"),
    ("t_hard", f"S{_LONGEST + 1}"),
    ("t_soft", f"S{_LONGEST + 1}"),
    ("hard_raw", "i4"),
    ("soft_raw", "i4"),
]
_TEXT += [("hard", "f8"), ("soft", "f8"), ("t_uncertainty_us", "i4"), ("status", "u1")]


class RowError(ValueError):
    """A line is not a row of a recording.

    Parameters
    ----------
    number : int
        Number of the line, counted from 0.
    reason : str
    """

    def __init__(self, number: int, reason: str) -> None:
        super().__init__(reason)
        self.number = number


def format_rows(block: Block) -> bytes:
    r"""Return samples as lines: times in s with 9 decimals, capacitances with all digits.

    Examples
    --------
    >>> from palpate.samples import block_of
    >>> from palpate.samples import Sample
    >>> format_rows(block_of([Sample(7, 26_000_123, 39_000_000, 8388608, -1, 0.0, 2.5, 0)]))
    b'7,0.026000123,0.039000000,8388608,-1,0.0,2.5,-1,0\n'
    """
    return _OWN.format(np.ascontiguousarray(block))


def lines_of(data: bytes) -> list[bytes]:
    r"""Split bytes at the line ends; those of Windows are understood.

    Examples
    --------
    >>> lines_of(b"1\r\n2\n\n3")
    [b'1', b'2', b'', b'3']
    """
    lines = data.split(b"\n")
    return [line.removesuffix(b"\r") for line in (lines if lines[-1] else lines[:-1])]


def columns_of(lines: list[bytes]) -> tuple[str, ...] | None:
    r"""Return the columns of a recording from its first lines: from its header, else from the first row; None: neither.

    Examples
    --------
    >>> columns_of([HEADER.encode()]) == COLUMNS, columns_of([b"7,0.026,0.039,-1,-1,0,2.5,0"]) == EARLIER, columns_of([b""])
    (True, True, None)
    """
    for columns in (COLUMNS, EARLIER):
        if lines[0].rstrip(b"\r\n") == ",".join(columns).encode():
            return columns
    found = (columns for line in lines for columns in (COLUMNS, EARLIER)
             if unreadable(line.removesuffix(b"\r"), columns) is None)  # fmt: skip
    return next(found, None)


def parse_rows(data: bytes, columns: tuple[str, ...] = COLUMNS, scale: Codes | None = _AD7746) -> Block:
    r"""Return lines as samples; capacitances are computed from the codes, if a row has codes.

    Parameters
    ----------
    data : bytes
    columns : tuple of str
        `COLUMNS`, or `EARLIER`: then the uncertainty of all times is unknown.
    scale : Codes or None
        That of the converter; None, unknown: the codes are left out, and the capacitances are those written.

    Raises
    ------
    RowError
        The first line that is not a row.

    Examples
    --------
    >>> block = parse_rows(b"7,0.026000123,0.039,9437184,-1,0,2.5,150,0\n")
    >>> block["t_hard_ns"], block["hard"], block["soft"]
    (array([26000123]), array([0.512]), array([2.5]))
    """
    own = OwnRows(None if scale is None else (scale.zero, scale.per_pF), uncertainty=columns == COLUMNS)
    plain = own.parse(data)
    return parse_any_rows(data, columns, scale) if plain is None else plain


def parse_any_rows(data: bytes, columns: tuple[str, ...] = COLUMNS, scale: Codes | None = _AD7746) -> Block:
    """Return lines as samples as `parse_rows`, also those that palpate never writes, and say what is wrong with others."""
    if not data:
        return np.zeros(0, DTYPE)
    # numpy takes more bytes for blanks than `unreadable`
    if not data.translate(None, _USED + b"\r\n") and data.count(b"\r") == data.count(b"\r\n"):
        text = data.decode("ascii").splitlines()
        with suppress(ValueError, InvalidOperation):
            return _parsed(text, columns, scale)
        with suppress(ValueError, InvalidOperation):
            return _parsed([_EMPTY.sub(",nan", line) for line in text], columns, scale)
    wrong = ((number, reason) for number, line in enumerate(lines_of(data)) if (reason := unreadable(line, columns)))
    raise RowError(*next(wrong, (0, "not rows of a recording")))


_EMPTY = re.compile(",(?=,)")  # spreadsheets write nan as an empty cell
_USED = b"0123456789+-., \tabcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"


def _parsed(lines: list[str], columns: tuple[str, ...], scale: Codes | None) -> Block:
    if "" in lines:
        raise ValueError("an empty line")
    kinds = [kind for name, kind in zip(COLUMNS, _TEXT, strict=True) if name in columns]
    text = np.loadtxt(lines, dtype=kinds, delimiter=",", comments=None, ndmin=1)
    uncertainty = text["t_uncertainty_us"] if columns == COLUMNS else np.array([-1])
    codes = np.minimum(text["hard_raw"], text["soft_raw"])
    if (
        len(text) != len(lines)
        or (text["status"] > LARGEST_STATUS).any()
        or (text["seq"] < 0).any()
        or min(codes.min(), uncertainty.min()) < -1
    ):
        raise ValueError
    block = np.zeros(len(text), DTYPE)
    for name in ("seq", "hard_raw", "soft_raw", "status"):
        block[name] = text[name]
    block["t_uncertainty_us"] = uncertainty
    if scale is None:
        block["hard_raw"] = block["soft_raw"] = -1
    for name in ("hard", "soft"):
        block[f"t_{name}_ns"] = _nanoseconds(text[f"t_{name}"])
        block[name] = capacitances(block[f"{name}_raw"], text[name], scale or _AD7746)
    return block


def capacitances(
    codes: NDArray[np.integer], written: NDArray[np.float64], scale: Codes = _AD7746
) -> NDArray[np.float64]:
    """Return the capacitances of the codes, pF; without a code the written value. All nan have the same bits."""
    readings = np.where(codes >= 0, (codes.astype(np.int64) - scale.zero) / scale.per_pF, written)
    readings[np.isnan(readings)] = np.nan
    return readings


def _nanoseconds(seconds: NDArray[np.bytes_]) -> NDArray[np.int64]:
    approximate = seconds.astype(np.float64)
    if not (np.abs(approximate) < _LATEST_S).all() or (np.char.str_len(seconds) > _LONGEST).any():
        raise ValueError("time")
    if np.abs(approximate).max() < _EXACT_S:
        return np.rint(approximate * 1e9).astype(np.int64)
    return np.array([_exactly(text.decode()) for text in seconds], np.int64)


def _exactly(text: str) -> int:
    ns = int(Decimal(text).scaleb(9))
    if not -(2**63) <= ns < 2**63:
        raise ValueError("time")
    return ns


def unreadable(line: bytes, columns: tuple[str, ...] = COLUMNS) -> str | None:
    """Return why a line is not a row; None if it is one.

    Examples
    --------
    >>> unreadable(b"7,0.026,0.039,8388608,8388608,0.0,0.0,150,0"), unreadable(b"7,0.026,0.0")
    (None, 'got 3 cells, allowed: 9')
    >>> unreadable(BOM_UTF8 + HEADER.encode())
    'begins with a byte order mark, put there by another program'
    """
    if zeros := line.count(b"\0"):
        return f"got {zeros} zero bytes, allowed: text"
    if line.startswith(BOM_UTF8):
        return "begins with a byte order mark, put there by another program"
    if (cells := line.count(b",") + 1) != len(columns):
        return f"got {cells} cells, allowed: {len(columns)}"
    for name, cell in zip(columns, line.decode("latin-1").split(","), strict=True):
        if not _fits(name, cell):
            return f"{quoted(cell)} is not a valid value for column {name}"
    return None


def is_whole(line: bytes, columns: tuple[str, ...] = COLUMNS) -> bool:
    """Return whether a line without a line end is still a complete row: its last cell has one digit.

    Examples
    --------
    >>> is_whole(b"7,0.026,0.039,8388608,8388608,0.0,0.0,150,0"), is_whole(b"7,0.026,0.039,8388608,8388608,0.0,0.0,1")
    (True, False)
    """
    return len(line.rpartition(b",")[2]) == 1 and not unreadable(line, columns)


_WHOLE = re.compile(r"[ \t]*[+-]?[0-9]+[ \t]*")
_REAL = re.compile(r"[ \t]*[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)(e[+-]?[0-9]+)?[ \t]*", re.IGNORECASE)
_NO_NUMBER = re.compile(r"[ \t]*[+-]?(nan|inf|infinity)[ \t]*|", re.IGNORECASE)


def _fits(name: str, cell: str) -> bool:
    try:
        if name.endswith("_pF"):
            return bool(_REAL.fullmatch(cell) or _NO_NUMBER.fullmatch(cell))
        if name.endswith("_s"):
            return bool(_REAL.fullmatch(cell)) and len(cell) <= _LONGEST and _is_time(cell)
        return _WHOLE.fullmatch(cell) is not None and _LOWEST.get(name, 0) <= int(cell) <= _HIGHEST[name]
    except (ValueError, InvalidOperation):
        return False


_LOWEST = {"hard_raw": -1, "soft_raw": -1, "t_uncertainty_us": -1}
_HIGHEST = dict.fromkeys(_LOWEST, LARGEST_CODE) | {"seq": 2**63 - 1, "status": LARGEST_STATUS}


def _is_time(cell: str) -> bool:
    return abs(float(cell)) < _LATEST_S and isinstance(_exactly(cell), int)
