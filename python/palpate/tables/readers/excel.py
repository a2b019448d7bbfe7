"""Excel workbooks as tables, by openpyxl."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from palpate.errors import RecordingError
from palpate.tables.asked import Asked
from palpate.tables.choice import the_one
from palpate.tables.readers.workbook import MOST_CELLS, Number, Rows, Workbook
from palpate.tables.table import Column, Table
from palpate.tables.text.rows import table_of


def parse(path: Path, data: bytes, asked: Asked) -> Table:
    """Return the sheet with the two channels.

    Columns of numbers are arrays; dates and times are text, to 1 us. Lines are rows of the sheet, and the first column is
    column A.

    Raises
    ------
    RecordingError
        Not a workbook, a damaged one, or no sheet has rows of numbers.
    ValueError
        Several sheets can be meant.
    """
    book = Workbook(path, data)
    tables: dict[str, Table] = {}
    wrong: list[RecordingError] = []
    for sheet in book.sheets:
        try:
            tables[sheet] = _table(path, book.rows(sheet))
        except RecordingError as error:
            wrong.append(error)
    if not tables:
        raise wrong[0] if wrong else RecordingError(path, "an Excel workbook without a sheet of cells")
    return the_one(tables, asked, "sheet")


def _table(path: Path, rows: Rows) -> Table:
    width = max((len(cells) for _, cells in rows), default=0)
    if width * len(rows) > MOST_CELLS:
        raise RecordingError(
            path, f"got {len(rows):,} rows of {width:,} cells, allowed: {MOST_CELLS:,} cells in a sheet"
        )
    table = table_of(path, [(number, cells + [""] * (width - len(cells))) for number, cells in rows])
    return replace(table, columns=[_column(column) for column in table.columns])


def _column(column: Column) -> Column:
    """Return a column as an array, if the file holds nothing but numbers in it."""
    numbers = [isinstance(cell, Number) for cell in column.cells]
    if not any(numbers) or any(cell and not number for cell, number in zip(column.cells, numbers, strict=True)):
        return column
    return replace(column, cells=np.array([cell or "nan" for cell in column.cells], float))
