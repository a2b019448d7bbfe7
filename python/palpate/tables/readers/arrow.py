"""Arrow columns as the cells of a table, and Parquet and Arrow files, of which only the columns that are used are read."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property, partial
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

from palpate.errors import RecordingError
from palpate.extras import need
from palpate.files import open_regular
from palpate.tables.asked import Asked
from palpate.tables.table import Cells, Column, Table

LARGEST = 500_000_000
"""Bytes of a column, at most, after decompression."""
_ROWS = 1 << 16
_NUMBER = 8  # bytes
_IN_PARTS: dict[str, Any] = {"pre_buffer": False, "buffer_size": 1 << 16}  # else row groups are in memory as a whole
_PARQUET, _ARROW = b"PAR1", b"ARROW1\0\0"


class LateColumn(Column):
    """A column whose cells are made at their first use: a column that nobody wants costs nothing, and is never wrong.

    Parameters
    ----------
    names : tuple of str
    cells : callable, or the cells
        Returns the cells.
    unit : str
    kind : str, optional
        Of the cells that it will return.
    """

    def __init__(
        self, names: tuple[str, ...], cells: Callable[[], Cells] | Cells, unit: str = "", kind: str = ""
    ) -> None:
        for name, value in {"names": names, "_given": cells, "unit": unit, "_kind": kind}.items():
            object.__setattr__(self, name, value)

    @cached_property
    def cells(self) -> Cells:
        """The cells."""
        given: Callable[[], Cells] | Cells = self.__dict__["_given"]
        return given() if callable(given) else given

    @property
    def kind(self) -> str:
        """As that of `Column`; known before the cells."""
        return str(self.__dict__["_kind"] or super().kind)


def arrow_column(where: Path, field: Any, get: Callable[[], Any]) -> Column:
    """Return a column of an Arrow table or file; its unit is that in the metadata of its field.

    Parameters
    ----------
    where : pathlib.Path
        For messages.
    field : pyarrow.Field
    get : callable
        Returns the pyarrow.ChunkedArray.
    """
    unit = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
    unit = "UTC" if getattr(field.type, "tz", None) else unit
    names = (field.name,) if field.name else ()
    return LateColumn(names, lambda: cells_of(where, field.name, get()), unit, _kind(field.type))


def _kind(of: Any) -> str:
    kinds = need("pyarrow", "export").types
    found = {
        "M": kinds.is_timestamp(of) or kinds.is_date(of),
        "m": kinds.is_duration(of) or kinds.is_time(of),
        "T": kinds.is_dictionary(of) or kinds.is_decimal(of) or _is_text(kinds, of),
        "b": kinds.is_boolean(of),
        "i": kinds.is_integer(of),
        "f": _is_number(kinds, of),
    }
    return next((kind for kind, holds in found.items() if holds), "O")


def cells_of(where: Path, name: str, column: Any) -> Cells:
    """Return the values of an Arrow array: numbers, datetime64, timedelta64, or text; "" for a null in text.

    Parameters
    ----------
    where, name
        For messages.
    column : pyarrow.ChunkedArray
        One chunk of float64 without a null is not copied.

    Raises
    ------
    RecordingError
        Its type is none of these.
    """
    arrow = need("pyarrow", "export")
    kinds, kind = arrow.types, column.type
    if kinds.is_dictionary(kind):
        if _is_text(kinds, kind.value_type):
            return _words(column)
        column = column.cast(kind.value_type)
    elif _is_text(kinds, kind):
        return _words(column.cast(arrow.large_string()).dictionary_encode())
    elif kinds.is_decimal(kind):
        column = column.cast(arrow.string()).cast(arrow.float64())  # the nearest number; a direct cast is not
    elif kinds.is_null(kind) or (column.null_count and _is_number(kinds, kind)):
        column = column.cast(arrow.float64(), safe=False)
    elif kinds.is_time(kind):
        column = column.cast(arrow.int32() if kind.bit_width == 32 else arrow.int64()).cast(arrow.int64())
        column = column.cast(arrow.duration(kind.unit))
    values = column.chunk(0) if column.num_chunks == 1 else column
    array: Any = values.to_numpy(**({} if values is column else {"zero_copy_only": False}))
    if array.dtype.kind not in "biufmM":
        raise RecordingError(where, f"column {name}: got values of type {kind}, allowed: numbers, times, or text")
    return array  # type: ignore[no-any-return]


def _is_number(kinds: Any, kind: Any) -> bool:
    return bool(kinds.is_integer(kind) or kinds.is_floating(kind) or kinds.is_boolean(kind))


def _is_text(kinds: Any, kind: Any) -> bool:
    return bool(kinds.is_string(kind) or kinds.is_large_string(kind) or kinds.is_string_view(kind))


def _words(column: Any) -> list[str | None]:
    """Return the texts of a dictionary column: a text that is there many times is kept once."""
    words: list[str | None] = []
    for chunk in column.chunks:
        known = ["" if word is None else word for word in chunk.dictionary.to_pylist()]
        words += ["" if index is None else known[index] for index in chunk.indices.to_pylist()]
    return words


def is_arrow(begin: bytes) -> bool:
    """Return whether a file that begins so is a Parquet or an Arrow file.

    Examples
    --------
    >>> is_arrow(b"PAR1"), is_arrow(b"ARROW1"), is_arrow(b"time,C1")
    (True, False, False)
    """
    return begin.startswith((_PARQUET, _ARROW))


def parse(path: Path, data: bytes, _asked: Asked) -> Table:
    """Read the contents of a Parquet or Arrow file as a table; the values of a column are read when they are used.

    Raises
    ------
    RecordingError
        Not such a file.
    MissingExtra
        pyarrow is not installed.
    """
    file = ArrowFile(path, data)
    if not file.rows:
        raise RecordingError(path, "has no rows")
    if file.rows > LARGEST // _NUMBER:
        raise RecordingError(path, f"got {file.rows:,} rows, allowed: {LARGEST // _NUMBER:,}")
    columns = [arrow_column(path, field, partial(file.column, i)) for i, field in enumerate(file.fields)]
    return Table(path, columns, range(1, file.rows + 1))


class ArrowFile:
    """A Parquet or Arrow file.

    Parameters
    ----------
    path : pathlib.Path
    data : bytes, optional
        Its contents, if they are in memory; path is then for messages.

    Attributes
    ----------
    fields : list of pyarrow.Field
    metadata : dict of bytes to bytes
        Of the whole file.
    rows : int
    names : list of str

    Raises
    ------
    RecordingError
        Not such a file, or damaged.
    MissingExtra
        pyarrow is not installed.
    """

    def __init__(self, path: Path, data: bytes | None = None) -> None:
        self.path, self._data = path, data
        with self._opened() as file:
            self.fields: list[Any] = list(file.schema)
            self.metadata: dict[bytes, bytes] = dict(file.metadata)
            self.rows: int = file.rows
            self.names: list[str] = [field.name for field in self.fields]  # here a name that is no text is an error

    def column(self, index: int) -> Any:
        """Return a column, a pyarrow.ChunkedArray.

        Raises
        ------
        RecordingError
            It is larger than `LARGEST`, or damaged.
        """
        kind = self.fields[index].type
        size, chunks = 0, []
        with self._opened() as file:
            for chunk in file.chunks(index):
                chunks.append(chunk)
                size += chunk.nbytes
                if size > LARGEST:
                    name = self.fields[index].name
                    raise RecordingError(self.path, f"column {name}: got more than {LARGEST:,} bytes, the most allowed")
        return need("pyarrow", "export").chunked_array(chunks, chunks[0].type if chunks else kind)

    def parts(self, names: list[str], rows: int) -> Iterator[Any]:
        """Yield these columns in parts of at most so many rows, as pyarrow.RecordBatch."""
        with self._opened() as file:
            yield from file.parts(names, rows)

    @contextmanager
    def _opened(self) -> "Iterator[_Parquet | _Ipc]":
        arrow = need("pyarrow", "export")
        try:
            with BytesIO(self._data) if self._data is not None else open_regular(self.path) as raw:
                begin = raw.read(len(_ARROW))
                raw.seek(0)
                yield _Ipc(raw) if begin == _ARROW else _Parquet(raw)
        except (arrow.ArrowException, OSError, UnicodeDecodeError) as error:
            reason = getattr(error, "strerror", None) or str(error).split("\n")[0]
            raise RecordingError(self.path, f"cannot be read: {reason:.300}") from error


class _Parquet:
    def __init__(self, raw: BinaryIO) -> None:
        parquet = need("pyarrow.parquet", "export")
        first = parquet.ParquetFile(raw, pre_buffer=False)
        self.schema = first.schema_arrow
        words = [field.name for field in self.schema if str(field.type) in ("string", "large_string")]
        self._file = parquet.ParquetFile(raw, metadata=first.metadata, read_dictionary=words, **_IN_PARTS)
        self.metadata = first.metadata.metadata or {}
        self.rows = first.metadata.num_rows

    def chunks(self, index: int) -> Iterator[Any]:
        """Yield a column in parts."""
        name = self.schema[index].name
        same = self.schema.get_all_field_indices(name)
        for batch in self.parts([name], _ROWS):
            yield batch.column(same.index(index))

    def parts(self, names: list[str], rows: int) -> Iterator[Any]:
        yield from self._file.iter_batches(batch_size=rows, columns=names, use_threads=False)


class _Ipc:
    def __init__(self, raw: BinaryIO) -> None:
        self._ipc, self._raw = need("pyarrow.ipc", "export"), raw
        self.schema = self._only([]).schema
        self.metadata = self.schema.metadata or {}

    @cached_property
    def rows(self) -> int:
        return sum(batch.num_rows for batch in self._batches([0]))

    def _only(self, indices: list[int]) -> Any:
        return self._ipc.open_file(self._raw, options=self._ipc.IpcReadOptions(included_fields=indices))

    def _batches(self, indices: list[int]) -> Iterator[Any]:
        file = self._only(indices)
        for i in range(file.num_record_batches):
            batch = file.get_batch(i)
            batch.validate(full=True)  # wrong offsets in a file would be wrong addresses
            yield batch

    def chunks(self, index: int) -> Iterator[Any]:
        """Yield a column in parts."""
        for batch in self._batches([index]):
            yield batch.column(0)

    def parts(self, names: list[str], rows: int) -> Iterator[Any]:
        for batch in self._batches([self.schema.get_field_index(name) for name in names]):
            for begin in range(0, batch.num_rows, rows):
                yield batch.slice(begin, rows)
