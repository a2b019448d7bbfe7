"""The cells of a line: numbers with their names and units. A line splits as a whole or not at all."""

import json
import math
import re
from typing import Any, NamedTuple

from palpate.errors import quoted
from palpate.tables.cell.numbers import OVERLOAD

MARKS = frozenset(["OL", "OVL", "OVLD", "OVER", "OVERLOAD", "OVF", "NAN", "INF"])
"""Words in place of a number, in any case and with any sign: the instrument has no value."""
UNIT_WORDS = frozenset(
    ["aF", "fF", "pF", "nF", "uF", "µF", "μF", "mF", "F", "af", "ff", "pf", "nf", "uf", "PF", "NF", "FF", "AF", "UF",
     "s", "sec", "ms", "us", "µs", "μs", "ns", "C", "°C", "degC", "deg.C"]
)  # fmt: skip
"""Words that belong to the number before them where blanks separate the cells."""
SEPARATORS = ("\t", ";", "|", ",", " ")
_CELL = re.compile(
    r"(?:([A-Za-z_][A-Za-z0-9_.]*+(?:[(\[][A-Za-zµμ°.]{1,6}+[)\]])?+)[=:])?+"
    r"([+-]?+(?:[0-9]++(?:\.[0-9]*+|,[0-9]++)?+|\.[0-9]++)(?:[eE][+-]?+[0-9]++)?+|[+-]?+[A-Za-z]{2,8}+)"
    r"(?: ?([A-Za-zµμ°%][A-Za-z.]{0,9}+))?+"
)
_CLOCK = re.compile(r"[0-9]{1,4}+(?:[-:/T][0-9]{1,4}+)++(?:\.[0-9]{1,9}+)?+Z?+")
_WHOLE = re.compile(r"-?[0-9]{1,20}+")
_THOUSANDS = re.compile(r"[+-]?+[1-9][0-9]{0,2}+,[0-9]{3}+")


class Refused(ValueError):
    """A line that is not read.

    Parameters
    ----------
    reason : str
    option : str
        The option of `serial:` that settles it, for example "unit=fF"; empty: not known.
    """

    def __init__(self, reason: str, option: str = "") -> None:
        super().__init__(reason)
        self.option: str = option


class Cell(NamedTuple):
    """One number of a line, as text.

    Attributes
    ----------
    label : str
        Its name in the line; empty: none.
    text : str
        A number, one of `MARKS`, or something that only a column without use may be.
    unit : str
        The unit after the number; empty: none.
    """

    label: str
    text: str
    unit: str = ""


class _Literal(str):
    """A number in a JSON object, as it is written."""

    __slots__ = ()


def split(text: str) -> tuple[str, list[Cell]]:
    """Split a line into its cells.

    Parameters
    ----------
    text : str
        The line, without checksum and line end.

    Returns
    -------
    kind, cells
        The kind is "{" for a JSON object, else the separator; "" if there is only one cell.

    Raises
    ------
    Refused
        A part of the line is not a number, a name with a number, or a clock stamp.

    Examples
    --------
    >>> split("C1=6.92 C2=4.69 pF")
    (' ', [Cell(label='C1', text='6.92', unit=''), Cell(label='C2', text='4.69', unit='pF')])
    """
    if text.startswith("{"):
        return "{", _json(text)
    for separator in SEPARATORS:
        if separator in text:
            parts = _by_blanks(text) if separator == " " else [tight(part) for part in text.split(separator)]
            cells = [cell for part in parts if (cell := _cell(part))]
            if len(cells) == len(parts):
                return separator if len(cells) > 1 else "", cells
    if cell := _cell(tight(text)):
        return "", [cell]
    raise Refused("it is not made of numbers, or of names with numbers")


def tight(text: str) -> str:
    """Return a text with single blanks, and none around = and : or before a bracket."""
    text = " ".join(text.split())
    for sign in "=:":
        text = text.replace(f" {sign}", sign).replace(f"{sign} ", sign)
    return text.replace(" (", "(").replace(" [", "[")


def is_mark(text: str) -> bool:
    """Return whether a cell says that there is no value."""
    return text.lstrip("+-").upper() in MARKS


def is_clock(text: str) -> bool:
    """Return whether a cell is a date or a time of day, which no column but one without use may be."""
    return _CLOCK.fullmatch(text) is not None


def number(text: str, decimal: str = ".") -> float:
    """Return the value of a cell; nan for one of `MARKS` and for the overload of SCPI instruments, 9.9E+37.

    Raises
    ------
    Refused
        Not a number, or with another decimal mark than `decimal`.
    """
    if is_mark(text):
        return math.nan
    if {".": ",", ",": "."}[decimal] in text:
        raise Refused(f"{quoted(text)} is not a number with the decimal mark {decimal!r}")
    try:
        value = float(text.replace(",", "."))
    except ValueError as error:
        raise Refused(f"{quoted(text)} is not a number") from error
    return value if abs(value) < OVERLOAD else math.nan


def whole(text: str, low: int, high: int) -> int:
    """Return the value of a cell that is a whole number.

    Raises
    ------
    Refused
        Not a whole number, or outside the range.
    """
    if not _WHOLE.fullmatch(text) or not low <= int(text) <= high:
        raise Refused(f"{quoted(text)} is not a whole number from {low} to {high}")
    return int(text)


def decimal_mark(texts: list[str]) -> str:
    """Return the decimal mark of these numbers: a comma only where it cannot separate thousands.

    Raises
    ------
    Refused
        The commas may separate thousands.
    """
    commas = [text for text in texts if "," in text]
    if not commas:
        return "."
    if all(_THOUSANDS.fullmatch(text) for text in commas):
        raise Refused(f"the comma of {quoted(commas[0])} may separate thousands or decimals", "decimal=comma")
    return ","


def _by_blanks(text: str) -> list[str]:
    """Split at blanks, but not between a number and its unit."""
    parts: list[str] = []
    for part in tight(text).split(" "):
        if part in UNIT_WORDS and parts and " " not in parts[-1]:
            parts[-1] += " " + part
        else:
            parts.append(part)
    return parts


def _cell(part: str) -> Cell | None:
    if match := _CELL.fullmatch(part):
        label, text, unit = match.groups(default="")
        if not text.lstrip("+-").isalpha() or is_mark(text):
            return Cell(label, text, unit)
    return Cell("", part) if is_clock(part) else None


def _json(text: str) -> list[Cell]:
    try:
        pairs = json.loads(
            text, parse_float=_Literal, parse_int=_Literal, parse_constant=_mark, object_pairs_hook=tuple
        )
    except (ValueError, RecursionError) as error:
        raise Refused("it begins as a JSON object, but is none") from error
    return [Cell(label, _json_text(label, value)) for label, value in pairs]


def _mark(_: str) -> _Literal:
    return _Literal("nan")


def _json_text(label: str, value: Any) -> str:
    """Return a number as it is written; a text only with its quotes, so that it never is a number."""
    if value is None:
        return "nan"
    if isinstance(value, _Literal):
        return str(value)
    if isinstance(value, str):
        return f'"{value}"'
    raise Refused(f"{quoted(label)} is neither a number nor a text")
