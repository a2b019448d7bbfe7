"""Names of columns that people use for times and for the two channels."""

from palpate.tables.table import Table
from palpate.tables.units import bare_name

TIMES = {"time", "t", "t_hard", "timestamp", "time stamp", "timestamps", "seconds", "elapsed", "elapsed time", "zeit",
         "date", "datetime", "clock"}  # fmt: skip


def named(table: Table, names: set[str]) -> list[int]:
    """Return the columns (from 0) that have one of these names, without their units."""
    return [column for column in range(table.width) if names & {bare_name(name) for name in table.names(column)}]
