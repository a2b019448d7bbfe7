"""The rows of a recording: one line of text for each sample, and back, with all digits."""

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from palpate._core import format_rows as _format_rows
from palpate._core import parse_rows as _parse_rows
from palpate.ad7746.registers import CODES_PER_PF, LAST_CODE, ZERO_CODE
from palpate.messages import quoted
from palpate.samples import Block, Status

LARGEST_CODE: int = 2**31 - 1
"""Largest code that a sample can have."""
LARGEST_STATUS = int(Status.LOST)
"""The status is the last column and has one digit: so an incomplete line is always recognised."""


class Codes(NamedTuple):
    """The scale of a converter's codes; the default is the AD7746.

    A code is an integer from 0: add an offset to the codes of a converter that gives negative ones,
    as `zero`.

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
        raise ValueError(
            f"codes: got {quoted(given)}, allowed: the keys {', '.join(Codes._fields)}"
        )
    found = Codes(**given)
    for name, low in (("zero", -LARGEST_CODE - 1), ("largest", 1)):
        value = given[name]
        if type(value) is not int or not low <= value <= LARGEST_CODE:
            raise ValueError(
                f"codes: {name}: got {quoted(value)}, allowed: an integer from {low} to {LARGEST_CODE}"
            )
    per_pF = found.per_pF
    if (
        isinstance(per_pF, bool)
        or not isinstance(per_pF, int | float)
        or not 1e-6 <= per_pF <= 1e15
    ):
        raise ValueError(
            f"codes: per_pF: got {quoted(per_pF)}, allowed: a number from 1e-6 to 1e15"
        )
    return found


COLUMNS = (
    "seq",
    "t_hard_s",
    "t_soft_s",
    "hard_raw",
    "soft_raw",
    "hard_pF",
    "soft_pF",
    "t_uncertainty_us",
    "status",
)
EARLIER = tuple(name for name in COLUMNS if name != "t_uncertainty_us")
"""Columns of older recordings, without the uncertainty of the times; they are still read."""
VERSIONS = COLUMNS, EARLIER
HEADERS = [",".join(columns).encode() for columns in VERSIONS]
HEADER = HEADERS[0].decode() + "\n"

_AD7746 = Codes()
_GOOD = dict(zip(COLUMNS, (b"0", b"0", b"0", b"-1", b"-1", b"0", b"0", b"-1", b"0"), strict=True))


def format_rows(block: Block) -> bytes:
    """Return samples as lines: times in s with 9 decimals, capacitances with all digits."""
    return _format_rows(np.ascontiguousarray(block))


def parse_rows(
    data: bytes, columns: tuple[str, ...] = COLUMNS, scale: Codes | None = _AD7746
) -> Block:
    """Return lines as samples, with capacitances from the codes, or as written; ValueError: no row.

    An infinite capacitance is read as nan.
    """
    codes = None if scale is None else (scale.zero, scale.per_pF)
    is_newest = columns == COLUMNS
    block = _parse_rows(data, codes, is_newest)
    if block is None and b"inf" in data:
        finite = re.sub(rb"(?<=,)-?inf(?=,)", b"nan", data)
        block = _parse_rows(finite, codes, is_newest)
    if block is None:
        raise ValueError("a line is not a row of a recording")
    return block


@lru_cache(maxsize=16)  # damage repeats itself
def unreadable(line: bytes, columns: tuple[str, ...] = COLUMNS) -> str | None:
    """Return why a line is not a row; None if it is one."""
    zeros = line.count(b"\0")
    if zeros:
        return f"got {zeros} zero bytes, allowed: text"
    if line.count(b",") != len(columns) - 1:
        return f"got {line.count(b',') + 1} cells, allowed: {len(columns)}"
    if _is_row(line, columns):
        return None
    cells = list(zip(columns, line.rstrip(b"\r\n").split(b","), strict=True))
    name, cell = next((each for each in cells if not _is_cell(*each)), cells[-1])
    return f"{quoted(cell.decode('latin-1'))} is not a valid value for column {name}"


def _is_row(line: bytes, columns: tuple[str, ...] = COLUMNS) -> bool:
    try:
        return len(parse_rows(line, columns, None)) == 1
    except ValueError:
        return False


def _is_cell(name: str, cell: bytes) -> bool:
    """Return whether a row that is right but for this cell can be read."""
    return _is_row(b",".join({**_GOOD, name: cell}.values()))
