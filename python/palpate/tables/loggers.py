"""Loggers that are known by the names of their columns, and what a user has said about their tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from palpate.errors import listed, quoted, unlike
from palpate.tables.asked import Asked, parsed_map
from palpate.tables.table import Table

OF_ONE_FILE = ("soft", "part", "rate")
"""What is asked of one file, not of all of a logger."""
_KEYS = ("columns", "map", "unit", "time-unit", "decimal")


@dataclass(frozen=True)
class Logger:
    """What a user has said about all tables with these columns.

    Attributes
    ----------
    columns : tuple of str
        The lowest name of each column.
    asked : Asked
    origin : str
        The file that says it.
    """

    columns: tuple[str, ...]
    asked: Asked
    origin: str = ""

    @classmethod
    def of(cls, entry: Any, origin: str) -> "Logger":
        """Return the logger of an entry of palpate.toml.

        Raises
        ------
        ValueError, TypeError
            Not such an entry.

        Examples
        --------
        >>> Logger.of({"columns": ["t", "A", "B"], "map": "hard=A,soft=B"}, "").asked.columns
        {'hard': 'A', 'soft': 'B'}
        """
        if not isinstance(entry, Mapping):
            raise TypeError(f"logger: got {quoted(entry)}, allowed: a table with {', '.join(_KEYS)}")
        if unknown := set(entry) - set(_KEYS):
            raise ValueError(f"logger: {unlike(min(unknown), _KEYS)}")
        columns = entry.get("columns")
        if not isinstance(columns, list) or not all(isinstance(name, str) for name in columns):
            raise ValueError(f"logger: columns: got {quoted(columns)}, allowed: a list of names")
        wanted = entry.get("map")
        values = {name.replace("-", "_"): entry.get(name) for name in _KEYS[2:]}
        return cls(tuple(columns), Asked(None if wanted is None else parsed_map(str(wanted)), **values), origin)

    @property
    def entry(self) -> dict[str, Any]:
        """The entry for palpate.toml."""
        given = dict(self.asked.given)
        wanted = self.asked.columns or {}
        for name in ("columns", *OF_ONE_FILE):
            given.pop(name, None)
        mapped = {"map": ",".join(f"{key}={name}" for key, name in wanted.items())} if wanted else {}
        return {
            "columns": list(self.columns),
            **mapped,
            **{name.replace("_", "-"): each for name, each in given.items()},
        }

    def __str__(self) -> str:
        """Return what was said, and where, as a note."""
        said = ", ".join(f"{name} {value}" for name, value in self.entry.items() if name != "columns")
        return f"read as remembered in {self.origin} for tables with the columns {listed(self.columns, 5)}: {said}"


def columns_of(table: Table) -> tuple[str, ...]:
    """Return the lowest name of each column; "" for one without a name."""
    return tuple(column.names[-1] if column.names else "" for column in table.columns)


def known(table: Table, loggers: Sequence[Logger]) -> Logger | None:
    """Return the last logger whose tables have these columns; None without one, or without names."""
    columns = columns_of(table)
    if not any(columns):
        return None
    return next((logger for logger in reversed(loggers) if logger.columns == columns), None)
