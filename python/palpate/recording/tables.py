"""Open a file of another program: a table of any format, or captured lines of a serial port."""

from pathlib import Path

from palpate.errors import RecordingError
from palpate.importers.channels import has_channel_names
from palpate.importers.formats import read_table
from palpate.importers.table import OptionError, ReadOptions, Table
from palpate.recording.captured_lines import captured_or_none, captured_table


def open_table(path: Path, options: ReadOptions) -> Table:
    """Return a file as a table; captured lines have the columns hard, soft and, if known, time.

    A table whose names say what its columns are is read as one. Else its lines are read as those
    of a serial port, if that is possible.

    Raises
    ------
    RecordingError
        The file cannot be read, or is no table.
    OptionError
        Something is ambiguous.
    """
    if options.of_lines:
        return captured_table(path, options)
    try:
        table = read_table(path, options)
    except (RecordingError, OptionError):
        if options.named_columns:
            raise
        captured = captured_or_none(path, options)
        if captured is None:
            raise
        return captured
    if options.named_columns or options.soft or not table.is_text:
        return table
    if has_channel_names(table):
        return table
    is_named = table.has_names or bool(table.unmatched_names)
    return captured_or_none(path, options, named=is_named) or table
