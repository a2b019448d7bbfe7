"""The formats of tables: one row for each. A file is known by its first bytes; its name says nothing."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from io import SEEK_END
from pathlib import Path
from typing import Any

from palpate.errors import RecordingError
from palpate.tables.asked import Asked
from palpate.tables.packed import contents, is_packed, opened, unpacked_name
from palpate.tables.table import Stream, Table
from palpate.tables.text import parsing
from palpate.tables.text.clean import clean_stream, clean_table

Reader = Callable[[Path, bytes, Asked], Table]


@dataclass(frozen=True)
class Format:
    """A format of files.

    Attributes
    ----------
    name : str
        As a message says it.
    suffixes : tuple of str
        Ends of the names of such files.
    begins : tuple of bytes
        The first bytes of such a file.
    reader : str
        MODULE:FUNCTION, imported when it is used: gives the table in the bytes of a file.
    stream : str
        MODULE:FUNCTION, too: gives the table in a file that is read in parts, or None.
    advice : str
        What to do with a format that has no reader.
    """

    name: str
    suffixes: tuple[str, ...]
    begins: tuple[bytes, ...]
    reader: str = ""
    stream: str = ""
    advice: str = ""


LONG = 1 << 17
"""Rows of a table that is read in parts, at least."""
_SHORTEST = len("0,1\n")
_SAVE = "save its table as CSV, and use that"
_UNPACK = "unpack it, and use what is in it"
FORMATS = (
    Format("an Excel workbook", (".xlsx", ".xlsm"), (b"PK\3\4", b"PK\5\6"), reader="palpate.tables.readers.excel:parse"),
    Format("an XDF file", (".xdf",), (b"XDF:",), reader="palpate.tables.readers.xdf:parse"),
    Format("a Parquet table", (".parquet",), (b"PAR1",), reader="palpate.tables.readers.arrow:parse",
           stream="palpate.tables.readers.arrow_stream:stream"),
    Format("an Arrow file", (".arrow", ".feather"), (b"ARROW1\0\0",), reader="palpate.tables.readers.arrow:parse",
           stream="palpate.tables.readers.arrow_stream:stream"),
    Format("an old Excel workbook, or one with a password", (".xls",), (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1",),
           advice="save it as .xlsx without a password, or as CSV"),
    Format("an HDF5 or MATLAB 7.3 file", (".h5", ".hdf5", ".mat"), (b"\x89HDF\r\n\x1a\n",), advice=_SAVE),
    Format("a MATLAB file", (".mat",), (b"MATLAB 5.0 MAT-file",), advice="save the matrix with writematrix as CSV"),
    Format("a numpy array", (".npy",), (b"\x93NUMPY",), advice="save it with numpy.savetxt as CSV"),
    Format("an SQLite database", (".sqlite", ".db"), (b"SQLite format 3\0",), advice=_SAVE),
    Format("a LabVIEW file", (".tdms",), (b"TDSm",), advice=_SAVE),
    Format("a PDF document", (".pdf",), (b"%PDF-",), advice=_SAVE),
    Format("an HTML or XML page", (".html", ".xml"), (b"<html", b"<HTML", b"<!DOCTYPE", b"<!doctype", b"<?xml", b"<table"),
           advice="open it in a spreadsheet program, and save it as .xlsx or CSV"),
    Format("an image", (".png", ".jpg", ".jpeg", ".gif", ".tif"),
           (b"\x89PNG", b"\xff\xd8\xff", b"GIF8", b"II*\0", b"MM\0*"), advice="use the table from which it was made"),
    Format("a packed file", (".bz2", ".xz", ".zst", ".7z", ".rar", ".gz"),
           (b"BZh", b"\xfd7zXZ\0", b"\x28\xb5\x2f\xfd", b"7z\xbc\xaf\x27\x1c", b"Rar!", b"\x1f\x8b"), advice=_UNPACK),
)  # fmt: skip
"""All formats but text, which begins with anything."""
_LONGEST_BEGIN = max(len(begin) for each in FORMATS for begin in each.begins)
_TEXT = Format("text", (".csv", ".txt", ".tsv", ".dat", ".asc"), ())


def readable(path: Path) -> bool:
    """Return whether the name of a file is that of a format with a reader.

    Examples
    --------
    >>> [name for name in ("a.csv", "A.CSV.gz", "a.json", "a.csv.unrepaired", "a.pdf") if readable(Path(name))]
    ['a.csv', 'A.CSV.gz']
    """
    suffix = Path(unpacked_name(path)).suffix.lower()
    return any(suffix in each.suffixes for each in (_TEXT, *FORMATS) if not each.advice)


def read_table(path: Path, asked: Asked | None = None) -> Table:
    """Read a file of any format as a table; also one that is packed as .gz, and standard input, of the name -.

    Parameters
    ----------
    path : pathlib.Path
    asked : Asked, optional
        What the user says: it finds the one of several tables in the file.

    Raises
    ------
    RecordingError
        The file cannot be read, or is not a table.
    ValueError
        It is open which one of several tables in the file is meant.
    MissingExtra
        A package that reads this format is not installed.
    """
    try:
        with opened(path) as file:
            known = format_of(file.read(_LONGEST_BEGIN))
        table = _clean(path) if known is _TEXT else None
        data = b"" if table else contents(path)
    except OSError as error:
        raise RecordingError(path, f"cannot be read: {error.strerror}") from error
    table = table or _read(path, data, known, asked or Asked())
    _note_name(table, path, known)
    return table


def long_table(path: Path) -> Stream | None:
    """Return a file as a table that is read in parts; None: it is short, or can only be read as a whole.

    Raises
    ------
    OSError
        The file cannot be read.
    RecordingError, MissingExtra
        As `read_table`.
    """
    with opened(path) as file:
        known = format_of(file.read(_LONGEST_BEGIN))
        is_short = file.seekable() and file.seek(0, SEEK_END) < LONG * _SHORTEST
    stream = None if is_short else _stream(path, known)
    if stream is None or stream.rows < LONG:
        return None
    _note_name(stream.first, path, known)
    return stream


def _stream(path: Path, known: Format) -> Stream | None:
    if known is _TEXT:
        with opened(path) as file:
            return clean_stream(path, file)
    if not known.stream or is_packed(path):
        return None
    found: Stream | None = _named(known.stream)(path)
    return found


def _note_name(table: Table, path: Path, known: Format) -> None:
    suffix = Path(unpacked_name(path)).suffix.lower()
    named = next((each for each in (_TEXT, *FORMATS) if suffix in each.suffixes), known)
    if named is not known:
        table.notes.append(f"the name says {named.name}, but it is {known.name}: read as that")


def _clean(path: Path) -> Table | None:
    with opened(path) as file:
        return clean_table(path, file)


def _read(path: Path, data: bytes, known: Format, asked: Asked) -> Table:
    if not data:
        raise RecordingError(path, "is empty")
    if known.advice:
        raise RecordingError(path, f"is {known.name}, which palpate cannot read: {known.advice}")
    if known is _TEXT:
        return parsing.parse(path, data)
    reader: Reader = _named(known.reader)
    return reader(path, data, asked)


def format_of(data: bytes) -> Format:
    """Return the format of a file by its first bytes.

    Examples
    --------
    >>> format_of(b"PAR1").name, format_of(b"time,C1").name
    ('a Parquet table', 'text')
    """
    return next((each for each in FORMATS if data.startswith(each.begins)), _TEXT)


def _named(function: str) -> Any:
    module, _, name = function.partition(":")
    return getattr(import_module(module), name)
