"""The formats of tables: one row for each, with its reader."""

from pathlib import Path

from palpate.errors import RecordingError
from palpate.files import read_bytes
from palpate.tables import arrow, text
from palpate.tables.table import Table

LARGEST = 500_000_000
"""Bytes of a table, at most, after decompression: it is read as a whole."""


def read_table(path: Path) -> Table:
    """Read a file of any format as a table.

    Raises
    ------
    RecordingError
        The file cannot be read, or is not a table.
    """
    try:
        data = read_bytes(path, LARGEST)
    except OSError as error:
        raise RecordingError(path, f"cannot be read: {error.strerror}") from error
    if not data:
        raise RecordingError(path, "is empty")
    if arrow.is_arrow(data[:8]):
        return arrow.parse(path, data)
    return text.parse(path, data)
