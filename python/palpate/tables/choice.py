"""Which one of several tables in a file is meant."""

from collections.abc import Mapping

from palpate.errors import listed, quoted
from palpate.tables.asked import Asked
from palpate.tables.roles import sides
from palpate.tables.table import Table


def the_one(tables: Mapping[str, Table], asked: Asked, what: str) -> Table:
    """Return the table that the user names; else the only one in which the two channels are found.

    Parameters
    ----------
    tables : mapping
        At least one, by name.
    asked : Asked
    what : str
        What one of them is: "sheet", "stream".

    Raises
    ------
    ValueError
        None or several can be meant.
    """
    if asked.part is not None:
        if asked.part not in tables:
            raise ValueError(f"part: got {quoted(asked.part)}, allowed: the name of a {what}: {listed(tables)}")
        return tables[asked.part]
    if len(tables) == 1:
        return next(iter(tables.values()))
    fitting = [name for name, table in tables.items() if _fits(table, asked)]
    if len(fitting) != 1:
        raise ValueError(
            f"part: got none for a file in which {len(fitting) or 'none'} of {len(tables)} {what}s have the two channels "
            f"by name, allowed: the name of a {what} (--part): {listed(fitting or tables)}"
        )
    table = tables[fitting[0]]
    table.notes.append(f"{what} {quoted(fitting[0])} is used: the only one of {len(tables)} with the two channels")
    return table


def _fits(table: Table, asked: Asked) -> bool:
    try:
        sides(table, asked)
    except ValueError:
        return False
    return True
