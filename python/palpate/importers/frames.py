"""Read a data frame of pandas, polars or Arrow, a dict of arrays, or a structured array."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataframe import ToNumpy, is_frame
from palpate.errors import RecordingError, need
from palpate.importers.table import ColumnData, ReadOptions, Table
from palpate.labels import require_same_index

_NUMBERS_AND_DATES = "biufmM"  # kinds of a numpy dtype


def frame_table(source: Any, options: ReadOptions) -> Table:
    """Return a data frame as a table; float64 is not copied.

    The index of pandas is its last column if it has a name, or is of dates or durations.

    Raises
    ------
    TypeError
        Not a data frame.
    RecordingError
        The columns have different shapes, or no rows.
    ValueError
        Columns of pandas in a dict have different indices.
    """
    library = type(source).__module__.split(".")[0]
    path = Path(f"{library}.{type(source).__name__}")
    is_series = _is_a(source, "pandas", "Series") or _is_a(source, "polars", "Series")
    if not is_frame(source) or is_series:
        frames = "a data frame of pandas, polars or Arrow with both channels"
        arrays = "a dict of arrays, or a structured array"
        lazy = "a lazy frame has to be collected first"
        allowed = f"a path, {frames}, {arrays}; {lazy}"
        raise TypeError(f"recording: got {path}, allowed: {allowed}")
    columns = _columns(source)
    shapes = {column.cells.shape for column in columns}
    if len(columns) < 2 or len(shapes) > 1 or shapes & {(), (0,)}:
        got = f"got columns of shapes {sorted(shapes)}"
        allowed = "two columns or more, of one shape (n,), with a row or more"
        raise RecordingError(path, f"not a recording: {got}, allowed: {allowed}")
    lines = range(1, len(columns[0].cells) + 1)
    return Table(path, columns, lines, decimal_mark=options.decimal_mark)


def _is_a(source: object, library: str, *names: str) -> bool:
    """Return whether a value is of a class of a library, which is not imported for it."""
    for base in type(source).__mro__:
        if base.__name__ in names and base.__module__.split(".")[0] == library:
            return True
    return False


def _columns(source: Any) -> list[ColumnData]:
    if _is_a(source, "pandas", "DataFrame"):
        return _pandas_columns(source)
    if isinstance(source, Mapping):
        require_same_index(map(str, source.keys()), source.values())
        return [_column(name, cells) for name, cells in source.items()]
    if _is_a(source, "polars", "DataFrame"):
        names = source.columns
    elif isinstance(source, np.ndarray):
        names = source.dtype.names or ()
    else:
        return arrow_columns(need("pyarrow", "tables").table(source))
    return [_column(name, source[name]) for name in names]


def arrow_columns(table: Any) -> list[ColumnData]:
    """Return the columns of a pyarrow.Table, with the units in the metadata of its fields."""
    columns = []
    for field, cells in zip(table.schema, table.columns, strict=True):
        unit = (field.metadata or {}).get(b"unit", b"").decode()
        columns.append(_column(field.name, cells, unit))
    return columns


def _pandas_columns(frame: Any) -> list[ColumnData]:
    units = frame.attrs.get("units", {})
    columns = [_column(name, series, units.get(name, "")) for name, series in frame.items()]
    for level in range(frame.index.nlevels):
        index = frame.index.get_level_values(level)
        name = index.name
        if name is None and index.dtype.kind in "mM":
            name = "time"
        if name is not None:
            columns.append(_column(name, index.to_series(), units.get(name, "")))
    return columns


def _column(name: object, cells: Any, unit: str = "") -> ColumnData:
    """Return a column: numbers as they are, dates with a time zone in UTC, else objects.

    A masked value is none.
    """
    text = str(name)
    if isinstance(name, tuple):  # of the levels of a header
        text = " ".join(filter(None, map(str, name)))
    is_zoned = _has_time_zone(cells)
    if is_zoned and _is_a(cells, "pandas", "Series"):
        array = cells.to_numpy("M8[ns]")
    elif isinstance(cells, ToNumpy):
        array = cells.to_numpy()
    else:
        array = np.asanyarray(cells)
    if np.ma.isMaskedArray(array):
        array = _unmasked(array)
    if array.dtype.kind not in _NUMBERS_AND_DATES:
        array = array.astype(object)
    if is_zoned:
        unit = "UTC"
    return ColumnData(text, array, unit)


def _unmasked(array: Any) -> Any:
    """Return an array with nan, NaT or None in place of masked values."""
    kind = array.dtype.kind
    if kind in "mM":
        return array.filled(np.array("NaT", array.dtype))
    if kind in _NUMBERS_AND_DATES:
        return array.astype(float).filled(np.nan)
    return array.astype(object).filled(None)


def _has_time_zone(cells: Any) -> bool:
    """Return whether a column has dates with a time zone."""
    if _is_a(cells, "pandas", "Series"):
        return cells.dtype.kind == "M" and cells.dt.tz is not None
    if _is_a(cells, "polars", "Series"):
        return _is_a(cells.dtype, "polars", "Datetime") and cells.dtype.time_zone is not None
    if _is_a(cells, "pyarrow", "ChunkedArray", "Array"):
        return _is_a(cells.type, "pyarrow", "TimestampType") and cells.type.tz is not None
    return False
