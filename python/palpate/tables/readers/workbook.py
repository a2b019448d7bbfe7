"""An Excel workbook (.xlsx, .xlsm), by openpyxl: its sheets, as rows of cells with all their digits.

openpyxl rounds dates and times to 1 ms. Its parser of sheets is used without the styles of dates: so it gives serial days.
"""

import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from threading import Lock
from typing import Any

from palpate.errors import MissingExtra, RecordingError, listed, quoted
from palpate.tables.readers.package import Package
from palpate.tables.readers.serials import kind_of, text_of
from palpate.tables.text.parsing import MOST_COLUMNS

try:
    from openpyxl.reader.excel import ExcelReader
    from openpyxl.styles.numbers import BUILTIN_FORMATS_MAX_SIZE
    from openpyxl.styles.stylesheet import apply_stylesheet
    from openpyxl.utils.datetime import MAC_EPOCH
    from openpyxl.worksheet._reader import FORMULA_TAG, WorkSheetParser
except ImportError as _missing:
    raise MissingExtra("an Excel workbook needs openpyxl: type: pip install 'palpate[tables]'") from _missing

MOST_ROWS = 1 << 20
"""Rows of a sheet, at most, as in Excel."""
MOST_CELLS = 50_000_000
"""Cells of a sheet, at most; empty ones on the left of a value count, too."""
LONGEST_TEXT = 32_767
"""Characters of a cell, at most, as in Excel."""

_OTHERS = {
    "xl/workbook.bin": "an Excel binary workbook (.xlsb): save it as .xlsx",
    "content.xml": "an OpenDocument file (.ods, .odt): save its table as .xlsx or CSV",
    "word/document.xml": "a Word document: save its table as .xlsx or CSV",
}
_WARNINGS = Lock()  # the filters of warnings are those of all threads

Rows = list[tuple[int, list[str]]]


class Number(str):
    """A cell that the file holds as a number, with all its digits: its decimal mark is the point."""

    __slots__ = ()


class Workbook:
    """An Excel workbook.

    Parameters
    ----------
    path : pathlib.Path
        For messages.
    data : bytes

    Attributes
    ----------
    sheets : dict
        Name of each sheet, in order, and its name in the zip file.

    Raises
    ------
    RecordingError
        Not a workbook, a damaged one, or a too large one.
    """

    def __init__(self, path: Path, data: bytes) -> None:
        self._path = path
        with _parsing(path, "a zip file or Excel workbook"):
            self._package = Package(path, data)
            if any(name in self._package.names for name in _OTHERS) or not _has_workbook(self._package.names):
                raise RecordingError(path, self._what())
            reader = ExcelReader(BytesIO(data), read_only=True, data_only=True, keep_links=False)
            reader.archive = self._package
            reader.read_manifest()
            reader.read_strings()
            reader.read_workbook()
            apply_stylesheet(self._package, reader.wb)
            self._strings: list[str] = reader.shared_strings
            self._from_1904: bool = reader.wb.epoch == MAC_EPOCH
            self._shown = _shown(reader.wb)
            self.sheets: dict[str, str] = {
                sheet.name: part.target
                for sheet, part in reader.parser.find_sheets()
                if part.Type.endswith("/worksheet")  # not a chart
            }

    def rows(self, sheet: str) -> Rows:
        """Return the number of each row of a sheet that is not empty, and its cells from column A on.

        Raises
        ------
        RecordingError
            Damaged, or too large.
        """
        found: Rows = []
        size = 0
        with (
            _parsing(self._path, f"an Excel workbook with a sheet {quoted(sheet)}"),
            self._package.open(self.sheets[sheet]) as part,
        ):
            for count, (number, cells) in enumerate(_Parser(part, self._strings, data_only=True).parse(), 1):
                part.restart()
                row = self._row(number, cells)
                size += len(row)
                if max(count, number) > MOST_ROWS or size > MOST_CELLS:
                    reason = f"more than {MOST_ROWS:,} rows or {MOST_CELLS:,} cells in a sheet"
                    raise RecordingError(self._path, reason, number)
                if row:
                    found.append((number, row))
        return found

    def _what(self) -> str:
        names = self._package.names
        other = next((said for name, said in _OTHERS.items() if name in names), None)
        if other is None and names and all(name.endswith(".npy") for name in names):
            other = "numpy arrays (.npz): save them as CSV"
        return f"is {other}" if other else f"is a zip file, but no Excel workbook: unpack it; in it: {listed(names, 5)}"

    def _row(self, number: int, cells: list[dict[str, Any]]) -> list[str]:
        row: list[str] = []
        for cell in cells:
            text = self._text(cell["value"], cell["style_id"])
            if not text:
                continue
            column: int = cell["column"]
            if column > MOST_COLUMNS:
                reason = f"got a value in column {column:,}, allowed: {MOST_COLUMNS:,} columns"
                raise RecordingError(self._path, reason, number)
            row += [""] * (column - len(row))
            row[column - 1] = text
        return row

    def _text(self, value: str | float | bool | None, style: int) -> str:
        """Return what a cell holds as text."""
        if isinstance(value, bool):
            return str(value).upper()
        if isinstance(value, int | float):
            digits = repr(value)
            text = text_of(digits, self._shown[style], self._from_1904)
            return Number(text) if text == digits and math.isfinite(value) else text
        if value and len(value) > LONGEST_TEXT:
            raise ValueError(f"a text of more than {LONGEST_TEXT:,} characters")
        return (value or "").strip()


class _Parser(WorkSheetParser):  # type: ignore[misc]
    """Keeps what openpyxl changes or leaves out: dates that are text, and formulas that were never calculated."""

    def parse_cell(self, element: Any) -> dict[str, Any]:
        if element.get("t") == "d":
            element.set("t", "str")
        cell: dict[str, Any] = super().parse_cell(element)
        if cell["value"] is None and cell["data_type"] == "n" and element.find(FORMULA_TAG) is not None:
            cell["value"] = f"={element.findtext(FORMULA_TAG)} (never calculated)"
        return cell


@contextmanager
def _parsing(path: Path, what: str) -> Iterator[None]:
    """Turn what openpyxl, zip and XML raise into a RecordingError, and hide warnings of what no table needs."""
    with _WARNINGS, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            yield
        except RecordingError:
            raise
        except Exception as error:  # anyone may have made the file
            said = " ".join(str(error).split())[:200] or type(error).__name__
            raise RecordingError(path, f"{what} that is damaged, or not complete: {said}") from error


def _has_workbook(names: list[str]) -> bool:
    return "[Content_Types].xml" in names and any(name.startswith("xl/") for name in names)


def _shown(book: Any) -> list[str]:
    """Return what each cell style shows: a number, a date, ..."""
    numbers = [style.numFmtId for style in book._cell_styles]
    codes = {BUILTIN_FORMATS_MAX_SIZE + index: code for index, code in enumerate(book._number_formats)}
    return [kind_of(number, codes.get(number)) for number in numbers]
