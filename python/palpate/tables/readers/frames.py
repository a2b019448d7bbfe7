"""Data frames as tables: pandas, polars, anything of Arrow, a dict of arrays, a structured array. Nothing is copied."""

import sys
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NoReturn, Protocol

import numpy as np
from numpy.typing import NDArray

from palpate.errors import RecordingError, quoted
from palpate.extras import need
from palpate.tables.readers.arrow import LateColumn, arrow_column, cells_of
from palpate.tables.table import Cells, Column, Table


class ArrowStream(Protocol):
    """Interface of a data frame of pandas, polars, pyarrow, and others."""

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any: ...  # noqa: D105


Frame = ArrowStream | Mapping[str, Any] | NDArray[np.void]
"""A data frame, a dict of arrays, or a structured array."""
UNITS = "units"
"""Key in the `attrs` of a pandas frame: a mapping from the names of columns to their units."""


def is_frame(source: object) -> bool:
    """Return whether `frame` can read a value.

    Examples
    --------
    >>> is_frame({"hard": [1.0], "soft": [2.0]}), is_frame("bench.csv")
    (True, False)
    """
    return _adapter(source) is not None


def frame(source: Any) -> Table:
    """Return a data frame as a table; a column is converted when it is used.

    Parameters
    ----------
    source : pandas.DataFrame, polars.DataFrame, object with __arrow_c_stream__, mapping, or structured numpy.ndarray
        The index of a pandas frame is a column after the others, if it is of dates or durations, or has a name.

    Raises
    ------
    TypeError
        None of these.
    RecordingError
        No row, or fewer than two columns.
    MissingExtra
        Arrow data, and pyarrow is not installed.

    Examples
    --------
    >>> table = frame({"C1": np.arange(3.0), "C2": np.ones(3)})
    >>> table.describe(), len(table)
    ('1 (C1), 2 (C2)', 3)
    """
    adapter = _adapter(source)
    if adapter is None:
        raise TypeError(
            f"recording: got {quoted(source)}, allowed: a path, a data frame of pandas, polars or Arrow, a dict of arrays, "
            "or a structured array; a lazy frame has to be collected first"
        )
    where = Path(f"{type(source).__module__.split('.')[0]}.{type(source).__name__}")
    columns, rows = adapter(source, where)
    if not rows:
        raise RecordingError(where, "has no rows")
    if len(columns) < 2:
        raise RecordingError(where, f"not a recording: {len(columns)} column, two are needed")
    return Table(where, columns, range(1, rows + 1))


_Adapter = Callable[[Any, Path], tuple[list[Column], int]]


def _adapter(source: object) -> _Adapter | None:
    for library, frames in (("pandas", _pandas), ("polars", _polars)):
        for name, adapter in (("DataFrame", frames), ("Series", _series)):
            kind = getattr(sys.modules.get(library), name, None)  # of a library that is not imported there is none
            if kind is not None and isinstance(source, kind):
                return adapter
    if hasattr(source, "__arrow_c_stream__") or hasattr(source, "__arrow_c_array__"):
        return _arrow
    if isinstance(source, Mapping):
        return _mapping
    if isinstance(source, np.ndarray) and source.dtype.names:
        return _structured
    return None


def _series(_source: Any, where: Path) -> NoReturn:
    raise TypeError(f"recording: got one column, {where}, allowed: a data frame with both channels")


def _arrow(source: Any, where: Path) -> tuple[list[Column], int]:
    arrow = need("pyarrow", "export")
    try:
        table = arrow.table(source)
    except (arrow.ArrowException, TypeError):
        _series(source, where)
    columns = [arrow_column(where, field, partial(table.column, i)) for i, field in enumerate(table.schema)]
    return columns, table.num_rows


_KINDS = {"Datetime": "M", "Date": "M", "Duration": "m", "Time": "m", "Boolean": "b"}


def _polars(source: Any, where: Path) -> tuple[list[Column], int]:
    columns: list[Column] = []
    for series in source.get_columns():
        kind, unit = series.dtype, "UTC" if getattr(series.dtype, "time_zone", None) else ""
        known = _KINDS.get(kind.base_type().__name__, _polars_kind(kind))
        columns.append(LateColumn((series.name,), partial(_polars_cells, where, series), unit, known))
    return columns, len(source)


def _polars_kind(kind: Any) -> str:
    if kind.is_float() or kind.is_integer():
        return "f" if kind.is_float() else "i"
    return "O" if kind.is_nested() else "T"


def _polars_cells(where: Path, series: Any) -> Cells:
    kind = series.dtype
    if kind.base_type().__name__ in ("Datetime", "Duration") or (kind.is_numeric() and not kind.is_decimal()):
        values: NDArray[Any] = series.to_numpy()  # dates with a zone are in UTC
        return values
    # By to_arrow: the interface of Arrow fails on times and categories of polars 1.3 to 1.32 at least.
    return cells_of(where, series.name, need("pyarrow", "export").chunked_array([series.to_arrow()]))


def _mapping(source: Mapping[Any, Any], where: Path) -> tuple[list[Column], int]:
    arrays = {str(name): np.ma.asanyarray(values) if np.ma.isMaskedArray(values) else np.asarray(values)
              for name, values in source.items()}  # fmt: skip
    sizes = {array.shape for array in arrays.values()}
    if any(len(shape) != 1 for shape in sizes) or len(sizes) > 1:
        raise RecordingError(where, f"got arrays of shapes {sorted(sizes)}, allowed: one shape (n,)")
    columns: list[Column] = [
        LateColumn((name,), partial(_numpy_cells, where, name, array), kind=_kind(array.dtype))
        for name, array in arrays.items()
    ]
    return columns, next(iter(sizes), (0,))[0]


def _structured(source: NDArray[Any], where: Path) -> tuple[list[Column], int]:
    return _mapping({name: source[name] for name in source.dtype.names or ()}, where)


def _kind(dtype: Any) -> str:
    return str(dtype.kind) if dtype.kind in "biufmM" else "T"


def _numpy_cells(where: Path, name: str, values: NDArray[Any]) -> Cells:
    if np.ma.isMaskedArray(values):
        values = _filled(values)
    if values.dtype.kind in "biufmM":
        return values
    if values.dtype.kind not in "OUST":
        raise RecordingError(
            where, f"column {name}: got values of type {values.dtype}, allowed: numbers, times, or text"
        )
    return ["" if value is None or value != value else str(value) for value in values.tolist()]  # noqa: PLR0124 (nan, NaT)


def _filled(values: Any) -> NDArray[Any]:
    """Return a masked array as one with nan, NaT or "" for what is masked."""
    kind = values.dtype.kind
    if kind in "mM":
        made = values.filled(np.array("NaT", values.dtype))
    else:
        made = values.astype(float).filled(np.nan) if kind in "biuf" else values.astype(object).filled("")
    return np.asarray(made)


def _pandas(source: Any, where: Path) -> tuple[list[Column], int]:
    units = source.attrs.get(UNITS, {})
    columns = [
        _pandas_column(where, label, kind, partial(source.iloc.__getitem__, (slice(None), i)), units)
        for i, (label, kind) in enumerate(zip(source.columns, source.dtypes, strict=True))
    ]
    for level in range(source.index.nlevels):
        values = source.index.get_level_values(level)
        if values.name is not None or values.dtype.kind in "mM":
            label = "time" if values.name is None else values.name
            columns.append(_pandas_column(where, label, values.dtype, values.to_series, units))
    return columns, len(source)


def _pandas_column(where: Path, label: Any, kind: Any, get: Callable[[], Any], units: Mapping[Any, str]) -> Column:
    levels = [str(part) for part in (label if isinstance(label, tuple) else (label,))]
    names = tuple(name for name in dict.fromkeys([*levels, " ".join(levels)]) if name)
    zoned = getattr(getattr(kind, "pyarrow_dtype", kind), "tz", None)
    unit = "UTC" if zoned else str(units.get(label, ""))
    return LateColumn(names, partial(_pandas_cells, where, " ".join(levels), get), unit, _kind(kind))


def _pandas_cells(where: Path, name: str, get: Callable[[], Any]) -> Cells:
    series = get()
    kind = series.dtype
    if hasattr(kind, "pyarrow_dtype"):
        return cells_of(where, name, series.array.__arrow_array__())
    if getattr(kind, "tz", None):
        series = series.dt.tz_convert(None)
    elif not isinstance(kind, np.dtype) and kind.kind in "biuf" and series.hasnans:
        return series.to_numpy(float, na_value=np.nan)  # type: ignore[no-any-return]
    values = series.to_numpy()
    if values.dtype.kind == "O":
        values = np.where(series.isna().to_numpy(), None, values)
    return _numpy_cells(where, name, values)
