"""Finds the format of the lines from the first of them. What is not sure is asked about, not guessed."""

from collections.abc import Sequence
from contextlib import suppress
from itertools import pairwise

from palpate.errors import quoted
from palpate.sources.serial.cells import SEPARATORS, Cell, Refused, decimal_mark, is_clock, is_mark, split, tight
from palpate.sources.serial.formats import (
    Format,
    Given,
    Values,
    require_alike,
    require_pair,
    require_units,
    text_of,
    unsummed,
)
from palpate.sources.serial.names import UNUSED, Column, column
from palpate.sources.serial.sizes import Sizes

MOST = 20
"""Lines of two numbers without names that are kept until they are understood."""
_PAIR = (Column("hard"), Column("soft"))
_ASK = "columns=hard,soft"


class Settling:
    """The search for the format, line by line.

    Parameters
    ----------
    given : Given

    Attributes
    ----------
    format : Format, optional
        The format, when it is found.
    header : str
        The line that names the columns; empty: none came.
    guessed : bool
        Whether the channels are known by their order only.
    sizes : Sizes
    """

    def __init__(self, given: Given) -> None:
        self.given = given
        self.format: Format | None = None
        self.header: str = ""
        self.guessed: bool = False
        self.sizes: Sizes = Sizes()
        self._named: tuple[Column, ...] | None = given.columns
        self._candidate: Format | None = None
        self._values: list[Values] = []  # of the lines of the candidate

    def offer(self, line: str) -> int:
        """Take a line, and return how many of the last lines the format that is settled now holds for; 0: not settled.

        Raises
        ------
        Refused
            The line does not settle it. The message says why, and which option does.
        """
        try:
            return 0 if self.names(line) else self._offer(line)
        except Refused:
            self._candidate = None
            raise

    def names(self, line: str) -> bool:
        """Return whether this line names the columns; then the lines after it are read by it."""
        if self.given.columns or self.given.pattern:
            return False
        try:
            self._named, self.header = _header(line), line
        except Refused:
            return False
        return True

    def _offer(self, line: str) -> int:
        found, cells = self._format(line)
        values = found.read(line)
        self.sizes.require(found, values)
        if found != self._candidate:
            self._candidate, self._values = found, []
        self._values.append(values)
        if not self._sure(cells):
            return 0
        self.format = found
        return len(self._values)

    def _format(self, line: str) -> tuple[Format, list[Cell]]:
        if self.given.pattern:
            require_alike(self.given.groups, (), self.given)
            return Format(self.given.groups, self.given), []
        body, summed = unsummed(line)
        kind, cells = split(body)
        columns = self._columns(cells)
        try:
            require_pair(columns)
        except Refused as refused:
            raise Refused(str(refused), _option(_once(columns), cells)) from refused
        require_units(columns, cells)
        require_alike(columns, cells, self.given)
        _require_use(self.given, columns)
        decimal = self.given.decimal or decimal_mark([cell.text for cell in cells if cell.text[:1] != '"'])
        labels, units = tuple(cell.label for cell in cells), tuple(bool(cell.unit) for cell in cells)
        return Format(columns, self.given, kind, labels, units, decimal, summed), cells

    def _columns(self, cells: Sequence[Cell]) -> tuple[Column, ...]:
        """Return what the cells are: as the user or the header says it, by their names, or two capacitances."""
        if self._named:
            if len(cells) != len(self._named):
                raise Refused(
                    f"it has {len(cells)} cells, but there are {len(self._named)} names: {text_of(self._named)}"
                )
            return self._named
        if any(cell.label for cell in cells):
            return _labelled(cells)
        if len(cells) == 2:
            return _PAIR
        if len(cells) == 1:
            raise Refused("one number: it is not known of which channel")
        raise Refused(f"{len(cells)} numbers without names: which are hard and soft?", _suggested(cells))

    def _sure(self, cells: Sequence[Cell]) -> bool:
        """Return whether the format is sure.

        Of cells with other names than the user's, two lines must agree. Of two numbers without names, units settle it;
        else both have decimals and the size of a capacitance, and none grows with every line as a time does.
        """
        labelled = any(cell.label for cell in cells)
        if self.given.columns and labelled:
            return len(self._values) > 1
        if self._named or self.given.pattern or labelled:
            return True
        self.guessed = True
        if any(is_mark(cell.text) for cell in cells):
            raise Refused("no value, before it is known what the numbers are")
        if all(cell.unit for cell in cells):
            return True
        if len(self._values) == 1 and not self.given.unit and any(cell.text.lstrip("+-").isdigit() for cell in cells):
            raise Refused("whole numbers without names or units: are both capacitances?", _ASK)
        rows = [[values[role] for values in self._values] for role in ("hard", "soft")]
        if all(any(later <= earlier for earlier, later in pairwise(row)) for row in rows):
            return True
        if len(self._values) >= MOST:
            raise Refused("a number grows with every line, as a time or a counter does: are both capacitances?", _ASK)
        return False


def _header(line: str) -> tuple[Column, ...]:
    body = unsummed(line)[0]
    separator = next((sign for sign in SEPARATORS if sign in body), ",")
    names = tight(body).split(" ") if separator == " " else [tight(name) for name in body.split(separator)]
    columns = tuple(column(name) for name in names)
    require_pair(columns)
    require_units(columns)
    return columns


def _labelled(cells: Sequence[Cell]) -> tuple[Column, ...]:
    columns, strange = [], ""
    for cell in cells:
        try:
            columns.append(column(cell.label))
        except Refused:
            columns.append(Column(UNUSED))
            strange = strange or cell.label or cell.text
    if strange:
        raise Refused(f"what is {quoted(strange)}?", _option(_filled(columns), cells))
    return tuple(columns)


def _require_use(given: Given, columns: Sequence[Column]) -> None:
    codes = any(one.role == "hard_raw" for one in columns)
    if (given.code_pF and not codes) or (given.unit and codes):
        raise Refused(f"{'unit' if codes else 'code_pF'} is given, but its numbers are {'' if codes else 'no '}codes")


def _suggested(cells: Sequence[Cell]) -> str:
    """Return the option for cells without names: the last two numbers as the channels, whole ones before as a time."""
    names = [UNUSED] * len(cells)
    numbers = [at for at, cell in enumerate(cells) if not is_clock(cell.text)]
    for at, name in zip(numbers[::-1], ("soft", "hard", "t_ms", "seq"), strict=False):
        if name in ("hard", "soft") or cells[at].text.isdigit():
            names[at] = name
    return _option([column(name) for name in names], cells)


def _option(columns: Sequence[Column], cells: Sequence[Cell]) -> str:
    """Return these columns as an option; empty: they are not a pair."""
    with suppress(Refused):
        require_pair(columns)
        return f"columns={text_of(columns, cells)}"
    return ""


def _once(columns: Sequence[Column]) -> list[Column]:
    """Return columns of which none is there twice: a channel that comes again is the other one, if that is missing."""
    found: list[Column] = []
    roles = {one.role for one in columns}
    for one in columns:
        if one.role in {before.role for before in found}:
            other = {"hard": "soft", "soft": "hard"}.get(one.role, UNUSED)
            other = UNUSED if other in roles else other
            one = Column(other, one.unit if other != UNUSED else "")
            roles.add(other)
        found.append(one)
    return found


def _filled(columns: Sequence[Column]) -> list[Column]:
    """Return columns with hard and soft in place of the last two without use, if the channels are not there."""
    found = list(columns)
    free = [at for at, one in enumerate(found) if one.role == UNUSED]
    if not any(one.role in ("hard", "soft", "hard_raw", "soft_raw") for one in found) and len(free) > 1:
        found[free[-2]], found[free[-1]] = _PAIR
    return found
