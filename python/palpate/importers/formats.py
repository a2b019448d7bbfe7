"""Read a file of any format as a table: text, Excel, XDF, Parquet, Arrow.

The first bytes show the format; the name of the file does not matter.
"""

import io
import logging
import zipfile
from collections.abc import Callable, Mapping
from itertools import chain, repeat
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import PalpateError, RecordingError, need
from palpate.files import read_unpacked, unpacked_name
from palpate.importers.delimited_text import text_table
from palpate.importers.frames import arrow_columns
from palpate.importers.table import ColumnData, Option, OptionError, ReadOptions, Table
from palpate.importers.units import CellKind, cell_kind
from palpate.messages import listed, quoted

_SUFFIXES = (
    ".csv",
    ".txt",
    ".tsv",
    ".dat",
    ".asc",
    ".lvm",
    ".log",
    ".xlsx",
    ".xlsm",
    ".xdf",
    ".parquet",
    ".arrow",
    ".feather",
)
_WORKBOOKS = (".xlsx", ".xlsm")
_ZIP = b"PK\3\4"
_XDF = b"XDF:"
_PARQUET = b"PAR1"
_ARROW = b"ARROW1\0\0"
# pyxdf logs it of every stream whose times are not smoothed
_USUAL_MESSAGE = "Segments and clock-segments differ"


def readable(path: Path) -> bool:
    """Return whether the suffix of a file belongs to a format that can be read."""
    return Path(unpacked_name(path)).suffix.lower() in _SUFFIXES


def read_table(path: Path, options: ReadOptions) -> Table:
    """Read a file of any format as a table, also a packed one and standard input.

    Raises
    ------
    RecordingError
        The file cannot be read, or is no table.
    OptionError
        Something is ambiguous.
    """
    data = read_unpacked(path)
    read_format = _reader(path, data)
    try:
        table = read_format(path, data, options)
        table.notes += _suffix_notes(path, data)
        return table
    except (PalpateError, OptionError):
        raise
    except Exception as error:  # of a library: anyone may have made the file
        message = str(error).partition("\n")[0]
        reason = f"cannot be read, it is damaged, or no such file: {message:.200}"
        raise RecordingError(path, reason) from error


def is_plain_text(path: Path) -> bool:
    """Return whether a file is a text, not a workbook or another format with its own marks."""
    return not read_unpacked(path).startswith((_ZIP, _XDF, _PARQUET, _ARROW))


def _reader(path: Path, data: bytes) -> Callable[[Path, bytes, ReadOptions], Table]:
    """Return the function that reads a format, from the first bytes of a file."""
    if data.startswith(_ZIP):
        _require_workbook(path, data)
        return _read_workbook
    if data.startswith(_XDF):
        return _read_xdf
    if data.startswith((_PARQUET, _ARROW)):
        return _read_arrow
    return text_table


def _require_workbook(path: Path, data: bytes) -> None:
    """Refuse an archive that is no workbook of Excel; a damaged one is refused when it is read."""
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
        names = archive.namelist()
        kind = b""
        if "mimetype" in names:
            kind = archive.read("mimetype")[:100]
    except (zipfile.BadZipFile, OSError, NotImplementedError, RuntimeError):
        return
    if any(name.startswith("xl/") for name in names):
        return
    found = f"a zip archive of {listed(names, 3)}"
    advice = "unpack it, and open one of its files"
    if b"opendocument.spreadsheet" in kind:
        found = "a spreadsheet of LibreOffice (.ods)"
        advice = "save it as .xlsx or .csv"
    elif any(name.startswith("word/") for name in names) or b"opendocument" in kind:
        found = "a text document"
        advice = "save its table as .csv"
    raise RecordingError(path, f"not a table that palpate reads, but {found}: {advice}")


def _suffix_notes(path: Path, data: bytes) -> list[str]:
    """Return a note on a workbook or a text whose name says the other one."""
    suffix = Path(unpacked_name(path)).suffix.lower()
    is_workbook = data.startswith(_ZIP)
    is_named_so = suffix in _WORKBOOKS
    if is_workbook and not is_named_so and suffix:
        return [f"a workbook of Excel, though its name ends with {suffix}"]
    other_formats = (_ZIP, _XDF, _PARQUET, _ARROW)
    if is_named_so and not data.startswith(other_formats):
        return [f"text, though its name ends with {suffix}"]
    return []


def _select_part(path: Path, parts: Mapping[str, Any], options: ReadOptions, kind: str) -> Any:
    """Return the sheet or stream that the user names, or the only one with numbers."""
    if not parts:
        raise RecordingError(path, f"no {kind} has numbers")
    name = options.part
    if name is None and len(parts) == 1:
        name = next(iter(parts))
    if name is None or name not in parts:
        got = "none"
        if name is not None:
            got = quoted(name)
        raise OptionError(Option.PART, got, f"the name of a {kind} (--part): {listed(parts)}")
    return parts[name]


def _read_workbook(path: Path, data: bytes, options: ReadOptions) -> Table:
    """Return a sheet of an Excel workbook, read as text with tabs; a line is a row of the sheet."""
    openpyxl = need("openpyxl", "tables")
    book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
    sheets = {}
    sheets_of_text = {}
    for sheet in book.worksheets:
        rows = list(sheet.iter_rows())
        if any(map(_is_number, chain.from_iterable(rows))):
            sheets[sheet.title] = rows
        elif any(map(_has_number_as_text, chain.from_iterable(rows))):
            sheets_of_text[sheet.title] = rows
    notes = []
    if sheets_of_text and not sheets:
        sheets = sheets_of_text
        notes.append("the cells of the workbook are text: read as numbers")
    rows = _select_part(path, sheets, options, "sheet")
    width = max(map(len, rows))
    lines = []
    for row in rows:
        texts = list(map(_cell_text, row))
        texts += [""] * (width - len(texts))
        lines.append("\t".join(texts) + "\n")
    table = text_table(path, "".join(lines).encode(), options)
    table.notes += notes
    return table


def _has_number_as_text(cell: Any) -> bool:
    return isinstance(cell.value, str) and cell_kind(cell.value.strip()) is CellKind.NUMBER


def _is_number(cell: Any) -> bool:
    return isinstance(cell.value, int | float)


def _cell_text(cell: Any) -> str:
    """Return a cell of a sheet as text; a number that is shown in per cent is no capacitance."""
    if cell.value is None:
        return ""
    if _is_number(cell) and "%" in (cell.number_format or ""):
        return f"{100 * cell.value:.12g}%"
    return " ".join(str(cell.value).split())


def _read_xdf(path: Path, data: bytes, options: ReadOptions) -> Table:
    """Return a stream of numbers of an XDF file.

    Its times are not smoothed, which would hide lost samples.
    """
    loaded, notes = _load_xdf(data)
    streams = {}
    count = 0
    for stream in loaded:
        if len(stream["time_stamps"]) and isinstance(stream["time_series"], np.ndarray):
            streams[_text_in(stream["info"], "name")] = stream
            count += 1
    if len(streams) < count:
        raise RecordingError(path, "cannot be read: two streams have one name")
    stream = _select_part(path, streams, options, "stream")
    times = np.asarray(stream["time_stamps"], float)
    columns = [ColumnData("time", times, "s"), *_xdf_columns(stream)]
    if not stream["clock_times"]:
        notes.insert(0, "a stream without clock offsets: its times are on the clock of its sender")
    return Table(path, columns, range(1, len(times) + 1), notes, options.decimal_mark)


def _load_xdf(data: bytes) -> tuple[list[Any], list[str]]:
    """Return the streams of an XDF file, and what pyxdf logs; ValueError if it logs an error."""
    pyxdf = need("pyxdf", "tables")
    logger = logging.getLogger("pyxdf.pyxdf")
    notes: list[str] = []

    def note(record: logging.LogRecord) -> bool:
        message = record.getMessage()
        if record.levelno >= logging.ERROR:  # pyxdf continues at the next part that it finds
            raise ValueError(message)
        if _USUAL_MESSAGE not in message:
            notes.append(message)
        return False

    logger.addFilter(note)
    try:
        streams, _ = pyxdf.load_xdf(
            io.BytesIO(data), dejitter_timestamps=False, synchronize_clocks=True
        )
    finally:
        logger.removeFilter(note)
    return streams, notes


def _xdf_columns(stream: Any) -> list[ColumnData]:
    """Return the channels of a stream, with the labels and units of its description, if any."""
    series = stream["time_series"].T
    description = (stream["info"].get("desc") or [None])[0] or {}
    channels = (description.get("channels") or [{}])[0].get("channel", [])
    columns = []
    for values, channel in zip(series, chain(channels, repeat({})), strict=False):
        columns.append(ColumnData(_text_in(channel, "label"), values, _text_in(channel, "unit")))
    return columns


def _text_in(tree: Any, name: str) -> str:
    """Return a text in the form that pyxdf gives to XML: dicts of lists."""
    texts = tree.get(name) or [""]
    return str(texts[0] or "").strip()


def _read_arrow(path: Path, data: bytes, options: ReadOptions) -> Table:
    """Return the table of a Parquet, Arrow or Feather file."""
    pyarrow = need("pyarrow", "tables")
    if data.startswith(_PARQUET):
        # Threads of Arrow would close a file of Python while the interpreter ends: no threads and
        # no such file (apache/arrow 50482).
        source = pyarrow.BufferReader(data)
        table = need("pyarrow.parquet", "tables").ParquetFile(source).read(use_threads=False)
    else:
        table = need("pyarrow.ipc", "tables").open_file(pyarrow.py_buffer(data)).read_all()
    table.validate(full=True)  # wrong offsets in a file would be wrong addresses
    lines = range(1, len(table) + 1)
    metadata = table.schema.metadata
    return Table(path, arrow_columns(table), lines, (), options.decimal_mark, metadata)
