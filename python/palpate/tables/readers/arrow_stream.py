"""A Parquet or Arrow file as a table that is read in parts."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from palpate.extras import need
from palpate.tables.readers.arrow import ArrowFile, arrow_column, cells_of
from palpate.tables.table import Table

_ROWS = 1 << 15
_TEXT = "T"


@dataclass(frozen=True, eq=False)
class ArrowStream:
    """A table in a Parquet or Arrow file that is read in parts.

    Attributes
    ----------
    first : Table
        Its first rows.
    """

    first: Table
    _file: ArrowFile

    @property
    def rows(self) -> int:
        """All rows."""
        return self._file.rows

    def parts(self, columns: list[int]) -> Iterator[list[Any]]:
        """Yield the numbers of some columns (from 0), of all rows."""
        names = [self._file.names[column] for column in columns]
        for batch in self._file.parts(names, _ROWS):
            yield [cells_of(self._file.path, name, _chunked(batch.column(name))) for name in names]


def stream(path: Path) -> ArrowStream | None:
    """Return a file as a table in parts; None: columns of text, or of one name, are read as a whole.

    Raises
    ------
    RecordingError
        Not such a file.
    MissingExtra
        pyarrow is not installed.
    """
    file = ArrowFile(path)
    if not file.rows or len(set(file.names)) < len(file.names):
        return None
    columns = [arrow_column(path, field, _first(file, field.name)) for field in file.fields]
    if any(column.kind == _TEXT for column in columns):
        return None
    rows = sum(batch.num_rows for batch in islice(file.parts(file.names[:1], _ROWS), 1))
    return ArrowStream(Table(path, columns, range(1, rows + 1)), file)


def _first(file: ArrowFile, name: str) -> Callable[[], Any]:
    return lambda: _chunked(next(file.parts([name], _ROWS)).column(0))


def _chunked(column: Any) -> Any:
    return need("pyarrow", "export").chunked_array([column])
