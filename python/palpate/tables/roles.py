"""Which columns of a table are the two channels: as the user says, or by names that leave no doubt."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from palpate.errors import listed, quoted
from palpate.tables.asked import Asked
from palpate.tables.cell.clock_layout import is_time
from palpate.tables.clean_cells import NumberCells
from palpate.tables.long import id_column, id_columns, spread
from palpate.tables.names import PAIRS, SOFT_TIMES, named, named_channel, simple_name, time_columns
from palpate.tables.proposals import proposed, values_of
from palpate.tables.table import Column, Table
from palpate.tables.units import PICOFARADS, bare


class Side(NamedTuple):
    """One channel: its table, its column of values, and the columns that may be its times, the likeliest first.

    `asked`: whether the user named the column of times; then there is one.
    """

    table: Table
    value: int
    times: list[int]
    asked: bool
    label: str = ""

    @property
    def name(self) -> str:
        """The name of the channel: that in a column of names, else that of its column, without its unit."""
        return self.label or said(self.table, self.value)


def said(table: Table, column: int) -> str:
    """Return the name of a column as a message says it: without its unit, or its position."""
    name = table.name(column)
    return bare(name) or name


def sides(table: Table, asked: Asked, soft: Table | None = None) -> tuple[Side, Side]:
    """Return the hard and the soft channel; both of one table, or each of its own.

    Parameters
    ----------
    table : Table
    asked : Asked
    soft : Table, optional
        The table of the soft channel, if `table` has the hard channel only.

    Raises
    ------
    ValueError
        It is open which columns are meant: with what fits, and the option that settles it.
    """
    wanted = dict(asked.columns or {})
    table = dated(table)
    for column in wanted.values() if soft is None else ():
        table.require_clear(column)
    if soft is not None:
        hard_side = _alone(table, wanted.get("hard"), wanted.get("time"))
        return hard_side, _alone(dated(soft), wanted.get("soft"), wanted.get("soft_time", wanted.get("time")))
    guessed = {} if wanted else dict(_guessed(table))
    wanted = wanted or guessed
    sure = bool(guessed) and isinstance(guessed["hard"], int)  # a position
    names = None if sure else _id_column(table, wanted)
    if names is not None:
        parts = spread(table, names)
        hard_side, soft_side = (
            _alone(parts[name], None, wanted.get("time"), {names})._replace(label=name)
            for name in (str(wanted[key]).strip() for key in ("hard", "soft"))
        )
        return hard_side, soft_side
    hard, soft_column = table.column(wanted["hard"]), table.column(wanted["soft"])
    if hard == soft_column:
        raise ValueError(f"columns: got {quoted(wanted['hard'])} for both channels, allowed: two columns")
    taken = {hard, soft_column}
    both = _times(table, wanted.get("time"), taken)
    own = _soft_times(table, wanted.get("soft_time"), taken)
    hard_side = Side(table, hard, both, "time" in wanted)
    return hard_side, Side(table, soft_column, own, "soft_time" in wanted) if own else hard_side._replace(
        value=soft_column
    )


def _times(table: Table, wanted: str | int | None, taken: set[int]) -> list[int]:
    if wanted is not None:
        return [table.column(wanted)]
    return [column for column in time_columns(table) or _dates(table) if column not in taken]


def _soft_times(table: Table, wanted: str | int | None, taken: set[int]) -> list[int]:
    if wanted is not None:
        return [table.column(wanted)]
    found = [column for column in named(table, SOFT_TIMES) if column not in taken]
    return found if len(found) == 1 and time_columns(table) else []


def _dates(table: Table) -> list[int]:
    """Return the columns without a known name whose cells are dates or durations."""
    kinds = [column.kind for column in table.columns]
    known = [number for number, kind in enumerate(kinds) if kind in "mM"]
    return known or [
        number for number, kind in enumerate(kinds) if kind == "T" and _is_dated(table.columns[number].cells)
    ]


def _is_dated(cells: Any) -> bool:
    return (
        not isinstance(cells, NumberCells) and bool(len(cells)) and is_time(cells[0] or "") and is_time(cells[-1] or "")
    )


def _alone(
    table: Table, wanted: str | int | None, time: str | int | None, other: frozenset[int] | set[int] = frozenset()
) -> Side:
    """Return the channel of a table that has one; it is none of the columns `other`."""
    times = _times(table, time, set(other))
    if wanted is not None:
        value = table.column(wanted)
        return Side(table, value, [column for column in times if column != value], time is not None)
    values = [column for column in range(table.width) if column not in times and column not in other]
    if len(values) != 1 and len(likely := values_of(table, {*times, *other})) == 1:
        values = likely
    if len(values) != 1:
        raise ValueError(
            f"columns: got {len(values)} columns that can be the channel in {table.path.name}, allowed: one of "
            f"{table.describe()} (--map hard=COL,soft=COL)"
        )
    return Side(table, values[0], times, time is not None)


def _id_column(table: Table, wanted: Mapping[str, str | int]) -> int | None:
    """Return the column that holds the names of the channels, if they are no columns; else None.

    Raises
    ------
    ValueError
        No columns, and no names of channels; or they can be both.
    """
    names = [str(wanted[key]).strip() for key in ("hard", "soft")]
    try:
        columns = {table.column(name) for name in names}
    except ValueError:
        holding, likeliest = id_columns(table, names), id_column(table)
        found = [likeliest] if likeliest in holding else holding
        if len(found) != 1 or found[0] is None:
            raise
        return found[0]
    if not all(name.isdecimal() for name in names):
        return None
    likeliest = id_column(table)
    if likeliest is None or likeliest not in id_columns(table, names):
        return None
    if columns & {likeliest, *time_columns(table)}:
        return likeliest  # which no channel can be
    raise ValueError(
        f"columns: got {listed(names)}, which are columns as well as names in {said(table, likeliest)}, allowed: names of "
        "columns, or a table with other names of channels"
    )


def _guessed(table: Table) -> Mapping[str, str | int]:
    """Return the columns of the channels by their names, positions from 1, or their names in a column of names."""
    for names in PAIRS:
        hard, soft = (named(table, [name]) for name in names)
        if len(hard) == len(soft) == 1 and not _others(table, {hard[0], soft[0]}):
            return {"hard": hard[0] + 1, "soft": soft[0] + 1}
    column = id_column(table)
    if column is not None:
        known = {simple_name(name): name for name in spread(table, column)}
        for first, second in PAIRS:
            if set(known) == {first, second}:
                return {"hard": known[first], "soft": known[second]}
    raise ValueError(_open(table))


def _others(table: Table, taken: set[int]) -> list[int]:
    """Return the other columns that are capacitances by their unit, or by a name as C3."""
    rest = [column for column in range(table.width) if column not in taken]
    return [column for column in rest if table.unit(column, PICOFARADS) in PICOFARADS or named_channel(table, column)]


def _open(table: Table) -> str:
    allowed = f"hard and soft, two of {table.describe()}{proposed(table)}"
    return f"columns: got none for a table of another program, allowed: {allowed}"


def dated(table: Table) -> Table:
    """Return the table with one column of times in place of one of dates and one of times of day."""
    dates, clocks = (named(table, names) for names in ({"date", "datum"}, {"time", "zeit", "uhrzeit", "clock"}))
    if len(dates) != 1 or len(clocks) != 1:
        return table
    date, clock = table.columns[dates[0]], table.columns[clocks[0]]
    if (date.kind, clock.kind) != ("T", "T"):
        return table
    if isinstance(clock.cells, NumberCells) or not any(":" in (cell or "") for cell in clock.cells[:3]):
        return table
    cells = [
        f"{day} {time}" if day and time else day or time for day, time in zip(date.cells, clock.cells, strict=True)
    ]
    columns = list(table.columns)
    columns[clocks[0]] = Column(clock.names, cells)
    columns[dates[0]] = Column((), date.cells)
    return replace(table, columns=columns)
