"""Tables with a column of names and one of values: one row for each reading of a channel."""

from collections.abc import Collection

from palpate.tables.table import Table


def id_columns(table: Table, names: Collection[str]) -> list[int]:
    """Return the columns (from 0) that hold all of these names; without names, those that can hold names."""
    return []


def spread(table: Table, column: int) -> dict[str, Table]:
    """Return the rows of each name, without the column of names."""
    return {}
