"""An Excel workbook (.xlsx, .xlsm): its sheets, as rows of cells with all their digits.

It is read from one tag to the next, without a tree: memory is that of the cells with a value. The readers that were tried
take memory for the rectangle around all cells, which two cells make larger than any computer has, and round times to 1 ms.
"""

import math
from collections.abc import Iterator
from pathlib import Path

from palpate.errors import RecordingError, listed, quoted
from palpate.tables.readers.cells import Cells, longer
from palpate.tables.readers.package import Package, Part, Tags, damage
from palpate.tables.readers.serials import NUMBER, kind_of, text_of

_OTHERS = {
    "xl/workbook.bin": "an Excel binary workbook (.xlsb): save it as .xlsx",
    "content.xml": "an OpenDocument file (.ods, .odt): save its table as .xlsx or CSV",
    "word/document.xml": "a Word document: save its table as .xlsx or CSV",
}


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
        with damage(path, "a zip file or Excel workbook"):
            self._package = Package(path, data)
            whole = self._package.relations("").values()
            main = next((part.name for part in whole if part.kind == "officeDocument"), None)
            if main is None or any(name in self._package.names for name in _OTHERS):
                raise RecordingError(path, self._what())
            parts = self._package.relations(main)
            self._from_1904, self.sheets = self._read_sheets(main, parts)
            names = {part.kind: part.name for part in parts.values()}
            self._strings = self._read_strings(names["sharedStrings"]) if "sharedStrings" in names else []
            self._shown = self._read_styles(names["styles"]) if "styles" in names else []

    def rows(self, sheet: str) -> Iterator[tuple[int, list[str]]]:
        """Yield the number of each row of a sheet that is not empty, and its cells from column A on.

        Raises
        ------
        RecordingError
            Damaged, or too large.
        """
        with damage(self._path, f"an Excel workbook with a sheet {quoted(sheet)}"):
            cells = Cells(self._path, self._text)
            for _ in self._package.pieces(self.sheets[sheet], cells.begin, cells.end, cells.add):
                yield from cells.taken()

    def _what(self) -> str:
        names = self._package.names
        other = next((said for name, said in _OTHERS.items() if name in names), None)
        if other is None and names and all(name.endswith(".npy") for name in names):
            other = "numpy arrays (.npz): save them as CSV"
        return f"is {other}" if other else f"is a zip file, but no Excel workbook: unpack it; in it: {listed(names, 5)}"

    def _read_sheets(self, main: str, parts: dict[str, Part]) -> tuple[bool, dict[str, str]]:
        sheets: dict[str, str] = {}
        systems: list[str] = []

        def begin(tags: Tags, given: dict[str, str]) -> None:
            if tags[-1] == "workbookPr":
                systems.append(given.get("date1904", "0"))
            elif tags[-1] == "sheet":
                part = parts[next(given[key] for key in given if key.endswith(":id"))]
                if part.kind == "worksheet":  # not a chart
                    sheets[given["name"]] = part.name

        self._package.parse(main, begin)
        return systems[-1:] in (["1"], ["true"]), sheets

    def _read_strings(self, name: str) -> list[str]:
        """Return the texts to which cells refer by number; signs for the pronunciation are left out."""
        strings: list[str] = []

        def begin(tags: Tags, _given: dict[str, str]) -> None:
            if tags[-1] == "si":
                strings.append("")

        def add(tags: Tags, part: str) -> None:
            if tags[-1] == "t" and "rPh" not in tags:
                strings[-1] = longer(strings[-1], part)

        self._package.parse(name, begin, add=add)
        return [text.strip() for text in strings]

    def _read_styles(self, name: str) -> list[str]:
        """Return what each cell style shows: a number, a date, ..."""
        codes: dict[int, str] = {}
        shown: list[str] = []

        def begin(tags: Tags, given: dict[str, str]) -> None:
            if tags[-1] == "numFmt":
                codes[int(given["numFmtId"])] = given["formatCode"]
            elif tags[-2:] == ["cellXfs", "xf"]:
                number = int(given.get("numFmtId", 0))
                shown.append(kind_of(number, codes.get(number)))

        self._package.parse(name, begin)
        return shown

    def _text(self, kind: str, style: int, value: str, formula: str | None) -> str:
        """Return what a cell holds as text."""
        if kind == "s":
            return self._strings[int(value)]
        if kind == "b":
            return "TRUE" if value == "1" else "FALSE"
        if kind != "n":
            return value.strip()
        if not value:
            return "" if formula is None else f"={formula} (never calculated)"
        text = text_of(value, self._shown[style] if style < len(self._shown) else NUMBER, self._from_1904)
        return Number(text) if text == value and _is_number(value) else text


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text)) and "_" not in text
    except ValueError:
        return False
