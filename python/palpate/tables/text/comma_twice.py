"""Files in which the comma is the decimal mark, and seems to be the delimiter, or is both."""

import re
from collections.abc import Sequence

from palpate.errors import RecordingError
from palpate.tables.cell.kinds import TIME, kind
from palpate.tables.table import Table

_TWO_WHOLE = re.compile(r"\s*+[+-]?+[0-9]++,([0-9]++)\s*+")


def has_decimal_commas(first: str, sample: Sequence[str]) -> bool:
    """Return whether lines with two whole numbers each have one number with a decimal comma.

    Either their only name says it, or zeros after the comma.
    """
    matches = [_TWO_WHOLE.fullmatch(line) for line in sample]
    right = [match[1] for match in matches if match]
    one_name = "," not in first and not _TWO_WHOLE.fullmatch(first)
    padded = any(digits[0] == "0" and len(digits) > 1 for digits in right)
    return len(right) == len(sample) and (one_name or padded)


def check_marks(table: Table) -> None:
    """Refuse a table in which the comma is both: with twice as many cells as names, or one less.

    Raises
    ------
    RecordingError
        At the first row.
    """
    names, width = len(table.header[-1]), table.width
    cells = [column.cells[0] or "" for column in table.columns]
    whole = all(cell.isdecimal() or kind(cell) == TIME for cell in cells)
    if whole and names > 1 and (width == 2 * names or width == 2 * names - 1 > names + 1):
        reason = f"got {width} cells below {names} names: commas separate the cells and are decimal marks"
        raise RecordingError(table.path, f"{reason}; save it with another delimiter", table.lines[0])
