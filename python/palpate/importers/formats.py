"""Reads a file of any format, or a data frame, as a table. A file is known by its first bytes; its name says nothing."""

import csv
import io
import logging
import re
from collections.abc import Mapping
from pathlib import Path
from statistics import mode
from typing import Any, NamedTuple

import numpy as np

from palpate.dataframe import is_a, is_frame
from palpate.errors import MissingExtra, PalpateError, RecordingError, need
from palpate.files import read_unpacked, unpacked_name
from palpate.importers.table import DECIMALS, Asked, Question, Table, ask
from palpate.importers.units import NONE, NUMBER, SUMMARY, TEXT, TIME, kind
from palpate.messages import listed, quoted

PARQUET, ARROW = b"PAR1", b"ARROW1\0\0"
_SUFFIXES = (
    ".csv",
    ".txt",
    ".tsv",
    ".dat",
    ".asc",
    ".xlsx",
    ".xlsm",
    ".xdf",
    ".parquet",
    ".arrow",
    ".feather",
)
_HEADER = 1 << 18  # characters in which the first row of numbers is looked for
_SAMPLE = 500  # characters in the middle, and at the end, in which the dialect is looked for
_MOST_NAMES = 4  # rows of names
_DELIMITERS = "\t;|,"
_COMMENT = re.compile(r'["\s]*(?:[#%!]|//)')
_DOUBTFUL = re.compile(
    r"[+-]?[1-9][0-9]{0,2},[0-9]{3}"
)  # decimal comma, or a separator of thousands
_SECOND = "if a second head begins there, delete the lines before it"
_USUAL = "Segments and clock-segments differ"  # pyxdf logs it of every stream whose times are not smoothed


def readable(path: Path) -> bool:
    """Return whether a format with a reader has this name of a file."""
    return Path(unpacked_name(path)).suffix.lower() in _SUFFIXES


def read_table(path: Path, asked: Asked) -> Table:
    """Read a file of any format as a table, also a packed one and standard input; errors as of `palpate.read`."""
    data = read_unpacked(path)
    readers = {b"PK\3\4": _workbook, b"XDF:": _xdf, PARQUET: _arrow, ARROW: _arrow}
    reader = next(
        (reader for begin, reader in readers.items() if data.startswith(begin)), text_table
    )
    try:
        return reader(path, data, asked)
    except (PalpateError, Question):
        raise
    except Exception as error:  # of a library: anyone may have made the file
        said = str(error).partition("\n")[0]
        raise RecordingError(
            path, f"cannot be read, it is damaged, or no such file: {said:.200}"
        ) from error


class _Dialect(NamedTuple):
    """How the rows are written: delimiter (None: blanks), decimal mark, kinds of the cells of a row."""

    delimiter: str | None
    decimal: str
    kinds: list[str]


def text_table(path: Path, data: bytes, asked: Asked) -> Table:
    """Read the contents of a text file as a table; RecordingError with the line, ValueError if the decimal mark is open."""
    text = _decoded(path, data)
    dialect = _dialect(path, text, asked)
    above, begin = _above(path, text, dialect)
    end, notes = text.rfind("\n") + 1, list[str]()
    if (
        text[end:].strip() and end > begin and not _COMMENT.match(text[end:])
    ):  # its last number may be cut
        text, notes = text[:end], ["the last row is incomplete (no line end): left out"]
    first = len(above) + 1
    names = _names(path, above, dialect, text.find(".", begin) >= 0)
    columns = _alike(text, begin, dialect)
    lines: Any = range(first, first + len(columns[0])) if columns else []
    if not columns:
        rows, left_out = _by_line(text[begin:], first, above[-1] if above else "")
        cells = [_row(path, line, number, dialect) for number, line in rows.items()]
        columns = [np.array(each, object) for each in zip(*cells, strict=True)]
        lines, notes = list(rows), notes + left_out
    table = Table(path, zip(names, columns, strict=True), lines, notes, dialect.decimal)
    for each, of in zip(table.columns, dialect.kinds, strict=True):
        if (
            of in {NUMBER, TIME} and each.cells.dtype.kind == "O"
        ):  # not only of a channel: the row may be a sum
            wrong = [word for word in set(each.cells) if kind(word) == TEXT]
            each.refuse(
                np.isin(each.cells, wrong), f"is neither a number nor an overload mark; {_SECOND}"
            )
    return table


def _decoded(path: Path, data: bytes) -> str:
    try:
        text = data.decode("utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if "\0" in text:
        allowed = "text, .xlsx, .parquet, .arrow, .feather, .xdf; save a .xls, .mat, .h5 or .npy as one of them"
        raise RecordingError(path, f"not a table that palpate reads, allowed: {allowed}")
    text = (
        text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text
    )  # two passes over all of it
    return text.rstrip("\x1a")


def _split(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of a line."""
    if delimiter is None:
        return [cell.strip('"') for cell in line.split()]
    if line and '"' not in line:
        return [cell.strip() for cell in line.split(delimiter)]
    return [
        cell.strip()
        for row in csv.reader([line], delimiter=delimiter, skipinitialspace=True)
        for cell in row
    ]


def _dialect(path: Path, text: str, asked: Asked) -> _Dialect:
    """Find how the lines in the middle and at the end are written; ask if all commas may separate thousands."""
    half, tail = text.find("\n", len(text) // 2), text.rfind("\n", 0, max(len(text) - _SAMPLE, 0))
    middle = text[half + 1 : text.find("\n", half + _SAMPLE)] if half >= 0 else ""
    lines = [
        line
        for line in f"{middle}\n{text[tail + 1 :]}".split("\n")
        if line.strip() and not _COMMENT.match(line)
    ]
    if not lines:
        raise RecordingError(path, "nothing but blank lines", 1)

    def score(delimiter: str | None) -> int:
        kinds = [kind(cell) for line in lines for cell in _split(line, delimiter)]
        return kinds.count(NUMBER) + kinds.count(TIME) - kinds.count(TEXT)

    delimiter: str | None = max(_DELIMITERS, key=score)
    if "\t" not in lines[-1] and score(delimiter) < min(2 * len(lines), score(None)):
        delimiter = None
    rows = [_split(line, delimiter) for line in lines]
    commas = [
        cell
        for row in rows
        for cell in row
        if "," in cell and "." not in cell and kind(cell) == NUMBER
    ]
    if commas and not asked.decimal and all(map(_DOUBTFUL.fullmatch, commas)):
        got = f"{quoted(commas[0])}, a decimal comma or a thousands separator?"
        raise ask("decimal", got, 'decimal "point" or "comma" (--decimal)')
    width = mode(map(len, rows))
    kinds = [[kind(cell) for cell in row] for row in rows if len(row) == width]
    decimal = DECIMALS[asked.decimal or ("comma" if commas else "point")]
    return _Dialect(
        delimiter, decimal, max(kinds, key=lambda each: each.count(NUMBER) + each.count(TIME))
    )


def _row(path: Path, line: str, number: int, dialect: _Dialect) -> list[str]:
    """Return the cells of a row; refuse one with another number of cells."""
    cells, width = _split(line, dialect.delimiter), len(dialect.kinds)
    if len(cells) != width:
        raise RecordingError(
            path, f"got {len(cells)} cells, allowed: {width}, as in the other rows", number
        )
    return cells


def _above(path: Path, text: str, dialect: _Dialect) -> tuple[list[str], int]:
    """Return the lines above the first row of numbers, and where that row begins."""
    above: list[str] = []
    for found in re.finditer(r"([^\n]*)\n?", text[:_HEADER]):
        kinds = [kind(cell) for cell in _split(found[1], dialect.delimiter)]
        values = 0 if _COMMENT.match(found[1]) else kinds.count(NUMBER) + kinds.count(TIME)
        texts = [one == TEXT != other for one, other in zip(kinds, dialect.kinds, strict=False)]
        if values and len(kinds) == len(dialect.kinds) and (values > 1 or not any(texts)):
            return above, found.start()
        if values and TEXT not in kinds and len(kinds) > 1:
            _row(path, found[1], len(above) + 1, dialect)
        above.append(found[1])
    raise RecordingError(path, "not a recording: no row of numbers", 1)


def _names(path: Path, above: list[str], dialect: _Dialect, points: bool) -> list[str]:
    """Return the names of the columns, joined from up to four rows; "" if no line has a name for each column."""
    rows, width = list[list[str]](), len(dialect.kinds)
    filled = [
        line.lstrip('#%!/ "') if _COMMENT.match(line) else line for line in above if line.strip()
    ]
    for line in filled[: -_MOST_NAMES - 1 : -1]:
        ways = [
            _split(line, each) for each in (dialect.delimiter, *_DELIMITERS)
        ]  # it may have one of its own
        ways += (
            [] if rows or dialect.delimiter else [re.split(r"\s{2,}", line.strip())]
        )  # names with blanks in them
        ways += (
            [[*ways[0], ""]] if dialect.kinds[-1] == NONE else []
        )  # each row ends with a delimiter
        cells = next(
            ([cell.strip('"') for cell in cells] for cells in ways if len(cells) == width), []
        )
        kinds = [kind(cell) for cell in cells]
        if not cells or {NUMBER, TIME} & {*kinds} or kinds.count(TEXT) < min(2, width):
            break
        if rows and all(cell == "" or SUMMARY.match(cell) for cell in cells):
            reason = f"{quoted(line.strip())} above the names is of statistics, not of samples: take these rows out"
            raise RecordingError(
                path, reason, next(n for n, each in enumerate(above, 1) if each.endswith(line))
            )
        rows.insert(0, cells)
    few = _split(filled[-1], ",") if filled and not rows and not points else []
    if dialect.delimiter == "," and 1 < len(few) < width:
        reason = f"got {width} cells below {len(few)} names: commas separate the cells and are decimal marks?"
        raise RecordingError(path, f"{reason} save it with another delimiter", len(above) + 1)
    return [" ".join(filter(None, column)) for column in zip(*rows, strict=True)] or [""] * width


def _alike(text: str, begin: int, dialect: _Dialect) -> list[Any]:
    """Return the columns of rows that are all alike, by pandas; none: not so, or there is no pandas."""
    comments = [] if dialect.kinds[0] == NUMBER else ["#", "%", "!", "//"]
    if any(text.find(sign, begin) >= 0 for sign in ['"', *comments]):
        return []
    file = io.BytesIO(text.encode())
    file.seek(len(text[:begin].encode()))
    try:
        pandas = need("pandas", "tables")
        how = {
            "sep": dialect.delimiter or r"\s+",
            "decimal": dialect.decimal,
            "header": None,
            "na_filter": False,
        }
        how |= (
            {} if pandas.__version__ >= "3.1" else {"float_precision": "round_trip"}
        )  # the nearest double
        frame = pandas.read_csv(file, skip_blank_lines=False, low_memory=False, **how)
    except (MissingExtra, ValueError):
        return []
    columns = [
        each.to_numpy(object if each.dtype.kind not in "iuf" else None) for _, each in frame.items()
    ]
    wrong = [
        of == NUMBER and each.dtype.kind == "O"
        for each, of in zip(columns, dialect.kinds, strict=False)
    ]
    is_short = columns[-1].dtype.kind == "O" and not all(columns[-1])  # in a row
    return [] if len(columns) != len(dialect.kinds) or any(wrong) or is_short else columns


def _by_line(body: str, first: int, names: str) -> tuple[dict[int, str], list[str]]:
    """Return the rows by the number of their line, and a note on comments and repeated names."""
    lines = {number: line for number, line in enumerate(body.split("\n"), first) if line.strip()}
    left_out = [number for number, line in lines.items() if _COMMENT.match(line) or line == names]
    skipped = set(left_out)
    more = f", and {len(left_out) - 1} more lines" if len(left_out) > 1 else ""
    notes = [
        f"line {number} is no row ({quoted(lines[number])}){more}: left out"
        for number in left_out[:1]
    ]
    return {number: line for number, line in lines.items() if number not in skipped}, notes


def _part(path: Path, parts: Mapping[str, Any], asked: Asked, what: str) -> Any:
    """Return the only sheet or stream with numbers, or the one that the user names."""
    if not parts:
        raise RecordingError(path, f"no {what} has numbers")
    part = next(iter(parts)) if len(parts) == 1 and asked.part is None else asked.part
    if part is None or part not in parts:
        raise ask(
            "part",
            "none" if part is None else quoted(part),
            f"the name of a {what} (--part): {listed(parts)}",
        )
    return parts[part]


def _workbook(path: Path, data: bytes, asked: Asked) -> Table:
    """Return the sheet of an Excel workbook with the two channels, read as text with tabs; a line is a row of the sheet."""
    book = need("openpyxl", "tables").load_workbook(
        io.BytesIO(data), read_only=True, data_only=True
    )
    sheets = {sheet.title: list(sheet.iter_rows()) for sheet in book.worksheets}
    filled = {
        name: rows
        for name, rows in sheets.items()
        if any(_is_number(cell) for row in rows for cell in row)
    }
    rows = _part(path, filled, asked, "sheet")
    width = max(map(len, rows))
    lines = ["\t".join([*map(_written, row), *[""] * (width - len(row))]) for row in rows]
    return text_table(path, "".join(f"{line}\n" for line in lines).encode(), asked)


def _is_number(cell: Any) -> bool:
    return isinstance(cell.value, int | float)


def _written(cell: Any) -> str:
    """Return a cell of a sheet as text; a number that is shown in per cent is no capacitance."""
    if _is_number(cell) and "%" in (cell.number_format or ""):
        return f"{100 * cell.value:.12g}%"
    return "" if cell.value is None else " ".join(str(cell.value).split())


def _xdf(path: Path, data: bytes, asked: Asked) -> Table:
    """Return the only stream of numbers in an XDF file, or the one named; times are not smoothed, which hides lost samples."""
    pyxdf, logger, notes = need("pyxdf", "tables"), logging.getLogger("pyxdf.pyxdf"), list[str]()

    def heard(record: logging.LogRecord) -> bool:
        said = record.getMessage()
        if record.levelno >= logging.ERROR:  # pyxdf goes on where it finds a next part
            raise ValueError(said)
        notes.extend([said] * (_USUAL not in said))
        return False

    logger.addFilter(heard)
    try:
        streams, _ = pyxdf.load_xdf(
            io.BytesIO(data), dejitter_timestamps=False, synchronize_clocks=True
        )
    finally:
        logger.removeFilter(heard)
    streams = [
        one
        for one in streams
        if len(one["time_stamps"]) and isinstance(one["time_series"], np.ndarray)
    ]
    parts = {_word(one["info"], "name"): one for one in streams}
    if len(parts) < len(streams):
        raise RecordingError(path, "cannot be read: two streams have one name")
    stream = _part(path, parts, asked, "stream")
    channels = ((stream["info"].get("desc") or [None])[0] or {}).get("channels") or [{}]
    described = [*channels[0].get("channel", []), *[{}] * stream["time_series"].shape[1]]
    named = [(_word(each, "label"), _word(each, "unit")) for each in described]
    columns = [
        (name, values, unit)
        for values, (name, unit) in zip(stream["time_series"].T, named, strict=False)
    ]
    if not stream["clock_times"]:
        notes.insert(0, "a stream without clock offsets: its times are on the clock of its sender")
    times = np.asarray(stream["time_stamps"], float)
    return Table(path, [("time", times, "s"), *columns], range(1, len(times) + 1), notes)


def _word(tree: Any, name: str) -> str:
    """Return a text in what pyxdf makes of XML: dicts of lists."""
    return str((tree.get(name) or [""])[0] or "").strip()


def _arrow(path: Path, data: bytes, _asked: Asked) -> Table:
    if data.startswith(PARQUET):
        # No threads and no file of Python: Arrow's threads would close it while the interpreter ends (apache/arrow 50482).
        source = need("pyarrow", "tables").BufferReader(data)
        table = need("pyarrow.parquet", "tables").ParquetFile(source).read(use_threads=False)
    else:
        table = (
            need("pyarrow.ipc", "tables")
            .open_file(need("pyarrow", "tables").py_buffer(data))
            .read_all()
        )
    table.validate(full=True)  # wrong offsets in a file would be wrong addresses
    return Table(path, _of_arrow(table), range(1, len(table) + 1), metadata=table.schema.metadata)


_Named = tuple[str, Any, str]  # a column: its name, cells and unit


def frame(source: Any) -> Table:
    """Return a data frame as a table; float64 is not copied. The index of pandas is its last column if it may be times."""
    where = Path(f"{type(source).__module__.split('.')[0]}.{type(source).__name__}")
    if not is_frame(source) or any(
        is_a(library, "Series", source) for library in ("pandas", "polars")
    ):
        what = "a path, a data frame of pandas, polars or Arrow with both channels, a dict of arrays, or a structured array"
        raise TypeError(
            f"recording: got {where}, allowed: {what}; a lazy frame has to be collected first"
        )
    if is_a("pandas", "DataFrame", source):
        columns = _of_pandas(source)
    elif is_a("polars", "DataFrame", source):
        columns = list(map(_column, source.columns, source))
    elif isinstance(source, Mapping | np.ndarray):
        names = source if isinstance(source, Mapping) else source.dtype.names or ()
        columns = [_column(name, source[name]) for name in names]
    else:
        columns = _of_arrow(need("pyarrow", "tables").table(source))
    shapes = {cells.shape for _, cells, _ in columns}
    masked = any(np.ma.is_masked(cells) for _, cells, _ in columns)
    if len(columns) < 2 or len(shapes) > 1 or shapes & {(), (0,)} or masked:
        what = "two columns or more, of one shape (n,), with a row or more; nan in place of masked values"
        raise RecordingError(
            where, f"not a recording: got columns of shapes {sorted(shapes)}, allowed: {what}"
        )
    return Table(where, columns, range(1, len(columns[0][1]) + 1))


def _of_arrow(table: Any) -> list[_Named]:
    """Return the columns of an Arrow table with the units in the metadata of its fields."""
    units = [(field.metadata or {}).get(b"unit", b"").decode() for field in table.schema]
    return list(map(_column, table.column_names, table, units))


def _of_pandas(source: Any) -> list[_Named]:
    levels = [source.index.get_level_values(level) for level in range(source.index.nlevels)]
    levels = [
        each.rename("time") if each.name is None and each.dtype.kind in "mM" else each
        for each in levels
    ]
    series = [
        *source.items(),
        *((each.name, each.to_series()) for each in levels if each.name is not None),
    ]
    return [
        _column(name, each, source.attrs.get("units", {}).get(name, "")) for name, each in series
    ]


def _column(name: object, cells: Any, unit: str = "") -> _Named:
    """Return a column of an array, or of what has `to_numpy`: numbers as they are, dates with a zone in UTC, else objects."""
    of = getattr(cells, "type", getattr(cells, "dtype", None))  # Arrow has types
    of = getattr(of, "pyarrow_dtype", of)
    zoned = getattr(of, "tz", None) or getattr(of, "time_zone", None)
    if not hasattr(cells, "to_numpy"):
        values = np.ma.asanyarray(cells)
    else:
        values = (
            cells.to_numpy("M8[ns]")
            if zoned and is_a("pandas", "Series", cells)
            else cells.to_numpy()
        )
    joined = " ".join(filter(None, map(str, name))) if isinstance(name, tuple) else str(name)
    return (
        joined,
        values if values.dtype.kind in "biufmM" else values.astype(object),
        "UTC" if zoned else unit,
    )
