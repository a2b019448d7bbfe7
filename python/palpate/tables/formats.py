"""Reads a file of any format, or a data frame, as a table. A file is known by its first bytes; its name says nothing."""

import csv
import io
import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from logging.handlers import BufferingHandler
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, listed, quoted
from palpate.extras import need
from palpate.frames import is_a, is_frame
from palpate.tables.packed import contents, unpacked_name
from palpate.tables.table import Asked, Column, Table
from palpate.tables.text import NoRows, text_table

PARQUET, ARROW = b"PAR1", b"ARROW1\0\0"
_SUFFIXES = (".csv", ".txt", ".tsv", ".dat", ".asc", ".xlsx", ".xlsm", ".xdf", ".parquet", ".arrow", ".feather")


def readable(path: Path) -> bool:
    """Return whether a format with a reader has this name of a file."""
    return Path(unpacked_name(path)).suffix.lower() in _SUFFIXES


def read_table(path: Path, asked: Asked) -> Table:
    """Read a file of any format as a table, also a packed one and standard input; errors as of `palpate.read`."""
    data = contents(path)
    reader = next((reader for begin, reader in _READERS.items() if data.startswith(begin)), text_table)
    try:
        return reader(path, data, asked)
    except csv.Error as error:
        raise RecordingError(path, f"not a table: {error}") from error


def _the_one(tables: Mapping[str, Table], asked: Asked, what: str) -> Table:
    """Return the only sheet or stream, or the one that the user names."""
    part = next(iter(tables)) if len(tables) == 1 and asked.part is None else asked.part
    if part is None or part not in tables:
        got = "none" if part is None else quoted(part)
        raise ValueError(f"part: got {got}, allowed: the name of a {what} (--part): {listed(tables)}")
    return tables[part]


@contextmanager
def _damaged(path: Path, what: str) -> Iterator[None]:
    """Report any error of a library as a damaged file: anyone may have made it."""
    try:
        yield
    except Exception as error:
        said = str(error).partition("\n")[0]
        raise RecordingError(path, f"cannot be read: {what} that is damaged: {said:.200}") from error


def _workbook(path: Path, data: bytes, asked: Asked) -> Table:
    """Return the sheet of an Excel workbook with the two channels, read as text with tabs; a line is a row of the sheet."""
    openpyxl, found = need("openpyxl", "tables"), dict[str, Table]()
    with _damaged(path, "an Excel workbook"):
        book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
        sheets = {sheet.title: [list(map(_written, row)) for row in sheet.iter_rows()] for sheet in book.worksheets}
    for name, rows in sheets.items():
        width = max(map(len, rows), default=0)
        lines = ["\t".join([*row, *[""] * (width - len(row))]) for row in rows]
        with suppress(NoRows):
            found[name] = text_table(path, "".join(f"{line}\n" for line in lines).encode(), asked)
    if not found:
        raise RecordingError(path, "an Excel workbook without a sheet that has rows of numbers")
    return _the_one(found, asked, "sheet")


def _written(cell: Any) -> str:
    """Return a cell of a sheet as text; a number that is shown in per cent is no capacitance."""
    if isinstance(cell.value, int | float) and "%" in (cell.number_format or ""):
        return f"{100 * cell.value:.12g}%"
    return "" if cell.value is None else " ".join(str(cell.value).split())


def _arrow(path: Path, data: bytes, _asked: Asked) -> Table:
    arrow = need("pyarrow", "tables")
    with _damaged(path, "a Parquet or Arrow file"):
        if data.startswith(PARQUET):
            table = need("pyarrow.parquet", "tables").read_table(io.BytesIO(data))
        else:
            table = need("pyarrow.ipc", "tables").open_file(arrow.py_buffer(data)).read_all()
        table.validate(full=True)  # wrong offsets in a file would be wrong addresses
    columns = _of_arrow(table)
    return Table(path, columns, range(1, len(table) + 1), metadata=table.schema.metadata or {})


def _of_arrow(table: Any) -> list[Column]:
    """Return the columns of an Arrow table with the units in the metadata of its fields."""
    need("pandas", "tables")
    units = {
        field.name: field.metadata[b"unit"].decode() for field in table.schema if b"unit" in (field.metadata or {})
    }
    return _of_pandas(table.to_pandas(split_blocks=True, ignore_metadata=True), units)


def _xdf(path: Path, data: bytes, asked: Asked) -> Table:
    """Return the only stream of numbers in an XDF file, or the one named; times are not smoothed, which hides lost samples."""
    pyxdf, log, logger = need("pyxdf", "tables"), BufferingHandler(1_000_000), logging.getLogger("pyxdf.pyxdf")
    logger.addHandler(log)
    try:
        with _damaged(path, "an XDF file"):
            streams, _ = pyxdf.load_xdf(io.BytesIO(data), dejitter_timestamps=False, synchronize_clocks=True)
            if errors := [record.getMessage() for record in log.buffer if record.levelno >= logging.ERROR]:
                raise ValueError(errors[0])
            streams = [one for one in streams if len(one["time_stamps"]) and isinstance(one["time_series"], np.ndarray)]
            tables = {_word(one["info"], "name") or str(at): _stream(path, one) for at, one in enumerate(streams, 1)}
            if len(tables) < max(1, len(streams)):
                raise ValueError("no stream has a sample of numbers, or two streams have one name")
    finally:
        logger.removeHandler(log)
    table = _the_one(tables, asked, "stream")
    if not all(stream["clock_times"] for stream in streams):
        table.notes.append("a stream without clock offsets: its times are on the clock of its sender")
    said = [record.getMessage() for record in log.buffer]
    table.notes.extend(text for text in said if not text.endswith(_USUAL))
    return table


_USUAL = "Segments and clock-segments differ"  # logged of every stream whose times are not smoothed


def _stream(path: Path, stream: Any) -> Table:
    values = stream["time_series"]
    described = ((stream["info"].get("desc") or [None])[0] or {}).get("channels") or [{}]
    each = [*described[0].get("channel", []), *[{}] * values.shape[1]]
    columns = [Column("time", np.asarray(stream["time_stamps"], float), "s")]
    for at in range(values.shape[1]):
        columns.append(Column(_word(each[at], "label") or f"channel {at + 1}", values[:, at], _word(each[at], "unit")))
    return Table(path, columns, range(1, len(values) + 1))


def _word(tree: Any, name: str) -> str:
    """Return a text in what pyxdf makes of XML: dicts of lists."""
    return str((tree.get(name) or [""])[0] or "").strip()


_READERS: dict[bytes, Callable[[Path, bytes, Asked], Table]] = {
    b"PK\3\4": _workbook, b"XDF:": _xdf, PARQUET: _arrow, ARROW: _arrow,
}  # fmt: skip
"""Readers by the first bytes of a file; anything else is text."""


def frame(source: Any) -> Table:
    """Return a data frame as a table; float64 is not copied. The index of pandas is its last column if it may be times."""
    where = Path(f"{type(source).__module__.split('.')[0]}.{type(source).__name__}")
    if not is_frame(source) or any(is_a(library, "Series", source) for library in ("pandas", "polars")):
        raise TypeError(
            f"recording: got {where}, allowed: a path, a data frame of pandas, polars or Arrow with both channels, a dict of "
            "arrays, or a structured array; a lazy frame has to be collected first"
        )
    if is_a("pandas", "DataFrame", source):
        columns = _of_pandas(source, source.attrs.get("units", {}))
    elif is_a("polars", "DataFrame", source):
        zones = {each.name: "UTC" for each in source.get_columns() if getattr(each.dtype, "time_zone", None)}
        columns = [Column(each.name, each.to_numpy(), zones.get(each.name, "")) for each in source.get_columns()]
    elif isinstance(source, Mapping | np.ndarray):
        names = source if isinstance(source, Mapping) else source.dtype.names or ()
        columns = [Column(str(name), np.ma.asanyarray(source[name])) for name in names]
    else:
        columns = _of_arrow(need("pyarrow", "tables").table(source))
    shapes = {each.cells.shape for each in columns}
    masked = any(np.ma.is_masked(each.cells) for each in columns)
    if len(columns) < 2 or len(shapes) > 1 or shapes & {(), (0,)} or masked:
        what = "two columns or more, of one shape (n,), with a row or more; nan in place of masked values"
        raise RecordingError(where, f"not a recording: got columns of shapes {sorted(shapes)}, allowed: {what}")
    return Table(where, columns, range(1, len(columns[0].cells) + 1))


def _of_pandas(source: Any, units: Mapping[Any, str]) -> list[Column]:
    columns, series = [], [(label, source.iloc[:, at]) for at, label in enumerate(source.columns)]
    for level in range(source.index.nlevels):
        values = source.index.get_level_values(level)
        if values.name is not None or values.dtype.kind in "mM":
            series.append(("time" if values.name is None else values.name, values.to_series()))
    for label, each in series:
        name = " ".join(filter(None, map(str, label))) if isinstance(label, tuple) else str(label)
        zoned = getattr(getattr(each.dtype, "pyarrow_dtype", each.dtype), "tz", None)
        cells = _cells(each.dt.tz_convert(None) if zoned else each)
        columns.append(Column(name, cells, "UTC" if zoned else str(units.get(label, ""))))
    return columns


def _cells(series: Any) -> NDArray[Any]:
    """Return the cells of a pandas series; nan, NaT or "" where there is none."""
    kind = series.dtype.kind
    if kind in "mM":
        return np.asarray(series.to_numpy(f"{kind}8[ns]"))
    if kind in "biuf" and (isinstance(series.dtype, np.dtype) or not series.hasnans):
        return np.asarray(series.to_numpy())
    if kind in "iuf":
        return np.asarray(series.to_numpy(float, na_value=np.nan))
    return np.asarray(series.astype(object).where(series.notna(), "").to_numpy(object))
