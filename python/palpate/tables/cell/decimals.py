"""How a number is written: decimal mark, grouped digits, and a unit after it."""

import re
import unicodedata
from collections.abc import Iterable
from typing import NamedTuple

MARKS = {"point": ".", "comma": ","}
"""The decimal marks."""

_NUMBER = re.compile(
    r"([+-]?+)([0-9][0-9.,'\u2019\u00a0\u2009\u202f ]*+|[.,][0-9]++)((?:[eE][+-]?+[0-9]++)?+)[\u00a0\u202f ]?+([A-Za-zµμ%]{0,3}+)"
)
_UNGROUPED = re.compile(r"[+-]?+(?:[0-9]++[.,]?+[0-9]*+|[.,][0-9]++)(?:[eE][+-]?+[0-9]++)?+")
_SEPARATOR = re.compile(r"[^0-9]")
_DOUBTFUL = re.compile(r"[+-]?+[1-9][0-9]{0,2}+[.,][0-9]{3}")
_CLOCK_FRACTION = re.compile(r":[0-9][0-9]([.,])[0-9]")


class Written(NamedTuple):
    """A number as it is written in a cell.

    Attributes
    ----------
    point, comma : float or None
        Its value if this is the decimal mark; None: it is no number then.
    groups : str
        The mark that separates groups of digits in each reading of the number, "." or ","; "" if none.
    unit : str
        The letters after it, or "%".
    """

    point: float | None
    comma: float | None
    groups: str
    unit: str

    def value(self, decimal: str) -> float | None:
        """Return the value with a decimal mark, "point" or "comma"."""
        return self.point if decimal == "point" else self.comma

    @property
    def sure(self) -> str:
        """The only possible decimal mark, "point" or "comma"; "" if both are possible."""
        return "point" if self.comma is None else "comma" if self.point is None else ""


def written(cell: str) -> Written | None:
    """Read a number with each decimal mark; None: no number.

    Examples
    --------
    >>> written("1.234,5")
    Written(point=None, comma=1234.5, groups='.', unit='')
    >>> written("6.123 pF")
    Written(point=6.123, comma=6123.0, groups='', unit='pF')
    """
    match = _NUMBER.fullmatch(cell if cell.isascii() else plain(cell))
    if not match:
        return None
    sign, body, exponent, unit = match.groups()
    if exponent and body.endswith(" "):
        return None
    point, comma = (_value(sign, body.strip(), exponent, mark) for mark in ".,")
    if point is None and comma is None:
        return None
    only = {",": point, ".": comma}
    groups = next((mark for mark, value in only.items() if mark in body and value is not None), "")
    return Written(point, comma, groups if point is None or comma is None else "", unit)


def is_plain(cell: str) -> bool:
    """Return whether a cell is a number without groups of digits and unit, in ASCII.

    Examples
    --------
    >>> is_plain("-6,1e3"), is_plain("6.1 pF"), is_plain("1.234,5")
    (True, False, False)
    """
    return _UNGROUPED.fullmatch(cell) is not None


def plain(cell: str) -> str:
    """Return a cell with a minus sign and full-width characters as ASCII has them."""
    return "".join(_PLAIN.get(c) or (unicodedata.normalize("NFKC", c) if "\uff00" < c < "\uff5f" else c) for c in cell)


_PLAIN = {"\u2212": "-"}


def _value(sign: str, body: str, exponent: str, mark: str) -> float | None:
    whole, _, fraction = body.partition(mark)
    separators = set(_SEPARATOR.findall(whole))
    groups = _SEPARATOR.split(whole)
    if separators and (exponent or len(separators) > 1 or not _grouped(groups)):
        return None
    if fraction and not fraction.isdecimal():
        return None
    return float(f"{sign}{''.join(groups)}.{fraction}{exponent}")


def _grouped(groups: list[str]) -> bool:
    return 1 <= len(groups[0]) <= 3 and groups[0][0] != "0" and all(len(group) == 3 for group in groups[1:])


def sure_marks(cells: Iterable[str | None]) -> set[str]:
    """Return the decimal marks, "point" or "comma", of the first cell of a column that leaves no doubt."""
    for cell in cells:
        if cell and (mark := _sure_mark(cell)):
            return {mark}
    return set()


def _sure_mark(cell: str) -> str:
    if _DOUBTFUL.fullmatch(cell):
        return ""
    if clock := _CLOCK_FRACTION.search(cell):
        return "point" if clock[1] == "." else "comma"
    number = written(cell) if "." in cell or "," in cell else None
    return number.sure if number else ""
