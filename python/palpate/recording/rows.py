"""The rows of a recording: samples as text, one line for each sample, and back, without any loss of digits."""

import math
import re
from codecs import BOM_UTF8
from collections.abc import Mapping
from decimal import Decimal
from typing import Any, NamedTuple

import numpy as np

from palpate._core import OwnRows
from palpate.ad7746.datasheet import CODES_PER_PF, LAST_CODE, ZERO_CODE
from palpate.errors import quoted
from palpate.samples import DTYPE, Block, Status

LARGEST_CODE: int = 2**31 - 1
"""Largest code that a sample can have."""
LARGEST_STATUS = int(Status.LOST)
"""The status is the last column and has one digit: so an incomplete line is always recognised."""


class Codes(NamedTuple):
    """What the codes of a converter mean; the default is the AD7746.

    A code is an integer from 0: add an offset to the codes of a converter that gives negative ones, as `zero`.

    Attributes
    ----------
    zero : int
        The code of 0 pF, -(2**31) to 2**31 - 1.
    per_pF : float
        Codes for one pF, 1e-6 to 1e15.
    largest : int
        Largest code, 1 to 2**31 - 1.

    Examples
    --------
    >>> fdc1004 = Codes(zero=2**23, per_pF=2**19, largest=2**24 - 1)
    >>> fdc1004.pF(2**23 + 2**20)
    2.0
    >>> {"codes": fdc1004._asdict()}  # in the description of a source
    {'codes': {'zero': 8388608, 'per_pF': 524288, 'largest': 16777215}}
    """

    zero: int = ZERO_CODE
    per_pF: float = CODES_PER_PF
    largest: int = LAST_CODE

    def pF(self, code: int) -> float:
        """Return the capacitance of a code; the readers of a recording compute the same bits."""
        return (code - self.zero) / self.per_pF

    def disagreement(self, name: str, code: int, value: float) -> str | None:
        """Return what is wrong with a value and its code; None: there is no code, or the value is the one of the code."""
        if code > self.largest:
            return f"{name}_raw: got {code}, allowed: -1 to {self.largest}, as describe()['codes'] says"
        if code < 0 or value == self.pF(code):
            return None
        return (
            f"{name}: got {value!r} pF for the code {code}, allowed: {self.pF(code)!r}, (code - zero) / per_pF with "
            f"describe()['codes'], by default those of the AD7746; or -1 in place of the code"
        )


def codes_of(device: Mapping[str, Any]) -> Codes:
    """Return the scale of the codes from the description of an instrument.

    Parameters
    ----------
    device : mapping
        As from `Source.describe`; its key `codes` has `zero`, `per_pF` and `largest`.

    Returns
    -------
    Codes
        That of the AD7746 without such a key.

    Raises
    ------
    ValueError
        A part is missing, unknown, or outside its range.

    Examples
    --------
    >>> codes_of({"codes": {"zero": 0, "per_pF": 1000, "largest": 65535}}).pF(1500)
    1.5
    """
    given = device.get("codes", Codes()._asdict())
    if not isinstance(given, Mapping) or set(given) != set(Codes._fields):
        raise ValueError(f"codes: got {quoted(given)}, allowed: the keys {', '.join(Codes._fields)}")
    found = Codes(**given)
    for name, low in (("zero", -LARGEST_CODE - 1), ("largest", 1)):
        if type(value := given[name]) is not int or not low <= value <= LARGEST_CODE:
            raise ValueError(f"codes: {name}: got {quoted(value)}, allowed: an integer from {low} to {LARGEST_CODE}")
    per_pF = found.per_pF
    if isinstance(per_pF, bool) or not isinstance(per_pF, int | float) or not 1e-6 <= per_pF <= 1e15:
        raise ValueError(f"codes: per_pF: got {quoted(per_pF)}, allowed: a number from 1e-6 to 1e15")
    return found


COLUMNS = ("seq", "t_hard_s", "t_soft_s", "hard_raw", "soft_raw", "hard_pF", "soft_pF", "t_uncertainty_us", "status")
EARLIER = tuple(name for name in COLUMNS if name != "t_uncertainty_us")
"""Columns of recordings that were made before the uncertainty of the times was known; they are still read."""
HEADERS = [",".join(columns).encode() for columns in (COLUMNS, EARLIER)]
HEADER = HEADERS[0].decode() + "\n"

_AD7746 = Codes()
_OWN = OwnRows()
# Two roundings of 2**-53 each: below this time rounding to the nearest ns is exact.
_EXACT_S = 2**51 / 1e9
_LATEST_S = 1e10  # a little more than 64-bit nanoseconds can hold (292 years)
_LONGEST = 31  # characters of a time


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


def columns_of(lines: list[bytes]) -> tuple[str, ...] | None:
    r"""Return the columns of a recording from its first lines: from its header, else from the first row; None: neither.

    Examples
    --------
    >>> columns_of([HEADER.encode()]) == COLUMNS, columns_of([b"7,0.026,0.039,-1,-1,0,2.5,0"]) == EARLIER, columns_of([b""])
    (True, True, None)
    """
    if (first := lines[0].rstrip(b"\r\n")) in HEADERS:
        return (COLUMNS, EARLIER)[HEADERS.index(first)]
    for line in lines:
        for columns in (COLUMNS, EARLIER):
            if unreadable(line.removesuffix(b"\r"), columns) is None:
                return columns
    return None


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
    """As `parse_rows`, in Python: also for rows that palpate never writes; the error says what is wrong with a line."""
    lines = data.removesuffix(b"\n").split(b"\n") if data else []
    block = np.zeros(len(lines), DTYPE)
    for number, line in enumerate(lines):
        try:
            block[number] = _row(line.removesuffix(b"\r"), columns, scale)
        except ValueError as error:
            raise RowError(number, str(error)) from None
    return block


def unreadable(line: bytes, columns: tuple[str, ...] = COLUMNS) -> str | None:
    """Return why a line is not a row; None if it is one.

    Examples
    --------
    >>> unreadable(b"7,0.026,0.039,8388608,8388608,0.0,0.0,150,0"), unreadable(b"7,0.026,0.0")
    (None, 'got 3 cells, allowed: 9')
    >>> unreadable(BOM_UTF8 + HEADER.encode())
    'begins with a byte order mark, put there by another program'
    """
    try:
        _row(line, columns, None)
    except ValueError as error:
        return str(error)
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
_NO_NUMBER = re.compile(
    r"[ \t]*[+-]?(nan|inf|infinity)[ \t]*|", re.IGNORECASE
)  # spreadsheets write nan as an empty cell
_LOWEST = {"hard_raw": -1, "soft_raw": -1, "t_uncertainty_us": -1}
_HIGHEST = dict.fromkeys(_LOWEST, LARGEST_CODE) | {"seq": 2**63 - 1, "status": LARGEST_STATUS}


def _row(line: bytes, columns: tuple[str, ...], scale: Codes | None) -> tuple[Any, ...]:
    """Return a line as the fields of a sample; ValueError with the reason if it is not a row."""
    cells = _cells(line, len(columns))
    found: dict[str, Any] = {"t_uncertainty_us": -1}
    for name, cell in zip(columns, cells, strict=True):
        found[name] = _value(name, cell)
        if found[name] is None:
            raise ValueError(f"{quoted(cell)} is not a valid value for column {name}")
    for name in ("hard", "soft"):
        if scale is None:
            found[f"{name}_raw"] = -1
        elif (code := found[f"{name}_raw"]) >= 0:
            found[f"{name}_pF"] = scale.pF(code)
    order = ("seq", "t_hard_s", "t_soft_s", "hard_raw", "soft_raw", "hard_pF", "soft_pF", "status", "t_uncertainty_us")
    return tuple(found[name] for name in order)


def _cells(line: bytes, many: int) -> list[str]:
    if zeros := line.count(b"\0"):
        raise ValueError(f"got {zeros} zero bytes, allowed: text")
    if line.startswith(BOM_UTF8):
        raise ValueError("begins with a byte order mark, put there by another program")
    cells = line.decode("latin-1").split(",")
    if len(cells) != many:
        raise ValueError(f"got {len(cells)} cells, allowed: {many}")
    return cells


def _value(name: str, cell: str) -> float | None:
    """Return the value of a cell, a time in ns; None: it is not valid."""
    if name.endswith("_pF"):
        if _NO_NUMBER.fullmatch(cell):
            return float(cell) if "i" in cell.lower() else math.nan  # all nan have the same bits
        return float(cell) if _REAL.fullmatch(cell) else None
    if name.endswith("_s"):
        return _nanoseconds(cell) if _REAL.fullmatch(cell) and len(cell) <= _LONGEST else None
    if _WHOLE.fullmatch(cell) is None or len(cell) > 1000:
        return None
    return number if _LOWEST.get(name, 0) <= (number := int(cell)) <= _HIGHEST[name] else None


def _nanoseconds(cell: str) -> int | None:
    approximate = float(cell)
    if abs(approximate) < _EXACT_S:
        return round(approximate * 1e9)
    ns = int(Decimal(cell).scaleb(9)) if abs(approximate) < _LATEST_S else 2**63
    return ns if -(2**63) <= ns < 2**63 else None
