"""A table with named columns, of any format, and the options with which a user reads it."""

import math
import os
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError
from palpate.importers.units import (
    OVERLOAD,
    PICOFARADS,
    SECONDS,
    bare_name,
    checked_unit,
    simple_name,
    stated_unit,
    to_number,
)
from palpate.messages import listed, nearest, quoted, shortened, unlike

Array = NDArray[np.float64]
DECIMAL_MARKS = {"point": ".", "comma": ","}


class Option(StrEnum):
    """What can be ambiguous in a table, or wrong in an option: the first word of the message."""

    COLUMN = "column"
    COLUMNS = "columns"
    DECIMAL = "decimal"
    MAP = "map"
    PART = "part"
    RATE = "rate"
    TIME = "time"
    TIME_UNIT = "time_unit"
    UNIT = "unit"


class OptionError(ValueError):
    """Something in a table is ambiguous, or an option is wrong.

    Parameters
    ----------
    option : Option
        The option that resolves it.
    got : str
        What the table or the user has.
    allowed : str
        What resolves it.
    """

    def __init__(self, option: Option, got: str, allowed: str) -> None:
        super().__init__(option, got, allowed)  # all of them, so that it can be pickled
        self.option = option

    def __str__(self) -> str:
        """Return the message."""
        option, got, allowed = self.args
        return f"{option}: got {got}, allowed: {allowed}"


class ColumnData(NamedTuple):
    """A column as a format has it: its name, "" without one; its cells, and their unit.

    Cells are an array of numbers, datetime64 or timedelta64, or of texts with dtype object. The
    unit is "" if only the name may contain it, and "UTC" for dates that are known to be in UTC.
    """

    name: str
    cells: NDArray[Any]
    unit: str = ""


class Column:
    """A column of a table.

    Parameters
    ----------
    table : Table
    index : int
        From 0.
    data : ColumnData

    Attributes
    ----------
    name : str
        Its name, or its position.
    simple : str
        The name without unit and blanks, in lower case.
    label : str
        The name without unit, for messages.
    kind : str
        Of the dtype of its cells, as "f", "M" or "O".
    place : str
        Position and name, for messages.
    stated_unit : str
        The unit of the format or of the name, also one that is no capacitance; "" without one.
    in_farads : bool
        Whether the stated unit is one of capacitance.
    """

    def __init__(self, table: "Table", index: int, data: ColumnData) -> None:
        self.table = table
        self.position = index + 1
        self.cells = data.cells
        self.kind = data.cells.dtype.kind
        self.unit = data.unit
        self.name = data.name or f"column {self.position}"
        self.simple = simple_name(self.name)
        shown = shortened(self.name)
        self.label = bare_name(shown) or shown
        self.place = f"column {self.position} ({shown})"
        self.stated_unit = stated_unit(data.name)
        if data.unit:
            self.stated_unit = stated_unit(f"({data.unit})")
        self.in_farads = self.stated_unit in PICOFARADS

    def refuse(self, wrong: NDArray[np.bool_], reason: str) -> None:
        """Raise RecordingError for the first of the wrong cells, if there is one."""
        if not wrong.any():
            return
        row = int(np.argmax(wrong))
        cell = str(self.cells[row])
        shown = quoted(cell)
        if cell in {"", "None"}:
            shown = "an empty cell"
        message = f"{shown} in {self.place} {reason}"
        raise RecordingError(self.table.path, message, self.table.lines[row])

    def texts_that(self, test: Callable[[str], object]) -> NDArray[np.bool_]:
        """Return which cells are texts that pass a test, shape (n,); it sees equal texts once."""
        texts = {cell for cell in self.cells if isinstance(cell, str)}
        return np.isin(self.cells, list(filter(test, texts)))

    def numbers(self) -> Array:
        """Return the numbers, shape (n,), nan for a cell without a value.

        Raises
        ------
        RecordingError
            A cell is neither a number nor a mark of "no value".
        """
        if self.kind in "iuf":
            values = np.asarray(self.cells, float)
        else:
            values = self._numbers_in_texts()
        if values.min() > -OVERLOAD and values.max() < OVERLOAD:  # false for a nan
            return values
        return np.where(np.abs(values) < OVERLOAD, values, np.nan)

    def _numbers_in_texts(self) -> Array:
        mark = self.table.decimal_mark
        texts = [str(cell).strip() for cell in self.cells]
        try:
            return np.array([to_number(text, mark) for text in texts], float)
        except ValueError as error:
            word = "point" if mark == "." else "comma"
            reason = f"is neither a number with a decimal {word} nor an overload mark"
            self.refuse(np.array(texts, object) == str(error), reason)
            raise


class Table:
    """A table whose columns have the same length.

    Parameters
    ----------
    path : pathlib.Path
        Its file, or the type of a data frame.
    columns : iterable of ColumnData
    lines : sequence of int
        The number of the line of each row, from 1, for messages.
    notes : iterable of str
        Remarks of the format.
    decimal_mark : str
        Decimal mark of cells that are texts.
    metadata : mapping, optional
        Metadata of an Arrow or Parquet file.

    Attributes
    ----------
    has_names : bool
        Whether its columns have names; else they are called by their position.
    unmatched_names : list of str
        Names in its header whose columns are unknown, as there are fewer or more than columns.
    gap_rows : tuple of int
        Rows from which on an earlier baseline is not valid.
    host_stamps : bool
        Whether its times are stamps of the computer, when a line arrived.
    full_scale_pF : float
        Readings of this magnitude are saturated; inf: unknown.
    open_options : ReadOptions or None
        Of captured lines: options that were not used yet; None: all of them.
    """

    def __init__(
        self,
        path: Path,
        columns: Iterable[ColumnData],
        lines: Sequence[int],
        notes: Iterable[str] = (),
        decimal_mark: str = ".",
        metadata: Mapping[bytes, bytes] | None = None,
    ) -> None:
        self.path = path
        self.lines = lines
        self.notes = list(notes)
        self.decimal_mark = decimal_mark
        self.metadata = metadata or {}
        self.columns = [Column(self, index, data) for index, data in enumerate(columns)]
        self.has_names = True
        self.unmatched_names: list[str] = []
        self.gap_rows: tuple[int, ...] = ()
        self.host_stamps = False
        self.full_scale_pF = math.inf
        self.open_options: ReadOptions | None = None

    def add_column(self, data: ColumnData) -> None:
        """Add a column after the others."""
        self.columns.append(Column(self, len(self.columns), data))

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.lines)

    def of_kind(self, kinds: str) -> list[Column]:
        """Return the columns whose cells have a dtype of one of these kinds."""
        return [column for column in self.columns if column.kind in kinds]

    def named(self, names: Collection[str]) -> list[Column]:
        """Return the columns that have one of these simple names."""
        return [column for column in self.columns if column.simple in names]

    def describe(self) -> str:
        """Return positions and names of the columns, and the option that selects two."""
        names = [f"{column.position} ({column.name})" for column in self.columns]
        text = f"{listed(names)} (--map hard=COL,soft=COL)"
        if self.unmatched_names:
            found = f"{len(self.unmatched_names)} names above {len(self.columns)} columns"
            text += f"; {found}: {listed(self.unmatched_names)}"
        if not self.has_names:
            text += "; times: time=COL, too"
        return text

    def column(self, wanted: str | int) -> Column:
        """Return the column with this name, or at this position, from 1.

        Raises
        ------
        OptionError
            There is none, or more than one.
        """
        text = str(wanted).strip()
        found = self._with_name(text)
        for column in self.columns:
            if str(column.position) == text and column not in found:
                found.append(column)
        if len(found) == 1:
            return found[0]
        got = "no column"
        if found:
            got = f"the name or position of {len(found)} columns"
        names = [column.name.strip() for column in self.columns]
        allowed = f"one of {self.describe()}{nearest(text, names)}"
        raise OptionError(Option.COLUMN, f"{quoted(wanted)}, {got}", allowed)

    def _with_name(self, text: str) -> list[Column]:
        """Return the columns with this name, else those whose names differ by unit and case."""
        same = [column for column in self.columns if column.name.strip() == text]
        if same:
            return same
        simple = bare_name(text).casefold()
        similar = [column for column in self.columns if bare_name(column.name).casefold() == simple]
        if similar:
            return similar
        return [column for column in self.columns if _unbracketed(column.name) == simple]


def _unbracketed(name: str) -> str:
    """Return a name in lower case without the brackets at its end, whatever is in them."""
    return re.sub(r"\s*[(\[][^()\[\]]*[)\]]\s*$", "", name).casefold().strip()


_MAP_KEY = re.compile(r"(?:^|,)\s*(hard|soft|time|soft_time)\s*=")


def parse_map(text: str) -> dict[str, str]:
    """Parse hard=COL,soft=COL[,time=COL][,soft_time=COL]; a name may contain commas.

    Examples
    --------
    >>> parse_map("hard=C1, raw,soft=2")
    {'hard': 'C1, raw', 'soft': '2'}
    """
    begin, *parts = _MAP_KEY.split(text)
    keys = parts[0::2]
    names = parts[1::2]
    if begin.strip() or not keys or len(set(keys)) < len(keys):
        allowed = "hard=COL,soft=COL[,time=COL], each once"
        raise OptionError(Option.MAP, quoted(text), allowed)
    return dict(zip(keys, map(str.strip, names), strict=True))


@dataclass(frozen=True)
class ReadOptions:
    """How to read a table of another program; None means that palpate finds it out.

    Raises
    ------
    ValueError
        A value is not allowed.
    """

    columns: Mapping[str, str | int] | str | None = None
    """Names or positions of "hard", "soft", "time" and "soft_time". Of captured lines: the names of
    the cells in order, as "t_ms,hard,soft"."""
    unit: str | None = None
    """Unit of both signals."""
    time_unit: str | None = None
    """Unit of the times, ns to d."""
    rate: float | None = None
    """Pairs a second, in place of times."""
    decimal: str | None = None
    """Decimal mark, "point" or "comma"."""
    soft: str | os.PathLike[str] | None = None
    """File of the soft channel."""
    part: str | None = None
    """Name of a sheet or stream."""
    pattern: str | None = None
    """Of captured lines: a regular expression with groups of these names."""

    @property
    def named_columns(self) -> Mapping[str, str | int]:
        """The columns of a table by their role; empty without them."""
        if self.columns is None or isinstance(self.columns, str):
            return {}
        return self.columns

    @property
    def of_lines(self) -> bool:
        """Whether an option says what the cells of captured lines are."""
        return isinstance(self.columns, str) or self.pattern is not None

    @property
    def decimal_mark(self) -> str:
        """The decimal mark of numbers in texts; "." if there is no option for it."""
        return DECIMAL_MARKS[self.decimal or "point"]

    def __post_init__(self) -> None:
        """Check the values."""
        if self.time_unit is not None:
            object.__setattr__(self, "time_unit", str(self.time_unit).strip())
        if self.time_unit is not None and self.time_unit not in SECONDS:
            raise ValueError(f"time_unit: {unlike(self.time_unit, SECONDS)}")
        if self.decimal is not None and self.decimal not in DECIMAL_MARKS:
            raise ValueError(f"decimal: {unlike(self.decimal, DECIMAL_MARKS)}")
        if self.unit is not None:
            object.__setattr__(self, "unit", checked_unit("unit", self.unit))
        if self.columns and self.pattern is not None:
            allowed = "one of them; a pattern's groups are its columns"
            raise OptionError(Option.COLUMNS, "a pattern, too", allowed)
        if isinstance(self.columns, str) and "=" in self.columns:
            allowed = 'a mapping, as {"hard": 2, "soft": 3}, or names of cells, as "t_ms,hard,soft"'
            raise OptionError(Option.COLUMNS, quoted(self.columns), allowed)
        if self.columns is not None and not isinstance(self.columns, str):
            self._check_columns(set(self.columns))
        if self.rate is not None:
            self._check_rate(self.rate)

    def _check_columns(self, names: set[str]) -> None:
        needed = {"hard"}
        if not self.soft:
            needed.add("soft")
        if not needed <= names <= {"hard", "soft", "time", "soft_time"}:
            allowed = "hard, soft and, if wanted, time, soft_time"
            raise OptionError(Option.COLUMNS, listed(self.columns or {}) or "none", allowed)

    def _check_rate(self, rate: float) -> None:
        if {"time", "soft_time"} & set(self.named_columns):
            raise OptionError(Option.RATE, "it together with a column of times", "one of them")
        if not (isinstance(rate, float | int) and 0 < rate < math.inf):
            raise OptionError(Option.RATE, quoted(rate), "a number above 0, pairs a second")
