"""A table with named columns, of any format, the numbers in its columns, and what a user says about it."""

import math
import os
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError
from palpate.importers.units import (
    OVERLOAD,
    PICOFARADS,
    SECONDS,
    bare,
    checked_unit,
    simple_name,
    stated_unit,
    to_number,
)
from palpate.messages import listed, nearest, quoted, shortened, unlike

Array = NDArray[np.float64]
DECIMALS = {"point": ".", "comma": ","}


class Question(ValueError):
    """What is open, or wrong, in what a user says; the message names the option that settles it."""


def ask(what: str, got: object, allowed: str) -> Question:
    """Return the error for what is open, or wrong."""
    return Question(f"{what}: got {got}, allowed: {allowed}")


class Column:
    """A column of a table, `at` from 0: its name, or position; numbers, datetime64, timedelta64 or text; its unit."""

    def __init__(
        self, table: "Table", at: int, name: str, cells: NDArray[Any], unit: str = ""
    ) -> None:
        self.table, self.at, self.cells, self.unit = table, at, cells, unit
        self.name = name or f"column {at + 1}"
        self.simple = simple_name(self.name)
        self.label = bare(shortened(self.name)) or shortened(self.name)  # without its unit
        self.place = f"column {at + 1} ({shortened(self.name)})"
        self.stated_unit = stated_unit(
            f"({unit})" if unit else name
        )  # also one that is no capacitance; "" if nothing
        self.in_farads = self.stated_unit in PICOFARADS

    def refuse(self, wrong: NDArray[np.bool_], why: str) -> None:
        """Raise the error for the first of some wrong cells, if there is one."""
        if wrong.any():
            row = int(np.argmax(wrong))
            cell = str(self.cells[row])
            shown = "an empty cell" if cell in {"", "None"} else quoted(cell)
            raise RecordingError(
                self.table.path, f"{shown} in {self.place} {why}", self.table.lines[row]
            )

    def numbers(self) -> Array:
        """Return the numbers, shape (n,), nan for a cell without a value; RecordingError: a cell is none of these."""
        values, mark = self.cells, self.table.decimal
        if values.dtype.kind not in "iuf":
            try:
                values = np.array([to_number(str(cell).strip(), mark) for cell in values], float)
            except ValueError as error:
                word = next(name for name, sign in DECIMALS.items() if sign == mark)
                wrong = np.array([str(cell).strip() == str(error) for cell in values])
                self.refuse(
                    wrong, f"is neither a number with a decimal {word} nor an overload mark"
                )
        values = np.asarray(values, float)
        if not (values.min() > -OVERLOAD and values.max() < OVERLOAD):  # also of a nan
            return np.where(np.abs(values) < OVERLOAD, values, np.nan)
        return values


class Table:
    """A table whose columns have the same length; `path` is its file, or the type of a frame, `lines` the line of each row."""

    def __init__(
        self, path: Path, columns: Iterable[tuple[Any, ...]], lines: Sequence[int], notes: Iterable[str] = (),
        decimal: str = ".", metadata: Mapping[bytes, bytes] | None = None,
    ) -> None:  # fmt: skip
        self.path, self.lines, self.notes, self.decimal, self.metadata = (
            path,
            lines,
            notes,
            decimal,
            metadata or {},
        )
        self.columns = [Column(self, at, *each) for at, each in enumerate(columns)]

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.lines)

    def named(self, names: Collection[str]) -> list[Column]:
        """Return the columns that have one of these simple names."""
        return [each for each in self.columns if each.simple in names]

    def describe(self) -> str:
        """Return positions and names of the columns, and the option that selects two."""
        return f"{listed([f'{each.at + 1} ({each.name})' for each in self.columns])} (--map hard=COL,soft=COL)"

    def column(self, wanted: str | int) -> Column:
        """Return the column with this name, or at this position (from 1); ValueError if not one."""
        text, names = str(wanted).strip(), [each.name.strip() for each in self.columns]
        found = [each for each, name in zip(self.columns, names, strict=True) if name == text]
        found = found or [
            each for each in self.columns if bare(each.name).casefold() == bare(text).casefold()
        ]
        found += [each for each in self.columns if str(each.at + 1) == text and each not in found]
        if len(found) != 1:
            what = f"the name or position of {len(found)} columns" if found else "no column"
            allowed = f"one of {self.describe()}{nearest(text, names)}"
            raise ask("column", f"{quoted(wanted)}, {what}", allowed)
        return found[0]


_KEY = re.compile(r"(?:^|,)\s*(hard|soft|time|soft_time)\s*=")


def parsed_map(text: str) -> dict[str, str]:
    """Parse hard=COL,soft=COL[,time=COL][,soft_time=COL]; a name may contain commas."""
    parts = _KEY.split(text)
    if parts[0].strip() or len(parts) < 3 or len(set(parts[1::2])) < len(parts[1::2]):
        raise ask("map", quoted(text), "hard=COL,soft=COL[,time=COL], each once")
    return {key: name.strip() for key, name in zip(parts[1::2], parts[2::2], strict=True)}


@dataclass(frozen=True)
class Asked:
    """What a user says about a table of another program, as in `palpate.read`; None: palpate finds it out."""

    columns: Mapping[str, str | int] | None = None
    unit: str | None = None
    time_unit: str | None = None
    rate: float | None = None
    decimal: str | None = None
    soft: str | os.PathLike[str] | None = None
    part: str | None = None

    def __post_init__(self) -> None:
        """Check the values."""
        words: dict[str, Collection[str]] = {"time_unit": SECONDS, "decimal": DECIMALS}
        for name, allowed in words.items():
            if (value := getattr(self, name)) is not None and value not in allowed:
                raise ValueError(f"{name}: {unlike(value, allowed)}")
        checked_unit("unit", "pF" if self.unit is None else self.unit)
        columns, needed = self.columns or {}, {"hard"} if self.soft else {"hard", "soft"}
        if self.columns is not None and not needed <= set(columns) <= {
            "hard",
            "soft",
            "time",
            "soft_time",
        }:
            raise ask(
                "columns", listed(columns) or "none", "hard, soft and, if wanted, time, soft_time"
            )
        if self.rate is not None and {"time", "soft_time"} & set(columns):
            raise ask("rate", "it together with a column of times", "one of them")
        if self.rate is not None and not (
            isinstance(self.rate, float | int) and 0 < self.rate < math.inf
        ):
            raise ask("rate", quoted(self.rate), "a number above 0, pairs a second")
