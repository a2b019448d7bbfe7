"""The format of the lines of a port: what each cell is. Once settled it is fixed."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from palpate.ad7746.datasheet import LAST_CODE
from palpate.errors import quoted
from palpate.sources.serial.cells import Cell, Refused, is_mark, number, split, whole
from palpate.sources.serial.names import NANOSECONDS, UNUSED, Column, column, factor

Values = dict[str, Any]
"""Role -> value: pF (float, nan: none), ns (int), or a whole number."""
_CODE = (-1, LAST_CODE)
_RANGES = {
    "seq": (0, 2**32 - 1),
    "hard_raw": _CODE,
    "soft_raw": _CODE,
    "capdac_hard": (0, 255),
    "capdac_soft": (0, 255),
    "status": (0, 8),
    "t_uncertainty_us": (-1, 2**31 - 1),
}
TIMES = ("t", "t_hard", "t_soft")
_LONGEST_NS = 2**62


@dataclass(frozen=True)
class Given:
    """What the user says about the lines.

    Attributes
    ----------
    columns : tuple of Column, optional
        The cells, in order.
    pattern : re.Pattern, optional
        Matches whole lines; its groups are named as columns.
    unit : str
        Unit of capacitances that have none in the line; empty: pF.
    decimal : str
        The decimal mark; empty: as the lines show it.
    code_pF : float, optional
        pF of one code, for codes of another converter than the AD7746.
    """

    columns: tuple[Column, ...] | None = None
    pattern: "re.Pattern[str] | None" = None
    unit: str = ""
    decimal: str = ""
    code_pF: float | None = None

    @property
    def groups(self) -> tuple[Column, ...]:
        """The columns of the pattern's groups."""
        return tuple(map(column, self.pattern.groupindex)) if self.pattern else ()


@dataclass(frozen=True)
class Format:
    """A settled format.

    Attributes
    ----------
    columns : tuple of Column
    given : Given
    kind : str
        As from `split`; "pattern" for a pattern.
    labels : tuple of str
        The names in the lines.
    units : tuple of bool
        Which cells have a unit.
    decimal : str
    summed : bool
        Whether each line ends with a checksum.
    """

    columns: tuple[Column, ...]
    given: Given
    kind: str = "pattern"
    labels: tuple[str, ...] = ()
    units: tuple[bool, ...] = ()
    decimal: str = "."
    summed: bool = False

    @property
    def has_unit(self) -> bool:
        """Whether something says the unit of the capacitances; of codes it is known."""
        said = self.units or (False,) * len(self.columns)
        pairs = zip(self.columns, said, strict=True)
        return bool(self.given.unit) or all(one.unit or unit for one, unit in pairs if one.role in ("hard", "soft"))

    def read(self, line: str) -> Values:
        """Return the values of a line.

        Raises
        ------
        Refused
            The line has not this format.
        """
        body, summed = unsummed(line)
        if summed != self.summed:
            raise Refused("it has no checksum" if self.summed else "it has a checksum, the first lines had none")
        if self.given.pattern:
            return self._matched(self.given.pattern, body)
        kind, cells = split(body)
        if len({*self.labels}) == len(cells) and {cell.label for cell in cells} == {*self.labels}:
            cells.sort(key=lambda cell: self.labels.index(cell.label))  # names say which is which, in any order
        if (kind, tuple(cell.label for cell in cells)) != (self.kind, self.labels):
            raise Refused("it has another form than the first lines")
        for cell, had in zip(cells, self.units, strict=True):
            if bool(cell.unit) != had and not is_mark(cell.text):
                raise Refused(f"{quoted(cell.text)} has {'no' if had else 'a'} unit, unlike in the first lines")
        return self._values(self.columns, cells)

    def _matched(self, pattern: "re.Pattern[str]", body: str) -> Values:
        match = pattern.fullmatch(body)
        if not match:
            raise Refused("it does not match the pattern as a whole")
        found = [(name, text) for name, text in match.groupdict().items() if text is not None]
        columns = dict(zip(pattern.groupindex, self.columns, strict=True))
        return self._values([columns[name] for name, _ in found], [Cell("", text.strip()) for _, text in found])

    def _values(self, columns: Sequence[Column], cells: Sequence[Cell]) -> Values:
        values: Values = {}
        for one, cell in zip(columns, cells, strict=True):
            if one.role != UNUSED:
                values[one.role] = self._value(one, cell)
        return values

    def _value(self, one: Column, cell: Cell) -> float | int:
        role = one.role
        if role in _RANGES and not (role.endswith("_raw") and self.given.code_pF):
            if cell.unit:
                raise Refused(f"{role} has no unit")
            return whole(cell.text, *_RANGES[role])
        if role in TIMES:
            return _ns(cell.text, _unit(one, cell, ""), self.decimal)
        if role in ("hard", "soft"):
            return number(cell.text, self.decimal) * factor(role, _unit(one, cell, self.given.unit) or "pF")
        if role == "temperature" and cell.unit:
            factor(role, cell.unit)
        return number(cell.text, self.decimal)


def unsummed(line: str) -> tuple[str, bool]:
    """Return a line without its checksum, and whether it had one.

    Parameters
    ----------
    line : str
        One character a byte.

    Raises
    ------
    Refused
        The checksum, the XOR of all bytes before the `*`, is wrong.

    Examples
    --------
    >>> unsummed("hard=1,soft=2*6A")
    Traceback (most recent call last):
    palpate.sources.serial.cells.Refused: its checksum is 6A, but that of its text is 3E
    """
    body, star, digits = line[:-3], line[-3:-2], line[-2:]
    if star != "*" or not set(digits) <= set("0123456789abcdefABCDEF"):
        return decoded(line), False
    found = 0
    for byte in body.encode("latin-1"):
        found ^= byte
    if found != int(digits, 16):
        raise Refused(f"its checksum is {digits}, but that of its text is {found:02X}")
    return decoded(body), True


def decoded(line: str) -> str:
    """Return a line of bytes as text: UTF-8, or Latin-1 if it is none."""
    try:
        return line.encode("latin-1").decode().strip()
    except UnicodeDecodeError:
        return line.strip()


def require_pair(columns: Sequence[Column]) -> None:
    """Check that columns have both channels, once, and one time for both, or both times, or none.

    Raises
    ------
    Refused
        They have not.
    """
    roles = [one.role for one in columns if one.role != UNUSED]
    if twice := sorted({role for role in roles if roles.count(role) > 1}):
        raise Refused(f"{twice[0]} is there twice")
    if set(roles) & {"hard", "soft", "hard_raw", "soft_raw"} not in ({"hard", "soft"}, {"hard_raw", "soft_raw"}):
        raise Refused("it has not both channels, once each: hard and soft, or hard_raw and soft_raw")
    if ("t_hard" in roles) != ("t_soft" in roles) or ("t" in roles and "t_hard" in roles):
        raise Refused("it has not one time t, or both times t_hard and t_soft")


def require_units(columns: Sequence[Column], cells: Sequence[Cell] = ()) -> None:
    """Check that each time has a unit, in its name or in the line.

    Raises
    ------
    Refused
        It has not.
    """
    units = [cell.unit for cell in cells] or [""] * len(columns)
    for one, unit in zip(columns, units, strict=True):
        if one.role in TIMES and not (one.unit or unit):
            raise Refused(f"the unit of {one.role} is not known: s, ms or us?", f"columns={text_of(columns, cells)}")


def require_alike(columns: Sequence[Column], cells: Sequence[Cell], given: Given) -> None:
    """Check that both capacitances have a unit, or none of them.

    Raises
    ------
    Refused
        One has, and the option `unit` does not say that of the other.
    """
    units = [cell.unit for cell in cells] or [""] * len(columns)
    pairs = zip(columns, units, strict=True)
    said = {bool(one.unit or unit) for one, unit in pairs if one.role in ("hard", "soft")}
    if len(said) > 1 and not given.unit:
        raise Refused("one channel has a unit, the other has none", "unit=pF")


def text_of(columns: Sequence[Column], cells: Sequence[Cell] = ()) -> str:
    """Return columns as the option names them, times without a unit in s if they have decimals, else in ms."""
    guess = (
        "s" if any("." in cell.text for one, cell in zip(columns, cells, strict=False) if one.role in TIMES) else "ms"
    )
    units = [one.unit or (guess if one.role in TIMES else "") for one in columns]
    return ",".join(f"{one.role}_{unit}" if unit else one.role for one, unit in zip(columns, units, strict=True))


def shown(values: Mapping[str, Any]) -> str:
    """Return values as a message tells them."""
    parts = []
    for role, value in values.items():
        if role in ("hard", "soft"):
            parts.append(f"{role} {value:.9g} pF")
        elif role in TIMES:
            parts.append(f"{role} {value / 1e9:.9g} s")
        else:
            parts.append(f"{role} {value}")
    return ", ".join(parts)


def _unit(one: Column, cell: Cell, given: str) -> str:
    """Return the unit of a cell: it is said once, or every time alike."""
    said = {unit for unit in (one.unit, cell.unit, given) if unit}
    if len({factor(one.role, unit) for unit in said}) > 1:
        raise Refused(f"{one.role} has several units: {', '.join(sorted(said))}")
    return min(said, default="")


def _ns(text: str, unit: str, decimal: str) -> int:
    scale = NANOSECONDS[unit]
    if text.isascii() and text.isdigit():
        found = int(text) * scale
    else:
        value = number(text, decimal) * scale
        found = round(value) if abs(value) < _LONGEST_NS else _LONGEST_NS
    if not 0 <= found < _LONGEST_NS:
        raise Refused(f"{quoted(text)} {unit} is not a time")
    return found
