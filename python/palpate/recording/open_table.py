"""Open a file of another program: a table of any format, or captured lines of a serial port."""

from pathlib import Path

from palpate.errors import RecordingError
from palpate.importers.channels import has_channel_names
from palpate.importers.formats import is_plain_text, read_table
from palpate.importers.table import OptionError, ReadOptions, Table
from palpate.recording.captured_lines import captured_table, have_names, is_stamped


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
    table: Table | None = None
    problem: Exception | None = None
    try:
        table = read_table(path, options)
    except (RecordingError, OptionError) as error:
        problem = error
    if table is not None and has_channel_names(table):
        return table
    if options.named_columns or options.soft or not is_plain_text(path):
        return _table_or_error(table, problem)
    try:
        captured = captured_table(path, options)
    except (RecordingError, ValueError):
        if have_names(path) or (table is None and is_stamped(path)):
            raise  # its reason is the one that helps
        return _table_or_error(table, problem)
    are_numbers = not captured.has_names
    if are_numbers and table is not None and (table.has_names or table.unmatched_names):
        return table
    return captured


def _table_or_error(table: Table | None, problem: Exception | None) -> Table:
    if table is not None:
        return table
    assert problem is not None
    raise problem
