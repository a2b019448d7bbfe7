"""The formats of tables: one row for each, with its reader."""

from pathlib import Path

from palpate.errors import RecordingError
from palpate.files import read_bytes
from palpate.tables import text
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
    if data.startswith(b"PAR1"):
        raise RecordingError(path, "a Parquet table: palpate cannot read Parquet; use the CSV from which it was made")
    return text.parse(path, data)
